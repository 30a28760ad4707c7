//! The rig's own friction as the programs know it: identified, read again, used, compensated.

use haptic_ipc::{AdviceBasis, AdviceReply, Client, ErrorCode, LossSource, Request, RigFrictionStatus, Topic};
use std::path::Path;
use system_tests::{Daemon, ctl_offline_json, engage, plain, refused, status, subscribe, until_some};

/// Leaves what was identified of the fake rig in a state directory, as the daemon does.
fn identified(directory: &Path, friction: &str) {
    let directory = directory.join("state/friction");
    std::fs::create_dir_all(&directory).expect("a directory");
    let text = format!(
        "rig = \"fake\"\nfirmware = \"any\"\nreversed = false\nresolution_m = 1e-5\nforce_limit_N = 20.0\n\
         sample_rate_Hz = 1000.0\nwatchdog_ms = 0\nbuttons = 0\ntime_unix_s = 1.0\nby = \"ada\"\n\n\
         [friction]\n{friction}\n"
    );
    std::fs::write(directory.join("fake.toml"), text).expect("written");
}

const FRICTION: &str = "mass_kg = 1.4\ndynamic_force_N = { positive = 0.8, negative = 0.7 }\nviscous_Ns_per_m = 0.5";

/// A daemon with the rig in its process, whose state outlives it.
fn daemon(directory: &Path, arguments: &[&str]) -> (Daemon, Client) {
    let daemon = Daemon::start_in(directory, "fake", arguments);
    let client = daemon.client();
    (daemon, client)
}

/// What the daemon says of the rig's friction, once it has read what was identified.
fn known(client: &mut Client) -> RigFrictionStatus {
    until_some("its friction is not read", || {
        let friction = status(client).device.rig_friction;
        friction.filter(|friction| friction.identified.is_some())
    })
}

/// What the advice is based on.
fn basis(client: &mut Client) -> AdviceBasis {
    let advice: AdviceReply = client.request(Request::Advise {}).expect("advice");
    advice.basis.expect("a basis")
}

#[test]
fn what_was_identified_is_used_and_an_option_overrides_it() {
    let directory = tempfile::tempdir().expect("a directory");
    let (without, mut client) = daemon(directory.path(), &[]);
    let friction = status(&mut client).device.rig_friction.expect("it is reported");
    assert_eq!(
        (friction.friction_n, friction.friction_from),
        (0.8, LossSource::Default)
    );
    assert_eq!((friction.identified, friction.compensated_share), (None, None));

    drop(without);
    identified(directory.path(), FRICTION);
    let (with, mut client) = daemon(directory.path(), &[]);
    let friction = known(&mut client);
    assert_eq!(
        (friction.friction_n, friction.friction_from),
        (0.7, LossSource::Identified)
    );
    assert_eq!(
        (friction.damping_ns_per_m, friction.damping_from),
        (0.5, LossSource::Identified)
    );
    assert_eq!(friction.identified.expect("identified").mass, 1.4);
    let basis = basis(&mut client);
    assert_eq!((basis.friction_n, basis.friction_from), (0.7, LossSource::Identified));
    let printed = with.ctl_ok(&["status"]);
    assert!(
        printed.contains("0.700 N (identified), 0.500 N s/m (identified)"),
        "{printed}"
    );
    let printed = with.ctl_ok(&["advise"]);
    assert!(printed.contains("0.7 N (identified)"), "{printed}");

    drop(with);
    let (_option, mut client) = daemon(directory.path(), &["--rig-friction-n", "0.3"]);
    let friction = known(&mut client);
    assert_eq!((friction.friction_n, friction.friction_from), (0.3, LossSource::Option));
    assert_eq!(
        (friction.damping_ns_per_m, friction.damping_from),
        (0.5, LossSource::Identified)
    );
}

// hazard: F21
#[test]
fn friction_that_was_not_identified_is_not_compensated() {
    let directory = tempfile::tempdir().expect("a directory");
    let (_daemon, mut client) = daemon(directory.path(), &["--compensate", "0.5"]);
    let error = refused(&mut client, Request::engage());
    assert_eq!(error.code, ErrorCode::NotIdentified, "{error}");
}

#[test]
fn the_share_is_felt_shown_and_recorded() {
    let directory = tempfile::tempdir().expect("a directory");
    let friction = "mass_kg = 1.4\ndynamic_force_N = 0.8\nviscous_Ns_per_m = 0";
    identified(directory.path(), friction);
    let (daemon, mut client) = daemon(directory.path(), &["--compensate", "0.5"]);
    let friction = known(&mut client);
    assert_eq!(friction.compensated_share, Some(0.5));
    let printed = daemon.ctl_ok(&["status"]);
    assert!(printed.contains("0.5 of it compensated"), "{printed}");
    let basis = basis(&mut client);
    assert!((basis.friction_n - 0.4).abs() < 1e-12 && basis.compensated_share == Some(0.5));
    let file = directory.path().join("session.mcap");
    let mut recorder = daemon.recorder(&file, &["--for", "2s"]);
    system_tests::recorded::wait_for_rows(&file, 300);
    engage(&mut client);
    let compensation = subscribe(&mut client, &[Topic::Samples])
        .servo
        .expect("its settings")
        .settings
        .compensation
        .expect("compensated");
    assert_eq!(
        (compensation.share, compensation.friction.dynamic_force.positive),
        (0.5, 0.8)
    );
    // A replay computes it too.
    assert!(recorder.wait().expect("it ends").success());
    let report = ctl_offline_json(&["replay", plain(&file)]);
    assert_eq!(report["differing"], 0, "{report}");
    assert!(report["compared"].as_u64() > Some(500), "{report}");
}
