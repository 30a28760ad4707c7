//! The leases that clients hold, and the time at which the next one expires.

use crate::rt::clock::now_ns;
use haptic_ipc::Peer;
use std::cell::RefCell;
use std::collections::BTreeSet;
use std::mem::replace;
use tokio::sync::Notify;

/// The leases of all clients.
#[derive(Debug, Default)]
pub(crate) struct Leases {
    held: RefCell<Vec<Lease>>,
    /// Sessions whose lease has expired since they last sent a line.
    absent: RefCell<BTreeSet<u64>>,
    changed: Notify,
}

/// The lease of one client.
#[derive(Clone, Debug)]
pub(super) struct Lease {
    pub(super) session: u64,
    pub(super) by: Peer,
    timeout_ns: u64,
    pub(super) until_ns: u64,
}

impl Leases {
    /// Number of leases held.
    pub(crate) fn count(&self) -> usize {
        self.held.borrow().len()
    }

    /// The timeout of the lease that a client holds, ms.
    pub(super) fn timeout_ms(&self, session: u64) -> Option<u32> {
        let held = self.held.borrow();
        let lease = held.iter().find(|lease| lease.session == session)?;
        Some(u32::try_from(lease.timeout_ns / 1_000_000).unwrap_or(u32::MAX))
    }

    /// Time at which the next lease expires, ns.
    pub(super) fn until_ns(&self) -> u64 {
        let held = self.held.borrow();
        held.iter().map(|lease| lease.until_ns).min().unwrap_or(u64::MAX)
    }

    /// Replaces a client's lease; a timeout of 0 ends it.
    pub(super) fn replace(&self, session: u64, by: &Peer, timeout_ms: u32) {
        let mut held = self.held.borrow_mut();
        held.retain(|lease| lease.session != session);
        if timeout_ms != 0 {
            let timeout_ns = u64::from(timeout_ms) * 1_000_000;
            held.push(Lease {
                session,
                by: by.clone(),
                timeout_ns,
                until_ns: now_ns() + timeout_ns,
            });
        }
    }

    /// A client has sent a line: restarts the timeout of its lease. Returns the time at which it would have
    /// expired, ns; `None` if the client holds none.
    pub(super) fn renew(&self, session: u64) -> Option<u64> {
        self.absent.borrow_mut().remove(&session);
        let mut held = self.held.borrow_mut();
        let lease = held.iter_mut().find(|lease| lease.session == session)?;
        Some(replace(&mut lease.until_ns, now_ns() + lease.timeout_ns))
    }

    /// Removes and returns leases that have expired.
    pub(super) fn take(&self, which: impl Fn(&Lease) -> bool) -> Vec<Lease> {
        let expired: Vec<Lease> = self.held.borrow_mut().extract_if(.., |lease| which(lease)).collect();
        self.absent
            .borrow_mut()
            .extend(expired.iter().map(|lease| lease.session));
        expired
    }

    /// Whether the lease of a client has expired since it last sent a line.
    pub(super) fn is_absent(&self, session: u64) -> bool {
        self.absent.borrow().contains(&session)
    }

    /// A client is gone, and will send nothing more.
    pub(super) fn forget(&self, session: u64) {
        self.absent.borrow_mut().remove(&session);
    }

    /// Notifies the task that waits for the next lease to expire.
    pub(super) fn notify(&self) {
        self.changed.notify_one();
    }

    /// Waits for [`notify`](Self::notify).
    pub(super) async fn changed(&self) {
        self.changed.notified().await;
    }
}
