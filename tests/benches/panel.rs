//! What the panel costs without a graphics card: the share of a core that its process takes, all threads included,
//! those of the software renderer as well, while the real daemon feels a moving hand at 1 kHz.
//!
//! ```sh
//! cargo bench -p system-tests --bench panel
//! ```
//!
//! Twenty seconds of each; the X server is not counted. The rest of the machine should be quiet: what shares the
//! processor's caches makes the same work longer.

use std::path::Path;
use std::thread;
use std::time::{Duration, Instant};
use system_tests::screen::{Panel, Screen};
use system_tests::{Daemon, engage, wait_for};

/// What is measured of each, s.
const MEASURED_S: u64 = 20;

/// Until the plots are full and what it takes to come up is over, s.
const COMING_UP_S: u64 = 6;

/// Where Freeze is in a window of any size, pixels.
const FREEZE: (usize, usize) = (410, 175);

/// Share of a core that a panel takes, in percent.
fn share(panel: &Panel) -> f64 {
    thread::sleep(Duration::from_secs(COMING_UP_S));
    let (before_s, began) = (panel.processor_time_s(), Instant::now());
    thread::sleep(Duration::from_secs(MEASURED_S));
    (panel.processor_time_s() - before_s) / began.elapsed().as_secs_f64() * 100.0
}

/// Measures one way to look at the panel, which `arrange` brings about and what it returns upholds.
fn measure<T>(
    daemon: &Daemon,
    what: &str,
    size: (usize, usize),
    arguments: &[&str],
    arrange: impl FnOnce(&Screen) -> T,
) {
    let Some(screen) = Screen::of_size(size) else { return };
    let panel = screen.panel(daemon.socket(), arguments);
    wait_for(&mut daemon.client(), "the panel", |status| status.clients == 3);
    thread::sleep(Duration::from_secs(1));
    let _arranged = arrange(&screen);
    let share = share(&panel);
    println!("| {what} | {} x {} | {share:.1} % |", size.0, size.1);
    drop(panel);
    wait_for(&mut daemon.client(), "the panel to go", |status| status.clients == 1);
}

/// A daemon that feels a moving hand.
fn engaged(arguments: &[&str]) -> Daemon {
    let daemon = Daemon::start(arguments);
    engage(&mut daemon.client());
    daemon
}

fn main() {
    let daemon = engaged(&[]);
    println!("| | window | share of a core |");
    println!("|---|---|---|");
    let usual = (1280, 800);
    for size in [usual, (1024, 640), (1920, 1080)] {
        measure(&daemon, "Tune, 5 s in sight", size, &[], |_| {});
    }
    measure(&daemon, "Tune, frozen", usual, &[], |screen| {
        screen.click(FREEZE);
        // Out of the way, so that nothing is drawn for the pointer.
        screen.act(&["mousemove", "1", "1"]);
    });
    measure(&daemon, "Tune, covered by another window", usual, &[], |screen| {
        screen.panel(Path::new("/nowhere"), &[])
    });
    let recording = concat!(env!("CARGO_MANIFEST_DIR"), "/fixtures/recording-of-servo-3.mcap");
    for (what, shows) in [
        ("Record, a recording open", ["--open", recording]),
        ("Identify", ["--page", "identify"]),
        ("Task, no study open", ["--page", "task"]),
        ("Perception, no study open", ["--page", "perception"]),
    ] {
        measure(&daemon, what, usual, &shows, |_| {});
    }
    let plane = engaged(&["--kinematics", "xy", "--hand", "circle"]);
    for (what, page) in [("Plane, two axes", "plane"), ("Tune, two axes", "tune")] {
        measure(&plane, what, usual, &["--page", page], |_| {});
    }
    drop(plane);
    measure(&daemon, "Tune, minimised", usual, &[], |screen| {
        let manager = screen.window_manager();
        thread::sleep(Duration::from_secs(1));
        screen.act(&["search", "--name", "Haptic panel", "windowminimize"]);
        manager
    });
}
