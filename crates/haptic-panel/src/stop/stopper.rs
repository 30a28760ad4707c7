//! The thread that sends stops.

use super::line::{Received, Stop, StopLine, UNWRITTEN};
use super::stops::{SocketPlace, Stops};
use crate::update::StopNews;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use std::io::Read as _;
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::sync::{Arc, mpsc};
use std::time::{Duration, Instant};

/// Pause between two attempts to connect while a stop waits.
const HURRIED_RETRY: Duration = Duration::from_millis(50);

/// Pause between two attempts while the daemon has no place for a connection that only waits: its places
/// for stops are few, and shared.
const CROWDED_RETRY: Duration = Duration::from_secs(5);

pub(super) struct Stopper {
    stops: Arc<Stops>,
    woken: UnixStream,
    looked_for: mpsc::Receiver<SocketPlace>,
    news: mpsc::Sender<StopNews>,
    retry: Duration,
    path: Option<PathBuf>,
    /// A connection is kept ready.
    stays_ready: bool,
    line: Option<StopLine>,
    next_try: Instant,
    /// The newest stop that caused an attempt to connect.
    tried_for: u64,
    /// The newest stop that was reported as not sent.
    not_sent: u64,
    /// The newest stop that a socket has taken.
    sent: u64,
}

impl Stopper {
    pub(super) fn new(
        stops: Arc<Stops>,
        woken: UnixStream,
        looked_for: mpsc::Receiver<SocketPlace>,
        news: mpsc::Sender<StopNews>,
        retry: Duration,
    ) -> Self {
        Self {
            stops,
            woken,
            looked_for,
            news,
            retry,
            path: None,
            stays_ready: false,
            line: None,
            next_try: Instant::now(),
            tried_for: 0,
            not_sent: 0,
            sent: 0,
        }
    }

    pub(super) fn run(mut self) {
        while !self.stops.is_closed() {
            let now = Instant::now();
            let wanted = self.wanted();
            if let Err(reason) = self.serve(now, wanted) {
                self.lose_line(now, &reason);
            }
            self.wait(Instant::now());
            // A later wake-up interrupts the next wait.
            self.take_wake_ups();
        }
    }

    /// The newest stop, unless it is answered.
    fn wanted(&self) -> Option<Stop> {
        let number = self.stops.pressed();
        (number > self.stops.settled()).then(|| Stop {
            number,
            pressed_at: self.stops.pressed_at(),
        })
    }

    /// Does everything that needs no waiting.
    fn serve(&mut self, now: Instant, wanted: Option<Stop>) -> Result<(), String> {
        // A stop on a ready line comes first.
        self.send(now, wanted)?;
        self.take_places(now);
        self.connect(now, wanted)?;
        let received = self.line.as_mut().map_or(Ok(Vec::new()), StopLine::read)?;
        for message in received {
            match message {
                // The daemon would close such a line before it is needed, and it takes a place for stops.
                Received::Greeting {
                    is_for_a_moment: true, ..
                } if wanted.is_none() => {
                    self.line = None;
                    self.next_try = now + CROWDED_RETRY;
                }
                Received::Greeting { session, .. } => {
                    if let Some(number) = self.stops.greeted(&session) {
                        self.report(number, StopNews::Dropped);
                    }
                }
                Received::Answer(stop, result) => {
                    self.stops.settle(stop.number);
                    let after = stop.pressed_at.elapsed();
                    self.report(stop.number, StopNews::Answered { after, result });
                }
            }
        }
        self.send(now, self.wanted())?;
        match self.line.as_ref().and_then(|line| line.expired(now)) {
            Some(reason) => Err(reason.to_owned()),
            None => Ok(()),
        }
    }

