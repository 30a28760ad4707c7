//! What becomes of a change whose fate the loop decides while something else is done here.

use super::*;
use crate::config::{Configuration, FrictionOptions};
use crate::control::facts::{EngageRules, Facts};
use crate::rt::handoff::Shared;
use crate::rt::outbox::{outbox, tests::record};
use crate::rt::rig_setup::rig_setups;
use crate::rt::schedule::schedule;
use crate::telemetry::feed::Feed;
use device_io::Address;
use haptic_core::Scheme;
use haptic_core::adviser::RigFacts;
use haptic_core::limiter::Limits;
use haptic_core::passivity::RigLosses;
use haptic_core::servo::Settings;
use haptic_core::velocity::Method;
use haptic_ipc::RealTimeStatus;
use std::cell::Cell;
use std::time::Duration;

const PERIOD_S: f64 = 1e-3;

fn facts() -> Facts {
    Facts {
        server: String::new(),
        device: String::new(),
        address: device_boards::Address::Native(Address::Fake),
        servo: Cell::new(Settings {
            period_s: PERIOD_S,
            ramp_s: 0.1,
            limits: Limits {
                force_n: 20.0,
                slew_n_per_s: 5000.0,
                speed_mps: 5.0,
                acceleration_mps2: 2000.0,
            },
            losses: RigLosses {
                damping: 0.0,
                friction: 0.0,
            },
            passivity_control_n: 0.0,
            velocity: Method::AlphaBetaGamma,
            stale_ns: 0,
            stop_button: None,
            enable_button: None,
            compensation: None,
        }),
        configuration: Configuration::default(),
        _awake: None,
        share: None,
        rig: RigFacts {
            period_s: PERIOD_S,
            sample_period_s: 0.0,
            delay_s: 0.0,
            damping: 0.0,
            friction: 0.0,
            resolution: 0.0,
        },
        friction: FrictionOptions::default(),
        link: None,
        keeper: None,
        period_ns: 1_000_000,
        ramp: Duration::from_millis(100),
        rules: EngageRules::default(),
        state_dir: "".into(),
        scheme: Scheme::Exact,
        scene_dir: "".into(),
        real_time: RealTimeStatus::default(),
    }
}

#[test]
fn a_change_that_is_rendered_while_the_history_is_read_is_entered_afterwards() {
    let ((mut producer, records), (setups, _), (sender, _)) = (outbox(), rig_setups(), schedule());
    let feed = Feed::new(records, 1_000_000, None);
    let shared = Arc::new(Shared::new());
    let rig = RigHandle::new(facts(), shared, setups, sender, feed, Scene::paper(), 1);
    producer.push(|| record(0));
    rig.pump();
    let scene = Scene::paper()
        .with(&[("Fs".parse().expect("a key"), 5.0)])
        .expect("a scene");
    let change = NewChange {
        at_tick: 100,
        compiled: rig
            .compile_from(&Scene::paper(), &scene, 0.0)
            .expect("it can be rendered"),
        scene: scene.clone(),
        step: Move::Forward,
        entry: JournalEntry::of("set"),
    };
    let peer = Peer::default();
    let by = Requester {
        session: 1,
        peer: &peer,
    };
    let revision = rig.schedule(by, false, 1, vec![change]).expect("there is room");
    let claim = Arc::clone(&rig.schedule.borrow().waiting[0].claim);

    let history = rig.history();
    assert!(claim.decide(Fate::Rendered(100)));
    rig.pump();
    assert_eq!(history.newest().revision, 1);
    drop(history);
    rig.pump();
    assert_eq!((rig.revision(), rig.scene().clone()), (revision, scene));
    assert_eq!(rig.journal(0, 9).entries[0].tick, Some(100));
}
