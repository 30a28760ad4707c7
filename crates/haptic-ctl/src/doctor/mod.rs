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
use std::borrow::Cow;
use std::path::Path;

pub(crate) async fn run(socket: Option<&Path>, json: bool) -> Result<(), Failure> {
    let checks = checks(&socket_path::for_client(socket), hint::addressed).await;
    if json {
        output::json(&as_json(&checks))?;
    } else {
        show(&checks)?;
    }
    outcome(&checks)
}

/// Checks every rig, one after the other, each under its name.
pub(crate) async fn run_all(sockets: Vec<NamedSocket>, json: bool) -> Result<(), Failure> {
    let (mut all, mut answers) = (Vec::new(), Vec::new());
    for rig in sockets {
        let checks = checks(&rig.path, |text| hint::for_rig(text, &rig).into()).await;
        if json {
            answers.push(json!({ "rig": rig.name, "socket": rig.path, "doctor": as_json(&checks) }));
        } else {
            output::line(&rig.name)?;
            show(&checks)?;
        }
        all.extend(checks);
    }
    if json {
        output::json(&answers)?;
    }
    outcome(&all)
}

/// The checks of a rig; `addressed` makes commands in a text those for this rig.
async fn checks(path: &Path, addressed: impl Fn(&str) -> Cow<'_, str>) -> Vec<Check> {
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
    for check in &mut checks {
        check.found = addressed(&check.found).into_owned();
        check.fix = check.fix.take().map(|fix| addressed(&fix).into_owned());
    }
    checks
}

fn show(checks: &[Check]) -> Result<(), Failure> {
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
