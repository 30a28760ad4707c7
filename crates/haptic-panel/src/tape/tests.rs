//! Tests of the tape, and the sample that other tests start from.

use super::*;
use haptic_ipc::{RigState, SamplesEvent};
use mark::MarkKind;
use proptest::prelude::*;

/// A batch of a rig of one axis.
pub(crate) fn batch(rows: Vec<Sample>) -> SamplesEvent {
    SamplesEvent {
        rows,
        ..SamplesEvent::default()
    }
}

pub(crate) fn at(t_s: f64) -> Sample {
    Sample {
        t_s,
        state: RigState::Engaged,
        revision: 1,
        ..Sample::default()
    }
}

/// A tape of one sample a tick, which lasts a millisecond, from a time on, s. The force in the coupling is one of the
/// time since then, s.
pub(crate) fn forced(begin_s: f64, ticks: impl IntoIterator<Item = u32>, force: impl Fn(f64) -> f64) -> Tape {
    Tape::recorded(ticks.into_iter().map(|tick| {
        let t_s = f64::from(tick) * 1e-3;
        Sample {
            tick: tick.into(),
            coupling_force_n: force(t_s),
            ..at(begin_s + t_s)
        }
    }))
}

impl Tape {
    /// Chunks that are the same memory in both tapes, and the number of chunks.
    pub(crate) fn shared_chunks(&self, other: &Self) -> (usize, usize) {
        let is_shared = |chunk: &&Arc<Chunk>| other.chunks.iter().any(|kept| Arc::ptr_eq(chunk, kept));
        (self.chunks.iter().filter(is_shared).count(), self.chunks.len())
    }
}

fn times(tape: &Tape) -> Vec<f64> {
    tape.range(tape.start..tape.end()).map(|sample| sample.t_s).collect()
}

#[test]
fn only_the_last_minute_of_a_live_rig_is_kept() {
    let mut tape = Tape::default();
    tape.extend([0.0, 10.0, 65.0].map(at));
    assert_eq!(times(&tape), [10.0, 65.0]);
    tape.extend((0..250_000).map(|i| at(66.0 + f64::from(i) * 1e-6)));
    assert_eq!(times(&tape).len(), MAX_LIVE_SAMPLES);
    assert_eq!(times(&Tape::recorded([0.0, 10.0, 500.0].map(at))).len(), 3);
}

#[test]
fn rows_that_are_no_numbers_and_those_of_another_run_go() {
    let mut tape = Tape::default();
    let mut bad = at(1.0);
    bad.command_force_n = f64::NAN;
    tape.extend([at(0.5), bad, at(f64::INFINITY)]);
    assert_eq!(times(&tape), [0.5]);
    tape.extend([at(0.001)]);
    assert_eq!(times(&tape), [0.001], "the clock begins anew");
}

#[test]
fn a_while_is_found_with_or_without_its_neighbours() {
    let tape = Tape::recorded((0..10).map(|i| at(f64::from(i))));
    let seen = |samples: Vec<&Sample>| samples.iter().map(|sample| sample.t_s).collect::<Vec<_>>();
    assert_eq!(seen(tape.within(2.0, 4.0).collect()), [2.0, 3.0, 4.0]);
    assert_eq!(tape.places_around(2.0, 4.0), 1..6);
    assert_eq!(tape.places_around(-5.0, 40.0), 0..10);
    assert_eq!(seen(tape.within(4.2, 4.4).collect()), [0.0; 0]);
    assert_eq!(seen(tape.within(4.0, 2.0).collect()), [0.0; 0], "the wrong way round");
    assert_eq!(tape.at(4.9).map(|sample| sample.t_s), Some(4.0));
    assert!(tape.at(-0.1).is_none());
}

/// Noise with a spike, one sample a millisecond.
fn noisy(count: u32, spike: u32) -> Tape {
    Tape::recorded((0..count).map(|tick| {
        let mut row = at(f64::from(tick) * 1e-3);
        row.contact = i8::from(tick == spike);
        let noise = f64::from(tick.wrapping_mul(2_654_435_761) >> 16) * 1e-5;
        row.coupling_force_n = if tick == spike { 42.0 } else { noise };
        row
    }))
}

