//! The way to the study's thread: what the daemon says, and what the experimenter asks.

use super::news::{StudyCommand, StudyNews};
use super::session_thread::{Job, SendIntent, SessionThread};
use super::subject_screen::SubjectScreen;
use crate::intent::Intent;
use crate::update::Update;
use crate::update_sender::UpdateSender;
use haptic_ipc::Event;
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

/// The thread, and what it needs of the daemon's past when it begins.
#[derive(Default)]
struct Slot {
    jobs: Option<SyncSender<Job>>,
    /// The newest update of each kind that it asks for.
    connected: Option<Update>,
    subscribed: Option<Update>,
    state: Option<Update>,
    scene: Option<Update>,
    status: Option<Update>,
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

    /// What the subject's window shows.
    pub(crate) fn screen(&self) -> &Arc<SubjectScreen> {
        &self.screen
    }

    fn slot(&self) -> MutexGuard<'_, Slot> {
        // It is consistent between any two statements, so a panic elsewhere leaves it usable.
        self.slot.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes what the daemon says, as soon as it is read.
    pub(crate) fn hear(&self, update: &Update) {
        let mut slot = self.slot();
        let keep = match update {
            Update::Connected { .. } => {
                (slot.subscribed, slot.state, slot.scene, slot.status) = (None, None, None, None);
                Some(&mut slot.connected)
            }
            Update::Disconnected { .. } => {
                (slot.connected, slot.subscribed) = (None, None);
                (slot.state, slot.scene, slot.status) = (None, None, None);
                self.screen.lose_samples();
                self.screen.set_takes_hand(false);
                None
            }
            Update::Subscribed(_) => Some(&mut slot.subscribed),
            Update::Status(Ok(status)) => {
                self.screen.set_takes_hand(status.device.takes_hand);
                Some(&mut slot.status)
            }
            Update::Scene(Ok(_)) => Some(&mut slot.scene),
            Update::Event(Event::State(_)) => Some(&mut slot.state),
            Update::Event(Event::Samples(batch)) => {
                if let Some(newest) = batch.rows.last() {
                    self.screen.take_sample(newest, Instant::now());
                }
                if let Some(target_m) = self.screen.take_pointed() {
                    (self.send)(Intent::Hand { target_m });
                }
                None
            }
            Update::Event(Event::Timing(_) | Event::Servo(_))
            | Update::Answered {
                intent: Intent::TrialScene { .. } | Intent::Lease { .. },
                ..
            } => None,
            _ => return,
        };
        if let Some(kept) = keep {
            *kept = Some(update.clone());
        }
        if slot.jobs.is_some() {
            slot.enqueue(Job::Hear(update.clone()));
        }
    }

    /// Takes a command of the experimenter.
    pub(crate) fn command(&self, command: StudyCommand) {
        let mut slot = self.slot();
        let begins = matches!(command, StudyCommand::Create { .. } | StudyCommand::Open { .. });
        if begins && let Err(error) = self.begin(&mut slot) {
            drop(slot);
            self.report(StudyNews::Failed(format!("no thread for the study: {error}")));
            return;
        }
        let ends = command == StudyCommand::Close;
        let note = match &command {
            StudyCommand::Note(text) => Some(text.clone()),
            _ => None,
        };
        let is_queued = slot.enqueue(Job::Command(command));
        if ends {
            slot.jobs = None;
        }
        drop(slot);
        if !is_queued && !ends {
            let why = "The study's disk does not keep up".to_owned();
            self.report(match note {
                Some(text) => StudyNews::Noted {
                    text,
                    outcome: Err(why),
                },
                None => StudyNews::Failed(why),
            });
        }
    }

    /// Starts the thread, and passes on what the daemon has said.
    fn begin(&self, slot: &mut Slot) -> std::io::Result<()> {
        let (jobs, to_do) = mpsc::sync_channel(ROOM);
        let study = SessionThread::new(Arc::clone(&self.screen), Arc::clone(&self.send), self.updates.clone());
        thread::Builder::new()
            .name("study".to_owned())
            .spawn(move || study.run(&to_do))?;
        slot.jobs = Some(jobs);
        let past = [
            &slot.connected,
            &slot.subscribed,
            &slot.state,
            &slot.scene,
            &slot.status,
        ];
        for update in past.map(Clone::clone).into_iter().flatten() {
            slot.enqueue(Job::Hear(update));
        }
        Ok(())
    }

    fn report(&self, news: StudyNews) {
        // A closed panel needs no news.
        self.updates.send(Update::Study(news)).unwrap_or_default();
    }
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
