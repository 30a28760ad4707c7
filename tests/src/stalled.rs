//! A disk that does not answer, for one program and without a file system of one's own: the kernel
//! holds its system calls that list a directory or wait for the disk, for a supervisor that never
//! looks.
#![allow(unsafe_code, reason = "a filter of system calls is set by pointers")]

use crate::Daemon;
use libc::{BPF_ABS, BPF_JEQ, BPF_JMP, BPF_K, BPF_LD, BPF_RET, BPF_W, sock_filter, sock_fprog};
use std::io;
use std::os::unix::process::CommandExt;
use std::process::Command;

const SECCOMP_SET_MODE_FILTER: libc::c_ulong = 1;
const SECCOMP_GET_ACTION_AVAIL: libc::c_ulong = 2;
const SECCOMP_FILTER_FLAG_NEW_LISTENER: libc::c_ulong = 1 << 3;
const SECCOMP_RET_USER_NOTIF: u32 = 0x7fc0_0000;
const SECCOMP_RET_ALLOW: u32 = 0x7fff_0000;

/// A daemon with a fake rig, whose disk does not answer; none where this kernel cannot hold system
/// calls.
pub fn daemon(arguments: &[&str]) -> Option<Daemon> {
    let directory = tempfile::tempdir().expect("a directory");
    let scenes = directory.path().join("scenes");
    let mut command = Command::new(crate::binary("hapticd"));
    command.args(["--device", "fake", "--scene-dir"]).arg(&scenes);
    command.arg("--state-dir").arg(directory.path().join("state"));
    command.args(arguments);
    if let Err(why) = stall_disk(&mut command) {
        test_run::skip("seccomp", &format!("a kernel that holds system calls: {why}"));
        return None;
    }
    // A directory that is not there is not read.
    std::fs::create_dir(scenes).expect("a directory");
    let mut daemon = Daemon::spawn(command, &directory.path().join("run/control.sock"));
    daemon._directory = Some(directory);
    Some(daemon)
}

/// Has a program, once it is started, stand for ever in each call that lists a directory or waits
/// until a file is on the disk. What kills it still does.
///
/// # Errors
/// This kernel cannot hold system calls.
fn stall_disk(command: &mut Command) -> io::Result<()> {
    let action = SECCOMP_RET_USER_NOTIF;
    // SAFETY: the kernel reads one word.
    let available = unsafe { libc::syscall(libc::SYS_seccomp, SECCOMP_GET_ACTION_AVAIL, 0, &raw const action) };
    if available != 0 {
        return Err(io::Error::last_os_error());
    }
    // SAFETY: between fork and exec only system calls are made, and nothing is allocated.
    unsafe {
        command.pre_exec(install);
    }
    Ok(())
}

fn install() -> io::Result<()> {
    let op = |code: u32, jt: u8, jf: u8, k: u32| sock_filter {
        code: u16::try_from(code).unwrap_or(0),
        jt,
        jf,
        k,
    };
    let number = |call: libc::c_long| u32::try_from(call).unwrap_or(u32::MAX);
    let mut filter = [
        // The number of the call is the first word of what a filter sees.
        op(BPF_LD | BPF_W | BPF_ABS, 0, 0, 0),
        op(BPF_JMP | BPF_JEQ | BPF_K, 2, 0, number(libc::SYS_getdents64)),
        op(BPF_JMP | BPF_JEQ | BPF_K, 1, 0, number(libc::SYS_fsync)),
        op(BPF_RET | BPF_K, 0, 0, SECCOMP_RET_ALLOW),
        op(BPF_RET | BPF_K, 0, 0, SECCOMP_RET_USER_NOTIF),
    ];
    let program = sock_fprog {
        len: u16::try_from(filter.len()).unwrap_or(0),
        filter: filter.as_mut_ptr(),
    };
    // SAFETY: the filter lives until the call is over, which copies it.
    let listener = unsafe {
        if libc::prctl(libc::PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0 {
            return Err(io::Error::last_os_error());
        }
        libc::syscall(
            libc::SYS_seccomp,
            SECCOMP_SET_MODE_FILTER,
            SECCOMP_FILTER_FLAG_NEW_LISTENER,
            &raw const program,
        )
    };
    let Ok(listener) = i32::try_from(listener) else {
        return Err(io::Error::last_os_error());
    };
    if listener < 0 {
        return Err(io::Error::last_os_error());
    }
    // The program itself keeps the supervisor's end: were that closed, the calls would fail instead.
    // SAFETY: the descriptor was just made.
    if unsafe { libc::fcntl(listener, libc::F_SETFD, 0) } != 0 {
        return Err(io::Error::last_os_error());
    }
    Ok(())
}
