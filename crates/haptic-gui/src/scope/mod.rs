//! What the plots look at and how: the live rig, a while that was frozen or caught, or a recording.

mod chunk;
pub(crate) mod cursors;
mod outline;
pub(crate) mod signal;
pub(crate) mod tape;
pub(crate) mod trigger;
pub(crate) mod value_axes;
pub(crate) mod view;

use cursors::Cursors;
use haptic_ipc::Sample;
use signal::Quantity;
use tape::Tape;
use trigger::{Caught, Mode, Trigger};
use value_axes::ValueAxes;
use view::{View, Zero};

/// The plots' side of the model.
#[derive(Debug)]
pub(crate) struct Scope {
    live: Tape,
    /// The connection is gone: the live tape ends here, and is looked at until another begins.
    is_over: bool,
    /// What the live tape was when the user froze it.
    frozen: Option<Tape>,
    pub(crate) trigger: Trigger,
    view: View,
    pub(crate) cursors: Cursors,
    pub(crate) value_axes: ValueAxes,
    /// Which plots over time are shown.
    pub(crate) shown: [bool; 3],
    pub(crate) zooms_to_stick_band: bool,
    recording: Option<Tape>,
    /// The live view, while a recording is looked at.
    live_view: View,
}

impl Default for Scope {
    fn default() -> Self {
        Self {
            live: Tape::default(),
            is_over: false,
            frozen: None,
            trigger: Trigger::default(),
            view: View::default(),
            cursors: Cursors::default(),
            value_axes: ValueAxes::default(),
            shown: [true; 3],
            zooms_to_stick_band: false,
            recording: None,
            live_view: View::default(),
        }
    }
}

/// A while of the daemon's clock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct While {
    /// Where the time axis has its zero, s on the daemon's clock.
    pub(crate) zero_s: f64,
    pub(crate) from_s: f64,
    pub(crate) to_s: f64,
}

impl While {
    /// How long a while a column of pixels shows where there are so many of them, s.
    pub(crate) fn column_s(&self, columns: f64) -> f64 {
        ((self.to_s - self.from_s) / columns.max(1.0)).max(f64::MIN_POSITIVE)
    }
}

impl Scope {
    /// Takes new samples of the live rig.
    pub(crate) fn extend(&mut self, rows: &[Sample]) {
        if self.is_over && !rows.is_empty() {
            self.begin_anew();
        }
        self.live.extend(rows.iter().copied());
        // A recording that is looked at has a view of its own.
        let view = if self.is_of_recording() {
            &self.live_view
        } else {
            &self.view
        };
        let span_s = view.span_s();
        self.trigger.look(rows, self.live.oldest_s(), span_s);
        self.trigger.catch(&self.live, span_s);
    }

    /// The connection to the rig is gone. What was seen last stays until there is something else to see.
    pub(crate) fn lose_live(&mut self) {
        self.is_over = true;
    }

    /// Forgets what was live before the connection was lost. What the user holds still stays, and so does a recording.
    fn begin_anew(&mut self) {
        let before = std::mem::take(&mut self.live);
        self.is_over = false;
        let view = if self.is_of_recording() {
            &self.live_view
        } else {
            &self.view
        };
        if view.zero != Zero::Newest {
            // One that was only moved is on the tape that ends here.
            self.frozen.get_or_insert(before);
        }
        // What it caught and what it waits for are of the past as well.
        let mode = self.trigger.mode();
        self.trigger.set_mode(Mode::Off);
        self.trigger.set_mode(mode);
    }

    /// Looks at a recording.
    pub(crate) fn open(&mut self, tape: Tape) {
        self.frozen = None;
        let (from, to) = (tape.oldest_s().unwrap_or(0.0), tape.newest_s().unwrap_or(0.0));
        if self.recording.is_none() {
            self.live_view = self.view;
        }
        self.view = View::whole(from, to - from);
        discard(self.recording.replace(tape));
    }

    /// Looks at the live rig again.
    pub(crate) fn close(&mut self) {
        if let Some(tape) = self.recording.take() {
            self.view = self.live_view;
            discard(Some(tape));
        }
    }

