//! Every ready scene, in the daemon and offline, as a user meets it; and what a law refuses.

use haptic_core::friction::Friction;
use haptic_ipc::{Request, RigState, SceneReply};
use std::path::Path;
use system_tests::{Daemon, files, plain, status, wait_for, wait_for_state};

#[test]
fn every_ready_scene_is_rendered_with_a_hand_on_it() {
    let mut scenes = files(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../scenes")));
    scenes.retain(|path| path.extension().is_some_and(|extension| extension == "toml"));
    assert!(scenes.len() >= 5, "{scenes:?}");
    for path in scenes {
        let scene = plain(&path);
        let hand = ["--hand-amplitude-m=0.02", "--hand-frequency-hz=1"];
        let daemon = Daemon::start(&["--scene", scene, hand[0], hand[1], "--force-limit-n=15"]);
        let mut client = daemon.client();
        drop(daemon.ctl_ok(&["engage"]));
        wait_for_state(&mut client, RigState::Engaged);
        let begun = status(&mut client).tick;
        // The hand comes up to its stroke.
        let some = test_run::extent(250, 1000);
        wait_for(&mut client, "its ticks", |status| status.tick > begun + some);
        let follow = [
            "log", "--follow", "samples", "--rate", "all", "--json", "--count", "800",
        ];
        let watched = daemon.ctl_ok(&follow);
        let largest = watched
            .lines()
            .filter_map(|line| serde_json::from_str::<serde_json::Value>(line).ok())
            .filter_map(|sample| sample["coupling_force_N"].as_f64())
            .fold(0.0_f64, |most, force| most.max(force.abs()));
        // Without friction there is the block's own inertia, 0.4 N on this hand.
        assert!((0.3..15.0).contains(&largest), "{scene}: {largest} N at most");
        assert_eq!(status(&mut client).state, RigState::Engaged, "{scene}");
        // Each of its parameters can be changed while it runs, and a parameter that it has not is
        // refused by name.
        let reply: SceneReply = client.request(Request::get()).expect("the scene");
        for (name, value) in &reply.params {
            drop(daemon.ctl_ok(&["set", &format!("{name}={}", value.greatest() * 0.99)]));
        }
        let absent = if reply.params.contains_key("exponent") {
            "gamma"
        } else {
            "i"
        };
        let message = daemon.ctl_refused(&["set", &format!("{absent}=1")], 1, "does not apply here");
        assert!(message.contains(reply.scene.friction.law()), "{scene}: {message}");
        let described = daemon.ctl_ok(&["describe"]);
        let summary = Friction::summary(reply.scene.friction.law()).expect("a law of the list");
        assert!(
            described.lines().next().is_some_and(|law| law.ends_with(summary)),
            "{described}"
        );
        // The law, an empty line, the head of the table.
        assert_eq!(described.lines().count(), 3 + reply.params.len(), "{described}");
    }
}
