//! What the subject's window shows, shared between the thread that hears samples, the one that runs the study, and the
//! window. It is blind: it knows neither scene nor condition.

use super::latency::Latencies;
use egui::Context;
use haptic_ipc::Sample;
use haptic_studies::plan::RigMapping;
use haptic_studies::session::{Frame, Phase, View};
use std::fmt;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// A frame that follows the one before later than this says nothing of when that one was seen.
const MAX_FRAME: Duration = Duration::from_millis(500);

/// An action of the subject.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SubjectAction {
    /// A click, which also continues after words.
    Click,
    /// An answer: the interval, 1 or 2.
    Answer(u8),
}

/// How the handle moves the cursor, and how far targets reach.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TaskScale {
    /// How the handle moves the cursor.
    pub(crate) mapping: RigMapping,
    /// Largest distance from the middle that any target of the study reaches, m of the task: the scale is the same
    /// for all of them.
    pub(crate) reach_m: f64,
}

/// The scale of a pointer where there are no targets.
const WITHOUT_TARGETS: TaskScale = TaskScale {
    mapping: RigMapping {
        gain: 1.0,
        center_m: 0.0,
        range_m: [-0.06, 0.06],
    },
    reach_m: 0.06,
};

#[derive(Default)]
pub(crate) struct SubjectScreen {
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    /// None while no subject is at work.
    view: Option<View>,
    scale: Option<TaskScale>,
    /// The newest sample, and when it came.
    newest: Option<(Sample, Instant)>,
    /// Whether the pointer is the hand on the rig, and where it was since that was last asked, m of the rig.
    takes_hand: bool,
    pointed_m: Option<f64>,
    /// What the subject did, and the newest tick at that time.
    actions: Ticked<SubjectAction>,
    /// The window, while it is open.
    window: Option<Context>,
    is_full_screen: bool,
    /// The last frame, where it shows a cursor.
    shown: Option<CursorFrame>,
    latencies: Latencies,
    /// The frames that the study has not taken yet, each with the tick that it showed.
    fresh: Ticked<Frame>,
}

/// A frame that shows a cursor.
struct CursorFrame {
    /// When the frame began.
    began: Instant,
    /// The tick that it shows.
    tick: u64,
    /// When the sample that it shows was received.
    received: Instant,
    /// The time that the sample took from the device.
    before: Duration,
}

impl State {
    /// Whether a cursor is drawn.
    fn has_cursor(&self) -> bool {
        self.view.is_some_and(|view| matches!(view.phase, Phase::Targets(_)))
    }
}

impl fmt::Debug for SubjectScreen {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("SubjectScreen").finish_non_exhaustive()
    }
}

/// What a frame of the subject's window draws.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SubjectFrame {
    /// None while no subject is at work.
    pub(crate) view: Option<View>,
    /// How far targets reach, m of the task.
    pub(crate) reach_m: f64,
    /// Centre of the cursor, m of the task; none before the first sample.
    pub(crate) cursor_m: Option<f64>,
    /// The scale of the pointer, where that is the hand on the rig.
    pub(crate) hand: Option<TaskScale>,
}

/// What came, each with its tick.
type Ticked<T> = Vec<(T, u64)>;

/// Takes what waits up to a tick.
fn take_until<T>(waiting: &mut Ticked<T>, last_tick: u64) -> Ticked<T> {
    waiting.extract_if(.., |(_, tick)| *tick <= last_tick).collect()
}

impl SubjectScreen {
    fn state(&self) -> MutexGuard<'_, State> {
        // It is consistent between any two statements, so a panic elsewhere leaves it usable.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Shows something else.
    pub(crate) fn set_view(&self, view: Option<View>) {
        let window = {
            let mut state = self.state();
            if state.view == view {
                return;
            }
            state.view = view;
            state.window.clone()
        };
        repaint(window.as_ref());
    }

    pub(crate) fn set_scale(&self, scale: Option<TaskScale>) {
        self.state().scale = scale;
    }

    /// Takes the newest sample of a batch: the cursor moves.
    pub(crate) fn take_sample(&self, sample: &Sample, received: Instant) {
        let window = {
            let mut state = self.state();
            state.newest = Some((*sample, received));
            state.window.clone().filter(|_| state.has_cursor())
        };
        repaint(window.as_ref());
    }

    /// The samples end: no cursor is drawn until they continue, perhaps from another tick.
    pub(crate) fn lose_samples(&self) {
        let mut state = self.state();
        (state.newest, state.shown) = (None, None);
        state.actions.clear();
        state.fresh.clear();
    }

    /// Whether the pointer is the hand on the rig.
    pub(crate) fn set_takes_hand(&self, takes_hand: bool) {
        self.state().takes_hand = takes_hand;
    }

    /// The pointer is at a place, m of the rig.
    pub(crate) fn point(&self, target_m: f64) {
        self.state().pointed_m = Some(target_m);
    }

    /// Where the pointer was since last time, m of the rig.
    pub(crate) fn take_pointed(&self) -> Option<f64> {
        self.state().pointed_m.take()
    }

    /// The subject did something. Without a sample there is no tick, and nothing to do.
    pub(crate) fn act(&self, action: SubjectAction) {
        let mut state = self.state();
        if let Some((sample, _)) = state.newest {
            state.actions.push((action, sample.tick));
        }
    }

    /// What the subject did up to a tick, each with its own, and the frames that showed the cursor. What came later
    /// belongs to a later trial, where the study is behind.
    pub(crate) fn take_actions(&self, last_tick: u64) -> (Ticked<SubjectAction>, Ticked<Frame>) {
        let state = &mut *self.state();
        (
            take_until(&mut state.actions, last_tick),
            take_until(&mut state.fresh, last_tick),
        )
    }

