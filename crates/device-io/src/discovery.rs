//! Every device that may be a rig: serial ports and HID devices, their identity, and whether this
//! process may open them.
//!
//! [`list`] opens nothing: many boards are reset when their port is opened, and a rig in use must
//! not notice. [`probe`] opens one device, on request.

use crate::address::{Address, DEFAULT_BAUD};
use crate::link::hid_node::{self, HidNode};
use crate::link::remedy;
use crate::link::{ConnectError, Connector, DeviceInfo, LinkCounters, LoopTiming};
use crate::usb_boards;
use rustix::fs::{Access, access};
use rustix::io::Errno;
use serialport::{SerialPortInfo, SerialPortType};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A device that may be a rig.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Candidate {
    /// Its address, for `--device`.
    pub address: Address,
    /// Its node.
    pub node: PathBuf,
    /// Its description, for people.
    pub description: String,
    /// Its identity, for a device on USB and a HID device.
    pub identity: Option<Identity>,
    /// Why it cannot be used at present.
    pub access_problem: Option<AccessProblem>,
}

/// The identity that a device reports.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Identity {
    /// USB vendor.
    pub vendor: u16,
    /// USB product.
    pub product: u16,
    /// Serial number.
    pub serial: Option<String>,
    /// Manufacturer.
    pub manufacturer: Option<String>,
    /// Product name.
    pub name: Option<String>,
}

/// Why a device cannot be used, and what to do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AccessProblem {
    /// Why.
    pub why: String,
    /// The remedy.
    pub remedy: String,
}

/// Links to serial ports by their identity. udev makes them, and they stay when the numbers of the
/// nodes change.
const BY_ID: &str = "/dev/serial/by-id";

/// Every serial port and every HID device, first those on USB, as most rigs are. Opens none of
/// them.
#[must_use]
pub fn list() -> Vec<Candidate> {
    // Without this folder serialport panics.
    let ports = if Path::new("/sys/class/tty").is_dir() {
        serialport::available_ports().unwrap_or_default()
    } else {
        Vec::new()
    };
    let links = links(Path::new(BY_ID));
    let mut found: Vec<Candidate> = ports
        .into_iter()
        .filter(|port| is_real(&port.port_name))
        .map(|port| serial(port, &links))
        .chain(hid_node::nodes().into_iter().map(hid_device))
        .collect();
    let users = users(Path::new("/proc"));
    for candidate in &mut found {
        if candidate.access_problem.is_none()
            && let Some(user) = users.get(&candidate.node)
        {
            candidate.access_problem = Some(AccessProblem {
                why: format!("{} is open in {user}", candidate.node.display()),
                remedy: if user.starts_with("hapticd ") {
                    "its rig is among those of `haptic-ctl --all status`".to_owned()
                } else {
                    "end that program; docs/how-to/ports.md keeps it away from the rig".to_owned()
                },
            });
        }
    }
    found.sort_by(|a, b| (a.identity.is_none(), &a.node).cmp(&(b.identity.is_none(), &b.node)));
    found
}

/// Asks a device who it is. It opens the device, which resets many boards, and takes up to 3 s.
///
/// # Errors
/// The device is not there, may not be opened, is in use, or does not speak the protocol.
pub fn probe(connector: &mut dyn Connector) -> Result<DeviceInfo, ConnectError> {
    // The loop matters only once it renders.
    let greeted = connector.connect(LoopTiming::default(), &Arc::new(LinkCounters::default()))?;
    Ok(greeted.device)
}

/// The links of a folder, each with its target.
fn links(folder: &Path) -> Vec<(PathBuf, PathBuf)> {
    let Ok(entries) = std::fs::read_dir(folder) else {
        return Vec::new();
    };
    let mut links: Vec<_> = entries
        .flatten()
        .filter_map(|entry| Some((entry.path().canonicalize().ok()?, entry.path())))
        .collect();
    links.sort();
    links
}

