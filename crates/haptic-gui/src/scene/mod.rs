//! The scene in force: what the panel knows of it, what the user is changing in it, and how that is shown.

pub(crate) mod advice;
mod advice_lines;
mod edit;
mod journal;
mod library;
pub(crate) mod model;
mod panel;
mod parameter;
mod parameter_row;
mod tools;
pub(crate) mod trial;

pub(crate) use model::SceneModel;
pub(crate) use panel::{WIDTH, show};
pub(crate) use tools::take_keys;
