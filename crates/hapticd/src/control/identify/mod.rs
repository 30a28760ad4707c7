//! `identify.*`: one client has a commissioned rig to itself and draws the handle along courses, to
//! identify what the handle moves; and what was found of the rig itself is stored.

mod operations;

pub(in crate::control) use operations::{begin, end, excite, status, store};
