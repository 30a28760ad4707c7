//! Identification: what is asked, and the answer as it is shown. Both are made and thinned on a thread of
//! their own.

mod fit_chart;
mod question;

/// The names of a file's columns, `None` for a recording, whose columns are known; or why they cannot be read.
pub type Headings = Result<Option<Vec<String>>, String>;

pub(crate) use fit_chart::{Extent, FitChart, FitTrace, thinned};
pub(crate) use question::{Data, Samples};
pub use question::{Found, Question};
