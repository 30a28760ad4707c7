//! Detects other daemons whose loops run on the same processor.
//!
//! Two loops of one priority on one processor delay each other: a loop that wakes up while the
//! other spins or ticks waits for it. So each loop holds a lock that every other daemon can see,
//! whatever its user, and looks for other holders.
//!
//! - The lock is on a byte of /dev/null: `16 * processor + slot` beyond a base. That inode exists
//!   for every user, can always be opened for writing, and is the same inside a unit with
//!   ProtectSystem=strict, PrivateTmp and DevicePolicy=closed, where a file in /run, /tmp or
//!   /dev/shm is another one or read-only. Locking writes nothing.
//! - It belongs to the open file (an OFD lock), so the kernel releases it however the process ends,
//!   and no other descriptor of the process does.
//! - It is advisory: any user can hold such a lock. Its only effect is a line in `status`.
//!
//! The slot also sets the loop's phase within the period, so that loops on one processor do not
//! wake up at once.

use haptic_ipc::Problem;
use nix::fcntl::{FcntlArg, fcntl};
use std::fs::File;
use std::io;

/// Most loops on one processor that can be distinguished.
const SLOTS: u16 = 16;

/// Offset of the first byte: "haptic" in ASCII, which no other program locks by chance.
const BASE: i64 = 0x6861_7074_6963_0000;

const INODE: &str = "/dev/null";

/// Phase of each slot's deadlines, as a share of the period. The kernel's own tick falls on the
/// multiples of the period, so no slot is near there; the first slots are furthest from each other.
const PHASES: [f64; SLOTS as usize] = [
    0.5, 0.25, 0.75, 0.375, 0.625, 0.125, 0.875, 0.4375, 0.5625, 0.3125, 0.6875, 0.1875, 0.8125, 0.28125, 0.71875,
    0.46875,
];

/// This daemon's share of a processor, held until it is dropped.
#[derive(Debug)]
pub(crate) struct ProcessorShare {
    file: File,
    cpu: usize,
    /// `None` if all slots are taken.
    slot: Option<u16>,
}

impl ProcessorShare {
    /// Takes the first free slot of a processor.
    ///
    /// # Errors
    /// The system refuses to lock.
    pub(crate) fn claim(cpu: usize) -> io::Result<Self> {
        let file = File::options().read(true).write(true).open(INODE)?;
        let mut slot = None;
        for candidate in 0..SLOTS {
            match fcntl(&file, FcntlArg::F_OFD_SETLK(&byte(cpu, candidate))) {
                Ok(_) => {
                    slot = Some(candidate);
                    break;
                }
                Err(nix::Error::EAGAIN | nix::Error::EACCES) => {}
                Err(error) => return Err(error.into()),
            }
        }
        Ok(Self { file, cpu, slot })
    }

    /// Phase of the loop's deadlines within the period, ns.
    pub(crate) fn phase_ns(&self, period_ns: u64) -> u64 {
        let phase = self.slot.and_then(|slot| PHASES.get(usize::from(slot)));
        phase_ns(phase.copied().unwrap_or(PHASES[0]), period_ns)
    }

    /// How many other daemons run a loop on the processor now.
    pub(crate) fn others(&self) -> usize {
        let held = |slot: &u16| {
            let mut lock = byte(self.cpu, *slot);
            let looked = fcntl(&self.file, FcntlArg::F_OFD_GETLK(&mut lock));
            looked.is_ok() && i32::from(lock.l_type) != libc::F_UNLCK
        };
        // Its own lock does not conflict, and so is not counted.
        (0..SLOTS).filter(held).count()
    }

    /// The problem of sharing the processor, if another daemon does.
    pub(crate) fn problem(&self) -> Option<Problem> {
        let others = self.others();
        if others == 0 {
            return None;
        }
        let daemons = match others {
            1 => "another daemon runs its loop".to_owned(),
            others => format!("{others} other daemons run their loops"),
        };
        let cpu = self.cpu;
        Some(Problem {
            what: format!("{daemons} on processor {cpu} too: each can delay the other's ticks"),
            remedy: format!(
                "give each a processor of its own with --cpu, or end one: `pgrep -a hapticd` lists them, \
                 `grep Cpus_allowed_list /proc/PID/task/*/status` shows which is on processor {cpu}"
            ),
        })
    }
}

/// Phase of the deadlines of a loop that is not pinned, ns.
pub(crate) fn default_phase_ns(period_ns: u64) -> u64 {
    phase_ns(PHASES[0], period_ns)
}

#[expect(
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a share of a period of some milliseconds"
)]
fn phase_ns(share: f64, period_ns: u64) -> u64 {
    (share * period_ns as f64) as u64
}

/// The lock on the byte of a processor's slot.
fn byte(cpu: usize, slot: u16) -> libc::flock {
    let cpu = i64::try_from(cpu)
        .unwrap_or(i64::from(u16::MAX))
        .min(i64::from(u16::MAX));
    libc::flock {
        l_type: libc::F_WRLCK as libc::c_short,
        l_whence: libc::SEEK_SET as libc::c_short,
        l_start: BASE + cpu * i64::from(SLOTS) + i64::from(slot),
        l_len: 1,
        l_pid: 0,
    }
}

// Miri has no locks.
#[cfg(all(test, not(miri)))]
mod tests {
    use super::*;

    /// A processor that no daemon of this machine uses.
    fn unused_processor() -> usize {
        40_000 + usize::try_from(std::process::id()).unwrap_or(0) % 10_000
    }

    // hazard: H11
    #[test]
    fn daemons_on_one_processor_see_each_other() {
        let cpu = unused_processor();
        let first = ProcessorShare::claim(cpu).expect("a share");
        assert_eq!((first.others(), first.problem()), (0, None));
        let elsewhere = ProcessorShare::claim(cpu + 1).expect("a share");
        assert_eq!((first.others(), elsewhere.others()), (0, 0));
        let second = ProcessorShare::claim(cpu).expect("a share");
        assert_eq!((first.others(), second.others()), (1, 1));
        let message = first.problem().expect("there is another one").what;
        assert!(message.contains(&format!("processor {cpu}")), "{message}");
        // Another descriptor of the same inode comes and goes all the time.
        drop(File::open(INODE).expect("it is there"));
        assert_eq!(second.others(), 1);
        drop(first);
        assert_eq!(second.others(), 0);
    }

    // hazard: H11
    #[test]
    fn their_deadlines_are_apart_and_off_the_kernels_tick() {
        const PERIOD_NS: u64 = 1_000_000;
        let cpu = unused_processor() + 10_000;
        let shares: Vec<_> = (0..SLOTS)
            .map(|_| ProcessorShare::claim(cpu).expect("a share"))
            .collect();
        let mut phases: Vec<u64> = shares.iter().map(|share| share.phase_ns(PERIOD_NS)).collect();
        assert_eq!(phases[0], default_phase_ns(PERIOD_NS));
        assert!(phases[0].abs_diff(phases[1]) >= 250_000, "{phases:?}");
        phases.sort_unstable();
        assert!(phases.windows(2).all(|pair| pair[1] - pair[0] >= 30_000), "{phases:?}");
        assert!(phases[0] >= 125_000 && phases[15] <= 875_000, "{phases:?}");
        // The next has no slot, and is reported all the same.
        assert_eq!(
            ProcessorShare::claim(cpu).expect("a share").others(),
            usize::from(SLOTS)
        );
    }
}
