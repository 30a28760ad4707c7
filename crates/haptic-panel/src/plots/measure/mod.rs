//! What is measured on the samples in sight: statistics, the difference to another run, the spectrum. Pure
//! functions of a tape and a time.

pub(crate) mod difference;
pub(crate) mod results;
pub(crate) mod spectrum;
pub(crate) mod statistics;
