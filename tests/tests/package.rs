//! The Debian package: what it installs, starts, keeps and removes, on a machine of its own; and the manual pages in
//! it.

use crate::one_of_two;
use haptic_ipc::{RigState, Status};
use std::fs;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::Instant;
use system_tests::links::dead_ends;
use system_tests::pid1::{Machine, PACKAGE};
use system_tests::{binary, files, package, plain, pull_until, status, stderr, text, wait_for_state};

const PACKAGING: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../packaging");

/// Makes two ordinary users: alice, a member of the group `haptic`, and bob, who is not.
fn add_users(machine: &Machine) {
    machine.run_ok(&["useradd", "alice"]);
    machine.run_ok(&["useradd", "bob"]);
    machine.run_ok(&["usermod", "-aG", "haptic", "alice"]);
}

/// Runs haptic-ctl on a machine as one of them.
fn haptic_ctl(machine: &Machine, user: &str, arguments: &[&str]) -> Output {
    machine.run(&[&["runuser", "-u", user, "--", "haptic-ctl"], arguments].concat())
}

fn state_of(machine: &Machine, unit: &str) -> String {
    let shown = machine.run_ok(&["systemctl", "show", "--property=ActiveState", "--value", unit]);
    shown.trim().to_owned()
}

#[test]
fn package_installs_in_one_command_and_first_client_starts_rig() {
    let _one = one_of_two();
    let Some(machine) = Machine::boot_bare() else { return };
    let began = Instant::now();
    // What it depends on is there, and its apt has nothing to fetch from.
    machine.run_ok(&["apt-get", "install", "--yes", PACKAGE]);
    println!("apt install takes {} ms", began.elapsed().as_millis());
    machine.configure("");
    add_users(&machine);
    assert_eq!(state_of(&machine, "hapticd.socket"), "active");
    assert_eq!(state_of(&machine, "hapticd.service"), "inactive");
    assert_eq!(
        machine.run_ok(&["systemctl", "is-enabled", "hapticd.socket"]).trim(),
        "enabled"
    );
    // Exit code 4 of haptic-ctl: no permission; and nobody has started the daemon by that.
    assert_eq!(haptic_ctl(&machine, "bob", &["status"]).status.code(), Some(4));
    assert_eq!(state_of(&machine, "hapticd.service"), "inactive");

    let began = Instant::now();
    let engaged = haptic_ctl(&machine, "alice", &["engage", "--wait"]);
    println!(
        "its first client has engaged the rig after {} ms",
        began.elapsed().as_millis()
    );
    assert!(engaged.status.success(), "{}{}", stderr(&engaged), machine.journal());
    let shown = haptic_ctl(&machine, "alice", &["--json", "status"]);
    let shown: Status = serde_json::from_slice(&shown.stdout).expect("a status");
    assert_eq!(shown.state, RigState::Engaged);
    let words = machine.eventually("the state in words", || {
        let shown = machine.run_ok(&["systemctl", "status", "hapticd"]);
        let words = shown.lines().find(|line| line.contains("Status: \"engaged"))?;
        Some(words.trim().to_owned())
    });
    println!("systemctl status: {words}");
    // Its directory is closed to others now, and they learn whose it is.
    let closed = haptic_ctl(&machine, "bob", &["status"]);
    let message = stderr(&closed);
    assert_eq!(closed.status.code(), Some(4), "{message}");
    assert!(
        message.contains("usermod -aG haptic $USER`, then log in again"),
        "{message}"
    );
    // The socket is the manager's, and outlives the daemon.
    machine.run_ok(&["systemctl", "stop", "hapticd.service"]);
    let idle = ["wait", "--until", "state=idle", "--timeout", "30s"];
    assert!(haptic_ctl(&machine, "alice", &idle).status.success());
    assert_eq!(state_of(&machine, "hapticd.service"), "active");
}

