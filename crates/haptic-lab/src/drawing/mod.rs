//! Charts for people: force over time, against velocity or against position, as an SVG image or as a
//! page of HTML that stands alone. Both are readable on light and on dark ground.
//!
//! ```
//! use haptic_lab::drawing::{Chart, Trace, svg};
//! let chart = Chart::new("Force against velocity", "Velocity (m/s)", "Force (N)")
//!     .with(Trace::dots("measured", vec![[-0.1, -2.1], [0.1, 2.2]]))
//!     .with(Trace::line("fitted", vec![[-0.1, -2.0], [0.1, 2.0]]));
//! assert!(svg(&[chart]).starts_with("<svg"));
//! ```

mod axis;
mod chart;
mod figure;
mod page;
mod paths;
mod svg;
mod table;

pub use chart::{Axis, Chart, Form, Observation, Trace};
pub use figure::figures;
pub use page::{Page, PlotFormat, UnknownEnding};
pub use svg::{PLOT_WIDTH_PX, svg};
pub use table::Table;
