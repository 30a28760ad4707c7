//! A thread that hangs, without a back door in the program: it is stopped by a tracer, alone.

use nix::sys::ptrace;
use nix::sys::wait::{WaitPidFlag, WaitStatus, waitpid};
use nix::unistd::Pid;
use std::fs;
use std::marker::PhantomData;

/// A thread of another process that stands still while the others of that process go on. It runs
/// again when this is dropped.
#[derive(Debug)]
pub struct HeldThread {
    thread: Pid,
    /// Its tracer is the thread that has taken hold of it, and no other.
    _here: PhantomData<*const ()>,
}

impl HeldThread {
    /// Takes hold of the real-time thread of a daemon.
    pub fn real_time(daemon: u32) -> Self {
        Self::thread(real_time_thread(daemon))
    }

    /// Takes hold of the control thread of a daemon, which is its first.
    pub fn control(daemon: u32) -> Self {
        Self::thread(daemon)
    }

    fn thread(number: u32) -> Self {
        let thread = Pid::from_raw(i32::try_from(number).expect("a thread"));
        ptrace::seize(thread, ptrace::Options::empty()).expect("a thread that may be traced");
        interrupt(thread);
        Self {
            thread,
            _here: PhantomData,
        }
    }

    /// Whether somebody has killed it. Its process is not gone before this has been asked.
    pub fn is_killed(&self) -> bool {
        match waitpid(self.thread, Some(WaitPidFlag::__WALL | WaitPidFlag::WNOHANG)) {
            Ok(WaitStatus::StillAlive) => false,
            Ok(WaitStatus::Signaled(..) | WaitStatus::Exited(..)) => true,
            other => panic!("{other:?}"),
        }
    }
}

impl Drop for HeldThread {
    fn drop(&mut self) {
        if ptrace::detach(self.thread, None).is_err() {
            // It has been killed meanwhile.
        }
    }
}

/// Has a traced thread stand still.
fn interrupt(thread: Pid) {
    ptrace::interrupt(thread).expect("it is traced");
    let stopped = waitpid(thread, Some(WaitPidFlag::__WALL)).expect("it is traced");
    assert!(matches!(stopped, WaitStatus::PtraceEvent(..)), "{stopped:?}");
}

/// The real-time thread of a daemon.
pub fn real_time_thread(daemon: u32) -> u32 {
    fs::read_dir(format!("/proc/{daemon}/task"))
        .expect("it runs")
        .filter_map(|task| task.ok()?.file_name().to_str()?.parse().ok())
        .find(|thread| {
            fs::read_to_string(format!("/proc/{daemon}/task/{thread}/comm")).is_ok_and(|name| name.trim() == "rt")
        })
        .expect("it has a real-time thread")
}
