//! The panel without a window: what it shows of a daemon's updates, and what it makes of keys and clicks.

mod advice;
mod bench;
mod controls;
mod files;
mod hand;
mod help;
mod identify;
mod layout;
mod legible;
mod library;
mod measure;
#[path = "../fixture/metadata.rs"]
mod metadata;
mod plane;
mod plot_list;
mod plots;
mod remembered;
mod rig;
mod scene;
#[path = "../fixture/state.rs"]
mod state;
mod stop;
mod study;
mod values;
mod what_if;
