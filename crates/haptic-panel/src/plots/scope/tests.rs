//! Tests of the view of the plots.

use super::*;
use crate::tape::tests::{at, batch};

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
