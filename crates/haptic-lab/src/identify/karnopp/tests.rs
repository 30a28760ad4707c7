//! Identification of records whose truth is known.

mod clocks;

use crate::identify::study::kinds::{self, Conditions, Kind};
use crate::identify::study::{Experiment, Movement, Sensors, Truth, value_in};
use crate::identify::{Clocks, Directions, Identified, ModelKind, Options, Record, identify};
use haptic_core::Directional;
use haptic_core::friction::{Friction, Karnopp};

fn alike() -> Karnopp {
    Karnopp {
        viscous: Directional::both(10.0),
        ..Karnopp::new(5.0, 3.5)
    }
}

fn truth(friction: Karnopp, offset_n: f64) -> Truth {
    Truth {
        mass_kg: 0.5,
        friction: Friction::Karnopp(friction),
        offset_n,
    }
}

fn experiment(friction: Karnopp) -> Experiment {
    Experiment::thorough(truth(friction, 0.0))
}

/// What sensors see of the experiment. The mass is moved at 10 kHz, so that its grip is smooth between samples.
fn watched(friction: Karnopp, seed: u64, rate_hz: f64) -> Record {
    let mut fine = experiment(friction);
    fine.sensors.rate_hz = 10_000.0;
    let mut motion = fine.motion().expect("it can be rendered");
    #[expect(clippy::cast_sign_loss, reason = "rates are positive")]
    let every = (fine.sensors.rate_hz / rate_hz) as usize;
    for column in [&mut motion.t_s, &mut motion.position_m, &mut motion.force_n] {
        *column = column.iter().copied().step_by(every).collect();
    }
    let sensors = Sensors {
        rate_hz,
        ..Sensors::USUAL
    };
    sensors.watch(&motion, seed)
}

fn record(friction: Karnopp, seed: u64) -> Record {
    watched(friction, seed, 1000.0)
}

fn found(record: &Record) -> Identified {
    found_with(record, |_| {})
}

fn found_with(record: &Record, change: impl FnOnce(&mut Options)) -> Identified {
    let mut options = Options::new(ModelKind::Karnopp);
    change(&mut options);
    identify(record, &options).expect("a record")
}

fn refused(found: &Identified) -> Vec<&str> {
    found.refused.iter().map(|each| each.parameter.as_str()).collect()
}

/// Every parameter that is reported with an interval, with its value, its truth and how far it may be from that.
fn pairs<'a>(found: &'a Identified, truth: &Truth) -> Vec<(&'a str, f64, f64, f64)> {
    let pair = |name: &'a String| {
        let within = match name.split('.').next()? {
            "mass_kg" | "viscous_Ns_per_m" => 0.01,
            "dynamic_force_N" => 0.005,
            _ => 0.05,
        };
        Some((name.as_str(), found.value(name)?, value_in(truth, name)?, within))
    };
    found.intervals.keys().filter_map(pair).collect()
}

/// Whether every interval of friction that is alike and an offset, N, holds, and within how many of its halves.
fn held(found: &Identified, offset_n: f64, halves: f64) {
    for parameter in [
        "mass_kg",
        "dynamic_force_N.positive",
        "viscous_Ns_per_m.negative",
        "static_force_N.positive",
    ] {
        let is_reported = found.value(parameter).is_some();
        assert_eq!(is_reported, found.intervals.contains_key(parameter), "{parameter}");
    }
    for (name, value, truth, _) in pairs(found, &truth(alike(), offset_n)) {
        let [low, high] = found.intervals[name];
        let half = (high - low) / 2.0;
        assert!(
            (value - truth).abs() <= halves * half,
            "{name} = {value} +- {half} for {truth}: {:#?}",
            found.notes
        );
    }
}

#[test]
fn the_truth_is_found_and_its_intervals_hold() {
    let seeds: u64 = test_run::extent(5, 100);
    let mut held = std::collections::BTreeMap::<String, u64>::new();
    for seed in 1..=seeds {
        let found = found(&record(alike(), seed));
        assert!(found.refused.is_empty(), "{:?}", found.refused);
        let pairs = pairs(&found, &truth(alike(), 0.0));
        assert_eq!(pairs.len(), 8, "{pairs:?}");
        for (name, value, truth, within) in pairs {
            assert!(
                (value - truth).abs() <= within * truth.abs().max(1.0),
                "{seed}: {name} = {value}"
            );
            let [low, high] = found.intervals[name];
            *held.entry(name.to_owned()).or_default() += u64::from((low..=high).contains(&truth));
        }
    }
    println!("intervals that hold the truth, of {seeds}: {held:?}");
    for (name, count) in held {
        // Of five runs one may miss; of 100, ten.
        assert!(count + 1 + seeds / 11 >= seeds, "{name}: {count} of {seeds}");
    }
}