    fn send(&mut self, now: Instant, wanted: Option<Stop>) -> Result<(), String> {
        let Some(line) = &mut self.line else { return Ok(()) };
        let is_enqueued = wanted.is_some_and(|stop| line.enqueue(stop));
        if is_enqueued || line.waits_to_write() {
            let is_written = line.write(now)?;
            if let Some(stop) = line.newest().filter(|_| is_written) {
                self.sent = self.sent.max(stop.number);
                // If this line is lost, that is reported again.
                self.not_sent = self.not_sent.min(stop.number.saturating_sub(1));
                self.report(stop.number, StopNews::Sent);
                // One may have been pressed during the write.
                return self.send(now, self.wanted());
            }
        }
        if let Some(stop) = wanted.filter(|stop| stop.number > self.sent && now >= stop.pressed_at + UNWRITTEN) {
            self.tell_not_sent(stop.number, "the daemon does not read");
        }
        Ok(())
    }

    fn connect(&mut self, now: Instant, wanted: Option<Stop>) -> Result<(), String> {
        // A new stop does not wait for the next attempt.
        let is_new = wanted.is_some_and(|stop| stop.number > self.tried_for);
        let is_due = is_new || (now >= self.next_try && (self.stays_ready || wanted.is_some()));
        let Some(path) = self.path.as_ref().filter(|_| is_due && self.line.is_none()) else {
            if let Some(stop) = wanted.filter(|_| self.path.is_none()) {
                self.tell_not_sent(stop.number, "no connection");
            }
            return Ok(());
        };
        if let Some(stop) = wanted {
            self.tried_for = stop.number;
        }
        self.line = Some(StopLine::open(path, now)?);
        Ok(())
    }

    fn lose_line(&mut self, now: Instant, reason: &str) {
        self.line = None;
        let wanted = self.wanted();
        let pause = if wanted.is_some() { HURRIED_RETRY } else { self.retry };
        self.next_try = now + pause;
        if let Some(stop) = wanted {
            // A stop in the socket of a silent daemon stays "sent, not confirmed". Without a socket
            // it is lost.
            if self.sent < stop.number || reason == "no connection" {
                self.tell_not_sent(stop.number, reason);
            }
        }
    }

    fn report(&self, number: u64, news: StopNews) {
        // The outcome of an older stop says nothing of the newest.
        if number == self.stops.pressed() {
            self.news.send(news).unwrap_or(());
        }
    }

    fn tell_not_sent(&mut self, number: u64, reason: &str) {
        if self.not_sent < number {
            self.not_sent = number;
            let reason = reason.to_owned();
            self.report(number, StopNews::NotSent { reason });
        }
    }

    fn take_places(&mut self, now: Instant) {
        while let Ok(SocketPlace { path, is_connected }) = self.looked_for.try_recv() {
            if self.path.as_ref() != Some(&path) {
                // Another daemon's.
                self.line = None;
            }
            self.path = Some(path);
            self.stays_ready |= is_connected;
            if is_connected && self.line.is_none() {
                self.next_try = now;
            }
        }
    }

    fn take_wake_ups(&mut self) {
        let mut bytes = [0; 64];
        while matches!(self.woken.read(&mut bytes), Ok(1..)) {}
    }

    /// Waits for the next event or deadline.
    fn wait(&self, now: Instant) {
        let wanted = self.wanted();
        let mut deadlines = vec![];
        match &self.line {
            Some(line) => deadlines.extend(line.deadline()),
            None if self.path.is_some() && (self.stays_ready || wanted.is_some()) => deadlines.push(self.next_try),
            None => {}
        }
        if let Some(stop) = wanted.filter(|stop| stop.number > self.sent.max(self.not_sent)) {
            deadlines.push(stop.pressed_at + UNWRITTEN);
        }
        let timeout = deadlines.into_iter().min().map(|deadline| {
            // A millisecond more, so that the deadline is past.
            let left = deadline.saturating_duration_since(now) + Duration::from_millis(1);
            Timespec::try_from(left).unwrap_or(Timespec { tv_sec: 1, tv_nsec: 0 })
        });
        let mut watched = vec![PollFd::new(&self.woken, PollFlags::IN)];
        if let Some(line) = &self.line {
            let mut flags = PollFlags::IN;
            if line.waits_to_write() {
                flags |= PollFlags::OUT;
            }
            watched.push(PollFd::new(line.stream(), flags));
        }
        // After an interrupted wait everything is checked as well.
        poll(&mut watched, timeout.as_ref()).unwrap_or_default();
    }
}
