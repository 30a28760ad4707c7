//! Dahl's law and LuGre's identified from records of known friction.

use crate::identify::grid::Even;
use crate::identify::presliding::Path;
use crate::identify::study::cases::{Case, DAHL, LUGRE, cases, half_a_kilogram};
use crate::identify::study::{Experiment, Judgement, Movement, Sensors};
use crate::identify::{
    Clocks, Identification, Identified, IdentifyError, Left, ModelKind, Options, Record, identify,
    identify_with_progress,
};
use crate::stats::mean::rms;
use crate::surface;
use fastrand::Rng;
use haptic_core::friction::{Dahl, Friction, Lugre};
use std::ops::ControlFlow;
use test_run::{extent, is_long_for};

fn found(record: &Record, model: ModelKind) -> Identified {
    identify(record, &Options::new(model)).expect("the record is whole")
}

/// Of half a kilogram under movements.
fn record_of(friction: Friction, movements: &[Movement]) -> Record {
    let experiment = Experiment::thorough(half_a_kilogram(friction)).with_movements(movements);
    experiment.record(1).expect("the scene is sound")
}

/// Of Dahl's friction under strokes.
fn record_of_dahl() -> Record {
    record_of(Friction::Dahl(DAHL), &[STROKES])
}

const STROKES: Movement = Movement::Chirp {
    from_hz: 0.5,
    to_hz: 3.0,
    stroke_m: 0.03,
    duration_s: 8.0,
};

#[track_caller]
fn assert_refused(found: &Identified, parameter: &str, because: &str, instead: &str) {
    let refusal = found.refused.iter().find(|refusal| refusal.parameter == parameter);
    let refusal = refusal.unwrap_or_else(|| panic!("{parameter} is not refused: {found:#?}"));
    assert!(refusal.reason.contains(because), "{refusal:?}");
    assert!(refusal.instead.contains(instead), "{refusal:?}");
    let json = serde_json::to_value(found).expect("it writes");
    assert!(
        json[parameter].is_null(),
        "{parameter} is refused and reported: {found:#?}"
    );
    assert!(
        !found.intervals.keys().any(|name| name.starts_with(parameter)),
        "{found:#?}"
    );
}

/// A case of the study: the truth is inside nine of ten intervals, and what has a claim is reported in every run, as
/// near to the truth as is claimed.
#[track_caller]
fn assert_near(name: &str, seeds: u64, most_errors: &[(&str, f64)]) {
    let case = case(name);
    let judgement = Judgement::of(&case, 0..extent(1, seeds));
    for (name, judged) in &judgement.parameters {
        // One seed proves nothing of an interval.
        let least = extent(0, judged.reported * 9 / 10);
        assert!(judged.inside >= least, "{}: {name} {judged:?}", case.name);
    }
    for (name, most) in most_errors {
        let judged = &judgement.parameters[*name];
        assert_eq!(judged.reported, judgement.runs, "{}: {name} {judged:?}", case.name);
        let truth = judged.truth.expect("the law has the parameter");
        assert!(judged.worst <= most * truth, "{}: {name} {judged:?}", case.name);
    }
}

fn case(name: &str) -> Case {
    cases()
        .into_iter()
        .find(|case| case.name == name)
        .expect("the case is there")
}

#[test]
fn dahl_and_lugre_are_found_within_their_intervals() {
    const MASS: (&str, f64) = ("mass_kg", 0.01);
    const DYNAMIC: (&str, f64) = ("dynamic_force_N.positive", 0.005);
    const STIFFNESS: (&str, f64) = ("stiffness_N_per_m", 0.03);
    const EXPONENT: (&str, f64) = ("exponent", 0.03);
    let viscous = ("viscous_Ns_per_m.positive", 0.01);
    assert_near("dahl", 20, &[MASS, DYNAMIC, viscous, STIFFNESS, EXPONENT]);
    if !is_long_for("LuGre's law, and Dahl's with another exponent and limits that differ by direction") {
        return;
    }
    let other = ("dynamic_force_N.negative", 0.005);
    let directions = [MASS, DYNAMIC, other, STIFFNESS, EXPONENT];
    assert_near("dahl, teflon, directions differ", 10, &directions);
    assert_near("lugre", 6, &[MASS, DYNAMIC, ("static_force_N.positive", 0.05)]);
    assert_near("dahl, stiff and sharp", 6, &[MASS, DYNAMIC]);
    // Its limit is within four steps of the encoder.
    let record = case("dahl, stiff and sharp").experiment.record(1);
    let found = found(&record.expect("the scene is sound"), ModelKind::Dahl);
    for (parameter, because) in [
        ("stiffness_N_per_m", "less than 5 times the encoder's step"),
        ("exponent", "less than 9 times the encoder's step"),
    ] {
        assert_refused(&found, parameter, because, "encoder");
    }
    let mut refused = found.refused.iter();
    let has_damping = refused.any(|refusal| refusal.parameter.contains("damping"));
    assert!(!has_damping, "Dahl's law has none: {found:#?}");
}

