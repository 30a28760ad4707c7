//! What the real-time thread asks of the system: a core of its own, a real-time priority, and
//! memory that stays in place.
//!
//! Whatever cannot be had is reported with the exact way to get it, and the loop runs without.
#![allow(unsafe_code, reason = "scheduling has no safe wrapper")]

use crate::rt::thread::{Policy, ThreadSettings};
use crate::threads::block_signals;
use haptic_ipc::socket_permission::user_in_limits;
use haptic_ipc::{Problem, RealTimeStatus};
use nix::errno::Errno;
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

/// The processor for the loop where none was named: the last one, as the first serves most
/// interrupts. None where there is only one.
pub(crate) fn default_cpu(available: &[usize]) -> Option<usize> {
    match available {
        [_, .., last] => Some(*last),
        _ => None,
    }
}

/// Memory that the daemon may come to use, bytes. Under a smaller limit it must not lock what it
/// will allocate later: an allocation beyond the limit would then fail, and end it.
const ENOUGH_LOCKED_BYTES: u64 = 256 * 1024 * 1024;

/// Whether the service manager started this process: then its unit sets its limits, and no file of the user's.
fn is_service() -> bool {
    std::env::var_os("NOTIFY_SOCKET").is_some()
}

/// How a limit is raised: for a user, or in the unit of a service.
fn higher_limit(of_user: &str, of_unit: &str) -> String {
    if is_service() {
        return format!("{of_unit} in its unit: `systemctl edit` it, and restart it");
    }
    format!(
        "`{} - {of_user}` in /etc/security/limits.d/hapticd.conf and log in again, or `sudo setcap \
         cap_sys_nice,cap_ipc_lock+ep {}`",
        user_in_limits(rustix::process::getuid().as_raw()),
        program(),
    )
}

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

/// Locks all memory of the process, now and later. Before the thread is started, so that its stack
/// is locked too.
pub(crate) fn lock_memory(status: &mut RealTimeStatus) {
    match lock_all_memory() {
        Ok(()) => status.memory_locked = true,
        Err(why) => status.problems.push(Problem {
            what: format!("memory is not locked, a page fault can delay a tick: {why}"),
            remedy: higher_limit("memlock unlimited", "LimitMEMLOCK=infinity"),
        }),
    }
}

/// Keeps the processors from sleeping so deeply that they wake up late. It holds as long as the file is open.
pub(crate) fn keep_cpus_awake(status: &mut RealTimeStatus) -> Option<std::fs::File> {
    use std::io::Write;
    const DEVICE: &str = "/dev/cpu_dma_latency";
    let held = std::fs::OpenOptions::new()
        .write(true)
        .open(DEVICE)
        .and_then(|mut file| {
            // Microseconds that a wake-up may take: none.
            file.write_all(&0_i32.to_ne_bytes())?;
            Ok(file)
        });
    match held {
        Ok(file) => {
            status.cpus_kept_awake = true;
            Some(file)
        }
        Err(error) => {
            let remedy = if error.kind() == std::io::ErrorKind::NotFound {
                "nothing: this kernel has no such device, as in many containers and virtual machines".to_owned()
            } else if is_service() {
                format!("DeviceAllow={DEVICE} rw in its unit (`systemctl edit`), and a user who may write it")
            } else {
                let uid = rustix::process::getuid().as_raw();
                format!("let this user write it: `sudo setfacl -m u:{uid}:rw {DEVICE}`")
            };
            status.problems.push(Problem {
                what: format!("the processors may sleep deeply, which delays wake-ups: {DEVICE} says {error}"),
                remedy,
            });
            None
        }
    }
}

/// Bytes of stack that are touched before the loop begins: more than it comes to use.
const PREFAULTED_BYTES: usize = 128 * 1024;

/// Touches the stack, so that its first use is not a page fault in a tick.
#[inline(never)]
fn prefault_stack() {
    let mut pages = [0_u8; PREFAULTED_BYTES];
    for page in pages.chunks_mut(4096) {
        page[0] = 1;
        std::hint::black_box(page);
    }
}

