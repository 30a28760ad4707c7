//! A file that is read as text or MCAP.

use std::fs::File;
use std::io::{Chain, Cursor};

/// A file whose first bytes have been looked at. A pipe cannot be wound back.
pub(crate) type Input = Chain<Cursor<Vec<u8>>, File>;
