//! CSV with lines of `#`, so that pandas (`comment="#"`), R, Matlab and gnuplot read it as it is:
//!
//! ```text
//! # hapticd recording 1
//! # {"server":"hapticd 0.1.0","device":"fake rig","loop_rate_hz":1000.0,"rate_hz":1000.0,"started_unix_s":1760000000.0,"revision":7,"scene":{...}}
//! tick,t_s,state,contact,device_position_m,...
//! 183042,183.042,engaged,0,0.0123,...
//! # {"mark":"scene","tick":183050,"revision":8,"name":"steel on teflon","law":"karnopp","params":{"mass":0.5,...}}
//! # {"mark":"state","tick":183100,"state":"stopped"}
//! # {"mark":"lost","rows":12}
//! # {"mark":"end","rows":5000,"lost":12,"missed":0}
//! ```
//!
//! The first line names the format and its version, the next lines hold the [`Metadata`], then come
//! the columns' names ([`haptic_ipc::SAMPLE_COLUMNS`], of two axes [`haptic_ipc::SAMPLE_Y_COLUMNS`]
//! behind them; more may be added at the end) and a row for each sample. A [`Mark`] stands before the
//! first row that it concerns. Other lines of `#` are remarks, and are passed over. A line counts only
//! when its newline is there.

mod reader;
mod row;
mod writer;

pub(super) use reader::Reader;
pub(super) use writer::Writer;

#[cfg(doc)]
use crate::{Mark, Metadata};

pub(super) use haptic_motion::RECORDING_TITLE as TITLE;
