//! Processes as the system sees them.

use rustix::process::{Pid, Signal, kill_process};
use std::fs;
use std::ops::{Deref, DerefMut};
use std::process::{Child, Output};

/// A size of a process in KiB, by its name in `/proc/PID/status` (`VmRSS`: what is in memory now, `VmHWM`: at most so
/// far); nothing where the process has ended.
pub fn size_kib(pid: u32, name: &str) -> Option<u64> {
    let status = fs::read_to_string(format!("/proc/{pid}/status")).ok()?;
    let size = status
        .lines()
        .find_map(|line| line.strip_prefix(name)?.strip_prefix(':'))?;
    size.trim().trim_end_matches(" kB").parse().ok()
}

/// Time that processors have spent on the threads that a process has now, s.
pub fn processor_time_s(pid: u32) -> f64 {
    let threads = fs::read_dir(format!("/proc/{pid}/task")).expect("it runs");
    let of_thread = |thread: fs::DirEntry| -> Option<f64> {
        // The first field is the time that it ran, ns. A thread may just have ended.
        let stat = fs::read_to_string(thread.path().join("schedstat")).ok()?;
        stat.split_whitespace().next()?.parse().ok()
    };
    threads.flatten().filter_map(of_thread).sum::<f64>() * 1e-9
}

/// Descriptors that a process has open; none where it has ended.
pub fn descriptors(pid: u32) -> usize {
    fs::read_dir(format!("/proc/{pid}/fd")).map_or(0, Iterator::count)
}

/// Sends a signal to a process, unless it has ended.
pub fn signal(pid: u32, signal: Signal) {
    let pid = i32::try_from(pid).ok().and_then(Pid::from_raw).expect("a process");
    if kill_process(pid, signal).is_err() {
        // It has ended.
    }
}

/// Sends a signal to a program and waits for its end.
pub fn end(child: Child, with: Signal) -> Output {
    signal(child.id(), with);
    child.wait_with_output().expect("it ends")
}

/// A program that ends with its test.
#[derive(Debug)]
pub struct Killed(pub Child);

impl Deref for Killed {
    type Target = Child;

    fn deref(&self) -> &Child {
        &self.0
    }
}

impl DerefMut for Killed {
    fn deref_mut(&mut self) -> &mut Child {
        &mut self.0
    }
}

impl Drop for Killed {
    fn drop(&mut self) {
        // It may have ended already; either way nothing of it stays.
        drop(self.0.kill());
        drop(self.0.wait());
    }
}
