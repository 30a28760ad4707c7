//! Asks a converter not to collect bytes before it passes them on: one by FTDI waits 16 ms by
//! default, and 1 ms with this setting.
#![allow(unsafe_code, reason = "these two requests have no safe wrapper")]

use rustix::fd::{AsRawFd, BorrowedFd};

/// `struct serial_struct` of the kernel's interface (linux/serial.h), of which only the flags
/// matter here.
#[repr(C)]
struct SerialStruct {
    kind: libc::c_int,
    line: libc::c_int,
    port: libc::c_uint,
    irq: libc::c_int,
    flags: libc::c_int,
    /// The rest, with room to spare, which is returned unchanged.
    rest: [u64; 16],
}

const ASYNC_LOW_LATENCY: libc::c_int = 1 << 13;

/// Asks for low latency. CDC-ACM collects nothing, and a pseudo-terminal does not know the request:
/// neither is an error.
pub(crate) fn ask(line: BorrowedFd<'_>) {
    let mut serial = SerialStruct {
        kind: 0,
        line: 0,
        port: 0,
        irq: 0,
        flags: 0,
        rest: [0; 16],
    };
    // SAFETY: the kernel writes its own, shorter structure to the beginning of this one, and reads
    // it from there.
    unsafe {
        if libc::ioctl(line.as_raw_fd(), libc::TIOCGSERIAL, &raw mut serial) == 0 {
            serial.flags |= ASYNC_LOW_LATENCY;
            libc::ioctl(line.as_raw_fd(), libc::TIOCSSERIAL, &raw const serial);
        }
    }
}
