//! The state of the rig, its link, the real-time thread and the devices, as the daemon reports them.

use super::check::Check;
use crate::status;
use haptic_ipc::{DeviceStatus, DevicesReply, LinkCounts, LossSource, Problem, RigFrictionStatus, RigState, Status};
use std::path::{Path, PathBuf};

pub(super) fn rig(status: &Status, timer: Option<&LatencyTimer>) -> Vec<Check> {
    let device = &status.device;
    let what = format!("{}, {}", status.state, device.description);
    let waiting = device.link.as_ref().and_then(|link| link.waiting.as_deref());
    let state = state(status.state, what, status.fault.as_deref(), waiting);
    let mut checks = vec![state];
    let link = device.link.as_ref();
    checks.extend(link.map(|link| self::link(&link.counts, !status.has_device(), timer)));
    checks.extend(
        device
            .rig_friction
            .as_ref()
            .filter(|_| status.has_device())
            .map(|known| rig_friction(known, device)),
    );
    checks.extend(device.engage_refused.iter().map(refused));
    if !status.broken_bounds.is_empty() {
        let found = format!("{} breaks bounds: {}", status.scene, status.broken_bounds.join(", "));
        checks.push(Check::warn("scene", found, "see `haptic-ctl advise`"));
    }
    checks
}

/// The state of the rig, and `waiting`, why it has no device.
fn state(state: RigState, what: String, fault: Option<&str>, waiting: Option<&str>) -> Check {
    match state {
        RigState::Faulted | RigState::Stopped if let Some(why) = waiting => Check::fail(
            "rig",
            format!("{what}, and there is no device: {why}"),
            "mend what it says, then `haptic-ctl reset`; `haptic-ctl devices` lists what is plugged in",
        ),
        RigState::Faulted => {
            let why = fault.unwrap_or("for no known reason");
            let what = format!("{what}: {why}");
            if why.starts_with("still_enabled") {
                Check::fail(
                    "rig",
                    what,
                    "cut the motor's power; then mend or replace the device, and `haptic-ctl reset`",
                )
            } else {
                Check::warn("rig", what, "`haptic-ctl reset`")
            }
        }
        RigState::Stopped => Check::warn("rig", what, "`haptic-ctl reset`"),
        RigState::Disconnected => {
            let why = waiting.unwrap_or("no sample comes");
            let remedy = if why.contains("is not there") {
                "plug it in, and see `haptic-ctl devices`"
            } else {
                "mend what it says; `haptic-ctl devices` lists what is plugged in"
            };
            Check::fail("rig", format!("{what}: {why}"), remedy)
        }
        _ => Check::ok("rig", what),
    }
}

/// A reason why the rig would not engage.
fn refused(problem: &Problem) -> Check {
    Check::fail("engage", problem.what.clone(), problem.remedy.clone())
}

/// What is known of the rig's own friction.
fn rig_friction(known: &RigFrictionStatus, device: &DeviceStatus) -> Check {
    let remedy = if device.axes > 1 {
        "`haptic-ctl commission --motor` 1 and 2 measure it"
    } else {
        "`haptic-ctl identify --rig` measures it with the rig's own motor"
    };
    if let Some(problem) = &known.problem {
        return Check::warn("rig friction", problem.clone(), remedy);
    }
    // The rig in the daemon has what it says.
    let is_linked = device.link.is_some();
    if is_linked && known.friction_from == LossSource::Default && known.damping_from == LossSource::Default {
        return Check::skip("rig friction", format!("not known; {remedy}"));
    }
    Check::ok("rig friction", status::rig_friction(known))
}

/// How long a converter, such as FTDI's, collects bytes before it passes them on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct LatencyTimer {
    file: PathBuf,
    ms: u32,
}

impl LatencyTimer {
    /// That of the port which the daemon uses, where it is a port of this machine and has one.
    pub(super) fn of_used(found: &DevicesReply) -> Option<Self> {
        let used = found.devices.iter().find(|device| device.in_use)?;
        let (_, place) = used.address.split_once(':')?;
        let (node, _) = place.split_once('?').unwrap_or((place, ""));
        Self::of_node(Path::new("/sys/bus/usb-serial/devices"), Path::new(node))
    }

    fn of_node(ports: &Path, node: &Path) -> Option<Self> {
        let node = node.canonicalize().ok()?;
        let file = ports.join(node.file_name()?).join("latency_timer");
        let ms = std::fs::read_to_string(&file).ok()?.trim().parse().ok()?;
        Some(Self { file, ms })
    }
}

/// The quality of the link.
fn link(counts: &LinkCounts, is_gone: bool, timer: Option<&LatencyTimer>) -> Check {
    let found = format!(
        "{} samples, {} lost, {} late, {} with a bad CRC, {} malformed",
        counts.samples, counts.lost, counts.late, counts.bad_crc, counts.malformed
    );
    if is_gone {
        return Check::skip(
            "link",
            format!("no samples while the rig is disconnected; so far {found}"),
        );
    }
    // One in a thousand is felt.
    let many = |count: u64| count * 1000 > counts.samples;
    if many(counts.lost + counts.bad_crc + counts.malformed) {
        return Check::warn(
            "link",
            found,
            "try another cable and another port; `haptic-ctl status` shows whether it helped",
        );
    }
    if let Some(LatencyTimer { file, ms }) = timer
        && many(counts.late)
        && *ms > 1
    {
        let file = file.display();
        return Check::warn(
            "link",
            format!("{found}; they come in bursts, as the converter collects them for {ms} ms (its latency timer)"),
            format!(
                "`echo 1 | sudo tee {file}`; for ever with SUBSYSTEM==\"usb-serial\", DRIVER==\"ftdi_sio\", \
                 ATTR{{latency_timer}}=\"1\" in /etc/udev/rules.d/71-rig.rules"
            ),
        );
    }
    if many(counts.late) {
        return Check::warn(
            "link",
            found,
            "give the rig a port without a hub, and see the check of the real-time thread; `haptic-ctl status` shows \
             whether it helped",
        );
    }
    if counts.samples == 0 {
        return Check::warn("link", "no sample has come yet", "see `haptic-ctl status` in a second");
    }
    Check::ok("link", found)
}

