//! What the connected rig takes up of a motion, and what of it is compensated.

use super::record::KnownFriction;
use crate::control::connected_device::ConnectedDevice;
use crate::control::history::FIRST_REVISION;
use crate::control::rig::commission_record::Findings;
use crate::control::trial::{LIGHT_RIG_KG, TrialRig};
use crate::control::{RigHandle, change};
use crate::every::every;
use crate::rt::inbox::RigSetup;
use haptic_core::Directional;
use haptic_core::adviser::RigFacts;
use haptic_core::compensation::Compensation;
use haptic_core::passivity::RigLosses;
use haptic_core::scene::Coupling;
use haptic_core::servo::Settings;
use haptic_ipc::{AdviceBasis, LossSource, RigFrictionStatus};
use std::time::{Duration, Instant};

/// Time between two looks for another rig.
const WATCH_PERIOD: Duration = Duration::from_millis(50);

/// Time after which the delay of a new link is known.
const SETTLING: Duration = Duration::from_millis(300);

/// Time after which a file that could not be read is tried again.
const RETRY_PERIOD: Duration = Duration::from_millis(500);

/// In parts of a period a delay counts as the next longer one.
const DELAY_GRAIN: f64 = 0.25;

/// What is known of the connected rig's friction, as far as its file was read.
fn known(rig: &RigHandle) -> KnownFriction {
    ConnectedDevice::find(&rig.facts)
        .and_then(|device| rig.frictions().known(device.connection))
        .unwrap_or_default()
}

/// What the commissioning of the connected rig found, as far as its record was read.
fn findings(rig: &RigHandle) -> Findings {
    let found = ConnectedDevice::find(&rig.facts).and_then(|device| rig.records().newest(device.connection));
    found.map_or_else(Findings::default, |(findings, _)| findings)
}

/// The coupling that the connected rig bears: as its commissioning found it, else a soft one where its link is late.
pub(in crate::control) fn coupling(rig: &RigHandle) -> Option<Coupling> {
    commissioned_coupling(rig).or_else(|| Coupling::calm_behind(rig.facts.steady_delay_s()))
}

/// The coupling that the connected rig bears, where its commissioning found one.
pub(in crate::control) fn commissioned_coupling(rig: &RigHandle) -> Option<Coupling> {
    let device = ConnectedDevice::find(&rig.facts)?;
    rig.records().newest(device.connection)?.1
}

/// What the rig takes up, and the sources of damping and friction: an option, else what was
/// identified, else what its commissioning found, else the default.
fn losses(rig: &RigHandle, known: &KnownFriction, found: Findings) -> (RigLosses, LossSource, LossSource) {
    let options = rig.facts.friction;
    let identified = known.identified().map(|friction| friction.losses());
    let choose = |option: Option<f64>, identified: Option<f64>, found: Option<f64>, usual| {
        let sources = [
            (option, LossSource::Option),
            (identified, LossSource::Identified),
            (found, LossSource::Commissioned),
        ];
        let known = sources.into_iter().find_map(|(value, source)| Some((value?, source)));
        known.unwrap_or((usual, LossSource::Default))
    };
    let usual = rig.facts.servo.get().losses;
    let (damping, damping_from) = choose(
        options.damping_ns_per_m,
        identified.map(|losses| losses.damping),
        None,
        usual.damping,
    );
    let (friction, friction_from) = choose(
        options.friction_n,
        identified.map(|losses| losses.friction),
        found.friction_n,
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
        losses: losses(rig, &known, findings(rig)).0,
        compensation: compensation(rig, &known),
    }
}

/// Mass of the moving part, kg, where it is known: of the rig in this process, else as it was identified, else as its
/// commissioning found it.
fn mass(rig: &RigHandle, known: &KnownFriction, found: Findings) -> Option<f64> {
    let identified = known.identified().map(|friction| friction.mass);
    rig.facts.rig.mass.or(identified).or(found.mass_kg)
}

