//! `doctor`: checks everything between a person and the rig, each with the command that fixes it.
//! Works without a daemon.

mod check;
mod machine;
mod permission;
mod rig;
mod socket;

use crate::console::{self, BAD, DOUBTFUL, GOOD};
use crate::daemon::Daemon;
use crate::failure::Failure;
use crate::{devices, output};
use check::{Check, Level};
use haptic_ipc::{DevicesReply, Request, Status, socket_path};
use std::path::Path;

pub(crate) async fn run(socket: Option<&Path>, json: bool) -> Result<(), Failure> {
    let path = socket_path::for_client(socket);
    let mut checks = Vec::new();
    let mut status = None;
    match Daemon::connect(Some(&path)).await {
        Ok(mut daemon) => {
            checks.push(socket::served(&path, daemon.hello().rights));
            checks.push(permission::permission(&path, None));
            checks.push(socket::version(&daemon.hello().server));
            let found_devices = daemon.ask::<DevicesReply>(Request::Devices { probe: None }).await;
            let timer = found_devices.as_ref().ok().and_then(rig::LatencyTimer::of_used);
            match daemon.ask::<Status>(Request::Status {}).await {
                Ok(found) => {
                    checks.extend(rig::rig(&found, timer.as_ref()));
                    checks.extend(rig::thread(&found));
                    status = Some(found);
                }
                Err(failure) => checks.push(Check::fail("daemon", failure.to_string(), socket::fix(&failure))),
            }
            match found_devices {
                Ok(found) => checks.extend(rig::devices(&found)),
                Err(failure) => checks.push(Check::warn("devices", failure.to_string(), "see `haptic-ctl devices`")),
            }
        }
        Err(failure) => {
            checks.push(socket::unreachable(&path, &failure));
            checks.push(permission::permission(&path, Some(&failure)));
            checks.extend(rig::devices(&devices::found_here()));
            checks.extend(machine::limits());
        }
    }
    checks.push(machine::governor());
    checks.push(machine::isolation(status.as_ref()));
    show(&checks, json)
}

fn show(checks: &[Check], json: bool) -> Result<(), Failure> {
    let failed = checks.iter().filter(|check| check.level == Level::Fail).count();
    if json {
        output::json(&serde_json::json!({ "checks": checks, "failed": failed }))?;
    } else {
        for check in checks {
            let (word, style) = match check.level {
                Level::Ok => ("ok  ", GOOD),
                Level::Skip => ("skip", DOUBTFUL),
                Level::Warn => ("warn", DOUBTFUL),
                Level::Fail => ("fail", BAD),
            };
            output::line(&format!(
                "{}  {}: {}",
                console::paint(word, style),
                check.check,
                check.found
            ))?;
            if let Some(fix) = &check.fix {
                output::line(&format!("      {fix}"))?;
            }
        }
    }
    if failed > 0 { Err(Failure::Silent(1)) } else { Ok(()) }
}
