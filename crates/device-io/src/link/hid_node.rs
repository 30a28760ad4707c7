//! The HID devices of this machine by vendor, product and serial number, since the numbers of their
//! nodes change; and the opening of a node.

use super::connector::ConnectError;
use super::remedy;
use super::reports::Reports;
use rustix::fd::OwnedFd;
use rustix::fs::{FlockOperation, Mode, OFlags, flock, open};
use rustix::io::Errno;
use std::fmt;
use std::path::{Path, PathBuf};

/// The identity of a HID device.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HidId {
    /// USB vendor.
    pub vendor: u16,
    /// USB product.
    pub product: u16,
    /// Its serial number; without one there must be only one device of its kind.
    pub serial: Option<String>,
}

impl fmt::Display for HidId {
    /// As in an address: `VID:PID[:SERIAL]`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:04x}:{:04x}", self.vendor, self.product)?;
        match &self.serial {
            Some(serial) => write!(f, ":{serial}"),
            None => Ok(()),
        }
    }
}

/// The node of a HID device.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct HidNode {
    pub(crate) path: PathBuf,
    pub(crate) id: HidId,
    pub(crate) manufacturer: Option<String>,
    pub(crate) name: Option<String>,
    /// The lengths of its reports, or why it cannot be a rig.
    pub(crate) reports: Result<Reports, String>,
}

/// All nodes of HID devices.
pub(crate) fn nodes() -> Vec<HidNode> {
    // It reads the kernel's tables in /sys and opens no device; without those tables there are no
    // devices.
    let Ok(found) = hidapi::HidApi::new() else {
        return Vec::new();
    };
    let text = |text: Option<&str>| text.filter(|text| !text.is_empty()).map(str::to_owned);
    let mut nodes: Vec<HidNode> = Vec::new();
    for device in found.device_list() {
        let path = PathBuf::from(device.path().to_string_lossy().into_owned());
        // A device with several collections is listed once for each.
        if nodes.iter().any(|node| node.path == path) {
            continue;
        }
        nodes.push(HidNode {
            id: HidId {
                vendor: device.vendor_id(),
                product: device.product_id(),
                serial: text(device.serial_number()),
            },
            manufacturer: text(device.manufacturer_string()),
            name: text(device.product_string()),
            reports: reports(&path),
            path,
        });
    }
    nodes
}

/// From the descriptor that the kernel has read.
fn reports(node: &Path) -> Result<Reports, String> {
    let name = node.file_name().unwrap_or_default();
    let path = Path::new("/sys/class/hidraw")
        .join(name)
        .join("device/report_descriptor");
    let descriptor = std::fs::read(&path).map_err(|error| format!("{}: {error}", path.display()))?;
    Reports::of(&descriptor)
}

/// Chooses the node of a device, and says the lengths of its reports. A device may have several interfaces, of which
/// only one can carry the protocol.
pub(super) fn choose(nodes: Vec<HidNode>, id: &HidId) -> Result<(HidNode, Reports), ConnectError> {
    let matching = nodes
        .into_iter()
        .filter(|node| (node.id.vendor, node.id.product) == (id.vendor, id.product))
        .filter(|node| id.serial.is_none() || id.serial == node.id.serial);
    let mut fit = Vec::new();
    let mut unfit = None;
    for node in matching {
        match &node.reports {
            Ok(reports) => fit.push((node.clone(), *reports)),
            Err(why) => unfit = Some(why.clone()),
        }
    }
    match (fit.len(), unfit) {
        (1, _) => Ok(fit.remove(0)),
        (0, None) => Err(ConnectError::Absent { what: what(id) }),
        (0, Some(why)) => Err(ConnectError::Protocol {
            what: what(id),
            problem: why,
        }),
        (count, _) => {
            let paths: Vec<String> = fit.iter().map(|(node, _)| node.path.display().to_string()).collect();
            Err(ConnectError::Refused {
                what: what(id),
                why: format!("there are {count}: {}", paths.join(", ")),
                remedy: format!(
                    "name one by its serial number, hid:{:04x}:{:04x}:SERIAL, or unplug the others",
                    id.vendor, id.product
                ),
            })
        }
    }
}

