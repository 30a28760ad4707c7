//! The active scene on the screen, and the controls to change it.

mod advice_lines;
mod journal;
mod library;
mod panel;
mod parameter_row;
mod tools;

pub(crate) use panel::{WIDTH, show};
pub(crate) use tools::take_keys;
