//! The trigger of an oscilloscope: when a signal crosses a level, the time around the crossing is
//! caught and stands still.
//!
//! Hysteresis keeps ripple from firing: before it can cross again, the signal must go back beyond the
//! level by a share of its recent range. The trigger fires only if the tape reaches as far back as the
//! view shows, and catches when the tape reaches as far ahead. All times are those of the samples, so a
//! late batch changes nothing.

use crate::tape::Tape;
use crate::tape::plane::Component;
use crate::tape::signal::Signal;
use haptic_ipc::Sample;
use std::borrow::Cow;

/// Multiples of the time seen that are caught on either side as well, to look around.
const SPANS_AROUND: f64 = 2.0;

/// Time without a crossing after which the automatic mode lets the plots run, s.
const PATIENCE_S: f64 = 0.5;

/// Hysteresis, as a share of the signal's recent range.
const HYSTERESIS: f64 = 0.1;

/// Time constant with which the recent range is forgotten, s.
const RECENT_S: f64 = 5.0;

/// When the trigger catches.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Mode {
    /// Never: the plots run.
    #[default]
    Off,
    /// At every crossing; the plots run while there is none.
    Auto,
    /// At every crossing.
    Normal,
    /// At the next crossing.
    Single,
}

impl Mode {
    pub(crate) const ALL: [Self; 4] = [Self::Off, Self::Auto, Self::Normal, Self::Single];

    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Off => "Off",
            Self::Auto => "Auto",
            Self::Normal => "Normal",
            Self::Single => "Single",
        }
    }
}

/// Direction in which the signal crosses the level.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Edge {
    #[default]
    Rising,
    Falling,
}

/// The samples around a crossing that the trigger has caught.
#[derive(Clone, Debug)]
pub(crate) struct Capture {
    pub(crate) tape: Tape,
    /// The first sample beyond the level, s on the daemon's clock.
    pub(crate) t_s: f64,
}

#[derive(Debug)]
struct Crossing {
    signal: Signal,
    component: Component,
    edge: Edge,
    level: f64,
    /// Recent range of the signal, in the unit of its quantity.
    reach: Option<(f64, f64)>,
    newest: Option<Sample>,
    /// The signal was far enough on the other side.
    is_ready: bool,
}

impl Crossing {
    fn new(signal: Signal, component: Component) -> Self {
        Self {
            signal,
            component,
            edge: Edge::default(),
            level: 0.0,
            reach: None,
            newest: None,
            is_ready: false,
        }
    }

    /// Looks for this crossing.
    fn aim(&mut self, edge: Edge, level: f64) {
        self.is_ready &= (self.edge, self.level) == (edge, level);
        (self.edge, self.level) = (edge, level);
    }