#[test]
fn directional_friction_is_found_and_offset_refused() {
    let pair = Directional::new;
    let friction = Karnopp {
        static_force: pair(5.0, 4.0),
        dynamic_force: pair(3.5, 3.0),
        viscous: pair(10.0, 12.0),
        ..alike()
    };
    let record = record(friction, 1);
    let unknown = found(&record);
    assert_eq!(refused(&unknown), ["offset_N"], "{unknown:#?}");
    // With a known offset nothing is refused, even where the viscous friction is alike.
    let known = found_with(&record, |options| options.offset_n = Some(0.0));
    assert!(known.refused.is_empty(), "{known:#?}");
    for found in [unknown, known] {
        let pairs = pairs(&found, &truth(friction, 0.0));
        assert_eq!(pairs.len(), 7);
        for (name, value, truth, within) in pairs {
            assert!(
                (value - truth).abs() <= 1.5 * within * truth.abs().max(1.0),
                "{name} = {value}: {found:#?}"
            );
        }
    }
}

#[test]
fn a_constant_force_is_the_offset_of_friction_that_is_alike() {
    let mut shifted = record(alike(), 3);
    shifted.force_n.iter_mut().for_each(|force| *force -= 1.2);
    let found = found(&shifted);
    assert!(found.refused.is_empty(), "{found:#?}");
    assert!(found.intervals.contains_key("offset_N"), "{found:#?}");
    held(&found, -1.2, 1.6);
}

#[test]
fn other_rates_units_and_directions_give_the_same() {
    for &rate_hz in test_run::extent(&[100.0, 250.0][..], &[100.0, 250.0, 5000.0]) {
        let found = found(&watched(alike(), 5, rate_hz));
        assert!(
            found.mass_kg.is_some() && found.dynamic_force_n.is_some(),
            "{rate_hz}: {found:#?}"
        );
        held(&found, 0.0, 2.0);
    }
    let mut turned = record(alike(), 6);
    for value in turned.position_m.iter_mut().chain(&mut turned.force_n) {
        *value = 5.0 - *value;
    }
    let found = found(&turned);
    held(&found, 5.0, 2.0);
}

#[test]
fn a_glitch_a_drift_and_a_clipped_force_do_not_deceive() {
    let mut glitches = record(alike(), 7);
    for force in glitches.force_n.iter_mut().step_by(997) {
        *force += 60.0;
    }
    held(&found(&glitches), 0.0, 2.0);
    let mut drifts = record(alike(), 8);
    for (force, t) in drifts.force_n.iter_mut().zip(&drifts.t_s) {
        *force += 0.3 * (t / 15.0 - 1.0);
    }
    held(&found(&drifts), 0.0, 2.0);
    let mut clipped = record(alike(), 9);
    for force in &mut clipped.force_n {
        *force = force.clamp(-6.0, 6.0);
    }
    let found = found(&clipped);
    assert!(says(&found, "saturated"), "{:?}", found.notes);
    held(&found, 0.0, 2.0);
}

