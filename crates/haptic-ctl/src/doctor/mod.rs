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
use crate::{devices, hint, output};
use check::{Check, Level};
use haptic_ipc::socket_path::{self, NamedSocket};
use haptic_ipc::{ClientError, DevicesReply, Request, Status};
use serde_json::{Value, json};
use std::path::Path;

pub(crate) async fn run(socket: Option<&Path>, json: bool) -> Result<(), Failure> {
    let checks = checks(&socket_path::for_client(socket)).await;
    if json {
        output::json(&as_json(&checks))?;
    } else {
        show(&checks, None)?;
    }
    outcome(&checks)
}

/// Checks every rig, one after the other, each under its name.
pub(crate) async fn run_all(sockets: Vec<NamedSocket>, json: bool) -> Result<(), Failure> {
    let (mut all, mut answers) = (Vec::new(), Vec::new());
    for rig in sockets {
        let checks = checks(&rig.path).await;
        if json {
            answers.push(json!({ "rig": rig.name, "socket": rig.path, "doctor": as_json(&checks) }));
        } else {
            output::line(&rig.name)?;
            show(&checks, Some(&rig))?;
        }
        all.extend(checks);
    }
    if json {
        output::json(&answers)?;
    }
    outcome(&all)
}

async fn checks(path: &Path) -> Vec<Check> {
    let mut checks = Vec::new();
    let mut status = None;
    match Daemon::connect(Some(path)).await {
        Ok(mut daemon) => {
            checks.push(socket::served(path, daemon.hello().rights));
            checks.push(permission::permission(path, None));
            checks.push(socket::version(&daemon.hello().server));
            let found_devices = daemon.ask::<DevicesReply>(Request::Devices { probe: None }).await;
            let timer = found_devices.as_ref().ok().and_then(rig::LatencyTimer::of_used);
            match daemon.ask::<Status>(Request::Status {}).await {
                Ok(found) => {
                    checks.extend(rig::rig(&found, timer.as_ref()));
                    checks.extend(rig::thread(&found));
                    status = Some(found);
                }
                Err(failure) => checks.push(Check::fail("daemon", failure.to_string(), socket::fix(path, &failure))),
            }
            match found_devices {
                Ok(found) => checks.extend(rig::devices(&found, status.as_ref().is_some_and(Status::has_device))),
                Err(failure) => checks.push(Check::warn("devices", failure.to_string(), "see `haptic-ctl devices`")),
            }
        }
        Err(failure) => {
            checks.push(socket::unreachable(path, &failure));
            checks.push(permission::permission(path, Some(&failure)));
            // Behind a socket that is closed or silent a daemon has them.
            if matches!(failure, Failure::Client(ClientError::NoDaemon { .. })) {
                checks.extend(rig::devices(&devices::found_here(), false));
                checks.extend(machine::limits());
            }
        }
    }
    checks.push(machine::governor());
    checks.push(machine::isolation(status.as_ref()));
    checks
}

/// Prints the checks, and their fixes as commands for this rig, where it is one of many.
fn show(checks: &[Check], rig: Option<&NamedSocket>) -> Result<(), Failure> {
    let addressed = |text: &str| rig.map_or(text.into(), |rig| hint::for_rig(text, rig));
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
            addressed(&check.found)
        ))?;
        if let Some(fix) = &check.fix {
            output::line(&format!("      {}", addressed(fix)))?;
        }
    }
    Ok(())
}

fn as_json(checks: &[Check]) -> Value {
    json!({ "checks": checks, "failed": failed(checks) })
}

fn failed(checks: &[Check]) -> usize {
    checks.iter().filter(|check| check.level == Level::Fail).count()
}

fn outcome(checks: &[Check]) -> Result<(), Failure> {
    match failed(checks) {
        0 => Ok(()),
        _ => Err(Failure::Silent(1)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn doctor_of_all_rigs_fails_where_one_fails() {
        let folder = tempfile::tempdir().expect("a folder");
        let sockets: Vec<NamedSocket> = ["left", "right"]
            .map(|name| NamedSocket {
                name: name.to_owned(),
                path: folder.path().join(name),
            })
            .into();
        for json in [false, true] {
            let outcome = run_all(sockets.clone(), json).await;
            assert!(matches!(outcome, Err(Failure::Silent(1))), "{outcome:?}");
        }
    }
}