#[test]
fn strokes_that_an_encoder_bends_report_nothing() {
    if !is_long_for("strokes that an encoder bends") {
        return;
    }
    let short = case("strokes of 0.3 mm");
    let found = found(&short.experiment.record(1).expect("the scene is sound"), short.model);
    for parameter in ["dynamic_force_N", "stiffness_N_per_m", "exponent"] {
        assert_refused(&found, parameter, "100 steps of the encoder", "10 mm");
    }
    assert!(found.intervals.is_empty(), "{found:#?}");
}

/// Fast slips on a soft grip are smoothed with the encoder's steps: a bias of which drawn records know a part.
#[test]
fn lugre_on_a_soft_grip_is_found_within_its_intervals() {
    let lugre = Lugre {
        static_force: 4.0.into(),
        stribeck_velocity: 0.01,
        contact_stiffness: 1e5,
        contact_damping: 100.0,
        viscous: 20.0.into(),
        ..LUGRE
    };
    let sensors = Sensors {
        resolution_m: 1e-7,
        ..Sensors::USUAL
    };
    let lab = surface::experiment(0.5, Friction::Lugre(lugre), sensors);
    for seed in 1..=extent(1, 6) {
        let found = found(&surface::record(&lab, seed).mass, ModelKind::Lugre);
        for (name, truth) in [("stribeck_velocity_mps", 0.01), ("bristle_damping_Ns_per_m", 100.0)] {
            let [low, high] = found.intervals[name];
            assert!(low <= truth && truth <= high, "seed {seed}: {name} {low} to {high}");
        }
    }
}

