//! Notifications of the service manager: readiness, status, the end of the daemon, and the
//! watchdog.
//!
//! The watchdog is fed from the control thread, and only when the loop has ticked since the last
//! time: whichever of the two threads hangs, the manager restarts the daemon. The real-time thread
//! does nothing for it, since its newest tick comes with the telemetry.
//!
//! The manager's own timeout is long: a machine that wakes up from a sleep takes seconds for its devices, in which
//! nobody can feed it. A loop that hangs is reported to the manager long before, counted in turns of the control
//! thread, which a sleep does not use up.

use crate::control::RigHandle;
use crate::threads;
use crate::timers::every;
use sd_notify::NotifyState;
use std::sync::mpsc::{SyncSender, sync_channel};
use std::time::Duration;
use tokio::time::{Instant, sleep};

/// Times that the watchdog is fed within its timeout, at least: one late feeding does no harm.
const FEEDINGS: u32 = 4;

/// Longest time between two feedings.
const FEEDING_PERIOD: Duration = Duration::from_millis(125);

/// Turns in a row without a tick after which the manager is asked to restart the daemon.
const HANGING_TURNS: u32 = 4;

/// Period of the status without a watchdog.
const STATUS_PERIOD: Duration = Duration::from_millis(500);

/// Most messages that wait for a manager that does not read; further ones are dropped.
const BACKLOG: usize = 8;

/// The service manager, if there is one.
#[derive(Debug)]
pub(crate) struct ServiceManager {
    messages: Option<SyncSender<String>>,
    /// Period at which its watchdog is fed.
    feeding: Option<Duration>,
}

impl ServiceManager {
    /// The manager that started this process, if it wants notifications.
    ///
    /// # Errors
    /// The system has no thread left.
    pub(crate) fn of_process() -> std::io::Result<Self> {
        if std::env::var_os("NOTIFY_SOCKET").is_none() {
            return Ok(Self {
                messages: None,
                feeding: None,
            });
        }
        // A thread of its own sends: sending blocks while the manager does not read, and a stop
        // must never wait for that.
        let (messages, to_send) = sync_channel::<String>(BACKLOG);
        threads::start("notify", 64 * 1024, move || {
            let mut was_sent = true;
            for message in to_send {
                let sent = sd_notify::notify(&[NotifyState::Custom(&message)]);
                if let Err(error) = &sent
                    && was_sent
                {
                    crate::say(&format!("cannot notify the service manager: {error}"));
                }
                was_sent = sent.is_ok();
            }
        })?;
        Ok(Self {
            messages: Some(messages),
            feeding: sd_notify::watchdog_enabled().map(|timeout| FEEDING_PERIOD.min(timeout / FEEDINGS)),
        })
    }

    /// Reports readiness after the first tick of the loop, and then the status, for ever.
    pub(crate) async fn watch(&self, rig: &RigHandle) {
        if self.messages.is_none() {
            return std::future::pending().await;
        }
        while rig.feed().newest().is_none() {
            sleep(Duration::from_millis(1)).await;
        }
        let mut pause = every(self.feeding.unwrap_or(STATUS_PERIOD).max(Duration::from_millis(1)));
        let (mut last_tick, mut ticked_at, mut reported, mut ready) = (None, Instant::now(), String::new(), false);
        let mut hanging_turns = 0;
        loop {
            pause.tick().await;
            let Some(newest) = rig.feed().newest().copied() else {
                continue;
            };
            let mut news = Vec::new();
            if !ready {
                news.push(NotifyState::Ready);
            }
            let mut status = newest.state.to_string();
            if let Some(fault) = newest.fault {
                status.push_str(&format!(": {fault}"));
            }
            if let Some(why) = rig.reloads.refusal().as_deref() {
                status.push_str(&format!(
                    "; the last reload was refused: {}",
                    why.lines().next().unwrap_or_default()
                ));
            }
            if last_tick.replace(newest.tick) == Some(newest.tick) {
                status = format!(
                    "the real-time thread has been hanging for {} ms",
                    ticked_at.elapsed().as_millis()
                );
                hanging_turns += 1;
                if hanging_turns >= HANGING_TURNS && self.feeding.is_some() {
                    news.push(NotifyState::WatchdogTrigger);
                }
            } else {
                ticked_at = Instant::now();
                hanging_turns = 0;
                if self.feeding.is_some() {
                    news.push(NotifyState::Watchdog);
                }
            }
            if status != reported {
                news.push(NotifyState::Status(&status));
            }
            if self.tell(&news) {
                ready = true;
                reported = status;
            }
        }
    }

    /// Reports that the configuration is being read again.
    pub(crate) fn reloading(&self) {
        // The clock can be read.
        if let Ok(now) = NotifyState::monotonic_usec_now() {
            self.tell(&[NotifyState::Reloading, now]);
        }
    }

    /// Reports that this is over, whatever came of it: the status and the journal say what.
    pub(crate) fn reloaded(&self) {
        self.tell(&[NotifyState::Ready]);
    }

    /// Reports that the daemon ends. The end has timeouts of its own, so the watchdog is fed no
    /// more.
    pub(crate) fn stopping(&self) {
        self.tell(&[NotifyState::Stopping, NotifyState::Status("ending")]);
    }

    /// Queues a message; false if there was no room.
    fn tell(&self, news: &[NotifyState<'_>]) -> bool {
        let lines: Vec<String> = news.iter().map(ToString::to_string).collect();
        lines.is_empty()
            || self
                .messages
                .as_ref()
                .is_some_and(|messages| messages.try_send(lines.join("\n")).is_ok())
    }
}
