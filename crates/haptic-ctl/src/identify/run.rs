//! `identify --run`: moves the rig by its own motor, and identifies what the motor moved.

use super::excite;
use super::session::IdentifySession;
use crate::console::Console;
use crate::daemon::Daemon;
use crate::failure::Failure;
use haptic_core::Directional;
use haptic_core::rig_friction::RigFriction;
use haptic_lab::identify::rig_itself::without_cogging;
use haptic_lab::identify::{self, Clocks, Identification, Identified, Options, Refusal};
use std::ops::ControlFlow;

/// What is known of a force that is the motor's command: it has no zero to be off.
const KNOWN_OFFSET_N: f64 = 0.0;

/// Moves the rig and identifies what is on it; `whole` keeps the rig's own part in the result.
pub(super) async fn run(
    daemon: &mut Daemon,
    arguments: &excite::MotionArguments,
    options: &Options,
    whole: bool,
) -> Result<Identification, Failure> {
    let console = Console::new("identify --run", arguments.yes)?;
    let mut session = IdentifySession::begin(daemon, console, arguments.range_m(), arguments.resets).await?;
    let excited = arguments.excite(&mut session, false).await?;
    let stored = session.begun.friction.filter(|_| !whole);
    let mut record = session
        .ticks
        .record(excited.first_tick, excited.last_tick, session.begun.resolution_m);
    let options = Options {
        clocks: Clocks::Commanded(session.longest_delay_s().await?),
        offset_n: options.offset_n.or(Some(KNOWN_OFFSET_N)),
        ..options.clone()
    };
    let identified = session
        .compute(move || {
            if let Some(cogging) = stored.and_then(|rig| rig.cogging) {
                without_cogging(&mut record, &cogging);
            }
            identify::identify_with_progress(&record, &options, &mut |_| ControlFlow::Continue(()))
        })
        .await?;
    session.end().await?;
    let mut identified = identified.map_err(|error| Failure::BadRig(error.to_string()))?;
    match stored {
        Some(rig) => subtract(&mut identified.found, &rig),
        None => identified.found.notes.push(
            "the rig itself and whatever is fixed to it: `haptic-ctl identify --rig` measures the rig alone, and is \
             then subtracted"
                .to_owned(),
        ),
    }
    Ok(identified)
}

/// Takes the rig's own mass and friction out of what was identified. The static limits lose the rig's
/// dynamic friction, which is what is stored of it.
fn subtract(found: &mut Identified, rig: &RigFriction) {
    let both = |found: Directional, own: Directional| {
        Directional::new(found.positive - own.positive, found.negative - own.negative)
    };
    if let Some(mass_kg) = &mut found.mass_kg {
        *mass_kg -= rig.mass;
    }
    let (dynamic, viscous) = (rig.dynamic_force, rig.viscous);
    for (value, own) in [
        (&mut found.dynamic_force_n, dynamic),
        (&mut found.static_force_n, dynamic),
        (&mut found.viscous_ns_per_m, viscous),
    ] {
        *value = value.map(|value| both(value, own));
    }
    let uncertainty = rig.uncertainty.unwrap_or_default();
    for (name, interval) in &mut found.intervals {
        let pair = |own: Directional| {
            if name.ends_with("negative") {
                own.negative
            } else {
                own.positive
            }
        };
        let (own, half) = match name.split('.').next().unwrap_or(name) {
            "mass_kg" => (rig.mass, uncertainty.mass),
            "dynamic_force_N" | "static_force_N" => (pair(dynamic), pair(uncertainty.dynamic_force)),
            "viscous_Ns_per_m" => (pair(viscous), pair(uncertainty.viscous)),
            _ => continue,
        };
        // Two independent experiments.
        let [low, high] = *interval;
        let (middle, own_half) = ((low + high) / 2.0 - own, ((high - low) / 2.0).hypot(half));
        *interval = [middle - own_half, middle + own_half];
    }
    if rig.uncertainty.is_none() {
        found.notes.push(
            "the rig was identified by an earlier version, without its uncertainty: the intervals are too narrow; run \
             `haptic-ctl identify --rig` again"
                .to_owned(),
        );
    }
    refuse_what_is_nothing(found);
    found.notes.push(
        "the rig's own mass, friction and cogging (`haptic-ctl identify --rig`) are subtracted; --whole leaves them in"
            .to_owned(),
    );
}