#[test]
fn what_the_motion_does_not_determine_is_refused_by_name() {
    let of = |movements: &[Movement]| {
        let experiment = experiment(alike()).with_movements(movements);
        found(&experiment.record(1).expect("it can be rendered"))
    };
    let chirp = Movement::Chirp {
        from_hz: 0.5,
        to_hz: 3.0,
        stroke_m: 0.03,
        duration_s: 12.0,
    };
    let ramp = |speed_mps, stroke_m| Movement::Ramp {
        speed_mps,
        stroke_m,
        duration_s: 20.0,
    };
    let fast_only = of(&[chirp]);
    assert_eq!(refused(&fast_only), ["static_force_N"], "{fast_only:#?}");
    assert!(fast_only.refused[0].instead.contains("1 mm/s"));
    held(&fast_only, 0.0, 2.0);

    // There and back again: of how breakaways scatter that says nothing.
    // Nothing sticks again on the way.
    let there_and_back = experiment(Karnopp::new(3.5, 3.5)).with_movements(&[
        Movement::Rest { duration_s: 0.25 },
        chirp,
        Movement::Ramp {
            speed_mps: 0.001,
            stroke_m: 0.0015,
            duration_s: 3.0,
        },
    ]);
    let one_each_way = found(&there_and_back.record(1).expect("it can be rendered"));
    assert_eq!(refused(&one_each_way), ["static_force_N"], "{one_each_way:#?}");
    let refusal = &one_each_way.refused[0];
    assert!(refusal.reason.contains("nothing of the next"), "{refusal:?}");

    // At one speed, and in one direction.
    for (movement, other) in [(ramp(0.05, 0.05), "viscous_Ns_per_m"), (ramp(0.02, 0.5), "offset_N")] {
        let found = of(&[movement]);
        let names = refused(&found);
        assert!(
            names.contains(&other) && names.contains(&"dynamic_force_N"),
            "{found:#?}"
        );
    }

    let still = of(&[Movement::Rest { duration_s: 5.0 }]);
    assert_eq!(refused(&still).len(), 5, "{still:#?}");
    assert!(still.refused[0].reason.contains("stroke"), "{still:#?}");

    let slow = of(&[ramp(0.001, 0.0015)]);
    held(&slow, 0.0, 2.0);
    assert!(refused(&slow).contains(&"viscous_Ns_per_m"), "{slow:#?}");
}

#[test]
fn force_against_the_motion_is_refused_with_its_cause() {
    let mut record = record(alike(), 3);
    record.force_n.iter_mut().for_each(|force| *force = -*force);
    let found = found(&record);
    let names = ["mass_kg", "dynamic_force_N", "viscous_Ns_per_m", "static_force_N"];
    assert_eq!(refused(&found), names, "{found:#?}");
    assert!(names.iter().all(|name| found.value(name).is_none()), "{found:#?}");
    for refusal in &found.refused {
        assert!(refusal.reason.contains("against the motion"), "{refusal:?}");
        assert!(refusal.instead.contains("--force-gain"), "{refusal:?}");
    }
}

#[test]
fn directions_beside_an_offset_that_is_not_known_are_refused() {
    let mut offset = record(alike(), 2);
    offset.force_n.iter_mut().for_each(|force| *force += 0.4);
    let of = |offset_n| {
        found_with(&offset, |options| {
            (options.directions, options.offset_n) = (Directions::Separate, offset_n);
        })
    };
    let unknown = of(None);
    assert_eq!(refused(&unknown), ["offset_N", "dynamic_force_N", "static_force_N"]);
    let reason = &unknown.refused[1].reason;
    assert!(reason.contains("a constant force of 0.39"), "{reason}");
    let known = of(Some(0.4));
    assert_eq!(known.offset_n, Some(0.4));
    held(&known, 0.4, 2.0);
}

#[test]
fn a_viscous_surface_has_no_dry_friction() {
    let drag = |dry: f64, viscous| Karnopp {
        viscous: Directional::both(viscous),
        ..Karnopp::new(dry, dry)
    };
    let mut record_of_drag = record(drag(0.0, 35.0), 1);
    let none = found(&record_of_drag);
    assert_eq!(none.dynamic_force_n, Some(Directional::both(0.0)), "{none:#?}");
    assert!(none.refused.is_empty(), "{none:#?}");
    assert!(says(&none, "no dry friction"), "{none:#?}");
    let [low, high] = none.intervals["dynamic_force_N.positive"];
    assert!(low == 0.0 && high > 0.0, "{low} {high}");
    assert!(none.scene("drag").is_ok(), "{none:#?}");
    // A sensor that points the other way is distinguished from it.
    record_of_drag.force_n.iter_mut().for_each(|force| *force = -*force);
    let reversed = found(&record_of_drag);
    assert_eq!(reversed.missing(), ["mass_kg", "dynamic_force_N", "viscous_Ns_per_m"]);
    let reasons: Vec<&str> = reversed.refused.iter().map(|one| one.reason.as_str()).collect();
    assert!(
        reasons.iter().all(|why| why.contains("points against the motion")),
        "{reversed:#?}"
    );
    // A little that the record shows is reported.
    let little = found(&record(drag(0.15, 35.0), 4));
    let [low, high] = little.intervals["dynamic_force_N.positive"];
    assert!(low > 0.0 && low < 0.15 && high > 0.15, "{little:#?}");
}

