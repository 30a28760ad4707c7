//! Statistics of studies: Fitts's law by ISO 9241-411, exact tests of counts, straight lines with intervals,
//! psychometric functions and staircases.
//!
//! Nothing here knows of files or people. What the numbers do not determine is refused by name ([`StatsError`]), with
//! the reason, instead of being answered with a number that is not one.
//!
//! ```
//! use haptic_lab::stats::throughput::{Movement, Task, throughput};
//! let movements = [-0.006, 0.003, 0.011, -0.002].map(|end_error_m| Movement {
//!     amplitude_m: 0.3,
//!     end_error_m,
//!     movement_time_s: 0.6,
//! });
//! let sequence = throughput(&movements, Task::Serial).expect("four movements that differ");
//! assert!((sequence.effective_amplitude_m - 0.3035).abs() < 1e-9);
//! ```

mod error;
pub mod exact;
pub mod mean;
pub mod psychometric;
pub mod regression;
pub mod staircase;
pub mod throughput;

pub use error::StatsError;

/// Level of every interval of confidence.
pub const CONFIDENCE: f64 = 0.95;
