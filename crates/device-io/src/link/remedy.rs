//! What a user does where a node does not open: for the user of this process, be it a person or the service.

use super::hid_node::HidId;
use std::fs;
use std::os::unix::fs::MetadataExt;
use std::path::Path;

/// Who has to get the right to a node.
#[derive(Debug)]
enum Account {
    Person,
    Service { user: String, unit: String },
}

impl Account {
    fn of_process() -> Self {
        let groups = fs::read_to_string("/proc/self/cgroup").unwrap_or_default();
        let user = rustix::process::geteuid().as_raw();
        match unit(&groups) {
            Some(unit) => Self::Service {
                user: name_of("/etc/passwd", user).unwrap_or_else(|| "hapticd".to_owned()),
                unit: unit.to_owned(),
            },
            None => Self::Person,
        }
    }

    fn join(&self, group: &str) -> String {
        match self {
            Self::Person => format!("`sudo usermod -aG {group} $USER`, then log in again"),
            Self::Service { user, unit } => {
                format!("`sudo usermod -aG {group} {user}`, then `sudo systemctl restart {unit}`")
            }
        }
    }
}

/// The unit of hapticd's service in which a process runs, by its control groups.
fn unit(groups: &str) -> Option<&str> {
    let services = groups.lines().filter(|line| !line.contains("/user.slice/"));
    let mut units = services.filter_map(|line| line.rsplit('/').next()?.strip_suffix(".service"));
    units.find(|unit| unit.starts_with("hapticd"))
}

/// The name of a user or group, from the file that lists them.
fn name_of(list: &str, id: u32) -> Option<String> {
    let list = fs::read_to_string(list).ok()?;
    list.lines().find_map(|line| {
        let mut fields = line.split(':');
        let name = fields.next()?;
        (fields.nth(1)?.parse() == Ok(id)).then(|| name.to_owned())
    })
}

/// The remedy for a missing right to open a line.
pub(crate) fn serial_permission(line: &Path) -> String {
    let found = line.metadata().ok();
    if let Some(found) = &found
        && line.canonicalize().is_ok_and(|node| node.starts_with("/dev/pts"))
    {
        let owner = name_of("/etc/passwd", found.uid()).unwrap_or_else(|| found.uid().to_string());
        return format!("it is a pseudo-terminal of {owner}: run this program and that one as the same user");
    }
    // A node that is root's alone is given to a group first.
    let for_group = found.filter(|found| found.gid() != 0 && found.mode() & 0o060 == 0o060);
    let group = for_group.and_then(|found| name_of("/etc/group", found.gid()));
    serial(line, group.as_deref(), &Account::of_process())
}

fn serial(line: &Path, group: Option<&str>, account: &Account) -> String {
    let who = match account {
        Account::Person => "the user",
        Account::Service { .. } => "the service's user",
    };
    match group {
        Some(group) => format!("add {who} to the group of {} ({})", line.display(), account.join(group)),
        None => {
            let name = line.file_name().unwrap_or_default().display();
            rule(&format!("SUBSYSTEM==\"tty\", KERNEL==\"{name}\""), "dialout", account)
        }
    }
}

/// The remedy for a missing right to open a HID device.
pub(crate) fn hid_permission(id: &HidId) -> String {
    hid(id, &Account::of_process())
}

fn hid(id: &HidId, account: &Account) -> String {
    let device = format!(
        "SUBSYSTEM==\"hidraw\", ATTRS{{idVendor}}==\"{:04x}\", ATTRS{{idProduct}}==\"{:04x}\"",
        id.vendor, id.product
    );
    rule(&device, "hapticd", account)
}

fn rule(device: &str, group: &str, account: &Account) -> String {
    let joining = match account {
        Account::Person => format!(", and {}", account.join(group)),
        // Its unit gives it both groups.
        Account::Service { .. } => String::new(),
    };
    format!(
        "put this line into /etc/udev/rules.d/71-rig.rules: {device}, GROUP=\"{group}\", MODE=\"0660\"; then run `sudo \
         udevadm control --reload && sudo udevadm trigger`{joining}"
    )
}

/// The remedy for a node that another program has open.
pub(super) fn busy(node: &Path) -> String {
    format!("another program has it open: `fuser -v {}` names it", node.display())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn service_and_person_are_distinguished() {
        for (groups, found) in [
            ("0::/system.slice/hapticd.service\n", Some("hapticd")),
            (
                "0::/system.slice/system-hapticd.slice/hapticd@left.service",
                Some("hapticd@left"),
            ),
            (
                "0::/user.slice/user-1000.slice/user@1000.service/app.slice/hapticd.service",
                None,
            ),
            ("0::/system.slice/ssh.service", None),
            ("0::/user.slice/user-1000.slice/session-1.scope", None),
            ("", None),
        ] {
            assert_eq!(unit(groups), found, "{groups}");
        }
    }

    #[test]
    fn right_to_a_node_is_given_to_whom_it_is_missing() {
        let service = Account::Service {
            user: "hapticd".to_owned(),
            unit: "hapticd@left".to_owned(),
        };
        let line = Path::new("/dev/ttyUSB0");
        let joins = "`sudo usermod -aG plugdev hapticd`, then `sudo systemctl restart hapticd@left`";
        let adds = format!("add the service's user to the group of /dev/ttyUSB0 ({joins})");
        assert_eq!(serial(line, Some("plugdev"), &service), adds);
        let joins = "(`sudo usermod -aG dialout $USER`, then log in again)";
        assert!(serial(line, Some("dialout"), &Account::Person).ends_with(joins));
        // Nobody is sent into the group of root.
        let rule = serial(line, None, &service);
        let device = r#"SUBSYSTEM=="tty", KERNEL=="ttyUSB0", GROUP="dialout", MODE="0660""#;
        assert!(rule.contains(device) && !rule.contains("usermod"), "{rule}");
        let id = HidId {
            vendor: 0x1209,
            product: 1,
            serial: None,
        };
        let device =
            r#"SUBSYSTEM=="hidraw", ATTRS{idVendor}=="1209", ATTRS{idProduct}=="0001", GROUP="hapticd", MODE="0660""#;
        let rule = hid(&id, &Account::Person);
        assert!(rule.contains(device), "{rule}");
        assert!(rule.contains("usermod -aG hapticd $USER"), "{rule}");
    }

    #[test]
    fn ids_have_the_names_of_their_list() {
        assert_eq!(name_of("/etc/passwd", 0).as_deref(), Some("root"));
        assert_eq!(name_of("/etc/group", 4_000_000_002), None);
        assert_eq!(name_of("/nonexistent", 0), None);
    }
}
