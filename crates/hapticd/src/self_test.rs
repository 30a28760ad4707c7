//! `--self-test`: what the machine can do, and what hapticd adds to it. The loop and a bare one
//! that only waits take turns on the same processor at the same priority, so that the machine's
//! moods are shared; what they saw stands side by side.

use crate::processor_share::default_phase_ns;
use crate::rt::clock::{Grid, Waiting, Wake, now_ns};
use crate::rt::handoff::ControlSide;
use crate::rt::privileges;
use crate::rt::tick::Tick;
use crate::telemetry::feed::PUMP_PERIOD;
use crate::telemetry::timing::{COARSE_DIGITS, histogram, percentiles};
use device_io::{Device, DeviceBounds, DeviceError, Measurement, Written};
use haptic_core::servo::CompiledScene;
use hdrhistogram::Histogram;
use std::fmt::Write;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::sync::atomic::Ordering::{Acquire, Release};
use std::thread::JoinHandle;
use std::time::Duration;

/// Turns of each loop.
const TURNS: usize = 5;

/// What a loop saw in one turn.
#[derive(Clone, Debug)]
struct Turn {
    /// How long after its deadline each tick began, ns.
    wake_latency: Histogram<u64>,
    /// How long each tick took, ns.
    tick: Histogram<u64>,
    missed_periods: u64,
}

impl Turn {
    fn new() -> Self {
        Self {
            wake_latency: histogram(COARSE_DIGITS),
            tick: histogram(COARSE_DIGITS),
            missed_periods: 0,
        }
    }

    fn run(&mut self, ticks: u64, period_ns: u64, waiting: Waiting, mut work: impl FnMut(Wake, u64) -> u64) {
        let mut grid = Grid::new(period_ns, default_phase_ns(period_ns), now_ns());
        for _ in 0..ticks {
            let wake = grid.wait(waiting);
            let ended_ns = work(wake, grid.missed());
            grid.advance(ended_ns);
            self.wake_latency
                .saturating_record(wake.began_ns.saturating_sub(wake.deadline_ns));
            self.tick.saturating_record(ended_ns.saturating_sub(wake.began_ns));
        }
        self.missed_periods = grid.missed();
    }
}

/// What both loops saw.
#[derive(Clone, Debug)]
pub(crate) struct Comparison {
    turn: Duration,
    ticks_a_turn: u64,
    bare: Vec<Turn>,
    hapticd: Vec<Turn>,
    /// Ticks back to back, on a link that costs nothing, ns.
    alone: Histogram<u64>,
    /// Two readings of the clock, one after the other.
    nothing: Histogram<u64>,
    /// Records that found no room: what such a tick takes is not what it takes in use.
    dropped: u64,
}

impl ControlSide {
    /// Has a thread at an ordinary priority take what the loop leaves, as the daemon's control
    /// thread does; off the loop's processor, of those that there are.
    ///
    /// # Errors
    /// The system has no thread left.
    pub(crate) fn serve(self, loops_cpu: Option<usize>, available_cpus: Vec<usize>) -> std::io::Result<Serving> {
        let over = Arc::new(AtomicBool::new(false));
        let is_over = Arc::clone(&over);
        let thread = std::thread::Builder::new().name("control".to_owned()).spawn(move || {
            if let Some(cpu) = loops_cpu {
                privileges::leave_cpu_alone(cpu, &available_cpus);
            }
            self.run(&is_over)
        })?;
        Ok(Serving { over, thread })
    }

    fn run(mut self, over: &AtomicBool) -> Self {
        loop {
            // Before the ring, so that what was left before it is taken.
            let last = over.load(Acquire);
            while self.records.pop().is_some() {}
            if last {
                return self;
            }
            std::thread::sleep(PUMP_PERIOD);
        }
    }
}

/// The control side at work on a thread of its own.
#[derive(Debug)]
pub(crate) struct Serving {
    over: Arc<AtomicBool>,
    thread: JoinHandle<ControlSide>,
}

impl Serving {
    /// Ends it; by then everything that was left is taken.
    fn end(self) -> ControlSide {
        self.over.store(true, Release);
        self.thread.join().expect("it does not panic")
    }
}