#[test]
fn a_known_mass_is_taken_and_not_identified() {
    let found = found_with(&record(alike(), 2), |options| options.mass_kg = Some(0.5));
    assert_eq!((found.mass_kg, found.intervals.get("mass_kg")), (Some(0.5), None));
    assert!(found.refused.is_empty(), "{found:#?}");
}

#[test]
fn a_real_drive_gives_the_figures_of_an_independent_fit() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/emps-pulses.csv");
    let Ok(text) = std::fs::read_to_string(path) else {
        test_run::skip("emps-pulses.csv", "the real machine's record, in ../shared/data");
        return;
    };
    let mut record = Record::default();
    for line in text.lines().skip(1) {
        let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().expect("a number")).collect();
        record.t_s.push(cells[0]);
        record.position_m.push(cells[1]);
        record.force_n.push(cells[2]);
    }
    let found = found(&record);
    println!("{} N left: {:?}", found.residual_rms_n, found.intervals);
    // The independent fit knows no force of the place, which the record shows.
    for (name, value) in [
        ("mass_kg", 93.6),
        ("viscous_Ns_per_m.positive", 211.0),
        ("viscous_Ns_per_m.negative", 211.0),
        ("dynamic_force_N.positive", 20.9),
        ("dynamic_force_N.negative", 20.9),
        ("offset_N", -3.2),
    ] {
        let [low, high] = found.intervals[name];
        assert!(low <= value && value <= high, "{name}: {low} to {high} for {value}");
        assert!(high - low <= 0.2 * value.abs(), "{name}: {low} to {high}");
    }
    assert!(found.residual_rms_n <= 1.05 * 2.1, "{}", found.residual_rms_n);
}

/// A hand of one sine, or of a chirp, and what a force of the place adds to the force that drives the mass, N.
fn with_place(from_hz: f64, to_hz: f64, seed: u64, place_n: impl Fn(f64) -> f64) -> Record {
    let experiment = Experiment {
        movements: vec![Movement::Chirp {
            from_hz,
            to_hz,
            stroke_m: 0.04,
            duration_s: 20.0,
        }],
        ..experiment(alike())
    };
    let mut record = experiment.record(seed).expect("it can be rendered");
    for (force, x) in record.force_n.iter_mut().zip(&record.position_m) {
        *force += place_n(*x);
    }
    record
}

fn says(found: &Identified, part: &str) -> bool {
    found.notes.iter().any(|note| note.contains(part))
}

#[test]
fn position_dependent_force_is_noted_and_left_out() {
    let spring = |x: f64| 20.0 * x;
    let cogging = |x: f64| 0.5 * (std::f64::consts::TAU * x / 0.01).sin();
    for seed in 1..=3 {
        for place_n in [&spring as &dyn Fn(f64) -> f64, &cogging] {
            let mut found = found(&with_place(0.5, 3.0, seed, place_n));
            // Its mean over the travel is one with the offset.
            found.intervals.remove("offset_N");
            assert!(says(&found, "depends on the place"), "{:?}", found.notes);
            held(&found, 0.0, 1.5);
        }
        let found = found(&with_place(0.5, 3.0, seed, |_| 0.0));
        assert!(!says(&found, "depends on the place"), "{:?}", found.notes);
    }
}

#[test]
fn single_frequency_motion_notes_that_no_spring_is_assumed() {
    assert!(says(
        &found(&with_place(1.5, 1.5, 1, |_| 0.0)),
        "has one frequency, 1.50 Hz"
    ));
    assert!(!says(&found(&with_place(0.5, 3.0, 1, |_| 0.0)), "one frequency"));
}

#[test]
fn slides_of_few_steps_of_the_encoder_are_reported() {
    for (resolution_m, is_reported) in [(1e-4, true), (1e-5, false)] {
        let conditions = Conditions {
            resolution_m,
            ..Conditions::FAIR
        };
        let found = found(&kinds::record(Kind::Relay, &conditions, 3).0);
        assert!(found.mass_kg.is_some() && says(&found, "cogging"), "{found:#?}");
        assert_eq!(says(&found, "steps of the encoder"), is_reported, "{:?}", found.notes);
    }
}
