//! The user, groups and program of a client, from the kernel: no client can claim to be another
//! user.
//!
//! User and groups are those at the time of the connection. The program may have changed since, so
//! it is only shown to people; no decision depends on it.
#![allow(unsafe_code, reason = "SO_PEERGROUPS has no safe wrapper")]

use crate::threads::Workers;
use haptic_ipc::Peer;
use nix::unistd::{Uid, User};
use rustix::fd::{AsFd, AsRawFd};
use rustix::io::Errno;
use std::cell::RefCell;
use std::collections::HashMap;
use std::time::Duration;
use tokio::net::UnixStream;
use tokio::sync::watch;

/// How long a client waits for the name of its user. The user directory may be on a network that
/// does not answer.
const NAME_TIMEOUT: Duration = Duration::from_millis(100);

/// Most groups of a process in Linux.
const MAX_GROUPS: usize = 65_536;

/// Most users whose names are remembered; further users have only a number. A user who can create
/// namespaces has thousands of user ids.
const MAX_USERS: usize = 256;

/// Most look-ups at once: a user directory that does not answer keeps a thread for each.
const MAX_LOOK_UPS: usize = 4;

/// The look-up of a user's name.
#[derive(Clone, Debug)]
struct LookUp {
    /// `None` while the look-up runs; then the name, if the user has one.
    found: watch::Receiver<Option<Option<String>>>,
    /// Whether it has exceeded [`NAME_TIMEOUT`].
    is_slow: bool,
}

/// The users seen so far.
#[derive(Debug)]
pub(crate) struct UserNames {
    known: RefCell<HashMap<u32, LookUp>>,
    directory: Workers,
}

impl Default for UserNames {
    fn default() -> Self {
        Self {
            known: RefCell::default(),
            directory: Workers::new("user-name", MAX_LOOK_UPS),
        }
    }
}

impl UserNames {
    /// The name of a user. Each user is looked up once. A client has no name if the look-up is too slow or there are
    /// too many, and later clients of that user do not wait for it: their first line may be a stop.
    async fn of(&self, uid: u32) -> Option<String> {
        let known = self.known.borrow().get(&uid).cloned();
        let mut answer = match known {
            Some(answer) => answer,
            None if self.known.borrow().len() >= MAX_USERS => return None,
            None => self.look_up(uid)?,
        };
        if answer.is_slow {
            return answer.found.borrow().clone().flatten();
        }
        let found = tokio::time::timeout(NAME_TIMEOUT, answer.found.wait_for(Option::is_some)).await;
        match found {
            Ok(found) => found.ok()?.clone().flatten(),
            Err(_) => {
                if let Some(answer) = self.known.borrow_mut().get_mut(&uid) {
                    answer.is_slow = true;
                }
                None
            }
        }
    }

    fn look_up(&self, uid: u32) -> Option<LookUp> {
        let (sender, found) = watch::channel(None);
        let is_begun = self.directory.begin(move || {
            let user = User::from_uid(Uid::from_raw(uid)).ok().flatten();
            sender.send_replace(Some(user.map(|user| user.name)));
        });
        let look_up = LookUp { found, is_slow: false };
        is_begun.then(|| self.known.borrow_mut().entry(uid).insert_entry(look_up).get().clone())
    }
}

/// The client of a connection; `session` is its name in the greeting. `None` if the kernel does not
/// tell.
pub(crate) async fn peer_of(stream: &UnixStream, session: String, names: &UserNames) -> Option<Peer> {
    let credentials = stream.peer_cred().ok()?;
    // 0 is a process that is not visible from here, in another container.
    let pid = credentials.pid().filter(|pid| *pid > 0);
    // First: a brief client may be gone by the time its user's name is found.
    let program = pid.and_then(program);
    Some(Peer {
        session,
        uid: credentials.uid(),
        user: names.of(credentials.uid()).await,
        pid,
        program,
    })
}

/// The name that a process gives itself: at most 15 bytes, with control characters replaced.
fn program(pid: i32) -> Option<String> {
    let name = std::fs::read(format!("/proc/{pid}/comm")).ok()?;
    let name = String::from_utf8_lossy(name.strip_suffix(b"\n").unwrap_or(&name)).into_owned();
    // A name with control characters must not rewrite a log on a terminal.
    let shown = name.replace(char::is_control, "\u{fffd}");
    (!shown.is_empty()).then_some(shown)
}

/// Whether the client was a member of a group, primary or supplementary, when it connected.
pub(crate) fn is_member(stream: &UnixStream, group: u32) -> bool {
    stream.peer_cred().is_ok_and(|peer| peer.gid() == group)
        || supplementary_groups(stream).is_ok_and(|groups| groups.contains(&group))
}

fn supplementary_groups(socket: impl AsFd) -> rustix::io::Result<Vec<u32>> {
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
            Some(Errno::RANGE) if length > room && count <= MAX_GROUPS => groups.resize(count, 0),
            error => return Err(error.unwrap_or(Errno::IO)),
        }
    }
}

/// A client, as the journal and the history know it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Requester<'a> {
    pub(crate) session: u64,
    pub(crate) peer: &'a Peer,
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
    async fn membership_is_that_of_first_and_supplementary_groups() {
        let (near, _far) = UnixStream::pair().expect("a pair");
        assert!(is_member(&near, rustix::process::getegid().as_raw()));
        for group in rustix::process::getgroups().expect("they are known") {
            assert!(is_member(&near, group.as_raw()), "{group:?}");
        }
        assert!(!is_member(&near, 4_000_000_001));
    }
}
