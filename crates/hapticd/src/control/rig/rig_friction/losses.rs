//! What the connected rig takes up of a motion, and what of it is compensated.

use super::record::KnownFriction;
use crate::control::RigHandle;
use crate::control::connected_device::ConnectedDevice;
use crate::rt::rig_setup::RigSetup;
use haptic_core::adviser::RigFacts;
use haptic_core::compensation::Compensation;
use haptic_core::passivity::RigLosses;
use haptic_ipc::{AdviceBasis, LossSource, RigFrictionStatus};
use std::time::Duration;

/// Time between two looks for another rig.
const WATCH_PERIOD: Duration = Duration::from_millis(50);

/// Time after which a file that could not be read is tried again.
const RETRY_PERIOD: Duration = Duration::from_millis(500);

/// What is known of the connected rig's friction, as far as its file was read.
fn known(rig: &RigHandle) -> KnownFriction {
    ConnectedDevice::find(&rig.facts)
        .and_then(|device| rig.frictions().known(device.connection))
        .unwrap_or_default()
}

/// What the rig takes up, and the sources of damping and friction: an option, else what was
/// identified, else the default.
fn losses(rig: &RigHandle, known: &KnownFriction) -> (RigLosses, LossSource, LossSource) {
    let options = rig.facts.friction;
    let identified = known.identified().map(|friction| friction.losses());
    let choose = |option: Option<f64>, identified: Option<f64>, usual| match (option, identified) {
        (Some(value), _) => (value, LossSource::Option),
        (None, Some(value)) => (value, LossSource::Identified),
        (None, None) => (usual, LossSource::Default),
    };
    let usual = rig.facts.servo.get().losses;
    let (damping, damping_from) = choose(
        options.damping_ns_per_m,
        identified.map(|losses| losses.damping),
        usual.damping,
    );
    let (friction, friction_from) = choose(
        options.friction_n,
        identified.map(|losses| losses.friction),
        usual.friction,
    );
    (RigLosses { damping, friction }, damping_from, friction_from)
}

fn compensation(rig: &RigHandle, known: &KnownFriction) -> Option<Compensation> {
    let share = rig.facts.friction.compensate?;
    known.identified().map(|friction| Compensation { share, friction })
}

/// What the loop gets to know of the connected rig.
pub(in crate::control) fn setup(rig: &RigHandle) -> RigSetup {
    let known = known(rig);
    RigSetup {
        losses: losses(rig, &known).0,
        compensation: compensation(rig, &known),
    }
}

/// The adviser's facts of the rig: what is compensated is not taken up.
pub(in crate::control) fn rig_facts(rig: &RigHandle) -> RigFacts {
    let known = known(rig);
    let losses = losses(rig, &known).0;
    let left = compensation(rig, &known).map_or(losses, |compensation| compensation.left_of(losses));
    RigFacts {
        damping: left.damping,
        friction: left.friction,
        ..rig.facts.linked_facts()
    }
}

/// The same facts, for people: the link's are measured, and change from one look to the next.
pub(in crate::control) fn advice_basis(rig: &RigHandle, facts: &RigFacts) -> AdviceBasis {
    let known = known(rig);
    let (_, damping_from, friction_from) = losses(rig, &known);
    AdviceBasis {
        period_us: facts.period_s * 1e6,
        sample_period_us: (facts.sample_period_s > 0.0).then_some(facts.sample_period_s * 1e6),
        delay_us: facts.delay_s * 1e6,
        delay_measured: rig.facts.is_delay_measured(),
        damping_ns_per_m: facts.damping,
        friction_n: facts.friction,
        damping_from,
        friction_from,
        compensated_share: compensation(rig, &known).map(|compensation| compensation.share),
        resolution_m: facts.resolution,
    }
}

/// What is known of the rig's friction, and what is done with it.
pub(in crate::control) fn status(rig: &RigHandle) -> RigFrictionStatus {
    let known = known(rig);
    let (losses, damping_from, friction_from) = losses(rig, &known);
    RigFrictionStatus {
        friction_n: losses.friction,
        friction_from,
        damping_ns_per_m: losses.damping,
        damping_from,
        identified: known.identified(),
        compensated_share: compensation(rig, &known).map(|compensation| compensation.share),
        problem: known.problem().map(str::to_owned),
    }
}

/// Reads what is known of each rig that is plugged in.
pub(crate) async fn watch(rig: &RigHandle) {
    let mut pause = tokio::time::interval(WATCH_PERIOD);
    loop {
        pause.tick().await;
        let Some(device) = ConnectedDevice::find(&rig.facts) else {
            continue;
        };
        let before = rig.frictions().known(device.connection);
        match before {
            None => {}
            Some(KnownFriction::Unread(_)) => tokio::time::sleep(RETRY_PERIOD).await,
            Some(_) => continue,
        }
        let known = rig.frictions().of(&rig.facts.state_dir, &device).await;
        if let Some(why) = known.problem()
            && before.as_ref() != Some(&known)
        {
            crate::say(&format!("the rig's own friction is not used: {why}"));
        }
    }
}
