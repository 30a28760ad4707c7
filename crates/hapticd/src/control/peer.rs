//! Who is at the other end of a connection, as the kernel tells it: no client can claim to be
//! somebody else.
//!
//! User and groups are those of the moment at which the client connected. Its program may have
//! become another since, so the program is for people to read and nothing is decided by it.
#![allow(unsafe_code, reason = "SO_PEERGROUPS has no safe wrapper")]

use haptic_ipc::Peer;
use nix::unistd::{Uid, User};
use rustix::fd::{AsFd, AsRawFd};
use rustix::io::Errno;
use std::cell::RefCell;
use std::collections::HashMap;
use std::time::Duration;
use tokio::net::UnixStream;
use tokio::sync::watch;

/// How long a client waits for the name of its user. The directory may be one on a network that
/// does not answer.
const NAME_TIMEOUT: Duration = Duration::from_millis(100);

/// Groups of a client that are looked at; Linux gives a process no more.
const MOST_GROUPS: usize = 65_536;

/// Users whose names are remembered; further ones go by their number. Whoever may make namespaces
/// has thousands of users.
const MOST_USERS: usize = 256;

/// The name of a user: nothing while it is looked for, and then what was found.
#[derive(Clone, Debug)]
struct Answer {
    found: watch::Receiver<Option<Option<String>>>,
    /// Whether it was waited for in vain.
    is_slow: bool,
}

/// The users seen so far.
#[derive(Debug, Default)]
pub(crate) struct UserNames(RefCell<HashMap<u32, Answer>>);

impl UserNames {
    /// The name of a user. Each is looked for once, on a thread of its own; a client goes without a
    /// name that does not come in time, and later ones of that user do not wait for it: their first
    /// word may be a stop.
    async fn of(&self, uid: u32) -> Option<String> {
        let known = self.0.borrow().get(&uid).cloned();
        let mut answer = match known {
            Some(answer) => answer,
            None if self.0.borrow().len() >= MOST_USERS => return None,
            None => self.0.borrow_mut().entry(uid).insert_entry(look_up(uid)?).get().clone(),
        };
        if answer.is_slow {
            return answer.found.borrow().clone().flatten();
        }
        let found = tokio::time::timeout(NAME_TIMEOUT, answer.found.wait_for(Option::is_some)).await;
        match found {
            Ok(found) => found.ok()?.clone().flatten(),
            Err(_) => {
                if let Some(answer) = self.0.borrow_mut().get_mut(&uid) {
                    answer.is_slow = true;
                }
                None
            }
        }
    }
}

/// Has a user looked for. On no thread of the runtime's own: the daemon would wait for that at its
/// end.
fn look_up(uid: u32) -> Option<Answer> {
    let (sender, found) = watch::channel(None);
    let looking = std::thread::Builder::new()
        .name("user-name".to_owned())
        .stack_size(256 * 1024)
        .spawn(move || {
            let user = User::from_uid(Uid::from_raw(uid)).ok().flatten();
            sender.send_replace(Some(user.map(|user| user.name)));
        });
    looking.ok().map(|_| Answer { found, is_slow: false })
}

/// Who is at the other end of a connection; `session` is its name in the greeting. Nothing where
/// the kernel does not say.
pub(crate) async fn peer_of(stream: &UnixStream, session: String, names: &UserNames) -> Option<Peer> {
    let credentials = stream.peer_cred().ok()?;
    // 0 is a process that cannot be seen from here, in another container.
    let pid = credentials.pid().filter(|pid| *pid > 0);
    // At once: a brief client may be gone when its user's name is there.
    let program = pid.and_then(program);
    Some(Peer {
        session,
        uid: credentials.uid(),
        user: names.of(credentials.uid()).await,
        pid,
        program,
    })
}

/// The program that a process runs, by the name that it gives itself: at most 15 bytes, with what
/// cannot be printed replaced.
fn program(pid: i32) -> Option<String> {
    let name = std::fs::read(format!("/proc/{pid}/comm")).ok()?;
    let name = String::from_utf8_lossy(name.strip_suffix(b"\n").unwrap_or(&name)).into_owned();
    // A name that moves the cursor must not rewrite a log on somebody's terminal.
    let shown = name.replace(char::is_control, "\u{fffd}");
    (!shown.is_empty()).then_some(shown)
}

/// Whether the client was a member of a group when it connected, be it the first or a further one.
pub(crate) fn is_member(stream: &UnixStream, group: u32) -> bool {
    stream.peer_cred().is_ok_and(|peer| peer.gid() == group)
        || further_groups(stream).is_ok_and(|groups| groups.contains(&group))
}

fn further_groups(socket: impl AsFd) -> rustix::io::Result<Vec<u32>> {
    let socket = socket.as_fd().as_raw_fd();
    let mut groups = vec![0_u32; 64];
    loop {
        let room = libc::socklen_t::try_from(size_of_val(&groups[..])).map_err(|_| Errno::NOMEM)?;
        let mut length = room;
        // SAFETY: `groups` has `length` bytes to be written, and both pointers are good for the
        // call.
        let done = unsafe {
            libc::getsockopt(
                socket,
                libc::SOL_SOCKET,
                libc::SO_PEERGROUPS,
                groups.as_mut_ptr().cast(),
                &raw mut length,
            )
        };
        let count = usize::try_from(length).map_err(|_| Errno::NOMEM)? / size_of::<u32>();
        if done == 0 {
            groups.truncate(count);
            return Ok(groups);
        }
        match Errno::from_io_error(&std::io::Error::last_os_error()) {
            // There are more: `length` says how many bytes they take.
            Some(Errno::RANGE) if length > room && count <= MOST_GROUPS => groups.resize(count, 0),
            error => return Err(error.unwrap_or(Errno::IO)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn the_other_end_of_a_pair_is_this_process() {
        let (near, _far) = UnixStream::pair().expect("a pair");
        let names = UserNames::default();
        let peer = peer_of(&near, "4321-7".to_owned(), &names).await.expect("it is known");
        assert_eq!(peer.uid, rustix::process::geteuid().as_raw());
        assert_eq!(peer.pid, i32::try_from(std::process::id()).ok());
        assert!(peer.program.is_some(), "{peer:?}");
        assert_eq!(peer.session, "4321-7");
        let again = peer_of(&near, "4321-7".to_owned(), &names).await.expect("it is known");
        assert_eq!(again, peer, "from memory as from the system");
    }

    #[tokio::test]
    async fn a_user_that_the_system_does_not_know_has_no_name() {
        let names = UserNames::default();
        assert_eq!(names.of(4_000_000_001).await, None);
        assert_eq!(names.of(0).await.as_deref(), Some("root"));
    }

    #[tokio::test]
    async fn membership_is_that_of_first_and_further_groups() {
        let (near, _far) = UnixStream::pair().expect("a pair");
        assert!(is_member(&near, rustix::process::getegid().as_raw()));
        for group in rustix::process::getgroups().expect("they are known") {
            assert!(is_member(&near, group.as_raw()), "{group:?}");
        }
        assert!(!is_member(&near, 4_000_000_001));
    }

    #[test]
    fn a_program_that_is_gone_has_no_name() {
        assert_eq!(program(i32::MAX), None);
    }
}