#[test]
fn what_a_motion_does_not_show_is_refused_with_what_would() {
    const ONE_WAY: [&str; 2] = ["one way", "both directions"];
    type Refused = &'static [(&'static str, [&'static str; 2])];
    let ramp = |speed_mps, stroke_m, duration_s| Movement::Ramp {
        speed_mps,
        stroke_m,
        duration_s,
    };
    let chirp = |from_hz, to_hz, stroke_m| Movement::Chirp {
        from_hz,
        to_hz,
        stroke_m,
        duration_s: 10.0,
    };
    let (dahl, lugre) = (Friction::Dahl(DAHL), Friction::Lugre(LUGRE));
    let soft = Friction::Dahl(Dahl {
        contact_stiffness: 3e3,
        ..DAHL
    });
    let cases: [(Friction, Movement, Refused); 7] = [
        (
            dahl,
            ramp(0.05, 1.0, 8.0),
            &[
                ("dynamic_force_N", ONE_WAY),
                ("viscous_Ns_per_m", ONE_WAY),
                ("offset_N", ONE_WAY),
                ("stiffness_N_per_m", ["turns 0 times", "to and fro"]),
            ],
        ),
        (
            dahl,
            Movement::Rest { duration_s: 5.0 },
            &[("mass_kg", ["hardly changes", "10 mm"])],
        ),
        (
            dahl,
            ramp(0.02, 0.06, 8.0),
            &[
                ("stiffness_N_per_m", ["turns 2 times", "ten turns"]),
                ("exponent", ["turns 2 times", "ten turns"]),
            ],
        ),
        (dahl, chirp(0.5, 1.5, 7e-4), &[("mass_kg", ["inertia", "faster"])]),
        (
            soft,
            chirp(1.0, 3.0, 1e-3),
            &[
                ("dynamic_force_N", ["longest stroke", "10 mm"]),
                ("exponent", ["longest stroke", "10 mm"]),
            ],
        ),
        (
            lugre,
            chirp(2.0, 3.0, 0.03),
            &[
                ("stribeck_velocity_mps", ["fall", "ramps"]),
                ("static_force_N", ["fall", "ramps"]),
            ],
        ),
        (
            lugre,
            ramp(0.001, 0.0015, 10.0),
            &[
                ("bristle_damping_Ns_per_m", ["quickly", "vibration"]),
                ("mass_kg", ["inertia", "faster"]),
            ],
        ),
    ];
    for (friction, movement, refused) in cases.into_iter().take(extent(2, 7)) {
        let model = match friction {
            Friction::Lugre(_) => ModelKind::Lugre,
            _ => ModelKind::Dahl,
        };
        let found = found(&record_of(friction, &[movement]), model);
        for (parameter, [because, instead]) in refused {
            assert_refused(&found, parameter, because, instead);
        }
        assert!(movement != Movement::Rest { duration_s: 5.0 } || found.intervals.is_empty());
    }
}

#[test]
fn a_coarse_encoder_refuses_what_it_hides() {
    let mut experiment = Experiment::thorough(half_a_kilogram(Friction::Dahl(DAHL))).with_movements(&[STROKES]);
    experiment.sensors = Sensors {
        resolution_m: 3e-4,
        ..Sensors::USUAL
    };
    let record = experiment.record(1).expect("the scene is sound");
    let dahl = found(&record, ModelKind::Dahl);
    // All of the law leans on what is hidden.
    for parameter in ["stiffness_N_per_m", "exponent", "mass_kg", "dynamic_force_N"] {
        assert_refused(&dahl, parameter, "encoder's step", "karnopp");
    }
    let chosen = found(&record, ModelKind::Auto);
    assert_eq!(chosen.model, ModelKind::Karnopp);
    let because = chosen.chosen_because.unwrap_or_default();
    assert!(because.contains("encoder's step"), "{because}");
}

#[test]
fn unrelated_force_yields_no_parameters() {
    let mut record = record_of_dahl();
    let mut random = Rng::with_seed(1);
    let mut force = 0.0;
    for value in &mut record.force_n {
        force += 0.05 * (random.f64() - 0.5) - 0.001 * force;
        *value = 4.0 * force;
    }
    for &model in extent(&[ModelKind::Dahl][..], &[ModelKind::Dahl, ModelKind::Lugre]) {
        let found = found(&record, model);
        assert!(found.intervals.is_empty() && found.mass_kg.is_none(), "{found:#?}");
        assert_refused(&found, "dynamic_force_N", "", "belong together");
        assert_refused(&found, "stiffness_N_per_m", "", "belong together");
    }
}

#[test]
fn clocks_that_differ_are_aligned_and_the_shift_is_reported() {
    let mut record = record_of_dahl();
    record.force_n.rotate_right(12);
    let options = Options {
        clocks: Clocks::Delayed,
        ..Options::new(ModelKind::Dahl)
    };
    let found = identify(&record, &options).expect("a record");
    assert!((found.shift_s - 0.012).abs() < 1e-3, "{found:#?}");
    let [low, high] = found.intervals["mass_kg"];
    assert!(low > 0.48 && high < 0.52, "{found:#?}");
}

#[test]
fn the_force_of_the_fit_is_the_records() {
    for (friction, model) in [
        (Friction::Dahl(DAHL), ModelKind::Dahl),
        (Friction::Lugre(LUGRE), ModelKind::Lugre),
    ] {
        let record = record_of(friction, &[STROKES]);
        let options = Options::new(model);
        let identified = identify_with_progress(&record, &options, &mut |_| ControlFlow::Continue(()));
        let (even, force) = identified.expect("the record is whole").fitted();
        assert_eq!(even.t_s.len(), record.t_s.len());
        let pairs = force.iter().zip(&even.force_n).skip(200);
        let rms = rms(pairs.map(|(fitted, force)| fitted - force));
        assert!(rms < 0.25, "{model:?}: {rms} N beside a noise of 0.1 N");
    }
}

#[test]
fn neither_force_is_drawn_across_a_gap() {
    let mut record = record_of_dahl();
    for column in [&mut record.t_s, &mut record.position_m, &mut record.force_n] {
        column.drain(4000..4500);
    }
    let found = Identified {
        mass_kg: Some(0.5),
        dynamic_force_n: Some(DAHL.dynamic_force),
        viscous_ns_per_m: Some(DAHL.viscous),
        stiffness_n_per_m: Some(DAHL.contact_stiffness),
        ..Identified::empty(ModelKind::Dahl)
    };
    for model in [ModelKind::Karnopp, ModelKind::Dahl] {
        let even = Even::new(&record);
        let identification = Identification {
            found: Identified { model, ..found.clone() },
            left: Left {
                path: Path::new(&even, 0.0),
                residual: Vec::new(),
            },
            even,
        };
        let (even, force) = identification.fitted();
        assert!(even.force_n[4250].is_nan() && force[4250].is_nan(), "{model:?}");
        assert!(
            even.force_n[3900].is_finite() && even.force_n[4600].is_finite(),
            "{model:?}"
        );
    }
}

#[test]
fn a_caller_hears_the_progress_and_cancels() {
    let record = record_of_dahl();
    let mut shares = Vec::new();
    let cancelled = identify_with_progress(&record, &Options::new(ModelKind::Dahl), &mut |share| {
        shares.push(share);
        if share < 0.4 {
            ControlFlow::Continue(())
        } else {
            ControlFlow::Break(())
        }
    });
    assert!(matches!(cancelled, Err(IdentifyError::Cancelled)), "{cancelled:?}");
    assert!(shares.windows(2).all(|pair| pair[0] <= pair[1]), "{shares:?}");
    assert!((0.4..0.5).contains(&shares[shares.len() - 1]), "{shares:?}");
}

#[test]
fn the_same_record_and_seed_give_the_same_numbers() {
    let record = record_of_dahl();
    assert_eq!(found(&record, ModelKind::Dahl), found(&record, ModelKind::Dahl));
}

#[test]
fn the_model_that_made_the_record_is_chosen() {
    if !is_long_for("the choice between Dahl and LuGre") {
        return;
    }
    let movements = [
        STROKES,
        Movement::Ramp {
            speed_mps: 0.001,
            stroke_m: 0.0015,
            duration_s: 6.0,
        },
    ];
    for (friction, model) in [
        (Friction::Dahl(DAHL), ModelKind::Dahl),
        (Friction::Lugre(LUGRE), ModelKind::Lugre),
    ] {
        let found = found(&record_of(friction, &movements), ModelKind::Auto);
        assert_eq!(found.model, model, "{found:#?}");
        let because = found.chosen_because.unwrap_or_default();
        assert!(because.contains("standard error"), "{because}");
    }
}
