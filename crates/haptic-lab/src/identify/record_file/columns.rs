//! Which column holds what.

/// Names of the columns; `None` for the usual ones.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Columns {
    /// Time.
    pub time: Option<String>,
    /// Position.
    pub position: Option<String>,
    /// Velocity, which is only held against the positions.
    pub velocity: Option<String>,
    /// Force that drives the moving mass.
    pub force: Option<String>,
}

/// A quantity of a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Quantity {
    Time,
    Position,
    Velocity,
    Force,
}

impl Quantity {
    pub(super) const fn what(self) -> &'static str {
        match self {
            Self::Time => "time",
            Self::Position => "position",
            Self::Velocity => "velocity",
            Self::Force => "force",
        }
    }

    pub(super) const fn option(self) -> &'static str {
        match self {
            Self::Time => "--time-column",
            Self::Position => "--position-column",
            Self::Velocity => "--velocity-column",
            Self::Force => "--force-column",
        }
    }

    /// SI units a unit of a column of this name: what its last word tells, else 1.
    pub(super) fn unit(self, plain: &str) -> f64 {
        match (self, plain.rsplit('_').next()) {
            (Self::Time, Some("ms")) | (Self::Position, Some("mm")) | (Self::Force, Some("mn")) => 1e-3,
            (Self::Time, Some("us")) | (Self::Position, Some("um")) => 1e-6,
            (Self::Time, Some("ns")) => 1e-9,
            (Self::Position, Some("cm")) => 1e-2,
            (Self::Force, Some("kn")) => 1e3,
            _ => {
                let usual = self.usual().iter().find(|(usual, _)| *usual == plain);
                usual.map_or(1.0, |(_, unit)| *unit)
            }
        }
    }

    /// Names by which it is found, the likelier first, with SI units a unit.
    pub(super) const fn usual(self) -> &'static [(&'static str, f64)] {
        match self {
            Self::Time => &[
                ("t_s", 1.0),
                ("time_s", 1.0),
                ("time", 1.0),
                ("t", 1.0),
                ("timestamp", 1.0),
                ("timestamp_s", 1.0),
                ("seconds", 1.0),
                ("t_ms", 1e-3),
                ("time_ms", 1e-3),
                ("timestamp_ms", 1e-3),
                ("t_us", 1e-6),
                ("time_us", 1e-6),
                ("timestamp_us", 1e-6),
                ("t_ns", 1e-9),
                ("time_ns", 1e-9),
                ("timestamp_ns", 1e-9),
            ],
            Self::Position => &[
                ("block_position_m", 1.0),
                ("position_m", 1.0),
                ("device_position_m", 1.0),
                ("position", 1.0),
                ("pos", 1.0),
                ("pos_m", 1.0),
                ("displacement", 1.0),
                ("displacement_m", 1.0),
                ("x", 1.0),
                ("x_m", 1.0),
                ("position_mm", 1e-3),
                ("pos_mm", 1e-3),
                ("displacement_mm", 1e-3),
                ("x_mm", 1e-3),
                ("position_um", 1e-6),
                ("x_um", 1e-6),
            ],
            Self::Velocity => &[
                ("block_velocity_mps", 1.0),
                ("velocity_mps", 1.0),
                ("device_velocity_mps", 1.0),
                ("velocity", 1.0),
                ("velocity_m_s", 1.0),
                ("vel", 1.0),
                ("v", 1.0),
                ("velocity_mm_s", 1e-3),
            ],
            Self::Force => &[
                ("coupling_force_n", 1.0),
                ("force_n", 1.0),
                ("force", 1.0),
                ("f", 1.0),
                ("f_n", 1.0),
                ("motor_force_n", 1.0),
                ("motor_force", 1.0),
                ("load_n", 1.0),
                ("load", 1.0),
                ("force_mn", 1e-3),
                ("force_kn", 1e3),
            ],
        }
    }
}

impl Columns {
    pub(super) fn named(&self, quantity: Quantity) -> Option<&str> {
        match quantity {
            Quantity::Time => &self.time,
            Quantity::Position => &self.position,
            Quantity::Velocity => &self.velocity,
            Quantity::Force => &self.force,
        }
        .as_deref()
    }
}

/// A name as it is compared: small letters, words joined by `_`, and units in brackets as a last word.
pub(super) fn plain(name: &str) -> String {
    let words: Vec<String> = name
        .trim()
        .trim_matches('"')
        .split(|letter: char| !letter.is_alphanumeric() && letter != 'µ')
        .filter(|word| !word.is_empty())
        .map(|word| word.to_lowercase().replace('µ', "u"))
        .collect();
    words.join("_")
}
