//! Prepares the loop, and everything that it needs, from the configuration.

use crate::config::{Config, RigChoice};
use crate::control::history::FIRST_REVISION;
use crate::control::{Facts, PointerHand};
use crate::processor_share::{self, ProcessorShare};
use crate::rt::handoff::{ControlSide, hand_over};
use crate::rt::lateness::Lateness;
use crate::rt::outbox::RECORDS;
use crate::rt::privileges;
use crate::rt::thread::{Policy, ThreadSettings};
use crate::rt::tick::Tick;
use device_io::Device;
use device_io::kinematics::Kinematics;
use device_io::link::{Keeper, LinkMonitor, LoopTiming};
use haptic_core::adviser::RigFacts;
use haptic_core::passivity::RigLosses;
use haptic_core::planar::Plane;
use haptic_core::servo::{CompiledScene, Servo, Settings};
use haptic_core::{Scene, SceneError, Scheme, Vector};
use haptic_ipc::{Problem, RealTimeStatus};
use std::cell::Cell;
use std::time::Duration;

/// The loop and everything around it, ready to be started.
pub(crate) struct Prepared {
    pub(crate) tick: ReadyTick,
    pub(crate) settings: ThreadSettings,
    pub(crate) status: RealTimeStatus,
    pub(crate) control: ControlSide,
    pub(crate) facts: Facts,
    pub(crate) scene: Scene,
    pub(crate) cpus: Vec<usize>,
    pub(crate) keeper: Option<Keeper>,
}

/// The loop of a rig of one axis or of two.
pub(crate) enum ReadyTick {
    Line(Tick<dyn Device>),
    Plane(Tick<dyn Device<Plane>, Plane>),
}

/// Prepares the loop.
///
/// # Errors
/// The scene cannot be rendered.
pub(crate) fn prepare(config: Config) -> Result<Prepared, SceneError> {
    let mut status = RealTimeStatus::default();
    privileges::lock_memory(&mut status);
    let awake = config
        .keep_cpus_awake
        .then(|| privileges::keep_cpus_awake(&mut status))
        .flatten();
    let (mass, losses, hand) = known_of(&config.rig);
    let scene = config.scene.clone().on(None);
    let may_be_the_rigs = config.scene.has_coupling_of_rig() || scene == Scene::light_block();
    let servo_settings = Settings { losses, ..config.servo };
    let (control, loop_side) = hand_over(if config.kinematics.is_some() {
        2 * RECORDS
    } else {
        RECORDS
    });
    let timing = LoopTiming {
        period_ns: config.period_ns,
        stale_ns: config.servo.stale_ns,
    };
    let (lateness, control_timeout_ns) = (Lateness::new(config.late_policy), config.control_timeout_ns);
    let (device, link) = prepare_device(config.rig, config.kinematics, timing);
    let is_linked = link.is_some();
    let (tick, description, resolution) = match device {
        AnyDevice::Line(device) => {
            let servo = first_servo(servo_settings, &scene, config.scheme, is_linked)?;
            let (description, resolution) = (device.description(), device.bounds().resolution_m);
            let tick = Tick::new(device, loop_side, servo, lateness, control_timeout_ns);
            (ReadyTick::Line(tick), description, resolution)
        }
        AnyDevice::Plane(device) => {
            let servo = first_servo(servo_settings, &scene, config.scheme, is_linked)?;
            let (description, resolution) = (device.description(), device.bounds().resolution_m);
            let tick = Tick::new(device, loop_side, servo, lateness, control_timeout_ns);
            (ReadyTick::Plane(tick), description, resolution)
        }
    };
    let (monitor, keeper) = link.unzip();

    let share = claim_processor(config.cpu.filter(|_| config.policy != Policy::Deadline), &mut status);
    let phase_ns = share.as_ref().map_or_else(
        || processor_share::default_phase_ns(config.period_ns),
        |share| share.phase_ns(config.period_ns),
    );
    let facts = Facts {
        server: format!("hapticd {}", env!("CARGO_PKG_VERSION")),
        device: description,
        address: config.device,
        servo: Cell::new(servo_settings),
        configuration: config.source,
        _awake: awake,
        share,
        keeper: None,
        rig: RigFacts {
            period_s: config.servo.period_s,
            // A rig in this process is read and written in the same tick; the times of a link are
            // measured.
            sample_period_s: 0.0,
            delay_s: 0.0,
            mass,
            damping: losses.damping,
            friction: losses.friction,
            resolution,
        },
        friction: config.friction,
        kinematics: config.kinematics,
        hand,
        link: monitor,
        period_ns: config.period_ns,
        ramp: Duration::from_secs_f64(config.servo.ramp_s),
        rules: config.rules,
        state_dir: config.state_dir,
        scheme: config.scheme,
        first_scene: may_be_the_rigs.then_some(config.scene),
        scene_dir: config.scene_dir,
        real_time: RealTimeStatus::default(),
    };
    Ok(Prepared {
        tick,
        settings: ThreadSettings {
            period_ns: config.period_ns,
            phase_ns,
            cpu: config.cpu,
            policy: config.policy,
            spin_ns: config.spin_ns,
        },
        status,
        control,
        facts,
        scene,
        cpus: config.available_cpus,
        keeper,
    })
}

