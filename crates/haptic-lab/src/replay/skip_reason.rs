//! Why rows of a recording are not compared.

use serde::Serialize;

/// Why a row is not compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum SkipReason {
    /// The servo has just begun: its estimate of velocity still depends on what came before.
    Settling,
    /// Force flowed when the recording began.
    BeganWithForce,
    /// Rows were lost before, and force has flowed since.
    RowsLost,
    /// Force began to flow before the servo had settled.
    ForceTooSoon,
    /// The recording does not hold the scene: a pulse, an excitation, or a scene from before it began.
    UnknownScene,
    /// The device fell silent. The force then depends on its period over a time before the recording.
    DeviceSilent,
    /// The clocks contradicted each other. The period over a time before the recording then decides.
    ClockUnknown,
}

impl std::fmt::Display for SkipReason {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Settling => "the estimate of velocity still remembered what came before",
            Self::BeganWithForce => "the recording began while force flowed",
            Self::RowsLost => "rows were lost before, and the force had not been zero since",
            Self::ForceTooSoon => "force began to flow before the estimate of velocity had settled",
            Self::UnknownScene => {
                "the scene is not in the recording (a pulse or an excitation, or one from before it began)"
            }
            Self::DeviceSilent => "the device fell silent, and its exact period was set before the recording began",
            Self::ClockUnknown => {
                "the device's clock contradicted ours, and its exact period was set before the recording began"
            }
        })
    }
}
