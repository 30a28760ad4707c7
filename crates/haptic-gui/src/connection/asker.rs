//! The thread that sends, and the only one that may stand in a write to the daemon.

use super::{Asked, Shared};
use crate::intent::Intent;
use crate::stop_path::Stops;
use haptic_ipc::{Request, Sender};
use std::sync::{Arc, mpsc};

/// What there is to send.
#[derive(Debug)]
pub(super) enum Job {
    /// A daemon has greeted: what is asked first of it, and the way to it.
    Introduce {
        conversation: u64,
        sender: Sender,
        requests: Vec<(Request, Asked)>,
    },
    /// Something that the panel wants to know.
    Ask {
        conversation: u64,
        request: Request,
        asked: Asked,
    },
    /// Something that the user wants, and how many stops had been asked for by then.
    Intent { intent: Intent, stops: u64 },
    /// A stop was asked for: the number of those says so itself.
    Stop,
}

/// The way to a daemon.
struct Talk {
    conversation: u64,
    sender: Sender,
    /// The newest stop that was sent on it, or needs not be.
    stops_sent: u64,
}

pub(super) struct Asker {
    shared: Arc<Shared>,
    stops: Arc<Stops>,
    talk: Option<Talk>,
    /// The newest stop for which the next attempt to connect was hurried.
    hurried_for: u64,
}

impl Asker {
    pub(super) fn new(shared: Arc<Shared>, stops: Arc<Stops>) -> Self {
        Self {
            shared,
            stops,
            talk: None,
            hurried_for: 0,
        }
    }

    /// Sends what there is until the panel is gone.
    pub(super) fn run(mut self, jobs: &mpsc::Receiver<Job>) {
        while let Ok(job) = jobs.recv() {
            // Ahead of what waited for longer.
            self.stop_if_asked();
            self.carry_out(job);
        }
    }

    fn carry_out(&mut self, job: Job) {
        match job {
            Job::Introduce {
                conversation,
                sender,
                requests,
            } => {
                self.talk = Some(Talk {
                    conversation,
                    sender,
                    stops_sent: self.stops.settled(),
                });
                self.stop_if_asked();
                for (request, asked) in requests {
                    self.send(request, asked);
                }
            }
            Job::Ask {
                conversation,
                request,
                asked,
            } => {
                // What was to be asked of an earlier daemon is of no use.
                if self.talk.as_ref().is_some_and(|talk| talk.conversation == conversation) {
                    self.send(request, asked);
                }
            }
            Job::Intent { intent, stops } => {
                // Nothing that was asked before a stop may bring the force back after it.
                if intent.is_void_after_stop() && stops < self.stops.pressed() {
                    return;
                }
                if let Some(request) = intent.request() {
                    self.send(request, Asked::Intent(intent));
                }
            }
            Job::Stop => {}
        }
    }

    fn stop_if_asked(&mut self) {
        let newest = self.stops.pressed();
        match &mut self.talk {
            Some(talk) if newest > talk.stops_sent => {
                talk.stops_sent = newest;
                self.send(Request::Stop {}, Asked::Stop(newest));
            }
            Some(_) => {}
            None if newest > self.hurried_for => {
                self.hurried_for = newest;
                self.shared.hurry_up();
            }
            None => {}
        }
    }

    /// Sends a request. One that cannot be sent is void with its connection, and the listening thread tells of the loss.
    fn send(&mut self, request: Request, asked: Asked) {
        let Some(talk) = &mut self.talk else { return };
        // Noted first: the answer may be there before the write returns.
        let key = (talk.conversation, talk.sender.next_id());
        self.shared.asked().insert(key, asked);
        if talk.sender.send(request).is_err() {
            self.talk = None;
            self.shared.asked().remove(&key);
            if self.stops.pressed() > self.stops.settled() {
                self.shared.hurry_up();
            }
        }
    }
}
