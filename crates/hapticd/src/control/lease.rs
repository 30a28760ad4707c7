//! `lease`: a client as a dead man's switch. The real-time thread itself releases the rig when a
//! lease expires, even if this thread hangs; this file begins, renews and ends leases.

use crate::control::RigHandle;
use crate::control::admission::Admission;
use crate::control::peer::Requester;
use crate::control::rig::Asked;
use crate::rt::clock::now_ns;
use haptic_core::servo::Command;
use haptic_ipc::{ErrorCode, LeaseReply, Peer};
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::mem::replace;
use std::rc::Rc;
use std::time::Duration;
use tokio::sync::Notify;
use tokio::task::spawn_local;

/// The leases of all clients, and the time at which the next one expires.
#[derive(Debug, Default)]
pub(crate) struct Leases {
    held: RefCell<Vec<Lease>>,
    /// The lapses of each client whose lease has lapsed.
    lapses: RefCell<BTreeMap<u64, Lapses>>,
    changed: Notify,
}

/// How often the lease of a client has lapsed.
#[derive(Clone, Copy, Debug, Default)]
struct Lapses {
    count: u64,
    /// The client has not asked for another lease since.
    is_newest: bool,
}

#[derive(Clone, Debug)]
struct Lease {
    session: u64,
    by: Peer,
    timeout_ns: u64,
    until_ns: u64,
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
    fn until_ns(&self) -> u64 {
        let held = self.held.borrow();
        held.iter().map(|lease| lease.until_ns).min().unwrap_or(u64::MAX)
    }

