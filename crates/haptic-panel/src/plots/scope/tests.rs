//! Tests of the view of the plots.

use super::*;
use crate::record::Loaded;
use crate::record::fixture::metadata;
use crate::tape::signal::Signal;
use crate::tape::tests::{at, batch};
use haptic_recording::Ending;
use std::time::{Duration, Instant};

/// A view and the tapes that it shows.
#[derive(Default)]
struct Bench {
    scope: Scope,
    tapes: Tapes,
}

impl Bench {
    /// With 20 s of a live rig.
    fn running() -> Self {
        let mut bench = Self::default();
        bench.extend(&(0..=20_000).map(|ms| at(f64::from(ms) * 1e-3)).collect::<Vec<_>>());
        bench
    }

    fn extend(&mut self, rows: &[Sample]) {
        let ended = self.tapes.extend(&batch(rows.to_vec()));
        self.scope.take_samples(rows, ended, &self.tapes);
    }

    fn extend_to_30_s(&mut self) {
        self.extend(&(20_001..30_000).map(|ms| at(f64::from(ms) * 1e-3)).collect::<Vec<_>>());
    }

    fn open(&mut self, rows: impl IntoIterator<Item = Sample>) {
        let loaded = Loaded::new("r.csv".into(), metadata(), rows, &[], Ending::Complete);
        self.tapes.open(loaded);
        self.scope = Scope::of_recording();
        self.scope.open(self.tapes.opened_tape().expect("a recording"));
    }

    fn seen(&self) -> TimeRange {
        self.scope.seen(&self.tapes)
    }

    fn tape(&self) -> &Tape {
        self.scope.tape(&self.tapes)
    }

    fn freeze(&mut self) {
        self.scope.freeze(&self.tapes);
    }

    fn shift(&mut self, by_s: f64) {
        self.scope.shift(by_s, &self.tapes);
    }
}

#[test]
fn plots_run_until_they_are_moved() {
    let mut bench = Bench::running();
    assert_eq!((bench.seen().from_s, bench.seen().to_s), (15.0, 20.0));
    bench.shift(-1.0);
    bench.extend_to_30_s();
    let seen = bench.seen();
    assert_eq!((seen.from_s, seen.to_s, seen.zero_s), (14.0, 19.0, 20.0));
    bench.scope.follow();
    assert!(bench.seen().to_s > 29.9);
}

#[test]
fn a_frozen_tape_stays_while_the_rig_goes_on() {
    let mut bench = Bench::running();
    bench.freeze();
    bench.extend_to_30_s();
    assert_eq!(bench.tape().newest_s(), Some(20.0));
    assert!(!bench.scope.follows());
    bench.scope.follow();
    assert!(bench.tape().newest_s() > Some(29.9));
}

#[test]
fn sample_after_a_freeze_copies_only_the_last_chunk() {
    let mut bench = Bench::running();
    bench.freeze();
    let (shared, all) = bench.tape().shared_chunks(bench.tapes.live());
    assert_eq!((shared, all), (20, 20));
    bench.extend(&[at(20.001)]);
    assert_eq!(bench.tape().shared_chunks(bench.tapes.live()), (19, 20));
    assert_eq!(bench.tape().newest_s(), Some(20.0));
}

/// The quickest of some runs: what the work takes without its neighbours on the machine.
fn quickest<T>(mut work: impl FnMut() -> T) -> (Duration, T) {
    let runs = (0..20).map(|_| {
        let began = Instant::now();
        let made = work();
        (began.elapsed(), made)
    });
    runs.min_by_key(|(time, _)| *time).expect("there are runs")
}

/// `cargo test --release -p haptic-panel --lib an_hour -- --ignored --nocapture` prints the times.
#[test]
#[ignore = "measures"]
fn an_hour_is_frozen_and_outlined_within_5_ms() {
    let mut bench = Bench::default();
    bench.open((0..3_600_000).map(|ms| at(f64::from(ms) * 1e-3)));
    let (freezing, ()) = quickest(|| bench.freeze());
    let frozen = bench.scope.frozen.as_ref().expect("it is frozen");
    let (shared, all) = frozen.shared_chunks(bench.tape());
    assert_eq!(shared, all);
    let seen = bench.seen();
    let ends = (seen.from_s, seen.to_s);
    let (outlining, lines) = quickest(|| frozen.outlines(&Signal::ALL, ends, seen.column_s(1280.0)));
    println!(
        "an hour at 1 kHz: frozen in {} us ({all} chunks, all shared); {} lines of {} points in {:.2} ms",
        freezing.as_micros(),
        lines.len(),
        lines.iter().map(Vec::len).sum::<usize>(),
        outlining.as_secs_f64() * 1e3
    );
    assert!((freezing + outlining).as_millis() < 5);
}

#[test]
fn samples_stay_after_disconnect_until_new_ones_arrive() {
    let mut bench = Bench::running();
    bench.tapes.end_live();
    assert_eq!((bench.seen().from_s, bench.seen().to_s), (15.0, 20.0));
    assert!(bench.scope.has_samples(&bench.tapes));
    assert!(bench.tapes.newest().is_none(), "they are past");
    bench.extend(&[]);
    assert!(bench.scope.has_samples(&bench.tapes));
    // The same daemon continues, or another begins.
    for t_s in [100.0, 0.5] {
        bench.tapes.end_live();
        bench.extend(&[at(t_s)]);
        assert_eq!((bench.tape().oldest_s(), bench.seen().to_s), (Some(t_s), t_s));
        assert!(bench.tapes.newest().is_some());
    }
}

#[test]
fn a_held_view_outlives_the_daemon() {
    let hold: [fn(&mut Bench); 2] = [Bench::freeze, |bench| bench.shift(-1.0)];
    for hold in hold {
        let mut bench = Bench::running();
        hold(&mut bench);
        let seen = bench.seen();
        for _ in 0..2 {
            bench.tapes.end_live();
            bench.extend(&[at(0.5)]);
            assert_eq!((bench.seen(), bench.tape().newest_s()), (seen, Some(20.0)));
        }
        bench.scope.follow();
        assert_eq!(bench.tape().newest_s(), Some(0.5));
    }
}

#[test]
fn a_recording_is_shown_whole_while_the_rig_goes_on() {
    let mut bench = Bench::running();
    bench.open((0..100).map(|i| at(f64::from(i))));
    bench.extend_to_30_s();
    assert_eq!((bench.seen().from_s, bench.seen().to_s), (0.0, 99.0));
    bench.scope.zoom(2.0, 99.0);
    assert_eq!((bench.seen().from_s, bench.seen().to_s), (49.5, 99.0));
}

#[test]
fn the_surroundings_of_a_caught_crossing_can_be_seen() {
    let mut bench = Bench::default();
    bench.scope.zoom(10.0, 0.0);
    bench.scope.set_trigger_mode(Mode::Single);
    let rows = (0..2000).map(|ms| {
        let mut row = at(f64::from(ms) * 1e-3);
        row.command_force_n = if ms < 1000 { 0.0 } else { 5.0 };
        row
    });
    bench.extend(&rows.collect::<Vec<_>>());
    let range = |from_s, to_s| TimeRange {
        zero_s: 1.0,
        from_s,
        to_s,
    };
    assert_eq!(bench.seen(), range(0.75, 1.25));
    bench.shift(0.1);
    assert_eq!(bench.seen(), range(0.85, 1.35));
    bench.extend_to_30_s();
    assert_eq!(bench.seen().zero_s, 1.0);
}