pub(super) fn what(id: &HidId) -> String {
    format!("HID device {id}")
}

/// Opens a node for this process alone, as far as other processes respect a lock.
pub(super) fn open_node(path: &Path, id: &HidId) -> Result<OwnedFd, ConnectError> {
    let refused = |error: Errno, remedy: String| ConnectError::Refused {
        what: path.display().to_string(),
        why: error.to_string(),
        remedy,
    };
    let flags = OFlags::RDWR | OFlags::NONBLOCK | OFlags::CLOEXEC;
    let node = open(path, flags, Mode::empty()).map_err(|error| match error {
        Errno::NOENT | Errno::NODEV | Errno::NXIO => ConnectError::Absent { what: what(id) },
        Errno::ACCESS | Errno::PERM => refused(error, remedy::hid_permission(id)),
        _ => refused(error, "unplug it and plug it in again".to_owned()),
    })?;
    // The kernel lets another process open it as well; two hosts would take each other's answers
    // for their own.
    flock(&node, FlockOperation::NonBlockingLockExclusive).map_err(|error| refused(error, remedy::busy(path)))?;
    Ok(node)
}

#[cfg(test)]
mod tests {
    use super::*;

    const REPORTS: Reports = Reports { input: 64, output: 64 };

    fn node(path: &str, serial: Option<&str>, reports: Result<Reports, &str>) -> HidNode {
        HidNode {
            path: path.into(),
            id: HidId {
                vendor: 0x1209,
                product: 0x0001,
                serial: serial.map(str::to_owned),
            },
            manufacturer: None,
            name: None,
            reports: reports.map_err(str::to_owned),
        }
    }

    #[test]
    fn a_device_is_chosen_by_what_it_says_of_itself() {
        let id = |serial: Option<&str>| node("", serial, Ok(REPORTS)).id;
        let mut other = node("/dev/hidraw9", None, Ok(REPORTS));
        other.id.product = 2;
        let keyboard = node("/dev/hidraw0", Some("A"), Err("too short"));
        let rig = node("/dev/hidraw1", Some("A"), Ok(REPORTS));
        let nodes = vec![keyboard.clone(), rig.clone(), other.clone()];
        let chosen = Ok((rig, REPORTS));
        let found = choose(nodes.clone(), &id(None));
        assert_eq!(found, chosen, "its other interface is not meant");
        assert_eq!(choose(nodes.clone(), &id(Some("A"))), chosen);
        let absent = |id: &HidId| ConnectError::Absent { what: what(id) };
        assert_eq!(choose(nodes.clone(), &id(Some("B"))), Err(absent(&id(Some("B")))));
        assert_eq!(choose(vec![other], &id(None)), Err(absent(&id(None))));
        assert!(matches!(choose(vec![keyboard], &id(None)),
                Err(ConnectError::Protocol { problem, .. }) if problem == "too short"));
        let mut two = nodes;
        two.push(node("/dev/hidraw2", Some("B"), Ok(REPORTS)));
        assert_eq!(choose(two.clone(), &id(Some("A"))), chosen);
        let Err(ConnectError::Refused { why, remedy, .. }) = choose(two, &id(None)) else {
            panic!("which one?");
        };
        assert!(why.contains("/dev/hidraw1, /dev/hidraw2"), "{why}");
        assert!(remedy.contains("hid:1209:0001:SERIAL"), "{remedy}");
    }

    #[test]
    fn second_opening_of_hid_node_is_refused_with_remedy() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("hidraw0");
        let id = node("", None, Ok(REPORTS)).id;
        let absent = ConnectError::Absent { what: what(&id) };
        assert_eq!(open_node(&path, &id).map(drop), Err(absent));
        std::fs::write(&path, "").expect("a file");
        let first = open_node(&path, &id).expect("it is there");
        let Err(ConnectError::Refused { remedy, .. }) = open_node(&path, &id) else {
            panic!("it is in use");
        };
        assert!(remedy.contains("fuser -v"), "{remedy}");
        drop(first);
        open_node(&path, &id).expect("nobody has it any more");
    }
}
