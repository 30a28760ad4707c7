//! What the real-time thread asks of the system: a core of its own, a real-time priority, and memory that stays in place.
//!
//! Whatever cannot be had is reported with the exact way to get it, and the loop runs without.
#![allow(unsafe_code, reason = "sched_setscheduler has no safe wrapper in rustix")]

use haptic_ipc::{Problem, RealTimeStatus};
use rustix::mm::{MlockAllFlags, mlockall};
use rustix::process::{Resource, getrlimit};
use rustix::thread::{CapabilitySet, CpuSet, capabilities, sched_getaffinity, sched_setaffinity};

/// Priorities that SCHED_FIFO knows.
pub(crate) const FIFO_PRIORITIES: std::ops::RangeInclusive<u8> = 1..=99;

/// The processors that this process may use.
pub(crate) fn available_cpus() -> Vec<usize> {
    let set = sched_getaffinity(None).unwrap_or_default();
    (0..CpuSet::MAX_CPU).filter(|&cpu| set.is_set(cpu)).collect()
}

/// The processor for the loop where none was named: the last one, as the first serves most interrupts. None where there is only one.
pub(crate) fn default_cpu(available: &[usize]) -> Option<usize> {
    match available {
        [_, .., last] => Some(*last),
        _ => None,
    }
}

/// Memory that the daemon may come to use, bytes. Under a smaller limit it must not lock what it will allocate later: an allocation beyond the
/// limit would then fail, and end it.
const ENOUGH_LOCKED_BYTES: u64 = 256 * 1024 * 1024;

/// Why memory cannot be locked, or nothing.
fn lock_all_memory() -> Result<(), String> {
    let unlimited = capabilities(None).is_ok_and(|sets| sets.effective.contains(CapabilitySet::IPC_LOCK));
    if let Some(limit) = getrlimit(Resource::Memlock).current.filter(|_| !unlimited)
        && limit < ENOUGH_LOCKED_BYTES
    {
        return Err(format!(
            "its limit is {} KiB, too little to lock what comes later",
            limit / 1024
        ));
    }
    mlockall(MlockAllFlags::CURRENT | MlockAllFlags::FUTURE).map_err(|error| format!("mlockall says {error}"))
}

/// Locks all memory of the process, now and later. Before the thread is started, so that its stack is locked too.
pub(crate) fn lock_memory(status: &mut RealTimeStatus) {
    match lock_all_memory() {
        Ok(()) => status.memory_locked = true,
        Err(why) => status.problems.push(Problem {
            what: format!("memory is not locked, a page fault can delay a tick: {why}"),
            remedy: format!(
                "raise the limit: `{} - memlock unlimited` in /etc/security/limits.d/hapticd.conf and log in again, \
                 LimitMEMLOCK=infinity in a systemd unit, or `sudo setcap cap_sys_nice,cap_ipc_lock+ep {}`",
                user_name(),
                program(),
            ),
        }),
    }
}

/// Pins the calling thread and gives it its priority.
pub(crate) fn prepare_thread(cpu: Option<usize>, priority: u8, status: &mut RealTimeStatus) {
    if let Some(cpu) = cpu {
        let mut set = CpuSet::new();
        set.set(cpu);
        match sched_setaffinity(None, &set) {
            Ok(()) => status.cpu = Some(cpu),
            Err(error) => status.problems.push(Problem {
                what: format!("the loop is not pinned to processor {cpu}: sched_setaffinity says {error}"),
                remedy: format!("choose one of the processors {:?} with --cpu", available_cpus()),
            }),
        }
    }
    match set_fifo(priority) {
        Ok(()) => status.fifo_priority = Some(priority),
        Err(error) => status.problems.push(Problem {
            what: format!(
                "the loop has no real-time priority, other programs can delay it: sched_setscheduler says {error}"
            ),
            remedy: format!(
                "allow it: `{} - rtprio {priority}` in /etc/security/limits.d/hapticd.conf and log in again, \
                 LimitRTPRIO={priority} in a systemd unit, or `sudo setcap cap_sys_nice,cap_ipc_lock+ep {}`",
                user_name(),
                program(),
            ),
        }),
    }
}

/// Keeps the calling thread off the loop's processor, where there is another one.
pub(crate) fn leave_cpu_alone(cpu: usize, available: &[usize]) {
    let mut others = CpuSet::new();
    for &other in available.iter().filter(|&&other| other != cpu) {
        others.set(other);
    }
    if others.count() > 0 && sched_setaffinity(None, &others).is_err() {
        // It stays where the system puts it: the loop's priority keeps it away all the same.
    }
}

fn set_fifo(priority: u8) -> Result<(), std::io::Error> {
    let parameters = libc::sched_param {
        sched_priority: i32::from(priority),
    };
    // SAFETY: a plain system call on the calling thread (0) with a valid structure.
    let result = unsafe { libc::sched_setscheduler(0, libc::SCHED_FIFO, &raw const parameters) };
    if result == 0 {
        Ok(())
    } else {
        Err(std::io::Error::last_os_error())
    }
}

fn user_name() -> String {
    std::env::var("USER").unwrap_or_else(|_| rustix::process::getuid().as_raw().to_string())
}

fn program() -> String {
    std::env::current_exe().map_or_else(|_| "hapticd".to_owned(), |path| path.display().to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_loop_gets_a_core_of_its_own_where_there_are_two() {
        assert_eq!(default_cpu(&[0, 1, 5]), Some(5));
        assert_eq!(default_cpu(&[3]), None);
        assert_eq!(default_cpu(&[]), None);
    }
}
