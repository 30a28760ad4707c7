//! `lease`: a client as a dead man's switch. The real-time thread itself lets the force out when a lease lapses, so that it does even if this thread hangs; here the
//! leases are kept, moved on and ended.

use crate::control::RigHandle;
use crate::control::journal::Until;
use crate::control::requester::Requester;
use crate::rt::clock::now_ns;
use haptic_core::servo::Command;
use haptic_ipc::{ErrorCode, JournalEntry, LEASE_TIMEOUT_MS, LeaseReply, Peer, WireError};
use std::cell::RefCell;
use std::time::Duration;
use tokio::sync::Notify;

/// The leases of all clients.
#[derive(Debug, Default)]
pub(crate) struct Leases {
    held: RefCell<Vec<Lease>>,
    /// Something has changed for whoever waits for the first to lapse.
    changed: Notify,
}

#[derive(Clone, Debug)]
struct Lease {
    session: u64,
    by: Peer,
    timeout_ns: u64,
    until_ns: u64,
}

impl Leases {
    /// How many there are.
    pub(crate) fn count(&self) -> usize {
        self.held.borrow().len()
    }

    /// Whether a client has one.
    pub(super) fn is_held_by(&self, session: u64) -> bool {
        self.held.borrow().iter().any(|lease| lease.session == session)
    }

    /// How long a client with one may be silent, ms.
    pub(super) fn longest_ms(&self, session: u64) -> u32 {
        let held = self.held.borrow();
        let lease = held.iter().find(|lease| lease.session == session);
        let timeout_ns = lease.map_or(0, |lease| lease.timeout_ns);
        u32::try_from(timeout_ns / 1_000_000).unwrap_or(u32::MAX)
    }

    /// When the first lapses, ns.
    fn until_ns(&self) -> u64 {
        self.held
            .borrow()
            .iter()
            .map(|lease| lease.until_ns)
            .min()
            .unwrap_or(u64::MAX)
    }
}

/// Begins, changes or ends the lease of a client.
///
/// # Errors
/// The time is out of range.
pub(super) fn lease(rig: &RigHandle, by: Requester<'_>, timeout_ms: u32) -> Result<LeaseReply, WireError> {
    if timeout_ms != 0 && !LEASE_TIMEOUT_MS.contains(&timeout_ms) {
        let (min, max) = (*LEASE_TIMEOUT_MS.start(), *LEASE_TIMEOUT_MS.end());
        let message = format!(
            "timeout_ms = {timeout_ms} ms is out of range: it must be from {min} to {max} ms, or 0 to end the lease"
        );
        return Err(WireError::new(ErrorCode::OutOfRange, message)
            .about("timeout_ms")
            .within(timeout_ms.into(), min.into(), max.into(), "ms"));
    }
    let leases = rig.leases();
    leases.held.borrow_mut().retain(|lease| lease.session != by.session);
    if timeout_ms != 0 {
        let timeout_ns = u64::from(timeout_ms) * 1_000_000;
        leases.held.borrow_mut().push(Lease {
            session: by.session,
            by: by.peer.clone(),
            timeout_ns,
            until_ns: now_ns() + timeout_ns,
        });
    }
    publish(rig);
    Ok(LeaseReply { timeout_ms })
}

/// A client has said something: if it has a lease, that begins anew.
pub(super) fn renew(rig: &RigHandle, session: u64) {
    let mut held = rig.leases().held.borrow_mut();
    let Some(lease) = held.iter_mut().find(|lease| lease.session == session) else {
        return;
    };
    lease.until_ns = now_ns() + lease.timeout_ns;
    drop(held);
    publish(rig);
}

/// A client has gone: if it still had a lease, that lapses now.
pub(super) async fn gone(rig: &RigHandle, session: u64) {
    let lapsed = take(rig, |lease| lease.session == session);
    lapse(rig, lapsed, "its client has closed the connection").await;
}

/// Ends the leases that lapse. For ever.
pub(crate) async fn watch(rig: &RigHandle) {
    loop {
        let until_ns = rig.leases().until_ns();
        let left = Duration::from_nanos(until_ns.saturating_sub(now_ns()));
        tokio::select! {
            () = rig.leases().changed.notified() => continue,
            () = tokio::time::sleep(left), if until_ns != u64::MAX => {}
        }
        let now = now_ns();
        let lapsed = take(rig, |lease| lease.until_ns <= now);
        lapse(rig, lapsed, "its client has fallen silent").await;
    }
}

fn take(rig: &RigHandle, which: impl Fn(&Lease) -> bool) -> Vec<Lease> {
    rig.leases()
        .held
        .borrow_mut()
        .extract_if(.., |lease| which(lease))
        .collect()
}

/// Lets the force out, and says why.
async fn lapse(rig: &RigHandle, lapsed: Vec<Lease>, why: &str) {
    if lapsed.is_empty() {
        return;
    }
    for lease in lapsed {
        let entry = JournalEntry {
            by: Some(lease.by),
            message: Some(why.to_owned()),
            ..JournalEntry::of("lease_lapsed")
        };
        rig.enter(Until::Done, entry);
    }
    // The real-time thread has done so already, unless the client has gone before its time. A rig that is stopped or faulted has no force to let out.
    if let Err(error) = rig.command(Command::Release, rig.stops(), None).await
        && error.code == ErrorCode::NotResponding
    {
        crate::say(&error.message);
    }
    // Only now: until the release is on its way, the thread must know that the lease has lapsed.
    publish(rig);
}

/// Tells the real-time thread, and whoever waits here, when the first lease lapses.
fn publish(rig: &RigHandle) {
    rig.lease_until(rig.leases().until_ns());
    rig.leases().changed.notify_one();
}
