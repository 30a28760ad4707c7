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
//! Its files point one way:
//!
//! ```text
//! theme, page, tape/      the list of pages; samples in chunks, the min/max pyramid, marks, and the list of signals
//! measure/                statistics, spectrum, and the difference of two runs: pure functions of a tape
//! settings                what is remembered, and its file
//! study/                  a study with a person: the subject's screen as data, the rig's part of a session, its thread
//! subject/                draws the subject's window
//! recording/, identification/   content and list of recordings; a question of identification and its answer
//! intent, update          what the panel says and hears
//! update_sender           sends updates to the window and limits its frames
//! stop_path/              stops alone; uses nothing else but `update` and `update_sender`
//! recorder, connection/   threads towards disk and daemon
//! model/                  daemon (facts), tapes (samples, recordings), view (what the user looks at, types and was told)
//! plots/, scene/, bars    draw a part of the model; plots/labels finds places for labels
//! dialogs                 the desktop's dialogs for files, each on the thread of the file
//! export/, files          files, on threads of their own
//! fake_rig                a daemon that ends with the window
//! pages/                  what each page shows
//! shell, app              keys, Stop, messages and the places of everything; ties it all together
//! ```
//!
//! The shell takes the keys and draws top bar, messages and timing before the page, which gets what is left of the
//! window; so no page can lose Stop. A new page is a variant in `page.rs` and a function in `pages/`;
//! `tests/panel/stop.rs` then types into each of its fields and stops.
//!
//! A plot is drawn from `(&Tape, &[Trace], &[Overlay])` (`plots/chart.rs`), in the window and in an SVG alike. A
//! new signal is an entry in `tape/signal.rs`. A limit, a reference, a cursor, the mark of a change, a fit or a trial is an
//! overlay.

mod app;
mod close_question;
pub mod connection;
mod dialogs;
mod drop_down;
pub mod export;
mod fake_rig;
mod files;
mod frame_limiter;
mod hand_strip;
mod help;
mod histogram;
mod identification;
mod intent;
mod measure;
mod model;
mod note;
mod notice;
mod page;
mod page_row;
mod pages;
mod plots;
mod readouts;
mod recorder;
mod recording;
mod scene;
mod settings;
mod settings_thread;
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
