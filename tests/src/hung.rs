//! A thread that is made to hang, in the real program and without a back door in it: a tracer puts
//! its registers where it wants them.

use crate::held::interrupt;
use nix::libc::{self, user_regs_struct};
use nix::sys::ptrace;
use nix::unistd::Pid;
use std::marker::PhantomData;
use std::os::fd::RawFd;

/// `syscall`
const SYSCALL: [u8; 2] = [0x0f, 0x05];

/// A jump to itself.
const JUMP_TO_ITSELF: [u8; 2] = [0xeb, 0xfe];

/// How a thread hangs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Hang {
    /// It stands in a write to a descriptor that takes nothing.
    Writing(RawFd),
    /// It goes round and round.
    Spinning,
}

/// A thread of another process that hangs. It goes on where it was when this is dropped.
#[derive(Debug)]
pub struct HungThread {
    thread: Pid,
    was: user_regs_struct,
    /// The word of its program that was written over, and its address.
    word: Option<(libc::c_long, ptrace::AddressType)>,
    /// Its tracer is the thread that has taken hold of it, and no other.
    _here: PhantomData<*const ()>,
}

impl HungThread {
    /// Has the thread of a daemon hang that serves its clients.
    pub fn control(daemon: u32, hang: Hang) -> Self {
        let thread = Pid::from_raw(i32::try_from(daemon).expect("a process"));
        ptrace::seize(thread, ptrace::Options::empty()).expect("a thread that may be traced");
        // Nearly always it waits in a system call; where it does not, a moment later it will.
        let (mut was, word) = loop {
            interrupt(thread);
            let was = ptrace::getregs(thread).expect("it stands still");
            let before = address(was.rip - 2);
            let word = ptrace::read(thread, before).expect("its program");
            if word.to_ne_bytes()[..2] == SYSCALL {
                break (was, word);
            }
            ptrace::cont(thread, None).expect("it stood still");
            crate::pause();
        };
        // What it waited for is interrupted, and not begun again.
        was.orig_rax = u64::MAX;
        let mut registers = was;
        registers.rip -= 2;
        let place = address(registers.rip);
        let word = match hang {
            Hang::Writing(descriptor) => {
                registers.rax = u64::try_from(libc::SYS_write).expect("a number");
                registers.rdi = u64::try_from(descriptor).expect("a descriptor");
                registers.rsi = was.rsp;
                registers.rdx = 1;
                None
            }
            Hang::Spinning => {
                let mut bytes = word.to_ne_bytes();
                bytes[..2].copy_from_slice(&JUMP_TO_ITSELF);
                ptrace::write(thread, place, libc::c_long::from_ne_bytes(bytes)).expect("its program");
                Some((word, place))
            }
        };
        ptrace::setregs(thread, registers).expect("it stands still");
        ptrace::cont(thread, None).expect("it stood still");
        Self {
            thread,
            was,
            word,
            _here: PhantomData,
        }
    }
}

impl Drop for HungThread {
    fn drop(&mut self) {
        interrupt(self.thread);
        if let Some((word, place)) = self.word {
            ptrace::write(self.thread, place, word).expect("its program");
        }
        ptrace::setregs(self.thread, self.was).expect("it stands still");
        ptrace::detach(self.thread, None).expect("it stood still");
    }
}

fn address(of: u64) -> ptrace::AddressType {
    std::ptr::with_exposed_provenance_mut(usize::try_from(of).expect("64 bits"))
}