/// What is no more than the rig's own is not a property of the sample.
fn refuse_what_is_nothing(found: &mut Identified) {
    let least = |value: Option<Directional>| value.map(|value| value.positive.min(value.negative));
    for (name, value, unit) in [
        ("mass_kg", found.mass_kg, "kg"),
        ("dynamic_force_N", least(found.dynamic_force_n), "N"),
        ("static_force_N", least(found.static_force_n), "N"),
    ] {
        let Some(value) = value.filter(|value| *value <= 0.0) else {
            continue;
        };
        found.refused.push(Refusal {
            parameter: name.to_owned(),
            reason: format!("no more than the rig's own is left: {value:.4} {unit}"),
            instead: "a sample that is heavier or has more friction, or --whole for the rig and all that is on it"
                .to_owned(),
        });
        found.intervals.retain(|of, _| !of.starts_with(name));
        match name {
            "mass_kg" => found.mass_kg = None,
            "dynamic_force_N" => found.dynamic_force_n = None,
            _ => found.static_force_n = None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use haptic_core::rig_friction::RigUncertainty;
    use haptic_lab::identify::ModelKind;

    const RIG: RigFriction = RigFriction {
        mass: 1.4,
        dynamic_force: Directional::new(0.8, 0.7),
        viscous: Directional::new(0.5, 0.25),
        cogging: None,
        uncertainty: Some(RigUncertainty {
            mass: 0.0,
            dynamic_force: Directional::new(0.0, 0.2),
            viscous: Directional::both(0.0),
        }),
    };

    fn found() -> Identified {
        Identified {
            mass_kg: Some(1.9),
            dynamic_force_n: Some(Directional::both(3.0)),
            viscous_ns_per_m: Some(Directional::both(1.0)),
            static_force_n: Some(Directional::both(4.0)),
            intervals: [
                ("mass_kg".to_owned(), [1.8, 2.0]),
                ("dynamic_force_N.negative".to_owned(), [2.9, 3.1]),
            ]
            .into(),
            ..Identified::empty(ModelKind::Karnopp)
        }
    }

    #[test]
    fn the_rigs_own_part_is_taken_out_of_values_and_intervals() {
        let mut sample = found();
        subtract(&mut sample, &RIG);
        assert!((sample.mass_kg.expect("kept") - 0.5).abs() < 1e-12);
        let dynamic = sample.dynamic_force_n.expect("kept");
        assert!((dynamic.positive - 2.2).abs() < 1e-12 && (dynamic.negative - 2.3).abs() < 1e-12);
        let [low, high] = sample.intervals["dynamic_force_N.negative"];
        let half = f64::hypot(0.1, 0.2);
        assert!((low - 2.3 + half).abs() < 1e-12 && (high - 2.3 - half).abs() < 1e-12);
        assert!(sample.refused.is_empty(), "{:?}", sample.refused);
        assert!(sample.notes[0].contains("--whole"));

        let mut sample = found();
        let earlier = RigFriction {
            uncertainty: None,
            ..RIG
        };
        subtract(&mut sample, &earlier);
        assert!(sample.notes[0].contains("too narrow"), "{:?}", sample.notes);
    }

    #[test]
    fn a_sample_that_is_nothing_beside_the_rig_is_refused_by_name() {
        let mut nothing = found();
        nothing.mass_kg = Some(1.3);
        subtract(&mut nothing, &RIG);
        assert_eq!((nothing.mass_kg, nothing.intervals.get("mass_kg")), (None, None));
        assert_eq!(nothing.refused[0].parameter, "mass_kg");
    }
}
