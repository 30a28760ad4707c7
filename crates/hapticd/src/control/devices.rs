//! `devices`: what is plugged in, and why one cannot be used.

use crate::control::RigHandle;
use device_io::Address;
use device_io::discovery::{Found, list, probe};
use device_io::link::ConnectError;
use haptic_ipc::{DevicesReply, ErrorCode, FoundDevice, LinkedDevice, Problem, WireError};
use std::time::Duration;

/// How long looking through the nodes may take.
const LIST_TIMEOUT: Duration = Duration::from_secs(2);

/// How long opening and greeting a device may take: a serial line is given more than two seconds to answer.
const PROBE_TIMEOUT: Duration = Duration::from_secs(4);

/// Lists what is plugged in, or asks one device who it is. Either may take a while, so a thread of its own does it.
///
/// # Errors
/// The address names no device, or this daemon uses it and nobody else may open it.
pub(super) async fn devices(rig: &RigHandle, asked: Option<String>) -> Result<DevicesReply, WireError> {
    let ours = rig.facts.address.clone();
    let done = match asked {
        None => {
            let look = move || list().iter().map(|found| one(found, &ours)).collect();
            rig.devices().run(LIST_TIMEOUT, look).await
        }
        Some(asked) => {
            let address: Address = asked
                .parse()
                .map_err(|error| WireError::new(ErrorCode::BadRequest, format!("{error}")).about("probe"))?;
            let name = address.to_string();
            let probed = rig.devices().run(PROBE_TIMEOUT, move || {
                // A path may lead anywhere, so it is not even looked at elsewhere.
                (!is_same(&address, &ours)).then(|| vec![greeted(&address)])
            });
            match probed.await {
                Ok(Some(told)) => Ok(told),
                Ok(None) => {
                    let message = format!("{name} is in use by this daemon: `status` shows what it answered");
                    return Err(WireError::new(ErrorCode::WrongState, message).about("probe"));
                }
                Err(error) => Err(error),
            }
        }
    };
    let devices =
        done.map_err(|error| WireError::new(ErrorCode::NotResponding, format!("looking for devices: {error}")))?;
    Ok(DevicesReply { devices })
}

/// Whether two addresses lead to the same device: links to a node may have many names.
fn is_same(address: &Address, other: &Address) -> bool {
    let node = |address: &Address| address.path().and_then(|path| path.canonicalize().ok());
    address == other || node(address).is_some_and(|here| node(other) == Some(here))
}

fn one(found: &Found, ours: &Address) -> FoundDevice {
    FoundDevice {
        address: found.address.to_string(),
        description: found.description.clone(),
        in_use: is_same(&found.address, ours),
        problem: found.obstacle.as_ref().map(|obstacle| Problem {
            what: obstacle.why.clone(),
            remedy: obstacle.remedy.clone(),
        }),
        device: None,
    }
}

fn greeted(address: &Address) -> FoundDevice {
    let mut told = FoundDevice {
        address: address.to_string(),
        ..FoundDevice::default()
    };
    match probe(address) {
        Ok(greeting) => {
            told.device = Some(LinkedDevice {
                firmware: greeting.firmware,
                force_limit_n: greeting.force_limit_n,
                sample_rate_hz: greeting.sample_rate_hz,
                resolution_m: greeting.resolution_m,
            });
        }
        Err(error) => {
            let what = error.to_string();
            let remedy = match error {
                ConnectError::Absent { .. } => "plug it in; `haptic-ctl devices` lists what is there".to_owned(),
                ConnectError::Refused { remedy, .. } => remedy,
                ConnectError::Protocol { .. } => "docs/device-protocol.md says what a firmware is to answer".to_owned(),
            };
            told.problem = Some(Problem { what, remedy });
        }
    }
    told
}