    /// Takes the next sample; returns whether the signal crosses there.
    fn take(&mut self, sample: &Sample) -> bool {
        let before = self.newest.replace(*sample).unwrap_or(*sample);
        let value = self.signal.of(&before, sample);
        let (low, high) = self.reach.unwrap_or((value, value));
        let forgets = ((sample.t_s - before.t_s) / RECENT_S).clamp(0.0, 1.0) * (high - low);
        let (low, high) = (value.min(low + forgets), value.max(high - forgets));
        self.reach = Some((low, high));
        // Distance beyond the level, in the direction of the crossing.
        let beyond = match self.edge {
            Edge::Rising => value - self.level,
            Edge::Falling => self.level - value,
        };
        let crosses = self.is_ready && beyond >= 0.0;
        self.is_ready = !crosses && (self.is_ready || beyond < -HYSTERESIS * (high - low));
        crosses
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Phase {
    #[default]
    Armed,
    /// It fired at this time, s, and waits for the samples after it.
    Fired(f64),
    /// A single crossing was caught.
    Done,
}

/// The trigger's settings and state.
#[derive(Debug)]
pub(crate) struct Trigger {
    mode: Mode,
    pub(crate) signal: Signal,
    /// On a rig of two axes `Whole` is the first; on one axis it is all that there is.
    pub(crate) component: Component,
    pub(crate) edge: Edge,
    /// In the unit of the signal's quantity.
    pub(crate) level: f64,
    /// Share of the time seen that lies before the crossing.
    pub(crate) share_before: f64,
    phase: Phase,
    /// Time since which it waits for a crossing, s on the daemon's clock.
    armed_at_s: Option<f64>,
    crossing: Option<Crossing>,
    caught: Option<Capture>,
}

impl Default for Trigger {
    fn default() -> Self {
        Self {
            mode: Mode::Off,
            signal: Signal::COMMAND_FORCE,
            component: Component::Whole,
            edge: Edge::Rising,
            level: 3.0,
            share_before: 0.5,
            phase: Phase::Armed,
            armed_at_s: None,
            crossing: None,
            caught: None,
        }
    }
}

impl Trigger {
    pub(crate) fn mode(&self) -> Mode {
        self.mode
    }

    /// Changes the mode, and waits for a crossing from now on.
    pub(crate) fn set_mode(&mut self, mode: Mode) {
        self.mode = mode;
        self.crossing = None;
        self.arm();
        if mode == Mode::Off {
            self.caught = None;
        }
    }

    /// Drops what it has caught and waits for: the tape has ended.
    pub(crate) fn restart(&mut self) {
        self.caught = None;
        self.set_mode(self.mode);
    }

    /// Waits for the next crossing.
    pub(crate) fn arm(&mut self) {
        (self.phase, self.armed_at_s) = (Phase::Armed, None);
    }

    /// The caught crossing, unless the plots run.
    pub(crate) fn caught(&self) -> Option<&Capture> {
        self.caught.as_ref()
    }

    pub(crate) fn state_text(&self) -> &'static str {
        match (self.mode, self.phase, &self.caught) {
            (Mode::Off, ..) => "Running",
            (Mode::Auto, Phase::Armed, None) => "No crossing: running",
            (_, Phase::Armed, _) => "Armed",
            (_, Phase::Fired(_), _) => "Triggered",
            (_, Phase::Done, _) => "Caught",
        }
    }

    /// Left and right edge of a window of `span_s`, s from the crossing.
    pub(crate) fn edges(&self, span_s: f64) -> (f64, f64) {
        (-self.share_before * span_s, (1.0 - self.share_before) * span_s)
    }

    /// Of new samples, which a tape holds already, what it looks at.
    pub(crate) fn rows_of<'a>(&self, rows: &'a [Sample], live: &Tape) -> Cow<'a, [Sample]> {
        let ends = rows.first().zip(rows.last());
        let component = live
            .component(self.component)
            .filter(|_| self.component != Component::Whole);
        match ends.zip(component) {
            Some(((first, last), tape)) => tape.within(first.t_s, last.t_s).copied().collect(),
            None => rows.into(),
        }
    }

    pub(crate) fn look(&mut self, rows: &[Sample], oldest_s: Option<f64>, span_s: f64) {
        if self.mode == Mode::Off {
            return;
        }
        let past_s = -self.edges(span_s).0;
        let of = (self.signal, self.component);
        let crossing = self
            .crossing
            .take()
            .filter(|crossing| (crossing.signal, crossing.component) == of);
        let mut crossing = crossing.unwrap_or_else(|| Crossing::new(self.signal, self.component));
        crossing.aim(self.edge, self.level);
        for row in rows {
            let since = *self.armed_at_s.get_or_insert(row.t_s);
            let has_past = oldest_s.is_some_and(|oldest| row.t_s - oldest >= past_s);
            let crosses = crossing.take(row);
            if self.phase == Phase::Armed && has_past && crosses {
                self.phase = Phase::Fired(row.t_s);
            }
            let is_quiet = row.t_s - since > PATIENCE_S.max(2.0 * span_s);
            if self.mode == Mode::Auto && self.phase == Phase::Armed && is_quiet {
                self.caught = None;
            }
        }
        self.crossing = Some(crossing);
    }

    /// The first crossing of the level from one time to another, s on the daemon's clock, with its hysteresis.
    pub(crate) fn first_crossing(&self, tape: &Tape, from_s: f64, to_s: f64) -> Option<f64> {
        let mut crossing = Crossing::new(self.signal, self.component);
        crossing.aim(self.edge, self.level);
        let mut samples = tape.component(self.component).unwrap_or(tape).within(from_s, to_s);
        samples.find(|sample| crossing.take(sample)).map(|sample| sample.t_s)
    }

    /// Catches the crossing once the samples after it are there; returns whether it did.
    pub(crate) fn catch(&mut self, live: &Tape, span_s: f64) -> bool {
        let Phase::Fired(t_s) = self.phase else {
            return false;
        };
        let (left_s, right_s) = self.edges(span_s);
        if live.newest_s().is_none_or(|newest| newest < t_s + right_s) {
            return false;
        }
        let around_s = SPANS_AROUND * span_s;
        self.caught = Some(Capture {
            tape: live.part(t_s + left_s - around_s, t_s + right_s + around_s),
            t_s,
        });
        self.arm();
        if self.mode == Mode::Single {
            self.phase = Phase::Done;
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tape::tests::at;
    use haptic_ipc::SampleY;

    const SPAN_S: f64 = 1.0;

    /// A trigger on a force that rises above 3 N, with a quarter of the second seen before it, fed
    /// as batches of ten samples, 1000 a second.
    struct TestRig {
        trigger: Trigger,
        tape: Tape,
        /// The force along the second axis, if there is one.
        y: Option<fn(u32) -> f64>,
    }

    impl TestRig {
        fn new(mode: Mode) -> Self {
            let mut trigger = Trigger {
                share_before: 0.25,
                ..Trigger::default()
            };
            trigger.set_mode(mode);
            Self {
                trigger,
                tape: Tape::default(),
                y: None,
            }
        }

        fn feel(&mut self, from_ms: u32, to_ms: u32, force: impl Fn(u32) -> f64) {
            let row = |ms: u32| Sample {
                command_force_n: force(ms),
                ..at(f64::from(ms) * 1e-3)
            };
            let y = |ms| {
                let force = self.y?;
                Some(SampleY {
                    command_force_n: force(ms),
                    ..SampleY::default()
                })
            };
            let ticks: Vec<_> = (from_ms..to_ms).map(|ms| (row(ms), y(ms))).collect();
            for batch in ticks.chunks(10) {
                self.tape.extend_ticks(batch.iter().copied());
                let rows: Vec<_> = batch.iter().map(|(row, _)| *row).collect();
                let rows = self.trigger.rows_of(&rows, &self.tape);
                self.trigger.look(&rows, self.tape.oldest_s(), SPAN_S);
                self.trigger.catch(&self.tape, SPAN_S);
            }
        }

        fn caught_ms(&self) -> Option<f64> {
            self.trigger.caught().map(|caught| (caught.t_s * 1e3).round())
        }
    }

    fn square(ms: u32) -> f64 {
        if ms % 400 < 200 { 0.0 } else { 5.0 }
    }

    #[test]
    fn a_rising_edge_is_caught_with_its_past_and_its_future() {
        let mut rig = TestRig::new(Mode::Single);
        rig.feel(0, 1340, |ms| if ms < 600 { 0.0 } else { 5.0 });
        assert_eq!(rig.caught_ms(), None, "the future is not there yet");
        assert_eq!(rig.trigger.state_text(), "Triggered");
        rig.feel(1340, 1400, |_| 5.0);
        assert_eq!(rig.caught_ms(), Some(600.0));
        let caught = rig.trigger.caught().expect("it is");
        assert!(caught.tape.oldest_s() <= Some(0.35) && caught.tape.newest_s() >= Some(1.35));
        assert_eq!(rig.trigger.state_text(), "Caught");
    }

    #[test]
    fn second_axis_and_length_fire_by_themselves() {
        for (component, level, at_ms) in [(Component::Y, 3.0, 600.0), (Component::Length, 6.0, 800.0)] {
            let mut rig = TestRig::new(Mode::Single);
            rig.y = Some(|ms| if ms < 600 { 0.0 } else { 5.0 });
            (rig.trigger.component, rig.trigger.level) = (component, level);
            rig.feel(0, 1700, |ms| if ms < 800 { 0.0 } else { -5.0 });
            assert_eq!(rig.caught_ms(), Some(at_ms), "{component:?}");
        }
    }

    #[test]
    fn an_edge_without_enough_of_a_past_does_not_count() {
        let mut rig = TestRig::new(Mode::Single);
        // Rises at 200, 600 and 1000 ms; at the first there are but 200 ms of a past of 250.
        rig.feel(0, 3000, square);
        assert_eq!(rig.caught_ms(), Some(600.0));
    }

    /// A block that sticks up to 5 N, and slides at 3 N with a ripple of a quarter of a newton.
    fn stick_slip_with_ripple(ms: u32) -> f64 {
        match ms % 1000 {
            until @ ..500 => f64::from(until) * 0.01,
            until => 3.0 + 0.25 * (f64::from(until) * 0.3).sin(),
        }
    }

    #[test]
    fn ripple_on_the_level_does_not_fire() {
        for (edge, at_ms) in [(Edge::Rising, 300.0), (Edge::Falling, 500.0)] {
            let mut rig = TestRig::new(Mode::Single);
            rig.trigger.edge = edge;
            rig.trigger.level = if edge == Edge::Rising { 3.0 } else { 2.9 };
            for second in (1..20_u32).step_by(2) {
                rig.trigger.arm();
                // Armed in the middle of a slide.
                rig.feel(1000 * second - 300, 1000 * second + 1700, stick_slip_with_ripple);
                if second > 1 {
                    assert_eq!(rig.caught_ms().map(|ms| ms % 1000.0), Some(at_ms), "{edge:?}");
                }
            }
        }
    }

    #[test]
    fn a_small_signal_fires_once_a_large_one_is_long_past() {
        let mut rig = TestRig::new(Mode::Single);
        rig.feel(0, 2000, |ms| if ms < 1000 { 0.0 } else { 20.0 });
        rig.trigger.arm();
        rig.feel(2000, 3000, |_| 2.5);
        rig.trigger.level = 2.6;
        let small = |ms: u32| if ms % 1000 < 500 { 2.5 } else { 2.7 };
        rig.feel(3000, 5000, small);
        assert_eq!(rig.caught_ms(), Some(1000.0), "not yet again");
        rig.feel(5000, 60_000, small);
        assert!(rig.caught_ms() > Some(5000.0));
    }

    #[test]
    fn normal_goes_on_to_the_next_and_single_waits_to_be_armed() {
        let mut normal = TestRig::new(Mode::Normal);
        normal.feel(0, 3000, square);
        assert!(normal.caught_ms() > Some(600.0));
        let mut single = TestRig::new(Mode::Single);
        single.feel(0, 3000, square);
        single.trigger.arm();
        single.feel(3000, 4000, square);
        assert_eq!(single.caught_ms(), Some(3000.0));
    }

    #[test]
    fn automatic_runs_while_nothing_happens() {
        let mut rig = TestRig::new(Mode::Auto);
        rig.feel(0, 2000, square);
        assert!(rig.trigger.caught().is_some());
        rig.feel(2000, 6000, |_| 0.0);
        assert!(rig.trigger.caught().is_none());
        let mut normal = TestRig::new(Mode::Normal);
        normal.feel(0, 2000, square);
        normal.feel(2000, 6000, |_| 0.0);
        assert!(normal.trigger.caught().is_some());
    }
}