/// The servo of the first scene. That of a linked device cannot be engaged until the device's first sample.
fn first_servo<V: Vector>(
    settings: Settings,
    scene: &Scene,
    scheme: Scheme,
    is_linked: bool,
) -> Result<Servo<V>, SceneError> {
    let compiled = CompiledScene::ramped(scene, scene, FIRST_REVISION, scheme, settings.period_s, 0.0)?;
    let mut servo = Servo::new(settings, Box::new(compiled));
    if is_linked {
        servo.disconnect();
    }
    Ok(servo)
}

/// Claims a share of the processor that the loop will be pinned to.
fn claim_processor(cpu: Option<usize>, status: &mut RealTimeStatus) -> Option<ProcessorShare> {
    match ProcessorShare::claim(cpu?) {
        Ok(share) => Some(share),
        Err(error) => {
            status.problems.push(Problem {
                what: format!(
                    "cannot tell whether another daemon runs its loop on the same processor: locking /dev/null \
                     failed: {error}"
                ),
                remedy: "allow fcntl(F_OFD_SETLK) in the daemon's filter of system calls, and /dev/null for writing"
                    .to_owned(),
            });
            None
        }
    }
}

/// What a rig is known to be as far as its files say nothing: its mass, kg; what it takes up; and the hand on it that
/// clients move.
fn known_of(rig: &RigChoice) -> (Option<f64>, RigLosses, Option<PointerHand>) {
    let (mass_kg, damping, friction, hand) = match rig {
        RigChoice::Fake(rig) => {
            let known = rig.properties();
            (known.mass_kg, known.damping_ns_per_m, known.friction_n, rig.pointer())
        }
        RigChoice::FakePlane(rig) => {
            let known = rig.properties();
            (known.mass_kg, known.damping_ns_per_m, known.friction_n, None)
        }
        RigChoice::Linked(_) => return (None, RigLosses::default(), None),
    };
    let hand = hand.cloned().map(PointerHand::new);
    (Some(mass_kg), RigLosses { damping, friction }, hand)
}

/// A device of one axis or of two.
enum AnyDevice {
    Line(Box<dyn Device>),
    Plane(Box<dyn Device<Plane>>),
}

/// The device's real-time end, and the rest of its link if it has one.
fn prepare_device(
    rig: RigChoice,
    kinematics: Option<Kinematics>,
    timing: LoopTiming,
) -> (AnyDevice, Option<(LinkMonitor, Keeper)>) {
    match rig {
        RigChoice::Fake(rig) => (AnyDevice::Line(rig), None),
        RigChoice::FakePlane(rig) => (AnyDevice::Plane(rig), None),
        RigChoice::Linked(connector) => match kinematics {
            None => {
                let (device, monitor, keeper) = Keeper::new(connector, timing);
                (AnyDevice::Line(Box::new(device)), Some((monitor, keeper)))
            }
            Some(kinematics) => {
                let (device, monitor, keeper) = Keeper::planar(connector, timing, kinematics);
                (AnyDevice::Plane(Box::new(device)), Some((monitor, keeper)))
            }
        },
    }
}