/// Runs both loops in turns of a duration, on the calling thread, which is prepared already.
pub(crate) fn compare(
    tick: &mut Tick<dyn Device>,
    serving: Serving,
    turn: Duration,
    period_ns: u64,
    waiting: Waiting,
) -> Comparison {
    let ticks_a_turn = u64::try_from(turn.as_nanos()).unwrap_or(u64::MAX) / period_ns;
    // All of it beforehand, so that nothing is allocated while the loops run.
    let mut comparison = Comparison {
        turn,
        ticks_a_turn,
        bare: vec![Turn::new(); TURNS],
        hapticd: vec![Turn::new(); TURNS],
        alone: histogram(COARSE_DIGITS),
        nothing: histogram(COARSE_DIGITS),
        dropped: 0,
    };
    // Between its turns it stands still on purpose, and a stall within one is what is measured.
    tick.disregard_stalls();
    for (bare, hapticd) in comparison.bare.iter_mut().zip(&mut comparison.hapticd) {
        bare.run(ticks_a_turn, period_ns, waiting, |_, _| now_ns());
        hapticd.run(ticks_a_turn, period_ns, waiting, |wake, missed| tick.run(wake, missed));
    }
    tick.replace_device(Box::new(NoLink::new(period_ns)));
    comparison.dropped = back_to_back(&mut comparison.alone, tick, &mut serving.end(), period_ns);
    clock_reading(&mut comparison.nothing);
    comparison
}

/// A hand that moves to and fro, at the other end of no link at all.
#[derive(Debug)]
pub(crate) struct NoLink {
    next: u32,
    period_ns: u64,
}

impl NoLink {
    /// One with samples at a period.
    pub(crate) fn new(period_ns: u64) -> Self {
        Self { next: 0, period_ns }
    }
}

/// Samples from one crossing of the middle to the next.
const HALF_TURN: u32 = 1000;
/// The hand's speed where it crosses the middle, m/s. It turns round along parabolas, so that at no
/// rate its acceleration is that of an encoder which jumps.
const TOP_SPEED_MPS: f64 = 0.06;

impl Device for NoLink {
    fn description(&self) -> String {
        "no link".to_owned()
    }

    fn bounds(&self) -> DeviceBounds {
        DeviceBounds::default()
    }

    fn read(&mut self, _now_ns: u64) -> Result<Measurement, DeviceError> {
        #[expect(clippy::cast_precision_loss, reason = "a period is far below 2^53 ns")]
        let half_turn_s = f64::from(HALF_TURN) * self.period_ns as f64 * 1e-9;
        // It begins where it turns round, at rest.
        let phase = self.next.wrapping_add(HALF_TURN / 2);
        let share = f64::from(phase % HALF_TURN) / f64::from(HALF_TURN);
        let aside_m = TOP_SPEED_MPS * half_turn_s * share * (1.0 - share);
        let side = (phase / HALF_TURN) % 2;
        let position_m = if side == 0 { aside_m } else { -aside_m };
        let sample = Measurement::new(self.next, u64::from(self.next) * self.period_ns, position_m);
        self.next = self.next.wrapping_add(1);
        Ok(sample)
    }

    fn write(&mut self, _force_n: f64, _enabled: bool) -> Result<Written, DeviceError> {
        Ok(Written::Taken)
    }
}

/// Ticks that are timed back to back.
const TICKS_BACK_TO_BACK: u64 = 1_000_000;
/// Ticks between two changes of the scene.
const TICKS_A_SCENE: u64 = 20;

/// Times whole ticks without a link, with a new scene every so often; what a control thread does in
/// between is not timed. Returns how many records have been dropped before.
#[inline(never)]
fn back_to_back(
    seen: &mut Histogram<u64>,
    tick: &mut Tick<dyn Device>,
    control: &mut ControlSide,
    period_ns: u64,
) -> u64 {
    let mut dropped = 0;
    let renderer = tick.scene().renderer.clone();
    let mut clock_ns = now_ns();
    for count in 0..TICKS_BACK_TO_BACK {
        if count.is_multiple_of(TICKS_A_SCENE) {
            let scene = CompiledScene::<f64>::at_once(renderer.clone(), count);
            control.inbox.post(scene);
        }
        clock_ns += period_ns;
        let wake = Wake {
            deadline_ns: clock_ns,
            began_ns: clock_ns,
            asleep_ns: 0,
        };
        let began_ns = now_ns();
        tick.run(wake, 0);
        let took_ns = now_ns().saturating_sub(began_ns);
        let record = control.records.pop().expect("every tick is recorded");
        assert!(record.state.is_live(), "every tick renders: {record:?}");
        seen.saturating_record(took_ns);
        dropped = record.dropped;
    }
    dropped
}

/// What timing nothing at all takes.
fn clock_reading(seen: &mut Histogram<u64>) {
    for _ in 0..TICKS_BACK_TO_BACK {
        let began_ns = now_ns();
        seen.saturating_record(now_ns().saturating_sub(began_ns));
    }
}

/// The middle one of a number of each turn: a turn in which the host took the processor away does not decide.
fn median(turns: &[Turn], number: impl Fn(&Turn) -> u64) -> u64 {
    let mut numbers: Vec<u64> = turns.iter().map(number).collect();
    numbers.sort_unstable();
    numbers[numbers.len() / 2]
}