#[test]
fn upgrade_ramps_force_down_first_and_returns_idle() {
    let _one = one_of_two();
    let Some(machine) = Machine::boot("ramp-ms = 300\nstale-ms = 500") else {
        return;
    };
    machine.run_ok(&["systemctl", "start", "hapticd"]);
    let before = machine.daemon();
    let mut client = machine.client();
    pull_until(&mut client, |status| status.command_force_n.abs() > 3.0);
    // A busy machine may have faulted the rig before it pulled.
    let earlier = machine.journal().len();
    let began = Instant::now();
    machine.run_ok(&["dpkg", "--install", PACKAGE]);
    println!(
        "an upgrade takes {} ms, with a ramp of 300 ms",
        began.elapsed().as_millis()
    );
    assert_ne!(machine.daemon(), before);
    wait_for_state(&mut machine.client(), RigState::Idle);
    let configuration = fs::read_to_string(machine.path("/etc/hapticd/hapticd.toml")).expect("it is kept");
    assert!(configuration.contains("ramp-ms = 300"), "{configuration}");
    // Released along its ramp, by the service manager's signal: neither killed nor faulted.
    let journal = machine.journal();
    for ended in ["SIGKILL", "status=", "fault"] {
        assert!(!journal[earlier..].contains(ended), "{journal}");
    }
}

#[test]
fn two_rigs_run_as_independent_instances() {
    let _one = one_of_two();
    let Some(machine) = Machine::boot("") else { return };
    let shipped = fs::read_to_string(machine.path("/etc/hapticd/hapticd.toml")).expect("it was installed");
    for rig in ["left", "right"] {
        let path = machine.path(&format!("/etc/hapticd/hapticd@{rig}.toml"));
        fs::write(path, &shipped).expect("written");
        machine.run_ok(&["systemctl", "start", &format!("hapticd@{rig}.service")]);
    }
    let client = |rig: &str| {
        let socket = machine.path(&format!("/run/hapticd@{rig}/control.sock"));
        haptic_ipc::Client::connect(&socket).expect("it serves")
    };
    let (mut left, mut right) = (client("left"), client("right"));
    pull_until(&mut left, |status| status.command_force_n.abs() > 3.0);
    assert_eq!(status(&mut right).state, RigState::Idle);
    machine.run_ok(&["systemctl", "stop", "hapticd@left.service"]);
    assert_eq!(status(&mut right).state, RigState::Idle);
    assert_eq!(state_of(&machine, "hapticd.service"), "inactive");
}

#[test]
fn removed_and_purged_it_leaves_nothing() {
    let _one = one_of_two();
    let Some(machine) = Machine::boot("") else { return };
    machine.run_ok(&["systemctl", "start", "hapticd"]);
    machine.run_ok(&["haptic-ctl", "scene", "save", "mine"]);
    machine.run_ok(&["dpkg", "--remove", "hapticd"]);
    for kept in ["/etc/hapticd/hapticd.toml", "/var/lib/hapticd/scenes/mine.toml"] {
        assert!(machine.path(kept).exists(), "{kept} is kept until the purge");
    }
    assert_eq!(state_of(&machine, "hapticd.socket"), "inactive");
    machine.run_ok(&["dpkg", "--purge", "hapticd"]);
    for place in [
        "/etc/hapticd",
        "/var/lib/hapticd",
        "/usr/bin/hapticd",
        "/usr/lib/hapticd",
        "/run/hapticd/control.sock",
    ] {
        assert!(!machine.path(place).exists(), "{place}");
    }
}

#[test]
fn lintian_finds_no_error() {
    if !test_run::is_long_for("the packages under lintian") || !test_run::has(&["lintian"]) {
        return;
    }
    let built = match package::hapticd().and_then(|hapticd| Ok([hapticd, package::haptic_gui()?])) {
        Ok(both) => both,
        Err((need, remedy)) => return test_run::skip(need, &remedy),
    };
    // What ran before an upgrade is started again although it is not enabled, which deb-systemd-invoke would not do.
    let output = Command::new("lintian")
        .args(["--fail-on=error,warning", "--allow-root"])
        .args(["--suppress-tags", "maintainer-script-calls-systemctl"])
        .args(built)
        .output();
    let output = output.expect("it was asked for its version");
    let printed = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{printed}");
}

#[test]
fn a_desktop_can_show_the_panel() {
    let metadata = Path::new(PACKAGING).join("gui");
    for (package, line) in [
        ("desktop-file-utils", "desktop-file-validate haptic-gui.desktop"),
        (
            "appstream",
            "appstreamcli validate --no-net io.github.hapticd.haptic-gui.metainfo.xml",
        ),
    ] {
        let words: Vec<&str> = line.split(' ').collect();
        if !test_run::is_there(words[0]) {
            test_run::skip(package, &format!("Debian: apt install {package}"));
            continue;
        }
        let output = Command::new(words[0]).args(&words[1..]).current_dir(&metadata).output();
        let output = output.expect("it starts");
        assert!(output.status.success(), "{line}: {output:?}");
    }
}