    /// Replaces a client's lease; a timeout of 0 ends it.
    fn replace(&self, session: u64, by: &Peer, timeout_ms: u32) {
        let mut held = self.held.borrow_mut();
        held.retain(|lease| lease.session != session);
        if let Some(lapses) = self.lapses.borrow_mut().get_mut(&session) {
            lapses.is_newest = false;
        }
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
    fn renew(&self, session: u64) -> Option<u64> {
        let mut held = self.held.borrow_mut();
        let lease = held.iter_mut().find(|lease| lease.session == session)?;
        Some(replace(&mut lease.until_ns, now_ns() + lease.timeout_ns))
    }

    /// Removes and returns leases that have expired.
    fn take(&self, which: impl Fn(&Lease) -> bool) -> Vec<Lease> {
        let expired: Vec<Lease> = self.held.borrow_mut().extract_if(.., |lease| which(lease)).collect();
        for lease in &expired {
            let mut lapses = self.lapses.borrow_mut();
            let lapses = lapses.entry(lease.session).or_default();
            (lapses.count, lapses.is_newest) = (lapses.count + 1, true);
        }
        expired
    }

    /// How often the lease of a client has lapsed.
    pub(super) fn lapses(&self, session: u64) -> u64 {
        self.lapses.borrow().get(&session).map_or(0, |lapses| lapses.count)
    }

    /// Whether the lease of a client has lapsed, and it has not asked for another since: it may not know that its silence
    /// would let the rig go on.
    pub(super) fn has_lapsed(&self, session: u64) -> bool {
        self.lapses
            .borrow()
            .get(&session)
            .is_some_and(|lapses| lapses.is_newest)
    }

    /// A client is gone, and will send nothing more.
    pub(super) fn forget(&self, session: u64) {
        self.lapses.borrow_mut().remove(&session);
    }
}

/// Why a lease lapses whose time is over.
const SILENT: &str = "its client has fallen silent";

/// Begins, changes or ends the lease of a client.
pub(super) fn lease(rig: &RigHandle, by: Requester<'_>, timeout_ms: u32) -> LeaseReply {
    rig.leases.replace(by.session, by.peer, timeout_ms);
    publish(rig);
    LeaseReply { timeout_ms }
}

/// Renews the lease of a client that has sent a line, if it has one. Waits for nothing: the line may be a stop.
pub(super) fn renew(rig: &Rc<RigHandle>, session: u64) {
    let Some(until_ns) = rig.leases.renew(session) else {
        return;
    };
    publish(rig);
    if now_ns() > until_ns {
        // The real-time thread may have seen the end before it received the new one, and have released the rig: so the
        // lease has lapsed, whatever the line asks for.
        rig.channel.shared.lease_until(until_ns);
        let expired = rig.leases.take(|lease| lease.session == session);
        let rig = Rc::clone(rig);
        drop(spawn_local(async move { expire(&rig, expired, SILENT).await }));
    }
}

/// Expires the lease of a client that has closed its connection.
pub(super) async fn closed(rig: &RigHandle, session: u64) {
    let expired = rig.leases.take(|lease| lease.session == session);
    expire(rig, expired, "its client has closed the connection").await;
}

/// Expires leases when their time is over, for ever.
pub(crate) async fn watch(rig: &RigHandle) {
    loop {
        let until_ns = rig.leases.until_ns();
        let left = Duration::from_nanos(until_ns.saturating_sub(now_ns()));
        tokio::select! {
            () = rig.leases.changed.notified() => continue,
            () = tokio::time::sleep(left), if until_ns != u64::MAX => {}
        }
        let now = now_ns();
        let expired = rig.leases.take(|lease| lease.until_ns <= now);
        expire(rig, expired, SILENT).await;
    }
}

/// Releases the rig, and enters the reason into the journal.
async fn expire(rig: &RigHandle, expired: Vec<Lease>, why: &str) {
    if expired.is_empty() {
        return;
    }
    for lease in expired {
        rig.end_schedule_of(lease.session, why);
        rig.enter_done("lease_lapsed", Some(&lease.by), Some(why.to_owned()));
    }
    // The real-time thread has already released the rig, unless the client closed its connection
    // early. A rig that is stopped or faulted has no force.
    let why = format!("a lease has lapsed: {why}");
    let (stops, asked) = (rig.channel.stops(), Asked::ByLapse(&why));
    if let Err(error) = rig.carry_out(Command::Release, Admission::NONE, stops, asked).await
        && error.code == ErrorCode::NotResponding
    {
        crate::say(&error.message);
    }
    // Last: until the release is sent, the real-time thread must know that the lease has expired.
    publish(rig);
}

/// Tells the real-time thread and [`watch`] when the next lease expires.
fn publish(rig: &RigHandle) {
    rig.channel.shared.lease_until(rig.leases.until_ns());
    rig.leases.changed.notify_one();
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::rig::ReadAfter;
    use crate::control::rig::fixture::rig;
    use tokio::task::{LocalSet, yield_now};

    /// In the moment in which the real-time thread releases the rig, and before [`watch`] hears of it.
    #[tokio::test]
    async fn lease_renewed_too_late_has_lapsed_in_the_journal() {
        let (rig, _producer) = rig();
        let (rig, peer) = (Rc::new(rig), Peer::default());
        let by = Requester {
            session: 1,
            peer: &peer,
        };
        lease(&rig, by, 1);
        let until_ns = rig.leases.until_ns();
        while now_ns() <= until_ns {
            std::hint::spin_loop();
        }
        let late = async {
            renew(&rig, 1);
            // What the late line asks for is another lease.
            lease(&rig, by, 60_000);
            yield_now().await;
        };
        LocalSet::new().run_until(late).await;
        rig.pump();
        let entries = rig.journal(0, 9).entries;
        let entered: Vec<_> = entries
            .iter()
            .map(|entry| (&*entry.op, entry.message.as_deref()))
            .collect();
        assert_eq!(entered, [("lease_lapsed", Some(SILENT))]);
        assert_eq!(rig.leases.count(), 1, "and the new one holds");
    }

    // hazard: F4
    #[tokio::test]
    async fn client_whose_lease_lapsed_engages_only_after_another() {
        let (rig, _producer) = rig();
        let (session, peer) = (1, Peer::default());
        let by = Requester { session, peer: &peer };
        let read_now = || ReadAfter {
            stops: rig.channel.stops(),
            lapses: rig.leases.lapses(session),
        };
        lease(&rig, by, 1000);
        let before = read_now();
        drop(rig.leases.take(|_| true));
        // It goes on as if nothing had happened.
        rig.leases.renew(session);
        let refused = rig.engage(true, read_now(), by).await.expect_err("nothing guards it");
        assert!(refused.message.contains("ask for `lease` again"), "{}", refused.message);
        lease(&rig, by, 1000);
        assert!(!rig.leases.has_lapsed(session), "it is guarded again");
        let refused = rig
            .engage(true, before, by)
            .await
            .expect_err("its lease has lapsed since");
        assert!(refused.message.contains("has expired since"), "{}", refused.message);
    }
}
