//! The identity of a rig beyond one connection: the results of its commissioning are stored under
//! it.

use std::path::{Path, PathBuf};

/// The identity of a rig.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RigIdentity {
    /// The same for the same rig at every connection: `usb-1209:0001-17` by its serial number, else
    /// by its path, as in `serial-/dev/ttyUSB0`.
    pub key: String,
    /// Whether the key contains a serial number, of its USB device or of its chip; otherwise another device at the same
    /// path has the same key.
    pub has_serial_number: bool,
    /// Whether the address inverts force and position.
    pub reversed: bool,
}

/// The kernel's table of the devices behind terminals.
const TERMINALS: &str = "/sys/class/tty";

/// Longest text of the kernel that is read, bytes; a USB string has at most 126 letters.
const MAX_TEXT: usize = 256;

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
                ..Self::default()
            };
        }
        // The path of the address, not its target: a link by the device's name stays when the
        // numbers of the nodes change.
        let path = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
        Self {
            key: format!("{kind}-{}", path.display()),
            ..Self::default()
        }
    }

    /// The identity of a device on USB.
    pub(crate) fn of_usb(vendor: u16, product: u16, serial: Option<&str>) -> Self {
        let serial = serial.filter(|serial| is_its_own(serial));
        Self {
            key: match serial {
                Some(serial) => format!("usb-{vendor:04x}:{product:04x}-{serial}"),
                None => format!("hid-{vendor:04x}:{product:04x}"),
            },
            has_serial_number: serial.is_some(),
            ..Self::default()
        }
    }

    /// The name of a firmware without its chip's number, and the identity by that number: `mine 1.0#a1b2` is `mine 1.0`
    /// on the chip `a1b2`, whichever cable it is behind.
    pub(crate) fn on_chip(mut self, name: &str) -> (String, Self) {
        let Some((name, chip)) = name.rsplit_once('#') else {
            return (name.to_owned(), self);
        };
        if chip.is_empty() || !chip.bytes().all(|byte| byte.is_ascii_alphanumeric()) {
            return (format!("{name}#{chip}"), self);
        }
        self.key = format!("chip-{chip}");
        self.has_serial_number = true;
        (name.trim_end().to_owned(), self)
    }

    /// The same for one of its motors, by number or letter.
    #[must_use]
    pub fn with_part(mut self, part: &str) -> Self {
        self.key.push('-');
        self.key.push_str(part);
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
        (!text.is_empty() && text.len() <= MAX_TEXT).then(|| text.to_owned())
    };
    let serial = text("serial").filter(|serial| is_its_own(serial))?;
    Some(format!("usb-{}:{}-{serial}", text("idVendor")?, text("idProduct")?))
}

/// Whether a serial number tells one device from another: makers give all of theirs 0001, as every CP2102 has it, or
/// zeros.
fn is_its_own(serial: &str) -> bool {
    !matches!(serial.trim().trim_start_matches('0'), "" | "1")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn usb_line_is_keyed_by_serial_number_others_by_path() {
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
        fs::write(usb.join("serial"), "0001\n").expect("a file");
        assert!(!of(&link).has_serial_number, "as all of its kind");
        fs::remove_file(usb.join("serial")).expect("it was there");
        assert!(!of(&link).has_serial_number, "no serial number");
        assert!(!RigIdentity::of_usb(1, 2, Some("0000")).has_serial_number);
        assert_eq!(RigIdentity::of_usb(1, 2, Some("10")).key, "usb-0001:0002-10");
    }

    #[test]
    fn a_name_that_ends_in_its_chip_goes_by_the_chip() {
        let mut usb = RigIdentity::of_usb(1, 2, None);
        usb.reversed = true;
        let on_chip = |name| usb.clone().on_chip(name);
        let (name, rig) = on_chip("mine 1.0#A1b2");
        assert_eq!((name.as_str(), rig.key.as_str()), ("mine 1.0", "chip-A1b2"));
        assert!(rig.has_serial_number && rig.reversed);
        for plain in ["mine 1.0", "mine 1.0#", "mine #1.0", ""] {
            assert_eq!(on_chip(plain), (plain.to_owned(), usb.clone()));
        }
    }
}
