//! hapticd on the reference firmware, as it runs on its microcontroller: the real machine code on a simulated
//! ATmega328P, whose PWM pin pulls a handle. hapticd's clock is the machine's, so the simulator has to keep up with it.

use haptic_ipc::{LinkCounts, RigState};
use rustix::process::Signal;
use serde_json::Value;
use std::process::Command;
use system_tests::fake_rig::FakeRig;
use system_tests::simulated_rig::{Encoder, SimulatedRig, WATCHDOG_S, conforms, number};
use system_tests::{Daemon, PAPER_SCENE, binary, status, timed, wait_for};

const TMP: &str = env!("CARGO_TARGET_TMPDIR");
/// How many newtons the paper's block takes to slide: its kinetic friction.
const KINETIC_N: f64 = 3.5;

/// hapticd renders the paper's block for some of the rig's seconds, and is killed while it pulls.
#[test]
fn hapticd_renders_on_it_and_killed_leaves_no_force() {
    let _alone = crate::alone();
    timed("the firmware as machine code in real time", || {
        rendered(Encoder::Quadrature, 20.0);
        rendered(Encoder::Magneto, 5.0);
    });
}

#[test]
fn the_fake_rig_passes_the_check_of_firmwares() {
    let _alone = crate::alone();
    timed("the fake rig's times by the checker of firmwares", || {
        for axes in ["1", "2"] {
            let rig = FakeRig::start(&["--hand", "free", "--axes", axes]);
            println!("{axes} axes");
            conforms(rig.link(), "2");
        }
    });
}

fn rendered(encoder: Encoder, time_s: f64) {
    let hapticd = binary("hapticd");
    let Some(mut rig) = SimulatedRig::start(encoder, TMP, &[]) else {
        return;
    };
    let directory = tempfile::tempdir().expect("a directory");
    let mut command = Command::new(hapticd);
    command.arg("--device").arg(format!("serial:{}", rig.line().display()));
    // Without the right to a priority a busy machine may keep the simulator waiting.
    command.args(["--stale-ms", "1000", "--uncommissioned", "--scene", PAPER_SCENE]);
    let daemon = Daemon::spawn(command, &directory.path().join("run/control.sock"));
    let mut client = daemon.client();
    wait_for(&mut client, "the rig", |status| {
        status.device.link.as_ref().is_some_and(|link| link.counts.samples > 0)
    });
    // Held up on a busy machine, hapticd is no silent host.
    rig.order("patience 2");
    // A light rig would chatter with that coupling; here a hand leads it.
    daemon.ctl_ok(&["engage", "--anyway", "--wait"]);
    // The hand takes a second and a half to come up to its stroke.
    rig.live(2.0);
    rig.clear();
    let stats = rig.live(time_s);

    let seen = status(&mut client);
    assert_eq!(seen.state, RigState::Engaged, "{seen:?}");
    let link = seen.device.link.expect("a link");
    println!("{}: {link:?} {stats}", encoder.name());
    nothing_was_lost(link.counts, &stats, time_s + 2.0);
    friction_was_felt(&stats, time_s);

    while number(&rig.live(0.005), "/motor/force_n").abs() <= 2.5 {
        assert_eq!(status(&mut client).state, RigState::Engaged);
    }
    let (status, _) = daemon.end(Signal::KILL);
    assert!(!status.success());
    // From here on the host is silent.
    rig.order("patience 0");
    let stats = rig.live(0.3);
    let after_s = number(&stats, "/motor/last_on_s") - number(&stats, "/motor/last_frame_s");
    println!("{}: off {:.2} ms after the last command", encoder.name(), after_s * 1e3);
    assert!((0.045..=WATCHDOG_S + 0.0005).contains(&after_s), "{after_s} s: {stats}");
    assert_eq!(number(&stats, "/motor/force_n").abs(), 0.0, "{stats}");
}

fn nothing_was_lost(counts: LinkCounts, stats: &Value, time_s: f64) {
    let rest = LinkCounts {
        samples: 0,
        late: 0,
        clipped: 0,
        ..counts
    };
    let expected = LinkCounts {
        connections: 1,
        ..LinkCounts::default()
    };
    assert_eq!(rest, expected, "nothing was lost, damaged or refused");
    #[expect(clippy::cast_precision_loss, reason = "some thousands")]
    let samples = counts.samples as f64;
    assert!(samples >= time_s * 1000.0, "{samples} samples");
    assert_eq!(
        (&stats["uart"]["overruns"], &stats["processor"]["resets"]),
        (&Value::from(0), &Value::from(0)),
        "{stats}"
    );
}

/// The motor worked against the hand over its whole travel, with the block's friction.
fn friction_was_felt(stats: &Value, time_s: f64) {
    let (work_j, travel_m) = (number(stats, "/motor/work_j"), number(stats, "/handle/travel_m"));
    assert!(travel_m > 0.02 * time_s, "{stats}");
    let felt_n = -work_j / travel_m;
    assert!((felt_n - KINETIC_N).abs() < 0.4, "{felt_n} N: {stats}");
    // The firmware's limit, 5 N, is high for 454 of the 512 cycles of two periods; the simulator may see the end of
    // each by an instruction of 4 cycles late, and the force goes by the square.
    assert!(
        number(stats, "/motor/largest_force_n") < 5.17,
        "beyond the firmware's limit: {stats}"
    );
}