/// The nodes that other programs have open, each with one of them, as far as the kernel shows them to this user.
fn users(processes: &Path) -> HashMap<PathBuf, String> {
    let mut users = HashMap::new();
    let own = std::process::id().to_string();
    for process in std::fs::read_dir(processes).into_iter().flatten().flatten() {
        let (Some(id), folder) = (process.file_name().into_string().ok(), process.path()) else {
            continue;
        };
        if id == own || !id.bytes().all(|digit| digit.is_ascii_digit()) {
            continue;
        }
        let files = std::fs::read_dir(folder.join("fd")).into_iter().flatten().flatten();
        let nodes = files.filter_map(|file| file.path().read_link().ok().filter(|node| node.starts_with("/dev")));
        for node in nodes {
            let name = std::fs::read_to_string(folder.join("comm")).unwrap_or_default();
            users.insert(node, format!("{} (process {id})", name.trim_end()));
        }
    }
    users
}

/// The kernel has nodes for ports that the machine does not have. It says to the superuser which
/// these are.
fn is_real(node: &str) -> bool {
    let name = Path::new(node).file_name().unwrap_or_default();
    let kind = std::fs::read_to_string(Path::new("/sys/class/tty").join(name).join("type"));
    !kind.is_ok_and(|kind| kind.trim() == "0")
}

fn serial(port: SerialPortInfo, links: &[(PathBuf, PathBuf)]) -> Candidate {
    let node = PathBuf::from(port.port_name);
    let identity = match port.port_type {
        SerialPortType::UsbPort(usb) => Some(Identity {
            vendor: usb.vid,
            product: usb.pid,
            serial: text(usb.serial_number),
            manufacturer: text(usb.manufacturer),
            name: text(usb.product),
        }),
        _ => None,
    };
    let path = links
        .iter()
        .find(|(target, _)| *target == node)
        .map_or(&node, |(_, link)| link)
        .clone();
    Candidate {
        address: Address::Serial {
            path,
            baud: DEFAULT_BAUD,
        },
        description: describe("serial port", &node, identity.as_ref()),
        identity,
        access_problem: closed(&node, || remedy::serial_permission(&node)),
        node,
    }
}

fn hid_device(device: HidNode) -> Candidate {
    let identity = Identity {
        vendor: device.id.vendor,
        product: device.id.product,
        serial: device.id.serial.clone(),
        manufacturer: device.manufacturer,
        name: device.name,
    };
    let access_problem = match device.reports {
        Err(why) => Some(AccessProblem {
            why,
            remedy: "not a rig, or its firmware does not speak the link protocol: docs/device-protocol.md".to_owned(),
        }),
        Ok(_) => closed(&device.path, || remedy::hid_permission(&device.id)),
    };
    Candidate {
        address: Address::Hid(device.id),
        description: describe("HID device", &device.path, Some(&identity)),
        identity: Some(identity),
        access_problem,
        node: device.path,
    }
}

fn text(text: Option<String>) -> Option<String> {
    text.filter(|text| !text.is_empty())
}

/// Such as `Acme Slider (1209:0001, serial number 17), HID device /dev/hidraw0`, with the name of a known board.
fn describe(kind: &str, node: &Path, identity: Option<&Identity>) -> String {
    let mut description = String::new();
    if let Some(identity) = identity {
        let words = [&identity.manufacturer, &identity.name].into_iter().flatten();
        for word in words {
            description.push_str(word);
            description.push(' ');
        }
        description.push_str(&format!("({:04x}:{:04x}", identity.vendor, identity.product));
        if let Some(serial) = &identity.serial {
            description.push_str(&format!(", serial number {serial}"));
        }
        description.push_str("), ");
        if let Some(board) = usb_boards::named(identity.vendor, identity.product) {
            description.push_str(&format!("{}, ", board.name));
        }
    }
    description.push_str(&format!("{kind} {}", node.display()));
    description
}