// hazard: H5
#[test]
fn a_frame_of_an_hour_looks_at_no_more_than_its_pixels_ask_for() {
    // In the short run a tenth of an hour: the levels and the chunks are the same.
    let count = u32::try_from(test_run::extent(360_000, 3_600_000)).expect("an hour of samples");
    let tape = noisy(count, 123_456);
    let length_s = f64::from(count) * 1e-3;
    let whole = (0.0, length_s);
    for columns in [400, 1600] {
        let column_s = length_s / f64::from(columns);
        let places = tape.places_around(whole.0, whole.1);
        let level = level(samples_a_column(&places, whole, column_s));
        let looked_at = tape.pieces(places, level, column_s).count();
        assert!(looked_at < 17 * 1600, "{columns} columns: {looked_at} pieces");
        let line = tape.outlines(&[Signal::COUPLING_FORCE], whole, column_s).remove(0);
        assert!(line.len() <= 2 * 1601, "{}", line.len());
        assert!(line.contains(&[123.456, 42.0]), "the spike is lost");
        let contacts = tape.contacts(whole, column_s);
        assert!(contacts.len() <= 1602, "{}", contacts.len());
        assert_eq!(contacts.iter().filter(|(_, slides)| *slides == Some(true)).count(), 1);
    }
    // Nowhere between the coarsest and the finest is there a zoom that costs more than some samples a pixel.
    for share in [1.0, 10.0, 60.0, 100.0, 300.0, 1000.0, 2000.0] {
        let span_s = share * length_s / 3600.0;
        let seen = (length_s / 2.0, length_s / 2.0 + span_s);
        let places = tape.places_around(seen.0, seen.1);
        let column_s = span_s / 1600.0;
        let level = level(samples_a_column(&places, seen, column_s));
        let looked_at = tape.pieces(places, level, column_s).count();
        assert!(looked_at < 66 * 1600, "{span_s} s: {looked_at} pieces");
    }
    let raw = tape.len() * size_of::<Sample>();
    let taken: usize = tape.chunks.iter().map(|chunk| chunk.bytes()).sum();
    println!(
        "{length_s} s: {} MB of samples, {} MB with their extremes",
        raw / 1_000_000,
        taken / 1_000_000
    );
    assert!(taken * 10 <= raw * 13, "{taken} bytes for {raw} of samples");
}

#[test]
fn a_part_of_a_tape_is_shared_and_stays_as_it_was() {
    let mut tape = Tape::default();
    tape.extend((0..70_000).map(|i| at(f64::from(i) * 1e-3)));
    let part = tape.part(30.0, 40.0);
    let whole = tape.clone();
    let (oldest_s, newest_s) = ends_of(&part);
    assert!((28.0..=30.0).contains(&oldest_s), "{oldest_s}");
    assert!((40.0..42.0).contains(&newest_s), "{newest_s}");
    tape.extend([at(70.0)]);
    let (shared, all) = whole.shared_chunks(&tape);
    assert_eq!((shared, all), (59, 60), "only the last chunk is copied");
    tape.extend((70_001..80_000).map(|i| at(f64::from(i) * 1e-3)));
    assert_eq!((whole.oldest_s(), whole.newest_s()), (Some(9.999), Some(69.999)));
    assert_eq!(tape.oldest_s(), Some(19.999));
    assert_eq!(tape.part(100.0, 200.0).len(), tape.part(79.999, 79.999).len());
    assert_eq!(Tape::default().part(0.0, 1.0).len(), 0);
}

#[test]
fn mark_lies_at_the_first_sample_from_its_tick_on() {
    let row = |tick: u32| Sample {
        tick: tick.into(),
        ..at(f64::from(tick))
    };
    let mark = |tick, text: &str| TapeMark {
        tick,
        kind: MarkKind::Scene,
        by: None,
        text: text.to_owned(),
    };
    let mut tape = Tape::default();
    tape.mark(mark(30, "late"));
    tape.mark(mark(10, "early"));
    tape.extend([5, 10, 12].map(row));
    let says = |tape: &Tape, from_s, to_s, expected: &[(f64, &str)], why: &str| {
        let marks = tape.marks(from_s, to_s).map(|(t_s, mark)| (t_s, &*mark.text));
        assert_eq!(marks.collect::<Vec<_>>(), expected, "{why}");
    };
    let both = [(10.0, "early"), (12.0, "late")];
    says(&tape, 0.0, 99.0, &both, "its sample is on its way");
    let frozen = tape.clone();
    tape.extend([40].map(row));
    says(&tape, 11.0, 99.0, &[(40.0, "late")], "the tick was not sampled");
    tape.extend([72].map(row));
    says(&tape, 0.0, 99.0, &[(40.0, "late")], "a minute is kept");
    says(&frozen, 0.0, 11.0, &[(10.0, "early")], "a frozen tape keeps its own");
}

fn ends_of(tape: &Tape) -> (f64, f64) {
    (tape.oldest_s().unwrap_or(0.0), tape.newest_s().unwrap_or(0.0))
}

