use super::*;
use crate::identify::study::{Movement, Sensors};
use crate::motion::DeviceSample;
use crate::simulate::{Start, simulate};
use crate::surface;
use haptic_core::friction::{Friction, Karnopp};
use haptic_core::scene::Block;
use haptic_core::{Directional, Scene, Scheme};
use std::f64::consts::TAU;

const BY_TIME: Options = Options {
    align: Some(AlignedBy::Time),
    mass_kg: None,
};

/// Position (m) and velocity (m/s) at a time, s.
type Course = fn(f64) -> (f64, f64);

/// A rest, strokes that become faster, and a slow ramp to and fro.
fn usual(t: f64) -> (f64, f64) {
    match t {
        ..1.0 => (0.0, 0.0),
        1.0..6.0 => {
            let (t, growth) = (t - 1.0, 0.22);
            let (phase, rate) = (TAU * (0.5 + growth * t) * t, TAU * (0.5 + 2.0 * growth * t));
            (0.02 * (1.0 - phase.cos()), 0.02 * rate * phase.sin())
        }
        _ => {
            let travel = (0.001 * (t - 6.0)).rem_euclid(0.004);
            if travel < 0.002 {
                (travel, 0.001)
            } else {
                (0.004 - travel, -0.001)
            }
        }
    }
}

/// A record of `law` under 1 kg that follows the course from `start_s` to `end_s` on a clock that is
/// `ahead_s` ahead.
fn record(law: Karnopp, course: Course, (start_s, end_s): (f64, f64), rate_hz: f64, ahead_s: f64) -> Record {
    let scene = Scene {
        block: Some(Block { mass: 1.0 }),
        friction: Friction::Karnopp(law),
        ..Scene::paper()
    };
    #[expect(clippy::cast_sign_loss, reason = "an end comes after its start")]
    let count = ((end_s - start_s) * rate_hz) as usize;
    let motion: Vec<DeviceSample> = (0..count)
        .map(|k| start_s + k as f64 / rate_hz)
        .map(|t| DeviceSample {
            t_s: t + ahead_s,
            position_m: course(t).0,
            velocity_mps: course(t).1,
        })
        .collect();
    let run = simulate(&scene, Scheme::Exact, &motion, Start::default()).expect("a valid scene");
    Record {
        t_s: motion.iter().map(|sample| sample.t_s).collect(),
        position_m: run
            .rows
            .iter()
            .map(|row| (row.block_position_m / 1e-5).round() * 1e-5)
            .collect(),
        force_n: run.rows.iter().map(|row| row.coupling_force_n).collect(),
        ..Record::default()
    }
}

/// What is found of two records that have something in common.
fn compared(real: &Record, rendered: &Record) -> Comparison {
    compare(real, rendered, &Options::default()).expect("a motion in common")
}

fn refused(real: &Record, rendered: &Record, options: &Options) -> String {
    compare(real, rendered, options).expect_err("refused").to_string()
}

fn levels(pair: Levels) -> [Level; 2] {
    [pair.positive, pair.negative].map(|level| level.expect("a level"))
}

