//! A rig without a real-time thread, for tests of what the control thread keeps of it.

use crate::config::{Configuration, EngageRules, FrictionOptions};
use crate::control::RigHandle;
use crate::control::facts::Facts;
use crate::rt::handoff::{LoopSide, hand_over};
use crate::rt::tick::tests::SETTINGS;
use device_io::Address;
use haptic_core::adviser::RigFacts;
use haptic_core::limiter::Limits;
use haptic_core::servo::Settings;
use haptic_core::{Scene, Scheme};
use haptic_ipc::RealTimeStatus;
use std::cell::Cell;
use std::time::Duration;

fn facts() -> Facts {
    Facts {
        kinematics: None,
        server: String::new(),
        device: String::new(),
        address: device_boards::Address::Native(Address::Fake),
        servo: Cell::new(Settings {
            ramp_s: 0.1,
            limits: Limits {
                slew_n_per_s: 5000.0,
                acceleration_mps2: 2000.0,
                ..SETTINGS.limits
            },
            stale_ns: 20_000_000,
            stop_button: None,
            ..SETTINGS
        }),
        configuration: Configuration::default(),
        _awake: None,
        share: None,
        rig: RigFacts {
            period_s: SETTINGS.period_s,
            sample_period_s: 0.0,
            delay_s: 0.0,
            mass: None,
            damping: 0.0,
            friction: 0.0,
            resolution: 0.0,
        },
        friction: FrictionOptions::default(),
        hand: None,
        link: None,
        keeper: None,
        period_ns: 1_000_000,
        ramp: Duration::from_millis(100),
        rules: EngageRules::default(),
        state_dir: "".into(),
        scheme: Scheme::Exact,
        first_scene: None,
        scene_dir: "".into(),
        real_time: RealTimeStatus::default(),
    }
}

/// The rig, and the ends of the real-time thread.
pub(in crate::control) fn rig() -> (RigHandle, LoopSide) {
    let (control, loop_side) = hand_over(16);
    (RigHandle::new(facts(), control, Scene::paper()), loop_side)
}
