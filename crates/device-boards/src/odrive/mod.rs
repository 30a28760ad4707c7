//! An ODrive, by its ASCII protocol: firmware 0.5.4 and later on ODrive 3.x, and 0.6 on S1 and Pro.
//! Tried against a fake, never on a real board.
//!
//! Source: ODrive's documentation, "ASCII Protocol" and "API reference" (docs.odriverobotics.com,
//! firmware 0.5.6 and 0.6).

mod connection;
mod connector;
mod conversation;
mod dialect;
mod feedback;
mod generation;
mod greeting;
mod options;
#[cfg(test)]
mod tests;
mod text;
#[cfg(test)]
mod virtual_line;
mod words;

pub(crate) use connector::ODriveConnector;
pub use options::ODriveOptions;
