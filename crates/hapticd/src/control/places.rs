//! The places for clients: as many as there are descriptors for, with some kept for those who come to stop the rig.

use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
use std::cell::{Cell, RefCell};
use std::collections::VecDeque;
use std::os::fd::AsRawFd;
use std::rc::Rc;
use std::time::{Duration, Instant};
use tokio::sync::Notify;

/// Clients served at once.
pub(super) const MAX_CLIENTS: usize = 32;

/// Most newcomers on a socket at once, beyond its clients.
const MAX_NEWCOMERS: usize = 16;

/// Descriptors for everything else: a device that comes back, files of scenes, a monitor's scrapes, the journal.
const KEPT: usize = 8;

/// Limit of descriptors that is asked for: more than are ever used.
const WANTED: u64 = 1024;

/// Shortest time for which a newcomer is listened to, however many wait behind it.
const MIN_LISTENING: Duration = Duration::from_millis(2);

/// How long a newcomer is listened to.
const LISTEN_FOR: Duration = Duration::from_millis(100);

/// How long the answer to its stop may take.
const ANSWERED_WITHIN: Duration = Duration::from_secs(2);

/// A client for which there is no place: it is listened to for a moment, to stop the rig.
#[derive(Debug)]
pub(super) struct Newcomer {
    since: Instant,
    /// Places for clients, all of which are taken.
    pub(super) places: usize,
    /// It has asked for a stop.
    stops: Cell<bool>,
    away: Notify,
}

impl Newcomer {
    /// It asks for a stop: it stays until it has its answer.
    pub(super) fn asks_for_a_stop(&self) {
        self.stops.set(true);
    }

    /// Whether it has not asked for a stop.
    pub(super) fn is_silent(&self) -> bool {
        !self.stops.get()
    }

    /// Until it has been listened to for long enough.
    pub(super) async fn over(&self) {
        drop(tokio::time::timeout(LISTEN_FOR, self.away.notified()).await);
        if self.stops.get() {
            tokio::time::sleep(ANSWERED_WITHIN).await;
        }
    }
}

#[derive(Debug)]
pub(super) struct Places {
    most_clients: usize,
    most_newcomers: usize,
    pub(super) clients: Rc<Cell<usize>>,
    newcomers: RefCell<VecDeque<Rc<Newcomer>>>,
    /// A newcomer has left.
    left: Notify,
}

impl Places {
    /// As many on each of some sockets as this process may have descriptors for, beside those that it has now. Raises
    /// its limit as far as it may.
    pub(super) fn of_process(sockets: usize) -> Self {
        let limit = getrlimit(Resource::Nofile);
        if limit.current.is_some_and(|current| current < WANTED) {
            let raised = Rlimit {
                current: Some(limit.maximum.map_or(WANTED, |most| most.min(WANTED))),
                maximum: limit.maximum,
            };
            // It may stay as it is: the places go by what there is.
            setrlimit(Resource::Nofile, raised).unwrap_or_default();
        }
        let limit = getrlimit(Resource::Nofile)
            .current
            .map_or(usize::MAX, |limit| usize::try_from(limit).unwrap_or(usize::MAX));
        Self::within(limit.saturating_sub(descriptors_in_use()), sockets)
    }

    fn within(free: usize, sockets: usize) -> Self {
        let places = free.saturating_sub(KEPT) / sockets;
        let most_newcomers = (places / 2).clamp(1, MAX_NEWCOMERS);
        Self {
            most_clients: places.saturating_sub(most_newcomers).clamp(1, MAX_CLIENTS),
            most_newcomers,
            clients: Rc::default(),
            newcomers: RefCell::default(),
            left: Notify::new(),
        }
    }

    /// Whether there is a place for another client.
    pub(super) fn has_room(&self) -> bool {
        self.clients.get() < self.most_clients
    }

    /// A place for a newcomer. Where all are taken, the one that has been silent for longest is sent away.
    pub(super) async fn admit(&self) -> Rc<Newcomer> {
        while self.newcomers.borrow().len() >= self.most_newcomers {
            self.send_one_away().await;
        }
        let newcomer = Rc::new(Newcomer {
            since: Instant::now(),
            places: self.most_clients,
            stops: Cell::new(false),
            away: Notify::new(),
        });
        self.newcomers.borrow_mut().push_back(Rc::clone(&newcomer));
        newcomer
    }

    /// Sends the newcomer away that has been silent for longest, and waits until one has left.
    pub(super) async fn send_one_away(&self) {
        let oldest = self
            .newcomers
            .borrow()
            .iter()
            .find(|newcomer| newcomer.is_silent())
            .cloned();
        if let Some(oldest) = oldest {
            let listened_for = oldest.since.elapsed();
            if listened_for < MIN_LISTENING {
                tokio::time::sleep(MIN_LISTENING - listened_for).await;
            }
            oldest.away.notify_one();
        }
        // Those who have asked for a stop have their answer soon.
        drop(tokio::time::timeout(MIN_LISTENING, self.left.notified()).await);
    }

    /// Gives a newcomer's place back.
    pub(super) fn give_back(&self, newcomer: &Rc<Newcomer>) {
        self.newcomers.borrow_mut().retain(|other| !Rc::ptr_eq(other, newcomer));
        self.left.notify_one();
    }
}

/// How many descriptors this process has, about: the system gives the lowest free number. A disk that does not answer
/// is not asked.
fn descriptors_in_use() -> usize {
    let next = rustix::io::dup(std::io::stdin()).map(|next| usize::try_from(next.as_raw_fd()).unwrap_or(0));
    next.unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    // hazard: H24
    #[test]
    fn client_places_fit_the_free_descriptors() {
        for (free, sockets, clients, newcomers) in [
            (1000, 1, 32, 16),
            (1000, 2, 32, 16),
            (56, 1, 32, 16),
            (40, 1, 16, 16),
            (20, 1, 6, 6),
            (20, 2, 3, 3),
            (0, 1, 1, 1),
        ] {
            let places = Places::within(free, sockets);
            assert_eq!(
                (places.most_clients, places.most_newcomers),
                (clients, newcomers),
                "{free} on {sockets}"
            );
        }
    }

    // hazard: H24
    #[tokio::test]
    async fn full_places_send_away_the_longest_silent_newcomer() {
        let places = Places::within(1000, 1);
        let mut newcomers = Vec::new();
        for _ in 0..MAX_NEWCOMERS {
            newcomers.push(places.admit().await);
        }
        newcomers[0].asks_for_a_stop();
        places.send_one_away().await;
        let mut sent_away = Vec::new();
        for newcomer in &newcomers[..3] {
            sent_away.push(tokio::time::timeout(Duration::ZERO, newcomer.over()).await.is_ok());
        }
        assert_eq!(sent_away, [false, true, false], "the first has asked for a stop");
    }
}
