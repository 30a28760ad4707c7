//! The mechanics of the fake rig on the command line.

use device_io::fake::RigProperties;

#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Mechanics")]
pub(crate) struct PlantOptions {
    /// Distance between two counts of the encoder, mm
    #[arg(long, value_name = "MM", default_value_t = 0.01)]
    resolution_mm: f64,

    /// Distance from the middle to the stop at either end, mm [default: no stops]
    #[arg(long, value_name = "MM")]
    stops_mm: Option<f64>,

    /// Mass of the moving part, kg
    #[arg(long, value_name = "KG", default_value_t = 1.4)]
    mass_kg: f64,

    /// Coulomb friction of the guide, N
    #[arg(long, value_name = "N", default_value_t = 0.8)]
    friction_n: f64,

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
    pub(crate) fn properties(&self) -> RigProperties {
        RigProperties {
            mass_kg: self.mass_kg,
            friction_n: self.friction_n,
            negative_friction_n: self.negative_friction_n,
            breakaway_ratio: self.breakaway_ratio,
            presliding_n_per_m: self.presliding_n_per_m,
            cogging_n: self.cogging_n,
            cogging_pitch_m: self.cogging_pitch_mm * 1e-3,
            damping_ns_per_m: self.damping_ns_per_m,
            resolution_m: self.resolution_mm * 1e-3,
            end_stop_m: self.stops_mm.map_or(f64::INFINITY, |stop_mm| stop_mm * 1e-3),
        }
    }
}
