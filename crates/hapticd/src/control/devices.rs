//! `devices`: lists the devices that are plugged in, and what keeps each from use.

use crate::control::rig::known_rig::KnownRig;
use crate::telemetry::link::linked;
use device_boards::Address;
use device_io::discovery::{Candidate, list, probe};
use device_io::link::ConnectError;
use haptic_ipc::{DevicesReply, ErrorCode, FoundDevice, ProbedMotors, Problem, WireError};
use std::time::Duration;

/// Timeout of a search through the nodes.
const LIST_TIMEOUT: Duration = Duration::from_secs(2);

/// Timeout of opening and greeting a device: a serial device has more than two seconds to answer.
const PROBE_TIMEOUT: Duration = Duration::from_secs(4);

/// Lists the devices that are plugged in, or greets one device. Either may block, so a worker
/// thread does it.
///
/// # Errors
/// The address names no device, or this daemon uses it and nobody else may open it.
pub(super) async fn devices(rig: &KnownRig, asked: Option<String>) -> Result<DevicesReply, WireError> {
    let ours = rig.facts.address.clone();
    let done = match asked {
        None => {
            let look = move || list().iter().map(|found| listed(found, &ours)).collect();
            rig.searches.run(LIST_TIMEOUT, look).await
        }
        Some(asked) => {
            let address: Address = asked
                .parse()
                .map_err(|error| WireError::new(ErrorCode::BadRequest, format!("{error}")).about("probe"))?;
            let name = address.to_string();
            let probed = rig.searches.run(PROBE_TIMEOUT, move || {
                // A path may lead anywhere, so files outside /dev are not even looked up.
                (!is_same(&address, &ours)).then(|| vec![probed(&address)])
            });
            match probed.await {
                Ok(Some(found)) => Ok(found),
                Ok(None) => {
                    let message = format!("{name} is in use by this daemon: `status` shows what it answered");
                    return Err(WireError::new(ErrorCode::WrongState, message).about("probe"));
                }
                Err(error) => Err(error),
            }
        }
    };
    let mut devices =
        done.map_err(|error| WireError::new(ErrorCode::NotResponding, format!("looking for devices: {error}")))?;
    for found in &mut devices {
        if let Some(key) = found.device.as_ref().and_then(|device| device.rig.clone()) {
            found.rig_friction = rig.frictions.of_other(&key).await;
        }
    }
    Ok(DevicesReply { devices })
}

/// Whether two addresses lead to the same device: links to a node may have many names.
fn is_same(address: &Address, other: &Address) -> bool {
    let node = |address: &Address| address.path().and_then(|path| path.canonicalize().ok());
    address == other || node(address).is_some_and(|here| node(other) == Some(here))
}

fn listed(found: &Candidate, ours: &Address) -> FoundDevice {
    FoundDevice {
        address: found.address.to_string(),
        description: found.description.clone(),
        in_use: is_same(&Address::Native(found.address.clone()), ours),
        problem: found.access_problem.as_ref().map(|access_problem| Problem {
            what: access_problem.why.clone(),
            remedy: access_problem.remedy.clone(),
        }),
        ..FoundDevice::default()
    }
}

fn probed(address: &Address) -> FoundDevice {
    let greeted = match address.connector() {
        Some(mut connector) => probe(&mut *connector),
        None => Err(ConnectError::Refused {
            what: address.to_string(),
            why: "it is simulated inside the daemon".to_owned(),
            remedy: "no link to probe; `fake-rig` simulates a device behind a serial line".to_owned(),
        }),
    };
    let found = FoundDevice {
        address: address.to_string(),
        ..FoundDevice::default()
    };
    match greeted {
        Ok(facts) => {
            let motors = facts.motors.map(|motors| ProbedMotors {
                are_rotary: motors.are_rotary,
                counts: motors.counts,
                limits: motors.limits,
            });
            FoundDevice {
                device: Some(linked(facts)),
                motors,
                ..found
            }
        }
        Err(error) => FoundDevice {
            problem: Some(problem(&error)),
            ..found
        },
    }
}

fn problem(error: &ConnectError) -> Problem {
    Problem {
        what: error.to_string(),
        remedy: error.remedy().to_owned(),
    }
}
