//! The channel to the study's thread: what the daemon says, and what the experimenter asks.

use super::news::{StudyCommand, StudyNews};
use super::session_thread::{Job, SendIntent, SessionThread};
use super::subject_screen::SubjectScreen;
use crate::intent::Intent;
use crate::update::Update;
use crate::update_sender::UpdateSender;
use haptic_ipc::{DaemonMirror, Event};
use std::sync::mpsc::{self, SyncSender, TrySendError};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;
use std::{fmt, thread};

/// What waits for the thread at most: forty seconds of batches. What finds no room is missing, and voids the trial.
const ROOM: usize = 10_000;

/// The study, if one is open. No call waits.
pub(crate) struct StudyLink {
    screen: Arc<SubjectScreen>,
    send: SendIntent,
    updates: UpdateSender,
    slot: Mutex<Slot>,
}

/// The thread, and the daemon at which it begins.
#[derive(Default)]
struct Slot {
    jobs: Option<SyncSender<Job>>,
    daemon: DaemonMirror,
}

impl fmt::Debug for StudyLink {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("StudyLink").finish_non_exhaustive()
    }
}

impl StudyLink {
    pub(crate) fn new(send: SendIntent, updates: UpdateSender) -> Self {
        Self {
            screen: Arc::default(),
            send,
            updates,
            slot: Mutex::default(),
        }
    }

    pub(crate) fn screen(&self) -> &Arc<SubjectScreen> {
        &self.screen
    }

    fn slot(&self) -> MutexGuard<'_, Slot> {
        // It is consistent between any two statements, so a panic elsewhere leaves it usable.
        self.slot.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Looks at what the daemon has stated.
    pub(crate) fn with_daemon<T>(&self, look: impl FnOnce(&DaemonMirror) -> T) -> T {
        look(&self.slot().daemon)
    }

    /// Takes what the daemon says, as soon as it is read.
    pub(crate) fn hear(&self, update: &Update) {
        let mut slot = self.slot();
        update.tell(&mut slot.daemon);
        match update {
            Update::Disconnected { .. } => {
                self.screen.lose_samples();
                self.screen.set_takes_hand(false);
            }
            Update::Status(Ok(status)) => self.screen.set_takes_hand(status.device.takes_hand),
            Update::Event(Event::Samples(batch)) => {
                if let Some(newest) = batch.rows.last() {
                    self.screen.take_sample(newest, Instant::now());
                }
                if let Some(target_m) = self.screen.take_pointed() {
                    (self.send)(Intent::Hand { target_m });
                }
            }
            _ => {}
        }
        if slot.jobs.is_some() && concerns_study(update) {
            slot.enqueue(Job::Hear(update.clone()));
        }
    }

    pub(crate) fn command(&self, command: StudyCommand) {
        let mut slot = self.slot();
        let begins = matches!(command, StudyCommand::Create { .. } | StudyCommand::Open { .. });
        if begins && let Err(error) = self.begin(&mut slot) {
            drop(slot);
            self.report(StudyNews::Failed(format!("no thread for the study: {error}")));
            return;
        }
        let is_queued = slot.enqueue(Job::Command(command.clone()));
        if command == StudyCommand::Close {
            slot.jobs = None;
            return;
        }
        drop(slot);
        if !is_queued {
            let why = "The study's disk does not keep up".to_owned();
            self.report(match command {
                StudyCommand::Note(text) => StudyNews::Noted {
                    text,
                    outcome: Err(why),
                },
                _ => StudyNews::Failed(why),
            });
        }
    }

    fn begin(&self, slot: &mut Slot) -> std::io::Result<()> {
        let (jobs, to_do) = mpsc::sync_channel(ROOM);
        let (screen, send, updates) = (Arc::clone(&self.screen), Arc::clone(&self.send), self.updates.clone());
        let study = SessionThread::new(screen, send, updates, slot.daemon.clone());
        thread::Builder::new()
            .name("study".to_owned())
            .spawn(move || study.run(&to_do))?;
        slot.jobs = Some(jobs);
        Ok(())
    }

    fn report(&self, news: StudyNews) {
        // A closed panel needs no news.
        self.updates.send(Update::Study(news)).unwrap_or_default();
    }
}

/// Whether a study has to hear of an update: of the daemon's facts, and of what it has asked for.
fn concerns_study(update: &Update) -> bool {
    matches!(
        update,
        Update::Connected { .. }
            | Update::Disconnected { .. }
            | Update::Subscribed(_)
            | Update::Status(Ok(_))
            | Update::Scene(Ok(_))
            | Update::Event(Event::State(_) | Event::Samples(_) | Event::Timing(_) | Event::Servo(_))
            | Update::Answered {
                intent: Intent::TrialScene { .. } | Intent::Lease { .. },
                ..
            }
    )
}

impl Slot {
    /// Queues a job for the thread; returns whether there was room.
    fn enqueue(&mut self, job: Job) -> bool {
        let Some(jobs) = &self.jobs else { return false };
        let result = jobs.try_send(job);
        if let Err(TrySendError::Disconnected(_)) = &result {
            self.jobs = None;
        }
        result.is_ok()
    }
}