#[test]
fn manual_pages_completions_and_schema_are_made() {
    let programs = tempfile::tempdir().expect("a directory");
    let made = |package: &str, names: &[&str]| {
        for name in names {
            symlink(binary(name), programs.path().join(name)).expect("a new name");
        }
        let output = Command::new(Path::new(PACKAGING).join("generate.sh"))
            .arg(package)
            .arg(programs.path())
            .output()
            .expect("there is a shell");
        assert!(output.status.success() && output.stderr.is_empty(), "{output:?}");
        programs.path().join("packaged").join(package)
    };
    let read = |path: PathBuf| fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let hapticd = made("hapticd", &["hapticd", "haptic-ctl"]);
    // Also what the short help leaves out has its text.
    for (page, text) in [
        ("haptic-ctl.1", "Rig of this name"),
        ("haptic-ctl-set.1", "Duration of the change"),
        ("haptic-ctl-scene-load.1", "NAME, @REVISION or FILE.toml"),
        ("hapticd.8", "Group, by name or number"),
    ] {
        let page = read(hapticd.join("man").join(page));
        assert!(page.contains(".TH ") && page.contains(text), "{page}");
    }
    for shell in ["bash", "zsh", "fish"] {
        assert!(read(hapticd.join(format!("completions.{shell}"))).contains("haptic-ctl"));
    }
    let schema = read(hapticd.join("control-protocol.schema.json"));
    assert!(schema.starts_with("{\n") && schema.contains("RequestLine"), "{schema}");
    let dead = dead_links_of_packaged_documents(programs.path());
    assert!(dead.is_empty(), "{}", dead.join("\n"));
    // The panel is compiled for it.
    if test_run::is_long_for("the panel's manual page") {
        let page = read(made("haptic-gui", &["haptic-gui"]).join("haptic-gui.1"));
        assert!(page.contains(".TH "), "{page}");
    }
}

/// The links of the packaged documents that lead to nothing that is packaged, where a folder has what was generated.
fn dead_links_of_packaged_documents(programs: &Path) -> Vec<String> {
    let manifest = Path::new(PACKAGING).join("../crates/hapticd/Cargo.toml");
    let manifest = fs::read_to_string(manifest).expect("it is there");
    let assets = manifest.lines().filter_map(|line| {
        let (from, to) = line.trim().strip_prefix("[\"target/release/")?.split_once("\", \"")?;
        let (from, name) = from.rsplit_once('/')?;
        let to = to.split_once("usr/share/doc/hapticd/")?.1.split('"').next()?;
        Some((programs.join(from), name.strip_prefix('*')?.to_owned(), to.to_owned()))
    });
    let installed = tempfile::tempdir().expect("a directory");
    let mut pages = Vec::new();
    for (from, ending, to) in assets {
        let to = installed.path().join(to);
        fs::create_dir_all(&to).expect("a directory");
        for file in files(&from) {
            // Those of a folder in it are assets of their own.
            if file.parent() == Some(&from) && plain(&file).ends_with(&ending) {
                pages.push(to.join(file.file_name().expect("a name")));
                fs::copy(&file, &pages[pages.len() - 1]).expect("a copy");
            }
        }
    }
    pages.retain(|page| page.extension().is_some_and(|extension| extension == "md"));
    assert!(pages.len() > 20, "{pages:?}");
    let read = |page: &PathBuf| dead_ends(page, &fs::read_to_string(page).expect("a page"));
    pages.iter().flat_map(read).collect()
}