/// Has timers that are not late: without a real-time priority the kernel may delay them by 50 us,
/// to wake up less often.
fn tighten_timers(status: &mut RealTimeStatus) {
    if let Err(error) = rustix::thread::set_current_timer_slack(std::num::NonZeroU64::new(1)) {
        status.problems.push(Problem {
            what: format!("without a real-time priority the loop's timers may be 50 us late: prctl says {error}"),
            remedy: "allow prctl(PR_SET_TIMERSLACK) in the filter of system calls that the daemon runs under, or give the loop its priority"
                .to_owned(),
        });
    }
}

/// Pins the calling thread, gives it its priority, and readies what its first tick would have to wait for.
pub(crate) fn prepare_thread(settings: &ThreadSettings, status: &mut RealTimeStatus) {
    block_signals();
    prefault_stack();
    // The core flushes what it keeps, on every processor.
    status.denormals_flushed = true;
    tighten_timers(status);
    let cpu = settings.cpu.filter(|_| settings.policy != Policy::Deadline);
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
    match settings.policy {
        Policy::Fifo { priority } => match set_fifo(priority) {
            Ok(()) => status.fifo_priority = Some(priority),
            Err(error) => status.problems.push(Problem {
                what: format!(
                    "the loop has no real-time priority, other programs can delay it: sched_setscheduler says {error}"
                ),
                remedy: higher_limit(&format!("rtprio {priority}"), &format!("LimitRTPRIO={priority}")),
            }),
        },
        Policy::Deadline => match set_deadline(settings.period_ns) {
            Ok(()) => status.deadline_scheduled = true,
            Err(error) => status.problems.push(Problem {
                what: format!("the loop is not scheduled by deadline: sched_setattr says {error}"),
                remedy: format!(
                    "`sudo setcap cap_sys_nice,cap_ipc_lock+ep {}`, and no cpuset or affinity on the process; or take \
                     --policy fifo",
                    program()
                ),
            }),
        },
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

/// The kernel's `struct sched_attr`, as of its first version.
#[repr(C)]
struct SchedAttr {
    size: u32,
    policy: u32,
    flags: u64,
    nice: i32,
    priority: u32,
    runtime_ns: u64,
    deadline_ns: u64,
    period_ns: u64,
}

fn set_deadline(period_ns: u64) -> Result<(), std::io::Error> {
    const SCHED_DEADLINE: u32 = 6;
    let attributes = SchedAttr {
        size: size_of::<SchedAttr>() as u32,
        policy: SCHED_DEADLINE,
        flags: 0,
        nice: 0,
        priority: 0,
        runtime_ns: period_ns / 2,
        deadline_ns: period_ns,
        period_ns,
    };
    // SAFETY: a plain system call on the calling thread (0) with a valid structure that says its own size.
    let result = unsafe { libc::syscall(libc::SYS_sched_setattr, 0, &raw const attributes, 0) };
    Ok(Errno::result(result).map(drop)?)
}

fn set_fifo(priority: u8) -> Result<(), std::io::Error> {
    // The kernel's structure is this number. The call itself, as musl has only a stub of its function.
    let priority = libc::c_int::from(priority);
    // SAFETY: a plain system call on the calling thread (0) with a valid structure.
    let result = unsafe { libc::syscall(libc::SYS_sched_setscheduler, 0, libc::SCHED_FIFO, &raw const priority) };
    Ok(Errno::result(result).map(drop)?)
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

    #[test]
    #[cfg(all(target_os = "linux", not(miri)))]
    fn timers_that_may_be_late_are_reported() {
        use crate::rt::purity_tests::filter_calls;
        let thread = std::thread::spawn(|| {
            let (mut allowed, mut forbidden) = (RealTimeStatus::default(), RealTimeStatus::default());
            tighten_timers(&mut allowed);
            let refused = libc::SECCOMP_RET_ERRNO | libc::EPERM.cast_unsigned();
            filter_calls(&[libc::SYS_prctl], refused, libc::SECCOMP_RET_ALLOW).ok()?;
            tighten_timers(&mut forbidden);
            Some((allowed.problems, forbidden.problems))
        });
        let Some((allowed, forbidden)) = thread.join().expect("it ends") else {
            test_run::skip("seccomp", "a kernel with it");
            return;
        };
        assert_eq!(allowed, []);
        let [Problem { what, remedy }] = &forbidden[..] else {
            panic!("{forbidden:?}");
        };
        assert!(what.contains("timers") && what.contains("prctl"), "{what}");
        assert!(remedy.contains("PR_SET_TIMERSLACK"), "{remedy}");
    }
}
