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
//!
//! A folder is a feature: what it knows, draws and does on threads of its own. Folders point one way, downwards here:
//!
//! ```text
//! shell/ settings/      keys, rows and dialogs around the page; what is remembered
//! connection/           the threads towards the daemon
//! export/ study/ identify/ record/ tune/
//! plots/                the plots, how they are looked at, and what is measured in them
//! daemon/               what is known of the daemon, and the bars that show it
//! stop/ tape/           stops alone, on a thread that waits for nothing; samples in chunks, min/max pyramid, marks
//! ```
//!
//! The files beside them are what all of these share: `model` folds every [`Update`] into `daemon` (its facts),
//! `tapes` (samples, recordings) and `view` (what the user looks at and types); `page` lists the pages; `intent` and
//! `update` are what the panel says and hears.
//!
//! The shell takes the keys and draws top bar, messages and timing before the page, which gets what is left of the
//! window; so no page can lose Stop. A new page is a variant in `page.rs` and a function in a folder;
//! `tests/panel/stop.rs` then types into each of its fields and stops.
//!
//! A plot is drawn from `(&Tape, &[Trace], &[Overlay])` (`plots/chart.rs`), in the window and in an SVG alike. A
//! new signal is an entry in `tape/signal.rs`. A limit, a reference, a cursor, the mark of a change, a fit or a trial
//! is an overlay.

mod app;
pub mod connection;
mod daemon;
mod dialogs;
mod drop_down;
pub mod export;
mod fake_rig;
mod files;
mod identify;
mod intent;
mod model;
mod notice;
mod page;
mod plots;
mod record;
mod settings;
mod shell;
mod stop;
mod study;
mod tape;
mod tapes;
mod text_input;
pub mod theme;
mod tune;
mod update;
mod update_sender;
mod view;
mod words;

pub use app::App;
pub use files::Files;
pub use identify::{Found, Headings, Question};
pub use intent::{DialogPurpose, Format, Intent, Target};
pub use model::Model;
pub use page::Page;
pub use record::{About, Length, Listed, Loaded, RecordingNews, WhatIfTape};
pub use settings::{AgainstSettings, Settings, Theme};
pub use shell::ui;
pub use study::{Stage, StudyCommand, StudyNews, StudyPlan, StudyRow, StudyState, SubjectAction, SubjectState};
pub use update::{Answer, StopNews, Update};