#[test]
fn a_rig_that_is_plugged_in_is_known_by_its_configuration() {
    let rigs = tempfile::tempdir().expect("a directory");
    for (name, device) in [
        (
            "@left",
            r#""serial:/dev/serial/by-id/usb-Example_Rig_0001-if00?baud=500000""#,
        ),
        ("@right", "'hid:1209:000A:AB12'"),
        ("@any", r#""hid:1209:0002""#),
        (
            "@odd",
            r#""odrive:/dev/serial/by-id/usb-ODrive_3-if00?radius_mm=5&torque_limit_nm=0.1""#,
        ),
        ("@bad name", r#""serial:/dev/serial/by-id/usb-bad""#),
        ("@refused", "\"serial:/dev/serial/by-id/usb-refused\"\nno-option = 1"),
        ("", "'serial:/dev/serial/by-id/usb-single'"),
    ] {
        let content = format!("# device = \"serial:/dev/ttyS0\"\nrate = 2000\n device={device} # the rig\n");
        fs::write(rigs.path().join(format!("hapticd{name}.toml")), content).expect("written");
    }
    fs::write(rigs.path().join("hapticd@none.toml"), "rate = 2000\n").expect("written");
    let helper = Path::new(PACKAGING).join("rig-of-device");
    let mode = fs::metadata(&helper).expect("it is there").permissions().mode();
    assert_eq!(mode & 0o111, 0o111);
    // The links of a port, which udev names with and without /dev/; those of a USB device, before it has a port; and
    // what a HID device says of itself.
    for (links, identity, rig) in [
        (
            "serial/by-path/p serial/by-id/usb-Example_Rig_0001-if00",
            "",
            Some("left"),
        ),
        ("/dev/serial/by-id/usb-Example_Rig_0001-if00", "", Some("left")),
        ("serial/by-id/usb-Example_Rig_0001-if*", "", Some("left")),
        ("serial/by-id/usb-ODrive_3-if00", "", Some("odd")),
        ("", "1209 000a ab12", Some("right")),
        ("", "1209 000a other", None),
        ("", "1209 0002 anything", Some("any")),
        // The one rig has no service of its own.
        ("serial/by-id/usb-single", "", Some("")),
        ("serial/by-id/usb-Example_Rig_0001", "", None),
        ("serial/by-id/usb-bad", "", None),
        ("serial/by-id/usb-refused", "", None),
        ("", "", None),
    ] {
        let names = ["ID_VENDOR_ID", "ID_MODEL_ID", "ID_SERIAL_SHORT"];
        let output = Command::new(&helper)
            .args(links.split_whitespace())
            .env("HAPTICD_RIGS", rigs.path())
            .env("HAPTICD", binary("hapticd"))
            .envs(names.into_iter().zip(identity.split(' ').chain(["", ""])))
            .output()
            .expect("there is a shell");
        assert!(output.status.success() && output.stderr.is_empty(), "{output:?}");
        let expected = match rig {
            None => String::new(),
            Some("") => "HAPTICD_CONFIGURED=1\n".to_owned(),
            Some(rig) => format!("HAPTICD_CONFIGURED=1\nHAPTICD_RIG={rig}\n"),
        };
        assert_eq!(text(&output.stdout), expected, "{links} {identity}");
    }
}

#[test]
fn rules_and_unit_name_the_ports_and_who_is_kept_away() {
    let read = |name: &str| fs::read_to_string(Path::new(PACKAGING).join(name)).expect("it is packaged");
    let rules = read("70-hapticd.rules");
    let usb = rules.find("SUBSYSTEM==\"usb\", ENV{HAPTICD_CONFIGURED}==\"1\", ENV{ID_MM_DEVICE_IGNORE}=\"1\"");
    let ports_alone = rules.find("SUBSYSTEM!=\"tty|hidraw\"").expect("it is there");
    assert!(usb.is_some_and(|usb| usb < ports_alone), "{rules}");
    let boards = device_io::usb_boards::modem_manager_rules();
    assert!(
        rules[..ports_alone].contains(&boards),
        "the known boards are to stand there:\n{boards}"
    );
    assert!(rules[ports_alone..].contains("ENV{ID_MM_PORT_IGNORE}=\"1\""), "{rules}");
    let brltty = read("95-hapticd-brltty.rules");
    for cleared in ["ENV{SYSTEMD_WANTS}=\"\"", "ENV{BRLTTY_BRAILLE_DRIVER}=\"\""] {
        assert!(brltty.contains(cleared), "{brltty}");
    }
    let unit = read("hapticd.service");
    for kind in ["ttyACM", "ttyUSB", "ttyS", "ttyAMA", "hidraw"] {
        assert!(
            unit.contains(&format!("\nDeviceAllow=char-{kind} rw\n")),
            "{kind}: {unit}"
        );
    }
}
