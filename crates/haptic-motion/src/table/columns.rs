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

/// Units at the end of a title that want a gain: of angles, counts, voltages, masses and torques.
const OTHER_UNITS: [&str; 24] = [
    "deg", "degrees", "rad", "mrad", "rev", "turns", "count", "counts", "cnt", "steps", "lsb", "adc", "raw", "v", "mv",
    "uv", "ma", "g", "kg", "lb", "lbs", "nm", "mnm", "psi",
];

/// Longest name that is an abbreviation, letters.
const MAX_ABBREVIATION: usize = 1;

/// What the unit in a title says of a quantity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Dimension {
    /// It is one of this quantity.
    Own,
    /// There is none.
    Unstated,
    /// It is one of another, or nobody knows it.
    Other,
}

/// A quantity of a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// The clock.
    Time,
    /// Where it is.
    Position,
    /// How fast it moves; may be missing.
    Velocity,
    /// The force that drives it.
    Force,
    /// Where it is on the second axis; may be missing.
    PositionY,
    /// How fast it moves on the second axis; may be missing.
    VelocityY,
}

impl Quantity {
    pub(super) const ALL: [Self; 6] = [
        Self::Time,
        Self::Position,
        Self::Velocity,
        Self::Force,
        Self::PositionY,
        Self::VelocityY,
    ];

    /// Whether a table may be without it.
    pub(super) const fn is_optional(self) -> bool {
        matches!(self, Self::Velocity | Self::PositionY | Self::VelocityY)
    }

    /// Whether it is only held against the positions.
    pub(super) const fn is_velocity(self) -> bool {
        matches!(self, Self::Velocity | Self::VelocityY)
    }

    pub(super) const fn what(self) -> &'static str {
        match self {
            Self::Time => "time",
            Self::Position => "position",
            Self::Velocity => "velocity",
            Self::Force => "force",
            Self::PositionY => "position on the second axis",
            Self::VelocityY => "velocity on the second axis",
        }
    }

    pub(super) const fn option(self) -> &'static str {
        match self {
            Self::Time => "--time-column",
            Self::Position | Self::PositionY => "--position-column",
            Self::Velocity | Self::VelocityY => "--velocity-column",
            Self::Force => "--force-column",
        }
    }

    /// SI units a unit, by the names of units.
    const fn units(self) -> &'static [(&'static str, f64)] {
        match self {
            Self::Time => &[
                ("s", 1.0),
                ("sec", 1.0),
                ("ms", 1e-3),
                ("us", 1e-6),
                ("ns", 1e-9),
                ("min", 60.0),
            ],
            Self::Position | Self::PositionY => &[
                ("m", 1.0),
                ("cm", 1e-2),
                ("mm", 1e-3),
                ("um", 1e-6),
                ("nm", 1e-9),
                ("in", 0.0254),
                ("inch", 0.0254),
            ],
            Self::Velocity | Self::VelocityY => &[("mps", 1.0), ("m_s", 1.0), ("mm_s", 1e-3), ("cm_s", 1e-2)],
            Self::Force => &[
                ("n", 1.0),
                ("mn", 1e-3),
                ("kn", 1e3),
                ("un", 1e-6),
                ("gf", 9.806_65e-3),
                ("kgf", 9.806_65),
                ("ozf", 0.278_013_850_953_781),
                ("lbf", 4.448_221_615_260_5),
            ],
        }
    }

    /// Names by which it is found, with a unit at the end or without one, the likelier first.
    const fn names(self) -> &'static [&'static str] {
        match self {
            Self::Time => &["t", "time", "timestamp", "seconds", "elapsed_time", "zeit"],
            Self::Position => &[
                "block_position",
                "position",
                "device_position",
                "pos",
                "displacement",
                "x",
                "weg",
            ],
            Self::Velocity => &["block_velocity", "velocity", "device_velocity", "vel", "v"],
            Self::Force => &["coupling_force", "force", "f", "motor_force", "load", "kraft"],
            Self::PositionY => &["block_position_y", "position_y", "device_position_y"],
            Self::VelocityY => &["block_velocity_y", "velocity_y", "device_velocity_y"],
        }
    }

    /// SI units a unit of a column of this title: by the unit at its end, else 1; `None` where that unit is not one of
    /// this quantity.
    pub(super) fn unit(self, title: &str) -> Option<f64> {
        let of = |text: &str| {
            let known = self.units().iter().find(|(unit, _)| *unit == plain(text));
            known.map(|(_, factor)| *factor)
        };
        if let Some(unit) = in_brackets(title) {
            return of(unit);
        }
        let words = plain(title);
        match self.unit_at_end(&words) {
            Some(factor) => Some(factor),
            None => (!OTHER_UNITS.iter().any(|unit| ends_with(&words, unit))).then_some(1.0),
        }
    }

    /// SI units a unit of this quantity at the end of a plain title.
    fn unit_at_end(self, words: &str) -> Option<f64> {
        let found = self.units().iter().find(|(unit, _)| ends_with(words, unit));
        found.map(|(_, factor)| *factor)
    }

    /// Whether a title says the unit.
    pub(super) fn names_unit(self, title: &str) -> bool {
        let words = plain(title);
        in_brackets(title).is_some() || (self == Self::Time && words == "seconds") || self.unit_at_end(&words).is_some()
    }

    /// How likely a column of this title is the one, the least the likeliest; `None` where it is another. One whose
    /// unit is of this quantity goes before one without a unit, and that before one in a unit of another, as
    /// `position_deg`, whose gain is asked for; then a full name goes before an abbreviation, and the usual names in
    /// their order.
    pub(super) fn rank(self, title: &str) -> Option<(Dimension, bool, usize)> {
        let words = plain(title);
        let of = |name: &str| {
            let rest = words.strip_prefix(name)?;
            let Some(unit) = rest.strip_prefix('_') else {
                return rest.is_empty().then_some(Dimension::Unstated);
            };
            let is_in_brackets = in_brackets(title).is_some_and(|text| plain(text) == unit);
            if self.units().iter().any(|(own, _)| *own == unit) {
                Some(Dimension::Own)
            } else {
                (is_in_brackets || OTHER_UNITS.contains(&unit)).then_some(Dimension::Other)
            }
        };
        let found = self.names().iter().enumerate();
        found
            .filter_map(|(place, name)| Some((of(name)?, name.len() <= MAX_ABBREVIATION, place)))
            .min()
    }

    /// What to give where the unit is not known.
    pub(super) const fn instead_of_unit(self) -> &'static str {
        match self {
            Self::Time => "write times in s, ms, us or ns",
            Self::Position | Self::Velocity | Self::PositionY | Self::VelocityY => {
                "--position-gain says how many metres it is (of an angle, the radius times the unit in radians)"
            }
            Self::Force => "--force-gain says how many newtons it is",
        }
    }

    /// What a title may be, for people.
    pub(super) fn usual(self) -> String {
        let names = self.names();
        format!(
            "{}, with a unit at the end or without, as in {}_{}",
            names.join(", "),
            names[0],
            match self {
                Self::Force => "N",
                _ => self.units()[0].0,
            }
        )
    }
}

