//! Who else has a loop on the same processor.
//!
//! Two loops at one priority on one processor do not see each other, and spoil each other all the
//! same: a loop that wakes up while the other one spins or ticks waits for it. So each loop holds a
//! lock that every other daemon can see, whatever its user, and looks who else holds one.
//!
//! - The lock is on a byte of /dev/null: `16 * processor + slot` beyond a base. That inode is there for every user, can always be opened for writing, and stays the same in a unit with
//!   ProtectSystem=strict, PrivateTmp and DevicePolicy=closed, where a file in /run, /tmp or /dev/shm
//!   is another one or read-only. A lock is not content: nothing is written.
//! - It belongs to the open file (an OFD lock), so that it goes with the process however that ends, and no other descriptor of the process takes it away.
//! - Nobody enforces it. Who wants to keep a daemon in the dark, or frighten it, can; all that comes of it is a line in `status`.
//!
//! The slot also gives the loop its place within the period, so that loops on one processor do not
//! wake up at once.

use haptic_ipc::Problem;
use nix::fcntl::{FcntlArg, fcntl};
use std::fs::File;
use std::io;

/// Loops on one processor that can be told apart.
const SLOTS: u16 = 16;

/// Where the bytes begin: "haptic" in ASCII, where no other program locks anything of /dev/null by chance.
const BASE: i64 = 0x6861_7074_6963_0000;

const INODE: &str = "/dev/null";

/// Where in the period each slot's deadlines are, as a share of it. The kernel's own tick sits on
/// the multiples of the period, so none is near there; the first ones are furthest from each other.
const PLACES: [f64; SLOTS as usize] = [
    0.5, 0.25, 0.75, 0.375, 0.625, 0.125, 0.875, 0.4375, 0.5625, 0.3125, 0.6875, 0.1875, 0.8125, 0.28125, 0.71875,
    0.46875,
];

/// This daemon's share of a processor, which it holds as long as this lives.
#[derive(Debug)]
pub(crate) struct ProcessorShare {
    file: File,
    cpu: usize,
    /// None where all are taken.
    slot: Option<u16>,
}

impl ProcessorShare {
    /// Takes the first free slot of a processor.
    ///
    /// # Errors
    /// The system does not lock.
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

    /// Where in the period the loop's deadlines are to be, ns.
    pub(crate) fn phase_ns(&self, period_ns: u64) -> u64 {
        let place = self.slot.and_then(|slot| PLACES.get(usize::from(slot)));
        phase_ns(place.copied().unwrap_or(PLACES[0]), period_ns)
    }

    /// How many other daemons have a loop on the processor, now.
    pub(crate) fn others(&self) -> usize {
        let held = |slot: &u16| {
            let mut lock = byte(self.cpu, *slot);
            let looked = fcntl(&self.file, FcntlArg::F_OFD_GETLK(&mut lock));
            looked.is_ok() && i32::from(lock.l_type) != libc::F_UNLCK
        };
        // Its own lock is not in its way, and so not seen.
        (0..SLOTS).filter(held).count()
    }

    /// What there is to say of the others, if there are any.
    pub(crate) fn problem(&self) -> Option<Problem> {
        let others = self.others();
        if others == 0 {
            return None;
        }
        let daemons = match others {
            1 => "another daemon has its loop".to_owned(),
            others => format!("{others} other daemons have their loops"),
        };
        let cpu = self.cpu;
        Some(Problem {
            what: format!("{daemons} on processor {cpu} as well: each can delay the other's ticks"),
            remedy: format!(
                "give each a processor of its own with --cpu, or end one: `pgrep -a hapticd` lists them, `grep Cpus_allowed_list /proc/PID/task/*/status` shows who has processor {cpu}"
            ),
        })
    }
}

/// Where in the period deadlines are where nobody else is to be heeded, ns.
pub(crate) fn usual_phase_ns(period_ns: u64) -> u64 {
    phase_ns(PLACES[0], period_ns)
}

#[expect(
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a share of a period of some milliseconds"
)]
fn phase_ns(place: f64, period_ns: u64) -> u64 {
    (place * period_ns as f64) as u64
}

/// The byte that stands for a slot of a processor.
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

    /// A processor that no daemon of this machine has.
    fn nobodys() -> usize {
        40_000 + usize::try_from(std::process::id()).unwrap_or(0) % 10_000
    }

    // hazard: H11
    #[test]
    fn two_on_one_processor_see_each_other_as_long_as_both_are_there() {
        let cpu = nobodys();
        let first = ProcessorShare::claim(cpu).expect("a share");
        assert_eq!((first.others(), first.problem()), (0, None));
        let elsewhere = ProcessorShare::claim(cpu + 1).expect("a share");
        assert_eq!((first.others(), elsewhere.others()), (0, 0));
        let second = ProcessorShare::claim(cpu).expect("a share");
        assert_eq!((first.others(), second.others()), (1, 1));
        let told = first.problem().expect("there is another one").what;
        assert!(told.contains(&format!("processor {cpu}")), "{told}");
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
        let cpu = nobodys() + 10_000;
        let shares: Vec<_> = (0..SLOTS)
            .map(|_| ProcessorShare::claim(cpu).expect("a share"))
            .collect();
        let mut phases: Vec<u64> = shares.iter().map(|share| share.phase_ns(PERIOD_NS)).collect();
        assert_eq!(phases[0], usual_phase_ns(PERIOD_NS));
        assert!(phases[0].abs_diff(phases[1]) >= 250_000, "{phases:?}");
        phases.sort_unstable();
        assert!(phases.windows(2).all(|pair| pair[1] - pair[0] >= 30_000), "{phases:?}");
        assert!(phases[0] >= 125_000 && phases[15] <= 875_000, "{phases:?}");
        // The next has no slot, and is told all the same.
        assert_eq!(
            ProcessorShare::claim(cpu).expect("a share").others(),
            usize::from(SLOTS)
        );
    }
}