#[expect(clippy::cast_precision_loss, reason = "nanoseconds of a turn are below 2^53")]
fn us(ns: u64) -> String {
    format!("{:.2}", ns as f64 * 1e-3)
}

impl Comparison {
    /// The two side by side, as people read them.
    pub(crate) fn report(&self, period_ns: u64, waiting: Waiting) -> String {
        let mut text = format!(
            "{TURNS} turns of {} s each, every {} us, spinning for the last {} us of each wait; medians of the \
             turns\n\n\
             {:24}{:>12}{:>12}\n",
            self.turn.as_secs_f64(),
            us(period_ns).trim_end_matches('0').trim_end_matches('.'),
            waiting.spin_ns / 1000,
            "wake-up latency, us",
            "bare loop",
            "hapticd"
        );
        let mut row = |name: &str, number: &dyn Fn(&Turn) -> u64, shown: fn(u64) -> String| {
            let [bare, ours] = [&self.bare, &self.hapticd].map(|turns| shown(median(turns, number)));
            // A string takes whatever is written to it.
            writeln!(text, "{name:24}{bare:>12}{ours:>12}").unwrap_or(());
        };
        row("  p50", &|turn| percentiles(&turn.wake_latency).p50, us);
        row("  p99", &|turn| percentiles(&turn.wake_latency).p99, us);
        row("  p99.9", &|turn| percentiles(&turn.wake_latency).p999, us);
        row("  max", &|turn| percentiles(&turn.wake_latency).max, us);
        row("periods missed", &|turn| turn.missed_periods, |count| count.to_string());
        row("of", &|turn| self.ticks_a_turn + turn.missed_periods, |count| {
            count.to_string()
        });
        let of_ticks = |number: fn(haptic_ipc::Percentiles) -> u64| {
            us(median(&self.hapticd, |turn| number(percentiles(&turn.tick))))
        };
        writeln!(
            text,
            "\nwhole tick, fake rig included: p50 {} us, p99 {} us, p99.9 {} us, max {} us",
            of_ticks(|tick| tick.p50),
            of_ticks(|tick| tick.p99),
            of_ticks(|tick| tick.p999),
            of_ticks(|tick| tick.max)
        )
        .unwrap_or(());
        let alone = percentiles(&self.alone);
        writeln!(
            text,
            "whole tick without a link, {TICKS_BACK_TO_BACK} of them back to back, a new scene every {TICKS_A_SCENE}: \
             p50 {} us, p99 {} us, p99.9 {} us; reading the clock to time them, p50 {} us, is in that",
            us(alone.p50),
            us(alone.p99),
            us(alone.p999),
            us(percentiles(&self.nothing).p50)
        )
        .unwrap_or(());
        if self.dropped > 0 {
            writeln!(
                text,
                "{} records found no room: the control side was held up, and the ticks above are not all whole",
                self.dropped
            )
            .unwrap_or(());
        }
        text
    }
}

#[cfg(all(test, not(miri)))]
mod tests {
    use super::*;
    use crate::rt::handoff::hand_over;
    use crate::rt::lateness::{LatePolicy, Lateness};
    use device_io::fake::{FakeRig, Hand, HandMotion, RigProperties};
    use haptic_core::servo::Command;
    use haptic_core::{Renderer, Scene, Scheme};

    #[test]
    fn the_turns_leave_no_more_records_than_there_is_room_for() {
        let motion = HandMotion::Sine {
            amplitude_m: 0.01,
            frequency_hz: 0.5,
        };
        let rig = FakeRig::new(RigProperties::default(), Hand::Prescribed(motion));
        let renderer = Renderer::new(&Scene::paper(), Scheme::Exact, 1e-3).expect("a valid scene");
        // Room for a second, where the turns take longer.
        let (mut control, loop_side) = hand_over(1000);
        let mut tick: Tick<dyn Device> = Tick::new(
            Box::new(rig),
            loop_side,
            crate::rt::tick::tests::servo(0.02, CompiledScene::at_once(renderer, 1)),
            Lateness::new(LatePolicy::Warn),
            u64::MAX,
        );
        assert!(control.inbox.command(1, Command::Engage, 0));
        let serving = control.serve(None, Vec::new()).expect("a thread");
        let turn = Duration::from_millis(300);
        let comparison = compare(&mut tick, serving, turn, 1_000_000, Waiting { spin_ns: 0 });
        println!("{}", comparison.report(1_000_000, Waiting { spin_ns: 0 }));
        assert_eq!(comparison.dropped, 0, "the daemon's ring is emptied all the time");
    }
}