    pub(crate) fn is_of_recording(&self) -> bool {
        self.recording.is_some()
    }

    /// What stands on the screen because the trigger caught it.
    fn caught(&self) -> Option<&Caught> {
        let is_shown = !self.is_of_recording() && self.frozen.is_none() && self.view.zero == Zero::Newest;
        self.trigger.caught().filter(|_| is_shown)
    }

    /// The samples that are looked at.
    pub(crate) fn tape(&self) -> &Tape {
        let still = self.recording.as_ref().or(self.frozen.as_ref());
        still.or(self.caught().map(|caught| &caught.tape)).unwrap_or(&self.live)
    }

    /// The samples of the live rig, whatever is looked at.
    pub(crate) fn live(&self) -> &Tape {
        &self.live
    }

    /// The newest sample of the live rig; none when the connection to it is gone.
    pub(crate) fn last(&self) -> Option<&Sample> {
        self.live.last().filter(|_| !self.is_over)
    }

    /// Whether there is anything to look at.
    pub(crate) fn is_empty(&self) -> bool {
        self.tape().last().is_none()
    }

    pub(crate) fn span_s(&self) -> f64 {
        self.view.span_s()
    }

    /// What is seen.
    pub(crate) fn seen(&self) -> While {
        let (zero_s, (left_s, right_s)) = match (self.view.zero, self.caught()) {
            (Zero::At(zero_s), _) => (zero_s, self.view.edges()),
            (Zero::Newest, Some(caught)) => (caught.t_s, self.trigger.edges(self.view.span_s())),
            (Zero::Newest, None) => (self.live.newest_s().unwrap_or(0.0), self.view.edges()),
        };
        While {
            zero_s,
            from_s: zero_s + left_s,
            to_s: zero_s + right_s,
        }
    }

    /// Whether the plots follow the live rig.
    pub(crate) fn follows(&self) -> bool {
        !self.is_of_recording() && self.frozen.is_none() && self.view.zero == Zero::Newest
    }

    /// Whether the right edge of what is seen is now.
    pub(crate) fn ends_now(&self) -> bool {
        self.follows() && !self.is_over && self.caught().is_none()
    }

    /// Keeps what is there now, for as long as the user wants to look at it.
    pub(crate) fn freeze(&mut self) {
        let seen = self.seen();
        self.frozen = Some(self.tape().clone());
        self.view.hold(seen.zero_s, seen.to_s - seen.zero_s);
    }

    /// Follows the live rig again.
    pub(crate) fn follow(&mut self) {
        self.frozen = None;
        self.view.follow();
    }

    /// Sets the trigger up; the plots follow it from then on.
    pub(crate) fn set_trigger_mode(&mut self, mode: Mode) {
        self.trigger.set_mode(mode);
        self.follow();
    }

    /// Makes the while shorter or longer around a time of the axis, s.
    pub(crate) fn zoom(&mut self, factor: f64, around_s: f64) {
        self.view.zoom(factor, around_s);
    }

    /// Moves towards later times, s. What ran stands still from then on, for else it would run away from under the pointer.
    pub(crate) fn shift(&mut self, by_s: f64) {
        if self.caught().is_some() {
            self.freeze();
        }
        let seen = self.seen();
        self.view.hold(seen.zero_s, seen.to_s - seen.zero_s + by_s);
    }

    /// The plots that are shown, in their order.
    pub(crate) fn quantities(&self) -> impl Iterator<Item = Quantity> {
        let shown = self.shown;
        Quantity::ALL
            .into_iter()
            .zip(shown)
            .filter(|(_, shown)| *shown)
            .map(|(quantity, _)| quantity)
    }
}

/// Frees what a recording took on a thread of its own: hundreds of megabytes take longer than a frame may.
fn discard(tape: Option<Tape>) {
    if let Some(tape) = tape {
        // Without a thread it is freed here.
        drop(
            std::thread::Builder::new()
                .name("free".to_owned())
                .spawn(move || drop(tape)),
        );
    }
}

#[cfg(test)]
mod tests {
    use super::tape::tests::at;
    use super::*;

