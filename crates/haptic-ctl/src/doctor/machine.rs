//! The limits of this user, and the processors.

use super::check::Check;
use haptic_ipc::{Status, socket_permission};
use rustix::process::{Resource, getrlimit};

/// Priority of the real-time thread by default.
const FIFO_PRIORITY: u64 = 80;

/// The limits of a daemon that this user starts. One that runs tells itself what it lacks.
pub(super) fn limits() -> [Check; 2] {
    let person = rustix::process::geteuid().as_raw();
    let priority = getrlimit(Resource::Rtprio).current;
    let memory = getrlimit(Resource::Memlock).current;
    let shown = |limit: Option<u64>| limit.map_or_else(|| "unlimited".to_owned(), |limit| limit.to_string());
    let priority_text = format!("RLIMIT_RTPRIO is {} for this user", shown(priority));
    let memory_text = match memory {
        None => "RLIMIT_MEMLOCK is unlimited for this user".to_owned(),
        Some(bytes) => format!("RLIMIT_MEMLOCK is {} KiB for this user", bytes / 1024),
    };
    let is_enough = priority.is_none_or(|limit| limit >= FIFO_PRIORITY);
    [
        limit(
            "priority limit",
            priority_text,
            is_enough,
            person,
            &format!("rtprio {FIFO_PRIORITY}"),
        ),
        limit(
            "memory limit",
            memory_text,
            memory.is_none(),
            person,
            "memlock unlimited",
        ),
    ]
}

/// A limit, which may be low for root.
fn limit(check: &'static str, found: String, is_enough: bool, person: u32, wanted: &str) -> Check {
    if is_enough {
        return Check::ok(check, found);
    }
    if person == 0 {
        return Check::ok(check, format!("{found}, which does not apply to root"));
    }
    let line = format!("{} - {wanted}", socket_permission::user_in_limits(person));
    let fix = format!("`echo '{line}' | sudo tee -a /etc/security/limits.d/hapticd.conf`, and log in again");
    Check::warn(check, found, fix)
}

pub(super) fn governor() -> Check {
    let Ok(processors) = std::fs::read_dir("/sys/devices/system/cpu") else {
        return Check::skip("governor", "unknown on this system");
    };
    let mut governors: Vec<String> = processors
        .filter_map(|entry| std::fs::read_to_string(entry.ok()?.path().join("cpufreq/scaling_governor")).ok())
        .map(|text| text.trim().to_owned())
        .collect();
    governors.sort();
    governors.dedup();
    if governors.is_empty() {
        return Check::skip(
            "governor",
            "unknown: this system does not report how it scales the processors' frequency",
        );
    }
    let found = governors.join(", ");
    if governors == ["performance"] {
        Check::ok("governor", found)
    } else {
        Check::warn(
            "governor",
            format!("{found}: a processor that has slowed down wakes up late"),
            "`echo performance | sudo tee /sys/devices/system/cpu/cpu*/cpufreq/scaling_governor`",
        )
    }
}

/// Whether the real-time thread's processor is kept free of other work.
pub(super) fn isolation(status: Option<&Status>) -> Check {
    let list = |name: &str| {
        let text = std::fs::read_to_string(format!("/sys/devices/system/cpu/{name}")).unwrap_or_default();
        processors(text.trim())
    };
    let (isolated, tickless) = (list("isolated"), list("nohz_full"));
    let Some(status) = status else {
        return Check::skip("isolation", "no daemon reports on which processor its loop runs");
    };
    let Some(cpu) = status.real_time.cpu else {
        return Check::skip("isolation", "the real-time thread is not pinned to a processor");
    };
    if isolated.contains(&cpu) && tickless.contains(&cpu) {
        return Check::ok("isolation", format!("processor {cpu} is kept for the real-time thread"));
    }
    Check::warn(
        "isolation",
        format!("other work may run on processor {cpu}, where the real-time thread is"),
        format!(
            "boot with the kernel parameters `isolcpus={cpu} nohz_full={cpu}` (of several rigs one list of their \
             processors, which leaves one for the system); where GRUB is the boot loader, add \
             them to GRUB_CMDLINE_LINUX in \
             /etc/default/grub, then `sudo update-grub` (Fedora: `sudo grub2-mkconfig -o /boot/grub2/grub.cfg`) and \
             `sudo reboot`"
        ),
    )
}

/// Reads the kernel's lists, such as `1,4-6`.
fn processors(list: &str) -> Vec<usize> {
    list.split(',')
        .filter_map(|part| {
            let (first, last) = part.split_once('-').unwrap_or((part, part));
            Some(first.trim().parse().ok()?..=last.trim().parse().ok()?)
        })
        .flatten()
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::check::Level;

    #[test]
    fn the_kernels_lists_are_read() {
        assert_eq!(processors("1,4-6"), [1, 4, 5, 6]);
        assert_eq!(processors("3"), [3]);
        assert!(processors("").is_empty());
        assert!(processors("(null)").is_empty());
    }

    #[test]
    fn a_low_limit_does_not_apply_to_root() {
        let check = |person| limit("priority limit", "it is 0".to_owned(), false, person, "rtprio 80");
        assert!(check(0).found.contains("root"));
        assert_eq!(check(4_000_000_001).level, Level::Warn);
        let fix = check(4_000_000_001).fix.expect("a fix");
        assert!(fix.contains("'4000000001:4000000001 - rtprio 80'"), "{fix}");
    }
}
