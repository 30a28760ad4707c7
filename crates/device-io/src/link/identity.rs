//! The identity of a rig beyond one connection: the results of its commissioning are stored under
//! it.

use std::path::{Path, PathBuf};

/// The identity of a rig.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RigIdentity {
    /// The same for the same rig at every connection: `usb-1209:0001-17` by its serial number, else
    /// by its path, as in `serial-/dev/ttyUSB0`.
    pub key: String,
    /// Whether the key contains a serial number; otherwise another device at the same path has the
    /// same key.
    pub has_serial_number: bool,
    /// Whether the address inverts force and position.
    pub reversed: bool,
}

/// The kernel's table of the devices behind terminals.
const TERMINALS: &str = "/sys/class/tty";

/// Longest text of the kernel that is read, bytes; a USB string has at most 126 letters.
const LONGEST_TEXT: usize = 256;

impl RigIdentity {
    /// The identity of a device on a serial line, by its path.
    #[must_use]
    pub fn of_line(kind: &str, path: &Path) -> Self {
        Self::of_line_in(Path::new(TERMINALS), kind, path)
    }

    fn of_line_in(terminals: &Path, kind: &str, path: &Path) -> Self {
        if let Some(key) = usb_key(terminals, path) {
            return Self {
                key,
                has_serial_number: true,
                reversed: false,
            };
        }
        // The path of the address, not its target: a link by the device's name stays when the
        // numbers of the nodes change.
        let path = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
        Self {
            key: format!("{kind}-{}", path.display()),
            has_serial_number: false,
            reversed: false,
        }
    }

    /// The identity of a device on USB.
    pub(crate) fn of_usb(vendor: u16, product: u16, serial: Option<&str>) -> Self {
        match serial {
            Some(serial) => Self {
                key: format!("usb-{vendor:04x}:{product:04x}-{serial}"),
                has_serial_number: true,
                reversed: false,
            },
            None => Self {
                key: format!("hid-{vendor:04x}:{product:04x}"),
                has_serial_number: false,
                reversed: false,
            },
        }
    }

    /// The same for one of its motors, by number or letter.
    #[must_use]
    pub fn with_part(mut self, part: &str) -> Self {
        self.key.push('-');
        self.key.push_str(part);
        self
    }

    /// The same with force and position inverted, or not.
    #[must_use]
    pub fn turned_round(mut self, reversed: bool) -> Self {
        self.reversed = reversed;
        self
    }
}

/// The key of the USB device behind a terminal, where it has a serial number.
fn usb_key(terminals: &Path, path: &Path) -> Option<String> {
    let node = path.canonicalize().ok()?;
    let device: PathBuf = terminals.join(node.file_name()?).join("device").canonicalize().ok()?;
    let usb = device.ancestors().find(|folder| folder.join("idVendor").is_file())?;
    let text = |name: &str| {
        let text = std::fs::read_to_string(usb.join(name)).ok()?;
        let text = text.trim();
        (!text.is_empty() && text.len() <= LONGEST_TEXT).then(|| text.to_owned())
    };
    Some(format!(
        "usb-{}:{}-{}",
        text("idVendor")?,
        text("idProduct")?,
        text("serial")?
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn a_line_on_usb_goes_by_its_serial_number_and_another_by_its_path() {
        let folder = tempfile::tempdir().expect("a folder");
        let root = folder.path();
        let usb = root.join("devices/usb1/1-1");
        let interface = usb.join("1-1:1.0");
        fs::create_dir_all(&interface).expect("folders");
        for (name, text) in [("idVendor", "1209\n"), ("idProduct", "0001\n"), ("serial", "17 b\n")] {
            fs::write(usb.join(name), text).expect("a file");
        }
        let terminals = root.join("class/tty");
        fs::create_dir_all(terminals.join("ttyACM0")).expect("a folder");
        std::os::unix::fs::symlink(&interface, terminals.join("ttyACM0/device")).expect("a link");
        let node = root.join("ttyACM0");
        fs::write(&node, "").expect("a node");
        let link = root.join("rig");
        std::os::unix::fs::symlink(&node, &link).expect("a link");
        let of = |path: &Path| RigIdentity::of_line_in(&terminals, "serial", path);
        assert_eq!(of(&link).key, "usb-1209:0001-17 b");
        assert!(of(&link).has_serial_number);
        let plain = of(&root.join("elsewhere"));
        assert_eq!(plain.key, format!("serial-{}", root.join("elsewhere").display()));
        assert!(!plain.has_serial_number);
        fs::remove_file(usb.join("serial")).expect("it was there");
        assert!(!of(&link).has_serial_number, "no serial number");
    }
}
