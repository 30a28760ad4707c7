//! The live tuning panel of hapticd: parameters on the left, plots on the right, and a stop button that is
//! always visible.
//!
//! The panel is a function: [`ui`] draws a [`Model`] and returns the user's [`Intent`]s. It knows neither a
//! window nor a socket nor a clock, so the tests drive it without a display. [`connection`] is the daemon
//! behind two channels; the program haptic-gui ties both to a window:
//!
//! ```text
//! daemon -> Connection -> Update -> Model::apply -> ui -> Intent -> Connection -> daemon
//! ```
//!
//! The thread of the window waits for nothing: connection, recorder and files have threads of their own.
//! [`App`] ties them together.

mod app;
mod browse;
mod closing;
pub mod connection;
mod dialogs;
mod drop_down;
pub mod export;
mod files;
mod frame_limiter;
mod histogram;
mod identification;
mod intent;
mod measure;
mod model;
mod new_file;
mod note;
mod notice;
mod number_field;
mod page;
mod page_row;
mod pages;
mod plots;
mod readouts;
mod recorder;
mod recording;
mod remembering;
mod scene;
mod settings;
mod shell;
mod stop_button;
mod stop_path;
mod study;
mod subject;
mod tape;
pub mod theme;
mod timing_panel;
mod top_bar;
mod typing;
mod update;
mod update_sender;
mod wording;

pub use app::App;
pub use files::Files;
pub use identification::{Found, Headings, Question};
pub use intent::{DialogPurpose, Format, Intent, Target};
pub use model::Model;
pub use page::Page;
pub use recording::{About, Length, Listed, Loaded, RecordingNews, WhatIfTape};
pub use settings::{AgainstSettings, Settings, Theme};
pub use shell::ui;
pub use study::{Stage, StudyCommand, StudyNews, StudyPlan, StudyRow, StudyState, SubjectAction, SubjectState};
pub use update::{Answer, StopNews, Update};
