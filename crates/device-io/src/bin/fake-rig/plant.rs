//! The mechanics of the fake rig on the command line.

use device_io::fake::{FakeRig, Mechanics, PlanarProperties, PlanarRig, ProgramOptions, RigProperties};
use device_io::kinematics::Kinematics;
use std::f64::consts::TAU;

#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Mechanics")]
pub(crate) struct PlantOptions {
    /// Number of axes; a second has the same mechanics, and a hand of its own
    #[arg(long, value_name = "N", default_value_t = 1, conflicts_with = "kinematics",
          value_parser = clap::value_parser!(u8).range(1..=2))]
    axes: u8,

    /// Two motors that move one hand in the plane: `xy`, `h-belt` or a file
    #[arg(long, value_name = "FILE", conflicts_with_all = [
        "stops_mm", "negative_friction_n", "breakaway_ratio", "presliding_n_per_m", "cogging_n", "cogging_pitch_mm",
    ])]
    kinematics: Option<Kinematics>,

    /// Largest force of a motor, N [default: 20]
    #[arg(long, value_name = "N")]
    force_limit_n: Option<f64>,

    /// Largest torque of a rotary motor, N m [default: 1]
    #[arg(long, value_name = "NM", requires = "kinematics")]
    torque_limit_nm: Option<f64>,

    /// Distance between two counts of an encoder, mm [default: 0.01]
    #[arg(long, value_name = "MM")]
    resolution_mm: Option<f64>,

    /// Counts of a rotary motor's encoder in a turn [default: 16384]
    #[arg(long, value_name = "N", requires = "kinematics")]
    counts_per_turn: Option<u32>,

    /// Distance from the middle to the stop at either end, mm [default: no stops]
    #[arg(long, value_name = "MM")]
    stops_mm: Option<f64>,

    /// Mass of the moving part, kg [default: 1.4, in the plane 0.3]
    #[arg(long, value_name = "KG")]
    mass_kg: Option<f64>,

    /// Coulomb friction of the guide, N [default: 0.8, in the plane 0.1]
    #[arg(long, value_name = "N")]
    friction_n: Option<f64>,

    /// Coulomb friction of the guide in the negative direction, N [default: as in the positive one]
    #[arg(long, value_name = "N")]
    negative_friction_n: Option<f64>,

    /// Force that sets the handle in motion, as a multiple of the Coulomb friction
    #[arg(long, value_name = "RATIO", default_value_t = 1.0)]
    breakaway_ratio: f64,

    /// Stiffness of the guide before it slides, N/m, by Dahl's law [default: rigid]
    #[arg(long, value_name = "N/M")]
    presliding_n_per_m: Option<f64>,

    /// Viscous damping of the guide, N s/m
    #[arg(long, value_name = "NS/M", default_value_t = 0.0)]
    damping_ns_per_m: f64,

    /// Amplitude of the motor's cogging, N
    #[arg(long, value_name = "N", default_value_t = 0.0)]
    cogging_n: f64,

    /// Distance between two rest positions of the cogging, mm
    #[arg(long, value_name = "MM", default_value_t = 10.0)]
    cogging_pitch_mm: f64,
}

impl PlantOptions {
    /// The mechanics, and the largest effort of a motor, N or N m.
    ///
    /// # Errors
    /// An option belongs to motors of the other kind, or the hand to another rig.
    pub(crate) fn mechanics(&self, program: &ProgramOptions) -> Result<(Mechanics, f64), String> {
        let of_linear = [
            ("--force-limit-n", self.force_limit_n.is_some()),
            ("--resolution-mm", self.resolution_mm.is_some()),
        ];
        let of_rotary = [
            ("--torque-limit-nm", self.torque_limit_nm.is_some()),
            ("--counts-per-turn", self.counts_per_turn.is_some()),
        ];
        let are_rotary = self.kinematics.is_some_and(|kinematics| kinematics.are_rotary());
        let (others, kind) = if are_rotary {
            (of_linear, "linear")
        } else {
            (of_rotary, "rotary")
        };
        if let Some((option, _)) = others.into_iter().find(|(_, is_given)| *is_given) {
            return Err(format!("{option} is for {kind} motors"));
        }
        let limit = if are_rotary {
            self.torque_limit_nm.unwrap_or(1.0)
        } else {
            self.force_limit_n.unwrap_or(20.0)
        };
        let mechanics = match self.kinematics {
            Some(kinematics) => {
                let path = program.path(kinematics.middle())?;
                let rig = PlanarRig::new(self.planar(&kinematics), kinematics, path)?;
                Mechanics::Plane(Box::new(rig))
            }
            None => {
                let hand = program.hand()?;
                let first = FakeRig::new(self.properties(), hand.clone());
                if self.axes == 1 {
                    Mechanics::Line(Box::new(first))
                } else {
                    Mechanics::TwoLines(Box::new([first, FakeRig::new(self.properties(), hand)]))
                }
            }
        };
        Ok((mechanics, limit))
    }

    fn planar(&self, kinematics: &Kinematics) -> PlanarProperties {
        let defaults = PlanarProperties::of(kinematics);
        let by_turn = self.counts_per_turn.map(|counts| TAU / f64::from(counts.max(1)));
        PlanarProperties {
            mass_kg: self.mass_kg.unwrap_or(defaults.mass_kg),
            friction_n: self.friction_n.unwrap_or(defaults.friction_n),
            damping_ns_per_m: self.damping_ns_per_m,
            count: by_turn
                .or(self.resolution_mm.map(|resolution_mm| resolution_mm * 1e-3))
                .unwrap_or(defaults.count),
        }
    }

    fn properties(&self) -> RigProperties {
        let defaults = RigProperties::default();
        RigProperties {
            mass_kg: self.mass_kg.unwrap_or(defaults.mass_kg),
            friction_n: self.friction_n.unwrap_or(defaults.friction_n),
            negative_friction_n: self.negative_friction_n,
            breakaway_ratio: self.breakaway_ratio,
            presliding_n_per_m: self.presliding_n_per_m,
            cogging_n: self.cogging_n,
            cogging_pitch_m: self.cogging_pitch_mm * 1e-3,
            damping_ns_per_m: self.damping_ns_per_m,
            resolution_m: self
                .resolution_mm
                .map_or(defaults.resolution_m, |resolution_mm| resolution_mm * 1e-3),
            end_stop_m: self.stops_mm.map_or(f64::INFINITY, |stop_mm| stop_mm * 1e-3),
        }
    }
}