/// Each tick comes, but the loop stands still for 3 s before one of them.
fn stalled() -> Tape {
    Tape::recorded((0..20_000u32).map(|tick| Sample {
        tick: tick.into(),
        ..at(f64::from(tick) * 1e-3 + if tick < 10_000 { 0.0 } else { 3.0 })
    }))
}

#[test]
fn lines_are_broken_where_samples_are_missing_or_late() {
    let missing = forced(0.0, (0..10_000).chain(10_001..20_000).chain(25_000..40_000), |_| 0.0);
    // By samples, by small buckets and by large ones; what is shorter than a column breaks nothing.
    let columns_of_missing: &[_] = &[(80_000.0, 2), (1000.0, 1), (200.0, 1), (20.0, 1), (4.0, 0)];
    let columns_of_stalled: &[_] = &[(50_000.0, 1), (1000.0, 1), (4.0, 0)];
    for (tape, gap, columns) in [
        (missing, [19.999, 25.0], columns_of_missing),
        (stalled(), [9.999, 13.0], columns_of_stalled),
    ] {
        let ends = ends_of(&tape);
        for (columns, breaks) in columns {
            let column_s = ends.1 / columns;
            let line = tape.outlines(&[Signal::COUPLING_FORCE], ends, column_s).remove(0);
            let parts: Vec<_> = line.split(|[t_s, _]| t_s.is_nan()).collect();
            assert_eq!(parts.len(), breaks + 1, "{columns} columns");
            let contacts = tape.contacts(ends, column_s);
            let is_known = contacts.iter().all(|(_, slides)| slides.is_some());
            assert_eq!(is_known, *breaks == 0, "{columns} columns");
            if let [.., before, after] = parts[..] {
                let ends = [before.last(), after.first()].map(|point| point.map(|[t_s, _]| *t_s));
                assert_eq!(ends, gap.map(Some), "{columns} columns");
                assert!(contacts.contains(&(gap[0], None)), "{columns} columns");
            }
        }
    }
}

#[test]
fn trail_is_broken_where_samples_are_missing_or_late() {
    let missing = forced(0.0, (0..100).chain(101..200).chain(250..300), |_| 0.0);
    // Of every tenth tick none is missing.
    let thinned = forced(0.0, (0..300).step_by(10), |_| 0.0);
    for (tape, strides, breaks) in [
        (missing, [1, 10, 100], [2, 1, 0]),
        (thinned, [1, 3, 10], [0; 3]),
        (stalled(), [1, 10, 100], [1; 3]),
    ] {
        let trail = |stride| {
            tape.pairs_every(stride, false, ends_of(&tape))
                .filter(Option::is_none)
                .count()
        };
        assert_eq!(strides.map(trail), breaks);
    }
}

proptest! {
    /// However coarse the buckets are, what is drawn of a live tape are its samples, in their
    /// order, with its extremes among them; all of them, where the columns are finer.
    #[test]
    fn what_is_drawn_of_buckets_is_of_the_samples(
        values in prop::collection::vec(-9.0..9.0f64, 1..4000),
        columns in 1.0..100.0f64,
        ends in (0.0..1.0f64, 0.0..1.0f64),
        start in 0.0..1e6f64,
    ) {
        let mut tape = Tape::default();
        for batch in values.chunks(34) {
            let begin = tape.end();
            tape.extend(batch.iter().zip(begin..).map(|(value, tick)| {
                let mut row = at(start + tick as f64 * 0.02);
                row.coupling_force_n = *value;
                row
            }));
        }
        let last_s = values.len() as f64 * 0.02;
        let ends = (ends.0.min(ends.1) * last_s, ends.0.max(ends.1) * last_s + 0.02);
        let (from_s, to_s) = (start + ends.0, start + ends.1);
        let column_s = (to_s - from_s) / columns;
        let line = tape.outlines(&[Signal::COUPLING_FORCE], (from_s, to_s), column_s).remove(0);
        prop_assert!(line.is_sorted_by(|a, b| a[0] < b[0]));
        let rows = tape.range(tape.places_around(from_s, to_s));
        let seen: Vec<_> = rows.map(|row| [row.t_s, row.coupling_force_n]).collect();
        prop_assert!(line.iter().all(|point| seen.contains(point)));
        prop_assert!(line.len() == seen.len() || column_s > 0.019);
        for pick in [f64::min, f64::max] {
            let of = |points: &[[f64; 2]]| points.iter().map(|[_, value]| *value).reduce(pick);
            prop_assert_eq!(of(&line), of(&seen));
        }
    }
}
