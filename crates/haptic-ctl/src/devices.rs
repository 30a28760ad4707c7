//! `devices`: what is plugged in, and why one cannot be used.

use crate::daemon::Daemon;
use crate::failure::Failure;
use crate::{output, progress};
use device_io::discovery::{self, Candidate};
use haptic_ipc::{DevicesReply, FoundDevice, LinkedDevice, ProbedMotors, Problem, Request};

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Identify the device at ADDRESS; this resets many boards
    #[arg(long, value_name = "ADDRESS")]
    probe: Option<String>,
}

impl Arguments {
    /// Whether a daemon must do it, with its devices and what it knows of them.
    pub(crate) fn needs_daemon(&self) -> bool {
        self.probe.is_some()
    }

    pub(crate) fn request(&self) -> Request {
        Request::Devices {
            probe: self.probe.clone(),
        }
    }
}

pub(crate) async fn run(daemon: &mut Daemon, request: Request, json: bool) -> Result<(), Failure> {
    let asking = matches!(request, Request::Devices { probe: Some(_) });
    let bar = asking.then(|| progress::busy("identifying the device"));
    let answered = daemon.ask(request).await;
    if let Some(bar) = bar {
        bar.finish_and_clear();
    }
    let reply: DevicesReply = answered?;
    let unanswered = asking.then(|| unanswered(&reply)).flatten();
    show(&reply, json)?;
    unanswered.map_or(Ok(()), |why| Err(Failure::NoDevice(why)))
}

/// Lists the devices as this user sees them, where no daemon is asked.
pub(crate) fn run_here(json: bool) -> Result<(), Failure> {
    show(&found_here(), json)
}

pub(crate) fn found_here() -> DevicesReply {
    let listed = |found: Candidate| FoundDevice {
        address: found.address.to_string(),
        description: found.description,
        problem: found.access_problem.map(|access_problem| Problem {
            what: access_problem.why,
            remedy: access_problem.remedy,
        }),
        ..FoundDevice::default()
    };
    DevicesReply {
        devices: discovery::list().into_iter().map(listed).collect(),
    }
}

fn show(reply: &DevicesReply, json: bool) -> Result<(), Failure> {
    if json {
        return output::json(reply);
    }
    if reply.devices.is_empty() {
        return output::line("no serial line and no HID device is plugged in");
    }
    for device in &reply.devices {
        for line in lines(device) {
            output::line(&line)?;
        }
    }
    Ok(())
}

/// Why the probed device has not identified itself.
fn unanswered(reply: &DevicesReply) -> Option<String> {
    let asked = reply.devices.first()?;
    if asked.device.is_some() {
        return None;
    }
    let why = asked.problem.as_ref().map_or("no answer", |problem| &problem.what);
    Some(format!("{} has not identified itself: {why}", asked.address))
}

/// A count and the largest effort of each motor.
fn motors(two: Option<ProbedMotors>, answered: &LinkedDevice) -> String {
    let motor = |count: f64, limit: f64, (count_unit, limit_unit): (&str, &str)| {
        format!("{:.3} {count_unit} a count, up to {limit} {limit_unit}", count * 1e6)
    };
    let linear = ("um", "N");
    let Some(ProbedMotors {
        are_rotary,
        counts,
        limits,
    }) = two
    else {
        return motor(answered.resolution_m, answered.force_limit_n, linear);
    };
    let units = if are_rotary { ("urad", "N m") } else { linear };
    let [first, second] = [0, 1].map(|index| motor(counts[index], limits[index], units));
    format!("motor 1 with {first}, motor 2 with {second}")
}

fn lines(device: &FoundDevice) -> Vec<String> {
    let mut lines = vec![device.address.clone()];
    let mut add = |text: String| lines.push(format!("    {text}"));
    if !device.description.is_empty() {
        add(device.description.clone());
    }
    if device.in_use {
        add("in use by this daemon".to_owned());
    }
    if let Some(answered) = &device.device {
        add(format!(
            "{}: {:.0} samples/s, {}",
            answered.firmware,
            answered.sample_rate_hz,
            motors(device.motors, answered)
        ));
    }
    if let Some(friction) = &device.rig_friction {
        let least = friction.losses();
        add(format!(
            "identified friction: at least {:.3} N and {:.3} N s/m, moving mass {:.3} kg",
            least.friction, least.damping, friction.mass
        ));
    }
    if let Some(problem) = &device.problem {
        add(problem.what.clone());
        add(format!("fix: {}", problem.remedy));
    }
    lines
}