    fn running() -> Scope {
        let mut scope = Scope::default();
        scope.extend(&(0..=20_000).map(|ms| at(f64::from(ms) * 1e-3)).collect::<Vec<_>>());
        scope
    }

    fn more(scope: &mut Scope) {
        scope.extend(&(20_001..30_000).map(|ms| at(f64::from(ms) * 1e-3)).collect::<Vec<_>>());
    }

    #[test]
    fn plots_run_until_they_are_moved() {
        let mut scope = running();
        assert_eq!((scope.seen().from_s, scope.seen().to_s), (15.0, 20.0));
        scope.shift(-1.0);
        more(&mut scope);
        assert_eq!(
            (scope.seen().from_s, scope.seen().to_s, scope.seen().zero_s),
            (14.0, 19.0, 20.0)
        );
        scope.follow();
        assert!(scope.seen().to_s > 29.9);
    }

    #[test]
    fn what_is_frozen_stays_when_the_rig_goes_on() {
        let mut scope = running();
        scope.freeze();
        more(&mut scope);
        assert_eq!(scope.tape().newest_s(), Some(20.0));
        assert!(!scope.follows());
        scope.follow();
        assert!(scope.tape().newest_s() > Some(29.9));
    }

    #[test]
    fn what_was_seen_last_stays_when_the_connection_is_lost_until_something_new_comes() {
        let mut scope = running();
        scope.lose_live();
        assert_eq!((scope.seen().from_s, scope.seen().to_s), (15.0, 20.0));
        assert!(!scope.is_empty() && scope.last().is_none(), "it is not what is so now");
        scope.extend(&[]);
        assert!(!scope.is_empty());
        // The same daemon goes on, or another begins.
        for t_s in [100.0, 0.5] {
            scope.lose_live();
            scope.extend(&[at(t_s)]);
            assert_eq!((scope.tape().oldest_s(), scope.seen().to_s), (Some(t_s), t_s));
            assert!(scope.last().is_some());
        }
    }

    #[test]
    fn what_is_held_still_outlives_the_daemon() {
        let hold: [fn(&mut Scope); 2] = [Scope::freeze, |scope| scope.shift(-1.0)];
        for hold in hold {
            let mut scope = running();
            hold(&mut scope);
            let seen = scope.seen();
            for _ in 0..2 {
                scope.lose_live();
                scope.extend(&[at(0.5)]);
                assert_eq!((scope.seen(), scope.tape().newest_s()), (seen, Some(20.0)));
            }
            scope.follow();
            assert_eq!(scope.tape().newest_s(), Some(0.5));
        }
    }

    #[test]
    fn a_recording_is_seen_whole_and_gives_way_to_the_rig() {
        let mut scope = running();
        scope.open(Tape::recorded((0..100).map(|i| at(f64::from(i)))));
        more(&mut scope);
        assert_eq!((scope.seen().from_s, scope.seen().to_s), (0.0, 99.0));
        scope.zoom(2.0, 99.0);
        assert_eq!((scope.seen().from_s, scope.seen().to_s), (49.5, 99.0));
        scope.close();
        assert!(scope.follows() && scope.seen().to_s > 29.9);
        assert_eq!(scope.span_s(), 5.0);
    }

    #[test]
    fn what_was_caught_can_be_looked_around_in() {
        let mut scope = Scope::default();
        scope.zoom(10.0, 0.0);
        scope.set_trigger_mode(Mode::Single);
        let rows = (0..2000).map(|ms| {
            let mut row = at(f64::from(ms) * 1e-3);
            row.coupling_force_n = if ms < 1000 { 0.0 } else { 5.0 };
            row
        });
        scope.extend(&rows.collect::<Vec<_>>());
        assert_eq!(
            scope.seen(),
            While {
                zero_s: 1.0,
                from_s: 0.75,
                to_s: 1.25
            }
        );
        scope.shift(0.1);
        assert_eq!(
            scope.seen(),
            While {
                zero_s: 1.0,
                from_s: 0.85,
                to_s: 1.35
            }
        );
        more(&mut scope);
        assert_eq!(scope.seen().zero_s, 1.0);
    }
}