#[test]
fn records_on_different_clocks_and_origins_are_aligned() {
    let real = record(Karnopp::new(2.2, 2.0), usual, (0.0, 14.0), 1000.0, 0.0);
    let rendered = Karnopp {
        static_force: Directional::new(3.3, 2.2),
        dynamic_force: Directional::new(3.0, 2.0),
        ..Karnopp::new(3.3, 3.0)
    };
    let mut rendered = record(rendered, usual, (0.2, 13.5), 800.0, 371.2345);
    for position in &mut rendered.position_m {
        *position += 0.25;
    }
    let found = compared(&real, &rendered);
    assert_eq!(found.aligned_by, AlignedBy::Time);
    let shift = found.shift_s.expect("a shift");
    assert!((shift - 371.2345).abs() < 2e-4, "{shift}");
    let offset = found.position_offset_m.expect("an offset");
    assert!((offset - 0.25).abs() < 5e-5, "{offset}");
    assert!((found.overlap_s - 13.3).abs() < 0.01, "{}", found.overlap_s);
    let [positive, negative] = levels(found.sliding_force_n);
    for (level, real, rendered) in [(positive, 2.0, 3.0), (negative, 2.0, 2.0)] {
        assert!((level.real_n - real).abs() < 0.02 * real, "{level:?}");
        assert!((level.rendered_n - rendered).abs() < 0.02 * rendered, "{level:?}");
        assert!(level.count > 3, "{level:?}");
    }
    assert!((positive.difference_percent - 50.0).abs() < 2.0, "{positive:?}");
    let [positive, negative] = levels(found.breakaway_force_n);
    for (level, real, rendered) in [(positive, 2.2, 3.3), (negative, 2.2, 2.2)] {
        // The mean over 10 ms cuts the peak of a rise of 25 N/s.
        assert!((level.real_n - real).abs() < 0.1, "{level:?}");
        assert!((level.rendered_n - rendered).abs() < 0.1, "{level:?}");
    }
    assert!(found.force_peak_difference_n > 0.9, "{}", found.force_peak_difference_n);
    let rms_n = found.force_rms_difference_n;
    assert!((0.3..1.0).contains(&rms_n), "{rms_n}");
    assert_eq!(found.notes, Vec::<String>::new());
    let mut torn = rendered;
    for values in [&mut torn.t_s, &mut torn.position_m, &mut torn.force_n] {
        values.drain(5000..5003);
    }
    let found = compared(&real, &torn);
    assert_eq!(
        found.notes,
        ["gaps in the rendered record: 1, bridged for the alignment alone"]
    );
}

/// Without the rows of some seconds, and with the hand elsewhere after them.
fn with_gap(record: &Record, seconds: std::ops::Range<f64>, away_m: f64) -> Record {
    let mut cut = Record::default();
    for (index, t) in record.t_s.iter().enumerate().filter(|(_, t)| !seconds.contains(*t)) {
        let later_m = if *t < seconds.start { 0.0 } else { away_m };
        cut.t_s.push(*t);
        cut.position_m.push(record.position_m[index] + later_m);
        cut.force_n.push(record.force_n[index]);
    }
    cut
}

#[test]
fn gaps_count_as_no_slides() {
    let sine: Course = |t| {
        let phase = TAU * 0.5 * t;
        (0.03 * (1.0 - phase.cos()), 0.03 * TAU * 0.5 * phase.sin())
    };
    let viscous = |dynamic, viscous| Karnopp {
        viscous: Directional::both(viscous),
        ..Karnopp::new(dynamic, dynamic)
    };
    let real = record(viscous(2.0, 5.0), sine, (0.0, 16.0), 1000.0, 0.0);
    let rendered = record(viscous(3.0, 5.0), sine, (0.0, 16.0), 1000.0, 0.0);
    // From one turn to the next but one.
    let [own, other] = [&real, &rendered].map(|record| with_gap(record, 7.0..9.0, 0.2));
    for align in [AlignedBy::Time, AlignedBy::Velocity] {
        let options = Options {
            align: Some(align),
            ..Options::default()
        };
        let whole = compare(&real, &rendered, &options).expect("a motion in common");
        let torn = compare(&own, &other, &options).expect("a motion in common");
        let pairs = levels(torn.sliding_force_n)
            .into_iter()
            .zip(levels(whole.sliding_force_n));
        for (torn, whole) in pairs {
            for ratio in [torn.real_n / whole.real_n, torn.rendered_n / whole.rendered_n] {
                assert!((ratio - 1.0).abs() < 0.01, "{torn:?} for {whole:?}");
            }
        }
        for (torn, whole) in [
            (torn.force_rms_n, whole.force_rms_n),
            (torn.force_rms_difference_n, whole.force_rms_difference_n),
        ] {
            assert!((torn / whole - 1.0).abs() < 0.03, "{torn} N for {whole} N");
        }
    }
}

