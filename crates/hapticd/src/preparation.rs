//! Prepares the loop, and everything that it needs, from the configuration.

use crate::config::{Config, RigChoice};
use crate::control::history::FIRST_REVISION;
use crate::control::{Facts, PointerHand};
use crate::processor_share::{self, ProcessorShare};
use crate::rt::handoff::{ControlSide, hand_over};
use crate::rt::lateness::Lateness;
use crate::rt::outbox::RECORDS;
use crate::rt::privileges;
use crate::rt::thread_settings::{Policy, ThreadSettings};
use crate::rt::tick::Tick;
use device_io::Device;
use device_io::link::{Keeper, LinkMonitor, LoopTiming};
use haptic_core::adviser::RigFacts;
use haptic_core::passivity::RigLosses;
use haptic_core::servo::{CompiledScene, Servo, Settings};
use haptic_core::{Renderer, Scene, SceneError};
use haptic_ipc::{Problem, RealTimeStatus};
use std::cell::Cell;
use std::time::Duration;

/// The loop and everything around it, ready to be started.
pub(crate) struct Prepared {
    pub(crate) tick: Tick<dyn Device>,
    pub(crate) settings: ThreadSettings,
    pub(crate) status: RealTimeStatus,
    pub(crate) control: ControlSide,
    pub(crate) facts: Facts,
    pub(crate) scene: Scene,
    pub(crate) cpus: Vec<usize>,
    pub(crate) keeper: Option<Keeper>,
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
    #[expect(clippy::cast_precision_loss, reason = "at most 10 000 000 ns")]
    let period_s = config.period_ns as f64 * 1e-9;
    let losses = default_losses(&config.rig);
    let (mass, hand) = match &config.rig {
        RigChoice::Fake(rig) => (
            Some(rig.properties().mass_kg),
            rig.pointer().cloned().map(PointerHand::new),
        ),
        RigChoice::Linked(_) => (None, None),
    };
    let scene = config.scene.clone().on(None);
    let may_be_the_rigs = config.scene.has_coupling_of_rig() || scene == Scene::light_block();
    let servo = prepare_servo(&config, &scene, period_s, losses)?;
    let servo_settings = *servo.settings();
    let (device, link) = prepare_device(
        config.rig,
        LoopTiming {
            period_ns: config.period_ns,
            stale_ns: config.watches.stale_ns,
        },
    );
    let (description, resolution) = (device.description(), device.bounds().resolution_m);
    let (monitor, keeper) = link.unzip();
    let (control, loop_side) = hand_over(RECORDS);
    let tick = Tick::new(
        device,
        loop_side,
        servo,
        Lateness::new(config.late_policy),
        config.watches.control_timeout_ns,
    );

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
            period_s,
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
        hand,
        link: monitor,
        period_ns: config.period_ns,
        ramp: Duration::from_secs_f64(config.ramp_s),
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
fn prepare_servo(config: &Config, scene: &Scene, period_s: f64, losses: RigLosses) -> Result<Servo, SceneError> {
    let renderer = Renderer::new(scene, config.scheme, period_s)?;
    let settings = Settings {
        period_s,
        ramp_s: config.ramp_s,
        limits: config.limits,
        losses,
        passivity_control_n: config.passivity_control_n,
        velocity: config.velocity,
        stale_ns: config.watches.stale_ns,
        stop_button: config.watches.stop_button,
        enable_button: config.watches.enable_button,
        // Until a rig is engaged whose friction is known.
        compensation: None,
    };
    let mut servo = Servo::new(settings, Box::new(CompiledScene::at_once(renderer, FIRST_REVISION)));
    if matches!(config.rig, RigChoice::Linked(_)) {
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

/// What a rig takes up as far as nothing is known of it.
fn default_losses(rig: &RigChoice) -> RigLosses {
    match rig {
        RigChoice::Fake(rig) => RigLosses {
            damping: rig.properties().damping_ns_per_m,
            friction: rig.properties().friction_n,
        },
        RigChoice::Linked(_) => RigLosses {
            damping: 0.0,
            friction: 0.0,
        },
    }
}

/// The device's real-time end, and the rest of its link if it has one.
fn prepare_device(rig: RigChoice, timing: LoopTiming) -> (Box<dyn Device>, Option<(LinkMonitor, Keeper)>) {
    match rig {
        RigChoice::Fake(rig) => (rig, None),
        RigChoice::Linked(connector) => {
            let (device, monitor, keeper) = Keeper::new(connector, timing);
            (Box::new(device), Some((monitor, keeper)))
        }
    }
}