/// Whether a word is the last of a plain title, and not the only one.
fn ends_with(words: &str, word: &str) -> bool {
    words.strip_suffix(word).is_some_and(|front| front.ends_with('_'))
}

/// The text in the last brackets of a title: its unit, if it is short.
pub(super) fn in_brackets(title: &str) -> Option<&str> {
    let title = title.trim().trim_matches('"').trim_end();
    let open = match title.chars().last()? {
        ']' => '[',
        ')' => '(',
        _ => return None,
    };
    let begin = title.rfind(open)? + 1;
    Some(title[begin..title.len() - 1].trim()).filter(|unit| !unit.is_empty())
}

/// Whether a title is that of a device's column, as our recordings have them beside those of the block.
pub(super) fn is_of_device(title: &str) -> bool {
    plain(title).starts_with("device_")
}

/// Whether a text is the name of a unit, with brackets or without them.
pub(super) fn is_unit(text: &str) -> bool {
    let unit = in_brackets(text).map_or_else(|| plain(text), plain);
    in_brackets(text).is_some_and(|unit| text.trim().len() <= unit.len() + 2)
        || OTHER_UNITS.contains(&unit.as_str())
        || Quantity::ALL
            .iter()
            .any(|quantity| quantity.units().iter().any(|(name, _)| *name == unit))
}

impl Columns {
    pub(super) fn named(&self, quantity: Quantity) -> Option<&str> {
        match quantity {
            Quantity::Time => &self.time,
            Quantity::Position => &self.position,
            Quantity::Velocity => &self.velocity,
            Quantity::Force => &self.force,
            Quantity::PositionY | Quantity::VelocityY => &None,
        }
        .as_deref()
    }
}

/// A name as it is compared: small letters, words joined by `_`, and units in brackets as a last word.
fn plain(name: &str) -> String {
    let words: Vec<String> = name
        .trim()
        .trim_matches('"')
        .split(|letter: char| !letter.is_alphanumeric() && letter != 'µ' && letter != 'μ')
        .filter(|word| !word.is_empty())
        .map(|word| word.to_lowercase().replace(['µ', 'μ'], "u"))
        .collect();
    words.join("_")
}