    /// The newest tick, while samples come.
    pub(crate) fn newest_tick(&self) -> Option<u64> {
        self.state().newest.map(|(sample, _)| sample.tick)
    }

    /// A frame begins, so the one before is over: it was seen by now at the latest.
    pub(crate) fn begin_frame(&self, now: Instant) -> SubjectFrame {
        let mut state = self.state();
        if let Some(shown) = state.shown.take() {
            let waited = now.saturating_duration_since(shown.received);
            if waited <= MAX_FRAME {
                let latency = waited + shown.before;
                state.latencies.add(latency);
                let frame = Frame {
                    latency_s: latency.as_secs_f64(),
                    lasted_s: now.saturating_duration_since(shown.began).as_secs_f64(),
                };
                state.fresh.push((frame, shown.tick));
            }
        }
        let scale = state.scale;
        let newest = state.newest.filter(|_| state.has_cursor());
        let cursor_m = newest.zip(scale).map(|((sample, received), scale)| {
            state.shown = Some(CursorFrame {
                began: now,
                tick: sample.tick,
                received,
                before: Duration::from_nanos(sample.device_round_trip_ns),
            });
            scale.mapping.task_m(sample.device_position_m)
        });
        SubjectFrame {
            view: state.view,
            reach_m: scale.map_or(0.0, |scale| scale.reach_m),
            cursor_m,
            hand: state.takes_hand.then(|| scale.unwrap_or(WITHOUT_TARGETS)),
        }
    }

    /// Median and 95th percentile of the cursor's latency in this study, ms, and the frames that were measured.
    pub(crate) fn latency_ms(&self) -> Option<(f64, f64, u64)> {
        let state = self.state();
        let latencies = &state.latencies;
        Some((
            latencies.quantile_ms(0.5)?,
            latencies.quantile_ms(0.95)?,
            latencies.frames,
        ))
    }

    /// Measures the latency again.
    pub(crate) fn forget_latency(&self) {
        self.state().latencies = Latencies::default();
    }

    pub(crate) fn is_open(&self) -> bool {
        self.state().window.is_some()
    }

    pub(crate) fn set_open(&self, window: Option<Context>) {
        let mut state = self.state();
        state.is_full_screen &= window.is_some();
        (state.window, state.shown) = (window, None);
    }

    pub(crate) fn is_full_screen(&self) -> bool {
        self.state().is_full_screen
    }

    pub(crate) fn set_full_screen(&self, is_full_screen: bool) {
        self.state().is_full_screen = is_full_screen;
    }
}

/// Draws the subject's window again.
fn repaint(window: Option<&Context>) {
    if let Some(window) = window {
        window.request_repaint_of(super::subject_window_id());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::subject::tests::targets;
    use crate::tape::tests::at;

    #[test]
    fn cursor_follows_newest_sample_and_next_frame_ends_latency() {
        let screen = SubjectScreen::default();
        let mapping = RigMapping {
            gain: 3.0,
            center_m: 0.01,
            range_m: [-0.1, 0.1],
        };
        screen.set_scale(Some(TaskScale { mapping, reach_m: 0.3 }));
        let begin = Instant::now();
        let ms = Duration::from_millis;
        let mut sample = at(1.0);
        (sample.device_position_m, sample.device_round_trip_ns) = (0.03, 2_000_000);
        screen.take_sample(&sample, begin);
        assert_eq!(screen.begin_frame(begin).cursor_m, None, "nobody is at work");
        screen.set_view(Some(targets()));
        let cursor_m = screen.begin_frame(begin + ms(1)).cursor_m.expect("a cursor");
        assert!((cursor_m - 0.06).abs() < 1e-12);
        assert_eq!(screen.latency_ms(), None, "it was not seen yet");
        screen.begin_frame(begin + ms(8));
        let (median_ms, _, frames) = screen.latency_ms().expect("a frame");
        assert!(
            (median_ms - 10.1).abs() < 1e-6,
            "8 ms and 2 ms of the link: {median_ms}"
        );
        assert_eq!(frames, 1);
        let (_, frames) = screen.take_actions(sample.tick);
        let [(Frame { latency_s, lasted_s }, _)] = frames[..] else {
            panic!("{frames:?}")
        };
        assert!((latency_s - 0.01).abs() < 1e-9 && (lasted_s - 0.007).abs() < 1e-9);
        // The window was hidden for a while.
        screen.begin_frame(begin + ms(5000));
        assert_eq!(screen.latency_ms().expect("a frame").2, 1);
    }

    #[test]
    fn click_takes_the_tick_of_the_newest_sample() {
        let screen = SubjectScreen::default();
        screen.act(SubjectAction::Click);
        assert_eq!(screen.take_actions(u64::MAX).0, []);
        let mut sample = at(1.0);
        for tick in [4711, 4900] {
            sample.tick = tick;
            screen.take_sample(&sample, Instant::now());
            screen.act(SubjectAction::Click);
        }
        // A study that waited for the disk between them is still at the first.
        assert_eq!(screen.take_actions(4899).0, [(SubjectAction::Click, 4711)]);
        assert_eq!(screen.take_actions(4899).0, []);
        assert_eq!(screen.take_actions(4900).0, [(SubjectAction::Click, 4900)]);
        screen.act(SubjectAction::Click);
        screen.lose_samples();
        assert_eq!(screen.take_actions(u64::MAX).0, [], "the next daemon counts from 0");
    }
}
