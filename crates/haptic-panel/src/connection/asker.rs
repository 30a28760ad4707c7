//! The thread that sends: the only one that may block in a write to the daemon.

use super::shared::{Asked, Shared};
use crate::intent::Intent;
use crate::stop::Stops;
use haptic_ipc::{Request, Sender};
use std::sync::{Arc, mpsc};

/// Work of the thread.
#[derive(Debug)]
pub(super) enum Job {
    /// A daemon has greeted: the sender to it, and the first requests.
    Introduce {
        conversation: u64,
        sender: Sender,
        requests: Vec<(Request, Asked)>,
    },
    /// A question of the panel.
    Ask {
        conversation: u64,
        request: Request,
        asked: Asked,
    },
    /// An intent of the user, and the number of stops pressed before it.
    Intent { intent: Intent, stops: u64 },
    /// A recording begins: so does the subscription anew, with a snapshot of the servo.
    SubscribeAnew,
    /// A stop was pressed. [`Stops`] has its number.
    Stop,
}

struct Conversation {
    number: u64,
    sender: Sender,
    /// The newest subscription.
    subscription: Option<Request>,
    /// The newest stop that needs no sending on it.
    stops_sent: u64,
}

pub(super) struct Asker {
    shared: Arc<Shared>,
    stops: Arc<Stops>,
    conversation: Option<Conversation>,
    /// The newest stop for which the next attempt to connect was hurried.
    hurried_for: u64,
}

impl Asker {
    pub(super) fn new(shared: Arc<Shared>, stops: Arc<Stops>) -> Self {
        Self {
            shared,
            stops,
            conversation: None,
            hurried_for: 0,
        }
    }

    /// Sends until the panel is closed.
    pub(super) fn run(mut self, jobs: &mpsc::Receiver<Job>) {
        while let Ok(job) = jobs.recv() {
            // Ahead of older work.
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
                self.conversation = Some(Conversation {
                    number: conversation,
                    sender,
                    subscription: None,
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
                // A question to an earlier daemon is void.
                if self
                    .conversation
                    .as_ref()
                    .is_some_and(|open| open.number == conversation)
                {
                    self.send(request, asked);
                }
            }
            Job::Intent { intent, stops } => {
                // An intent from before a stop must not bring the force back after it.
                if intent.is_void_after_stop() && stops < self.stops.pressed() {
                    return;
                }
                if let Some(request) = intent.request() {
                    let asked = match intent {
                        Intent::Stream { .. } => Asked::Subscribe,
                        intent => Asked::Intent(intent),
                    };
                    self.send(request, asked);
                }
            }
            Job::SubscribeAnew => {
                let open = self.conversation.as_ref();
                if let Some(subscription) = open.and_then(|open| open.subscription.clone()) {
                    self.send(subscription, Asked::Subscribe);
                }
            }
            Job::Stop => {}
        }
    }

    fn stop_if_asked(&mut self) {
        let newest = self.stops.pressed();
        match &mut self.conversation {
            Some(open) if newest > open.stops_sent => {
                open.stops_sent = newest;
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

    /// Sends a request. If that fails, the connection is lost, which the listening thread reports.
    fn send(&mut self, request: Request, asked: Asked) {
        let Some(open) = &mut self.conversation else { return };
        if matches!(asked, Asked::Subscribe) {
            open.subscription = Some(request.clone());
        }
        // Noted first: the answer may arrive before the write returns.
        let key = (open.number, open.sender.next_id());
        self.shared.asked().insert(key, asked);
        if open.sender.send(request).is_err() {
            self.conversation = None;
            self.shared.asked().remove(&key);
            if self.stops.pressed() > self.stops.settled() {
                self.shared.hurry_up();
            }
        }
    }
}