#[test]
fn clock_drift_is_reported_and_removed() {
    let drifting = |record: &Record, ppm: f64| Record {
        t_s: record.t_s.iter().map(|t| 3.0 + (1.0 + 1e-6 * ppm) * t).collect(),
        ..record.clone()
    };
    let real = record(Karnopp::new(2.2, 2.0), usual, (0.0, 14.0), 1000.0, 0.0);
    let stickier = record(Karnopp::new(3.3, 3.0), usual, (0.0, 14.0), 437.0, 0.0);
    let alike = record(Karnopp::new(2.2, 2.0), usual, (0.0, 14.0), 100.0, 0.0);
    for (other, ppm) in [(&stickier, 0.0), (&stickier, 200.0), (&alike, -350.0), (&alike, 0.0)] {
        let found = compared(&real, &drifting(other, ppm));
        let drift = found.clock_drift_ppm.unwrap_or_default();
        assert!((drift - ppm).abs() < 25.0, "{ppm}: {drift}");
        // In the middle of 14 s.
        let shift = found.shift_s.expect("a shift");
        assert!((shift - 3.0 - 7.0 * ppm * 1e-6).abs() < 5e-4, "{ppm}: {shift}");
        let [low, high] = found.intervals["shift_s"];
        assert!(low < shift && shift < high && high - low < 2e-3, "{low} {high}");
        assert_eq!(
            found.intervals.contains_key("clock_drift_ppm"),
            found.clock_drift_ppm.is_some()
        );
        let word = if ppm > 0.0 { "ppm faster" } else { "ppm slower" };
        assert!(ppm == 0.0 || found.notes[0].contains(word), "{:?}", found.notes);
    }
}

#[test]
fn a_steady_motion_tells_no_shift() {
    let steady: Course = |t| (0.02 * t, 0.02);
    let law = Karnopp::new(2.0, 2.0);
    let real = record(law, steady, (0.0, 5.0), 1000.0, 0.0);
    let rendered = record(Karnopp::new(3.0, 3.0), steady, (1.0, 5.0), 1000.0, 2.0);
    // Once it slides.
    let [real, rendered] = [real, rendered].map(|mut record| {
        for column in [&mut record.t_s, &mut record.position_m, &mut record.force_n] {
            column.drain(..500);
        }
        record
    });
    let found = compared(&real, &rendered);
    assert_eq!((found.aligned_by, found.shift_s), (AlignedBy::Velocity, None));
    assert!(found.notes[0].contains("any shift"), "{:?}", found.notes);
    let why = refused(&real, &rendered, &BY_TIME);
    assert!(why.contains("do not determine the shift"), "{why}");
}

#[test]
fn the_same_record_differs_by_nothing_in_json_and_page() {
    let real = record(Karnopp::new(2.2, 2.0), usual, (0.0, 10.0), 1000.0, 0.0);
    let found = compared(&real, &real);
    assert!(found.shift_s.expect("a shift").abs() < 1e-5, "{:?}", found.shift_s);
    assert!(found.force_rms_difference_n < 0.01, "{}", found.force_rms_difference_n);
    let value = serde_json::to_value(&found).expect("it writes");
    for name in [
        "aligned_by",
        "shift_s",
        "force_rms_difference_N",
        "force_peak_difference_N",
        "overlap_s",
    ] {
        assert!(!value[name].is_null(), "{name}: {value}");
    }
    assert!(value["sliding_force_N"]["positive"]["rendered_N"].is_f64(), "{value}");
    assert!(value.get("curves").is_none());
    let page = page(&found, ["a.csv", "b.csv"]);
    let titles: Vec<&str> = page.charts.iter().map(|chart| chart.title.as_str()).collect();
    assert_eq!(
        titles,
        [
            "Force against velocity",
            "Force against position",
            "Force over time",
            "Difference"
        ]
    );
    assert_eq!(page.tables[0].rows.len(), 5);
    assert!(!page.html().contains("NaN"));
}

