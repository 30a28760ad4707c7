//! How the user looks at the tapes: the time that is seen, freeze, trigger, cursors and axes.

pub(crate) mod against;
pub(crate) mod cursors;
pub(crate) mod plot_list;
#[cfg(test)]
mod tests;
mod time_window;
pub(crate) mod trigger;
pub(crate) mod value_axis;

use crate::tape::Tape;
use crate::tapes::Tapes;
use against::Against;
use cursors::Cursors;
use haptic_ipc::Sample;
use plot_list::PlotList;
use time_window::{TimeWindow, Zero};
use trigger::{Capture, Mode, Trigger};

/// The view of the plots.
#[derive(Debug, Default)]
pub(crate) struct Scope {
    /// The tape as it was when the user froze it.
    frozen: Option<Tape>,
    pub(crate) trigger: Trigger,
    pub(super) window: TimeWindow,
    /// Whether it shows the opened recording instead of the live rig.
    is_of_recording: bool,
    pub(crate) cursors: Cursors,
    pub(crate) plots: PlotList,
    pub(crate) against: Against,
}

/// A stretch of time on the daemon's clock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TimeRange {
    /// Zero of the time axis, s on the daemon's clock.
    pub(crate) zero_s: f64,
    pub(crate) from_s: f64,
    pub(crate) to_s: f64,
}

impl TimeRange {
    /// Time that one of `columns` columns of pixels shows, s.
    pub(crate) fn column_s(&self, columns: f64) -> f64 {
        ((self.to_s - self.from_s) / columns.max(1.0)).max(f64::MIN_POSITIVE)
    }

    /// Both ends, s from the zero of the axis.
    pub(crate) fn on_axis(&self) -> (f64, f64) {
        (self.from_s - self.zero_s, self.to_s - self.zero_s)
    }
}

impl Scope {
    /// The view of the opened recording.
    pub(crate) fn of_recording() -> Self {
        Self {
            is_of_recording: true,
            ..Self::default()
        }
    }

    /// Takes new samples of the live rig, which `tapes` holds already. `ended` is the tape that a new
    /// one has replaced.
    pub(crate) fn take_samples(&mut self, rows: &[Sample], ended: Option<Tape>, tapes: &Tapes) {
        if let Some(ended) = ended {
            if self.window.zero != Zero::Newest {
                // A moved window shows the tape that has ended.
                self.frozen.get_or_insert(ended);
            }
            self.trigger.restart();
        }
        let span_s = self.window.span_s();
        let rows = self.trigger.rows_of(rows, tapes.live());
        self.trigger.look(&rows, tapes.live().oldest_s(), span_s);
        self.trigger.catch(tapes.live(), span_s);
    }

    /// Shows the whole of the recording that was opened.
    pub(crate) fn open(&mut self, tape: &Tape) {
        let (from, to) = (tape.oldest_s().unwrap_or(0.0), tape.newest_s().unwrap_or(0.0));
        self.window = TimeWindow::whole(from, to - from);
    }

    /// Whether it shows the live rig.
    pub(crate) fn is_of_rig(&self) -> bool {
        !self.is_of_recording
    }

    /// The crossing that the trigger has caught, if it is shown.
    pub(crate) fn caught(&self) -> Option<&Capture> {
        self.trigger.caught().filter(|_| self.follows())
    }

    pub(crate) fn tape<'a>(&'a self, tapes: &'a Tapes) -> &'a Tape {
        let opened = tapes.opened_tape().filter(|_| self.is_of_recording);
        opened
            .or(self.frozen.as_ref())
            .or(self.caught().map(|caught| &caught.tape))
            .unwrap_or(tapes.live())
    }

    pub(crate) fn has_samples(&self, tapes: &Tapes) -> bool {
        self.tape(tapes).last().is_some()
    }

    pub(crate) fn span_s(&self) -> f64 {
        self.window.span_s()
    }

    pub(crate) fn seen(&self, tapes: &Tapes) -> TimeRange {
        let (zero_s, (left_s, right_s)) = match (self.window.zero, self.caught()) {
            (Zero::At(zero_s), _) => (zero_s, self.window.edges()),
            (Zero::Newest, Some(caught)) => (caught.t_s, self.trigger.edges(self.window.span_s())),
            (Zero::Newest, None) => (tapes.live().newest_s().unwrap_or(0.0), self.window.edges()),
        };
        TimeRange {
            zero_s,
            from_s: zero_s + left_s,
            to_s: zero_s + right_s,
        }
    }

    /// Whether the plots follow the live rig.
    pub(crate) fn follows(&self) -> bool {
        !self.is_of_recording && self.frozen.is_none() && self.window.zero == Zero::Newest
    }

    /// Whether the right edge of the plots is the present.
    pub(crate) fn ends_now(&self, tapes: &Tapes) -> bool {
        self.follows() && tapes.is_live() && self.caught().is_none()
    }

    /// Keeps what is seen until the user follows the live rig again. No sample is copied.
    pub(crate) fn freeze(&mut self, tapes: &Tapes) {
        let seen = self.seen(tapes);
        self.frozen = Some(self.tape(tapes).clone());
        self.window.hold(seen.zero_s, seen.to_s - seen.zero_s);
    }

    /// Follows the live rig again.
    pub(crate) fn follow(&mut self) {
        self.frozen = None;
        self.window.follow();
    }

    /// Sets the trigger's mode; from then on the plots follow it.
    pub(crate) fn set_trigger_mode(&mut self, mode: Mode) {
        self.trigger.set_mode(mode);
        self.follow();
    }

    /// Shows less time (a factor above 1) or more around a time of the axis, s.
    pub(crate) fn zoom(&mut self, factor: f64, around_s: f64) {
        self.window.zoom(factor, around_s);
    }

    /// Moves towards later times, s. A running plot stands still from then on: otherwise it would move
    /// away from under the pointer.
    pub(crate) fn shift(&mut self, by_s: f64, tapes: &Tapes) {
        if self.caught().is_some() {
            self.freeze(tapes);
        }
        let seen = self.seen(tapes);
        self.window.hold(seen.zero_s, seen.to_s - seen.zero_s + by_s);
    }

    /// The time that is measured, s on the daemon's clock: between the cursors, or what is seen.
    pub(crate) fn measured(&self, tapes: &Tapes) -> (f64, f64) {
        let seen = self.seen(tapes);
        if !self.cursors.shown {
            return (seen.from_s, seen.to_s);
        }
        let [first, second] = self.cursors.at_s.map(|at_s| seen.zero_s + at_s);
        (first.min(second), first.max(second))
    }
}
