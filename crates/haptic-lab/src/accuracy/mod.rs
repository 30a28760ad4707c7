//! Speed against error: schemes held against true motions.

pub mod cases;
mod error;
mod page;
pub mod reference;
mod report;
mod targets;

pub use error::{RunError, compare};
pub use page::page;
pub use report::{Measurement, measure, schemes, write_csv};
pub use targets::{Target, targets};