#[test]
fn inertia_is_taken_out_where_the_mass_is_known() {
    let law = Karnopp::new(2.0, 2.0);
    let real = record(law, usual, (0.0, 6.0), 1000.0, 0.0);
    let fast = |found: &Comparison| found.curves.real.iter().map(|row| row[2].abs()).fold(0.0, f64::max);
    let with = compared(&real, &real);
    let options = Options {
        mass_kg: Some(1.0),
        ..Options::default()
    };
    let without = compare(&real, &real, &options).expect("one motion");
    assert!(fast(&with) > 6.0, "{}", fast(&with));
    assert!(fast(&without) < 5.0, "{}", fast(&without));
    assert_eq!(without.mass_kg, Some(1.0));
}

#[test]
fn other_motions_are_compared_at_the_same_velocity() {
    let sine: Course = |t| (0.03 * (TAU * 0.9 * t).cos(), -0.03 * TAU * 0.9 * (TAU * 0.9 * t).sin());
    let real = record(Karnopp::new(2.0, 2.0), usual, (0.0, 6.0), 1000.0, 0.0);
    let rendered = record(Karnopp::new(3.0, 3.0), sine, (0.0, 9.0), 1000.0, 0.0);
    let found = compared(&real, &rendered);
    assert_eq!((found.aligned_by, found.shift_s), (AlignedBy::Velocity, None));
    assert!(found.notes[0].starts_with("the motions differ"), "{:?}", found.notes);
    for level in levels(found.sliding_force_n) {
        assert!((level.difference_n - 1.0).abs() < 0.25, "{level:?}");
    }
    let rms_n = found.force_rms_difference_n;
    assert!((rms_n - 1.0).abs() < 0.3, "{rms_n}");
    assert!(found.breakaway_force_n.positive.is_none());
    let mut notes = found.notes.iter();
    assert!(
        notes.any(|note| note.starts_with("no breakaway level")),
        "{:?}",
        found.notes
    );
    // The same course at half the size is another motion.
    let half: Course = |t| (0.5 * usual(t).0, 0.5 * usual(t).1);
    let smaller = record(Karnopp::new(2.0, 2.0), half, (0.0, 6.0), 1000.0, 0.0);
    let found_smaller = compared(&real, &smaller);
    assert_eq!(found_smaller.aligned_by, AlignedBy::Velocity);
    let why = refused(&real, &rendered, &BY_TIME);
    assert!(why.contains("--align velocity"), "{why}");
}

#[test]
fn records_without_a_velocity_in_common_are_refused() {
    let law = Karnopp::new(2.0, 2.0);
    let real = record(law, |t| (0.02 * t, 0.02), (0.0, 3.0), 1000.0, 0.0);
    let rendered = record(law, |t| (-0.02 * t, -0.02), (0.0, 3.0), 1000.0, 0.0);
    let why = refused(&real, &rendered, &Options::default());
    assert!(
        why.contains("no motion in common") && why.contains("to 25.0 mm/s"),
        "{why}"
    );
    let still = record(law, |_| (0.1, 0.0), (0.0, 3.0), 1000.0, 0.0);
    let why = refused(&real, &still, &Options::default());
    assert!(why.contains("the rendered record holds no motion"), "{why}");
}

