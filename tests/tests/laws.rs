//! Every ready scene, in the daemon and offline, as a user meets it; and what a law refuses.

use haptic_core::friction::Friction;
use haptic_ipc::{Request, RigState, SceneReply};
use std::path::{Path, PathBuf};
use system_tests::{Daemon, ctl_offline, ctl_offline_refused, status, wait_for, wait_for_state};

fn ready_scenes() -> Vec<PathBuf> {
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes");
    let mut scenes: Vec<PathBuf> = std::fs::read_dir(directory)
        .expect("the scenes")
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "toml"))
        .collect();
    scenes.sort();
    scenes
}

#[test]
fn every_ready_scene_is_rendered_with_a_hand_on_it() {
    let scenes = ready_scenes();
    assert!(scenes.len() >= 5, "{scenes:?}");
    for path in scenes {
        let scene = path.to_str().expect("a plain path");
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

#[test]
fn every_ready_scene_is_simulated_by_every_scheme() {
    let directory = tempfile::tempdir().expect("a directory");
    let out = directory.path().join("out.csv");
    let motion = Path::new(env!("CARGO_MANIFEST_DIR")).join("../crates/haptic-core/tests/data/reference/paper.csv");
    for scene in ready_scenes() {
        for scheme in ["exact", "literal:20", "implicit"] {
            let [scene, motion, out] = [&scene, &motion, &out].map(|path| path.to_str().expect("a plain path"));
            let files = [
                "simulate", scene, "--motion", motion, "--out", out, "--force", "--scheme", scheme,
            ];
            drop(ctl_offline(&files));
            let rows = std::fs::read_to_string(out).expect("rows");
            assert_eq!(rows.lines().count(), 3002);
            assert!(!rows.contains("NaN") && !rows.contains("inf"), "{scene:?} {scheme}");
        }
    }
}

#[test]
fn what_a_law_forbids_is_refused_with_the_reason() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("scene.toml");
    let block = "[block]\nmass = 0.5\n[coupling]\nstiffness = 25000\ndamping = 10\n";
    for (scene, parts) in [
        (
            "[friction]\nlaw = \"lugre\"\nFs = 3\nFd = 3.5\nws = 0.01\nsigma0 = 1e5\n".to_owned(),
            vec!["static_force = 3 N", "3.5 N", "lugre"],
        ),
        (
            "[friction]\nlaw = \"elasto-plastic\"\nFs = 4\nFd = { positive = 3, negative = 5 }\nws = 0.01\nsigma0 = 1e5\n".to_owned(),
            vec!["static_force- = 4 N", "5 N", "elasto-plastic"],
        ),
        (
            "[friction]\nlaw = \"lugre\"\nFs = 4\nFd = 3.5\nsigma0 = 1e5\n".to_owned(),
            vec!["stribeck_velocity = 0 m/s", "lugre"],
        ),
        (
            "[friction]\nlaw = \"reset-integrator\"\nFs = 4\nFd = 0\nsigma = 1e5\n".to_owned(),
            vec!["static_force+ = 4 N", "100 times", "0 N"],
        ),
        (
            format!("{block}[friction]\nlaw = \"karnopp\"\nFs = 4\nFd = 3\nKp = 1000\n"),
            vec!["contact_stiffness does not apply", "rigid"],
        ),
        (
            "[coupling]\nstiffness = 25000\ndamping = 10\n[friction]\nlaw = \"viscous\"\nb = 3\n".to_owned(),
            vec!["[coupling]", "[block]"],
        ),
        (
            "[block]\nmass = 1\n[friction]\nlaw = \"viscous\"\nb = 3\n".to_owned(),
            vec!["[block] needs a [coupling]"],
        ),
        (
            "[friction]\nlaw = \"dahl\"\nFd = 3\n".to_owned(),
            vec!["contact_stiffness"],
        ),
        (
            "[friction]\nlaw = \"dahl\"\nFd = 3\nsigma = -1\n".to_owned(),
            vec!["contact_stiffness = -1 N/m", "from 1 to 10000000 N/m"],
        ),
        (
            "[friction]\nlaw = \"coulomb\"\nFd = 3\n".to_owned(),
            vec!["coulomb", "karnopp", "elasto-plastic"],
        ),
    ] {
        std::fs::write(&path, &scene).expect("written");
        let file = path.to_str().expect("a plain path");
        let simulate = ["simulate", file, "--motion", "/nonexistent.csv", "--out", "/dev/null"];
        ctl_offline_refused(&simulate, 2, &parts);
    }
}