/// Whether this process may open a node for reading and writing, without opening it.
fn closed(node: &Path, remedy: impl FnOnce() -> String) -> Option<AccessProblem> {
    let error = access(node, Access::READ_OK | Access::WRITE_OK).err()?;
    Some(AccessProblem {
        why: format!("{}: {error}", node.display()),
        remedy: match error {
            Errno::ACCESS | Errno::PERM => remedy(),
            // It was unplugged in the meantime, or is not passed on into this container.
            _ => "plug it in again; in a container, pass its node on".to_owned(),
        },
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::HidId;
    use serialport::UsbPortInfo;

    #[test]
    fn a_port_is_named_by_a_link_that_stays() {
        let folder = tempfile::tempdir().expect("a folder");
        let node = folder.path().canonicalize().expect("there").join("ttyACM0");
        std::fs::write(&node, "").expect("a file");
        let by_id = folder.path().join("by-id");
        std::fs::create_dir(&by_id).expect("a folder");
        let stays = by_id.join("usb-Acme_Slider_17-if00");
        std::os::unix::fs::symlink(&node, &stays).expect("a link");
        let usb = |vid, pid, words: [Option<&str>; 3]| {
            let [serial_number, manufacturer, product] = words.map(|word| word.map(str::to_owned));
            SerialPortType::UsbPort(UsbPortInfo {
                vid,
                pid,
                serial_number,
                manufacturer,
                product,
            })
        };
        let slider = usb(0x1209, 1, [Some("17"), Some("Acme"), Some("Slider")]);
        let clone = usb(0x1A86, 0x7523, [None, None, Some("USB Serial")]);
        let linked = links(&by_id);
        let converter = "USB Serial (1a86:7523), CH340 converter, as on clones of Uno and Nano, ";
        for (port_type, links, path, described) in [
            (slider, &linked, &stays, "Acme Slider (1209:0001, serial number 17), "),
            (clone, &Vec::new(), &node, converter),
            (SerialPortType::PciPort, &links(&folder.path().join("none")), &node, ""),
        ] {
            let port_name = node.to_string_lossy().into_owned();
            let found = serial(SerialPortInfo { port_name, port_type }, links);
            assert_eq!(
                found.address.to_string(),
                format!("serial:{}?baud=1000000", path.display())
            );
            assert_eq!(found.description, format!("{described}serial port {}", node.display()));
            assert_eq!(found.identity.is_none(), described.is_empty());
            assert_eq!(found.access_problem, None);
        }
    }

    #[test]
    fn a_node_that_another_program_has_open_names_it() {
        let folder = tempfile::tempdir().expect("a folder");
        for (id, node) in [
            ("77", "/dev/ttyACM0"),
            ("78", "/home/ada/notes"),
            ("self", "/dev/ttyACM1"),
        ] {
            let process = folder.path().join(id);
            std::fs::create_dir_all(process.join("fd")).expect("a folder");
            std::fs::write(process.join("comm"), "ModemManager\n").expect("a file");
            std::os::unix::fs::symlink(node, process.join("fd/3")).expect("a link");
        }
        let found: Vec<_> = users(folder.path()).into_iter().collect();
        let user = "ModemManager (process 77)".to_owned();
        assert_eq!(found, [("/dev/ttyACM0".into(), user)]);
    }

    #[test]
    fn a_hid_device_that_cannot_be_a_rig_says_why() {
        let id = HidId {
            vendor: 0x046D,
            product: 0xC31C,
            serial: None,
        };
        let found = hid_device(HidNode {
            path: "/dev/hidraw-none".into(),
            id: id.clone(),
            manufacturer: None,
            name: Some("Keyboard".to_owned()),
            reports: Err("its reports are too short".to_owned()),
        });
        assert_eq!(found.address, Address::Hid(id));
        assert_eq!(found.description, "Keyboard (046d:c31c), HID device /dev/hidraw-none");
        let problem = found.access_problem.expect("it is none");
        assert_eq!(problem.why, "its reports are too short");
    }

    #[test]
    fn a_node_that_may_not_be_opened_says_how_to_mend_that() {
        let folder = tempfile::tempdir().expect("a folder");
        let node = folder.path().join("hidraw0");
        let remedy = || "the remedy".to_owned();
        let gone = closed(&node, remedy).expect("it is not there");
        assert!(gone.why.contains("hidraw0"), "{gone:?}");
        assert!(gone.remedy.contains("plug it in"), "{gone:?}");
        std::fs::write(&node, "").expect("a file");
        assert_eq!(closed(&node, remedy), None);
        if rustix::process::geteuid().is_root() {
            test_run::skip("an ordinary user", "the superuser may open everything");
            return;
        }
        std::fs::set_permissions(&node, std::os::unix::fs::PermissionsExt::from_mode(0o400)).expect("ours");
        assert_eq!(closed(&node, remedy).expect("not for writing").remedy, "the remedy");
    }

    #[test]
    fn what_is_there_is_listed_without_harm() {
        for found in list() {
            assert_eq!(found.address.to_string().parse(), Ok(found.address));
        }
    }
}