/// Surfaces that differ by static, dynamic, directed and viscous friction, under one hand and on one exact clock.
#[test]
fn differing_surfaces_pass_for_no_shift_and_no_drift() {
    let law = |fs_n: f64, fd_n: [f64; 2], viscous: f64| Karnopp {
        dynamic_force: Directional::new(fd_n[0], fd_n[1]),
        viscous: Directional::both(viscous),
        ..Karnopp::new(fs_n, fs_n.min(fd_n[0]))
    };
    let laws = [
        law(3.0, [2.5, 2.5], 0.0),
        law(4.0, [3.0, 2.5], 0.0),
        law(7.0, [3.5, 3.5], 0.0),
        law(3.0, [2.5, 2.5], 3.0),
        law(5.0, [4.0, 2.0], 1.0),
    ];
    let record = |index: usize, seed: u64| {
        let experiment = surface::experiment(0.5, Friction::Karnopp(laws[index]), Sensors::USUAL);
        surface::record(&experiment, seed).mass
    };
    let records: Vec<[Record; 2]> = (0..laws.len())
        .map(|index| [record(index, 1), record(index, 2)])
        .collect();
    let (mut covered, mut drifts, mut pairs) = (0, 0, 0);
    for (first, [real, _]) in records.iter().enumerate() {
        for (second, [_, rendered]) in records.iter().enumerate() {
            let found = compared(real, rendered);
            let [low, high] = found.intervals["shift_s"];
            assert!(high - low < 1e-3, "{first} {second}: {low} {high}");
            (pairs, covered) = (pairs + 1, covered + usize::from(low <= 0.0 && 0.0 <= high));
            drifts += usize::from(found.clock_drift_ppm.is_some());
        }
    }
    // Of 25 intervals of 95 %, one or two are wide of it.
    assert!(covered + 2 >= pairs, "{covered} of {pairs}");
    assert!(drifts <= 1, "{drifts} of {pairs}");
}

#[test]
fn a_slow_pull_counts_although_it_slips_and_a_fast_one_does_not() {
    let friction = Friction::Karnopp(Karnopp {
        viscous: Directional::both(4.0),
        ..Karnopp::new(3.0, 1.7)
    });
    let pulled = |speed_mps: f64, stroke_m: f64, seed: u64| {
        let ramps = Movement::Ramp {
            speed_mps,
            stroke_m,
            duration_s: 6.0,
        };
        let lab = surface::experiment(0.8, friction, Sensors::USUAL);
        surface::record(&lab.with_movements(&[Movement::Rest { duration_s: 0.5 }, ramps]), seed).mass
    };
    // On the grip of 5 N/mm the mass slips by half a millimetre, at up to 20 mm/s.
    let slow = pulled(0.001, 0.0015, 1);
    let found = compared(&slow, &pulled(0.001, 0.0015, 2));
    for level in levels(found.breakaway_force_n) {
        for force_n in [level.real_n, level.rendered_n] {
            assert!((force_n - 3.0).abs() < 0.06, "{level:?}");
        }
    }
    let found = compared(&pulled(0.1, 0.03, 1), &pulled(0.1, 0.03, 2));
    assert_eq!(found.breakaway_force_n, Levels::default());
    for side in ["real", "rendered"] {
        let lacking = format!("the {side} record has no rest");
        let notes = found.notes.iter().filter(|note| note.contains("no breakaway level"));
        assert_eq!(
            notes.filter(|note| note.contains(&lacking)).count(),
            2,
            "{:?}",
            found.notes
        );
    }
}

#[test]
fn sliding_levels_do_not_depend_on_the_order_of_the_files() {
    // Masses that differ slide at speeds that differ under the same hand.
    let record = |mass_kg: f64, fd_n: f64, viscous: f64| {
        let law = Karnopp {
            viscous: Directional::both(viscous),
            ..Karnopp::new(1.4 * fd_n, fd_n)
        };
        surface::record(&surface::experiment(mass_kg, Friction::Karnopp(law), Sensors::USUAL), 1).mass
    };
    let (one, other) = (record(0.73, 2.9, 3.4), record(1.4, 1.2, 6.0));
    let there = compare(&one, &other, &BY_TIME).expect("one motion").sliding_force_n;
    let back = compare(&other, &one, &BY_TIME).expect("one motion").sliding_force_n;
    for (there, back) in levels(there).into_iter().zip(levels(back)) {
        assert!(
            (there.difference_n + back.difference_n).abs() < 0.01,
            "{there:?} {back:?}"
        );
        // 1.7 N of dynamic friction, less 0.27 N of viscous at the mean speed of 0.104 m/s.
        assert!((there.difference_n + 1.43).abs() < 0.1, "{there:?}");
    }
}