/// The adviser's facts of the rig: what is compensated is not taken up.
pub(in crate::control) fn rig_facts(rig: &RigHandle) -> RigFacts {
    let (known, found) = (known(rig), findings(rig));
    let losses = losses(rig, &known, found).0;
    let left = compensation(rig, &known).map_or(losses, |compensation| compensation.left_of(losses));
    let linked = rig.facts.linked_facts();
    RigFacts {
        mass: mass(rig, &known, found),
        damping: left.damping,
        friction: left.friction,
        ..linked
    }
}

/// A rig as a trial takes it.
#[derive(Clone, Copy, Debug)]
pub(in crate::control) struct TrialBasis {
    pub(in crate::control) rig: TrialRig,
    /// The mass that it has for want of a known one, kg.
    pub(in crate::control) assumed_mass_kg: Option<f64>,
}

/// The connected rig for a trial of a scene: its own friction stays, and what is compensated of it is given back.
/// `found` is what its commissioning has just found, where it has.
pub(in crate::control) fn trial_basis(rig: &RigHandle, found: Option<Findings>) -> TrialBasis {
    let known = known(rig);
    let found = found.unwrap_or_else(|| findings(rig));
    let (losses, _, friction_from) = losses(rig, &known, found);
    let friction_n = match known.identified() {
        Some(friction) if friction_from == LossSource::Identified => friction.dynamic_force,
        _ => Directional::both(losses.friction),
    };
    let mass_kg = mass(rig, &known, found);
    let link = rig.facts.linked_facts();
    // A round trip that is measured anew each time is no other rig.
    let grain_s = DELAY_GRAIN * link.effective_period_s();
    TrialBasis {
        rig: TrialRig {
            settings: Settings {
                losses,
                compensation: compensation(rig, &known),
                ..rig.facts.servo.get()
            },
            scheme: rig.facts.scheme,
            force_limit_n: rig.facts.force_limit().0,
            sample_period_s: link.sample_period_s,
            delay_s: (rig.facts.steady_delay_s() / grain_s).ceil() * grain_s,
            resolution_m: link.resolution,
            mass_kg: mass_kg.unwrap_or(LIGHT_RIG_KG),
            friction_n,
            damping_ns_per_m: losses.damping,
        },
        assumed_mass_kg: mass_kg.is_none().then_some(LIGHT_RIG_KG),
    }
}

/// The same facts, for people: the link's are measured, and change from one look to the next.
pub(in crate::control) fn advice_basis(rig: &RigHandle, facts: &RigFacts) -> AdviceBasis {
    let known = known(rig);
    let (_, damping_from, friction_from) = losses(rig, &known, findings(rig));
    AdviceBasis {
        period_us: facts.period_s * 1e6,
        sample_period_us: (facts.sample_period_s > 0.0).then_some(facts.sample_period_s * 1e6),
        delay_us: facts.delay_s * 1e6,
        delay_measured: rig.facts.is_delay_measured(),
        mass_kg: facts.mass,
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
    let (losses, damping_from, friction_from) = losses(rig, &known, findings(rig));
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
    let mut pause = every(WATCH_PERIOD);
    let mut connected: Option<(u64, Instant)> = None;
    let mut begun = FIRST_REVISION;
    loop {
        pause.tick().await;
        let Some(device) = ConnectedDevice::find(&rig.facts) else {
            continue;
        };
        match connected {
            Some((connection, since)) if connection == device.connection => {
                if since.elapsed() >= SETTLING {
                    change::begin_on_the_rig(rig, &mut begun);
                }
            }
            _ => connected = Some((device.connection, Instant::now())),
        }
        let before = rig.frictions().known(device.connection);
        match before {
            None => {}
            Some(KnownFriction::Unread(_)) => tokio::time::sleep(RETRY_PERIOD).await,
            Some(_) => continue,
        }
        // What its commissioning found is used as well.
        drop(rig.records().known(&rig.facts.state_dir, &device, true).await);
        let known = rig.frictions().of(&rig.facts.state_dir, &device).await;
        if let Some(why) = known.problem()
            && before.as_ref() != Some(&known)
        {
            crate::say(&format!("the rig's own friction is not used: {why}"));
        }
    }
}