/// The scheduling of the real-time thread, and what it lacks.
pub(super) fn thread(status: &Status) -> Vec<Check> {
    let thread = &status.real_time;
    if thread.problems.is_empty() {
        let found = format!("{}, {}, {}", thread.scheduling(), thread.place(), thread.memory());
        return vec![Check::ok("real-time thread", found)];
    }
    thread
        .problems
        .iter()
        .map(|problem| Check::warn("real-time thread", problem.what.clone(), problem.remedy.clone()))
        .collect()
}

/// The nodes of devices; those that are not the rig's may fail where it has one.
pub(super) fn devices(found: &DevicesReply, has_rig: bool) -> Vec<Check> {
    if found.devices.is_empty() {
        return vec![Check::ok("devices", "no serial line and no HID device is plugged in")];
    }
    found
        .devices
        .iter()
        .map(|device| {
            let state = match &device.problem {
                Some(problem) => problem.what.as_str(),
                None if device.in_use => "in use by the daemon",
                None => "not in use, and can be opened",
            };
            let is_other = has_rig && !device.in_use;
            let whose = if is_other { "; it is not this rig's" } else { "" };
            let found = format!("{}, {}: {state}{whose}", device.address, device.description);
            match &device.problem {
                Some(_) if is_other => Check::skip("device", found),
                Some(problem) => Check::warn("device", found, problem.remedy.clone()),
                None => Check::ok("device", found),
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::check::Level;
    use haptic_ipc::FoundDevice;

    #[test]
    fn one_lost_or_late_sample_in_a_thousand_is_a_warning() {
        let counts = |samples, late| LinkCounts {
            samples,
            late,
            ..LinkCounts::default()
        };
        let link = |counts, is_gone| link(&counts, is_gone, None);
        assert_eq!(link(counts(0, 0), true).level, Level::Skip);
        assert_eq!(link(counts(0, 0), false).level, Level::Warn);
        assert_eq!(link(counts(100_000, 99), false).level, Level::Ok);
        assert_eq!(link(counts(100_000, 101), false).level, Level::Warn);
    }

    #[test]
    fn a_faulted_rig_whose_device_is_gone_is_not_only_reset() {
        let fault = |why, waiting| state(RigState::Faulted, "faulted, a rig".to_owned(), Some(why), waiting);
        let gone = fault("stale", Some("/dev/ttyACM0 is not there"));
        assert!(
            gone.level == Level::Fail && gone.found.contains("is not there"),
            "{gone:?}"
        );
        assert_eq!(fault("stale", None).fix.as_deref(), Some("`haptic-ctl reset`"));
        let on = fault("still_enabled: the motor is on", None).fix;
        assert!(on.is_some_and(|fix| fix.contains("cut the motor's power")));
    }

    #[test]
    fn a_port_that_is_not_the_rigs_may_fail() {
        let level = |in_use, has_rig| {
            let port = FoundDevice {
                in_use,
                problem: Some(Problem {
                    what: "Permission denied".to_owned(),
                    remedy: "join the group".to_owned(),
                }),
                ..FoundDevice::default()
            };
            devices(&DevicesReply { devices: vec![port] }, has_rig)[0].level
        };
        assert_eq!(level(false, true), Level::Skip);
        assert_eq!((level(false, false), level(true, true)), (Level::Warn, Level::Warn));
    }

    #[test]
    fn bursts_of_a_converter_are_not_blamed_on_a_hub() {
        let folder = tempfile::tempdir().expect("a folder");
        let port = folder.path().join("ttyUSB0");
        std::fs::create_dir(&port).expect("a folder");
        let timer = |ms: &str| {
            std::fs::write(port.join("latency_timer"), ms).expect("a file");
            // The node itself has the name of its port.
            LatencyTimer::of_node(folder.path(), &port)
        };
        let late = LinkCounts {
            samples: 1600,
            late: 1400,
            ..LinkCounts::default()
        };
        let fix = |timer: Option<LatencyTimer>| link(&late, false, timer.as_ref()).fix.expect("a fix");
        let message = fix(timer("16\n"));
        assert!(
            message.contains("ttyUSB0/latency_timer") && message.contains("ATTR{latency_timer}"),
            "{message}"
        );
        assert!(!message.contains("hub"), "{message}");
        assert!(fix(timer("1\n")).contains("hub"));
        assert!(fix(LatencyTimer::of_node(folder.path(), folder.path())).contains("hub"));
        let few = LinkCounts { late: 0, ..late };
        assert_eq!(link(&few, false, timer("16").as_ref()).level, Level::Ok);
    }
}
