//! Changes of the scene that the loop makes in ticks to come: compiled by the control thread, kept here
//! until their tick, and freed by the control thread again.
//!
//! Two queues of rtrb, wait-free on both sides. A schedule goes over in one piece, so the loop sees all
//! of its changes or none. Those that are rendered or discarded come back through the second queue,
//! which has room for all that the first one holds. A [`Claim`] decides between the loop and a
//! cancellation.

use crate::rt::claim::{Claim, ClaimState};
use haptic_core::servo::CompiledScene;
use haptic_ipc::MAX_SCHEDULED_CHANGES;
use std::sync::Arc;

/// A change on its way to the loop and back.
#[derive(Debug)]
pub(crate) struct ScheduledScene {
    /// The tick that renders it first.
    pub(crate) at_tick: u64,
    /// The scene, until it is rendered.
    pub(crate) scene: Option<Box<CompiledScene>>,
    pub(crate) claim: Arc<Claim>,
}

/// The control end.
#[derive(Debug)]
pub(crate) struct ScheduleSender {
    coming: rtrb::Producer<ScheduledScene>,
    gone: rtrb::Consumer<ScheduledScene>,
    /// Changes that have not come back.
    out: usize,
}

/// The real-time end.
#[derive(Debug)]
pub(crate) struct ScheduleReceiver {
    coming: rtrb::Consumer<ScheduledScene>,
    gone: rtrb::Producer<ScheduledScene>,
}

/// The two ends.
pub(crate) fn schedule() -> (ScheduleSender, ScheduleReceiver) {
    let (coming, from_control) = rtrb::RingBuffer::new(MAX_SCHEDULED_CHANGES);
    let (gone, from_loop) = rtrb::RingBuffer::new(MAX_SCHEDULED_CHANGES);
    let sender = ScheduleSender {
        coming,
        gone: from_loop,
        out: 0,
    };
    let receiver = ScheduleReceiver {
        coming: from_control,
        gone,
    };
    (sender, receiver)
}

impl ScheduleSender {
    /// How many more changes it takes. Frees those that came back.
    pub(crate) fn room(&mut self) -> usize {
        while self.gone.pop().is_ok() {
            self.out -= 1;
        }
        MAX_SCHEDULED_CHANGES - self.out
    }

    /// Sends changes in the order of their ticks; the loop sees all of them or none. Returns whether
    /// there was room.
    pub(crate) fn send(&mut self, changes: Vec<ScheduledScene>) -> bool {
        let count = changes.len();
        if self.room() < count {
            return false;
        }
        let Ok(chunk) = self.coming.write_chunk_uninit(count) else {
            return false;
        };
        self.out += chunk.fill_from_iter(changes);
        true
    }
}

impl ScheduleReceiver {
    /// Whether a tick has anything to do here.
    #[inline]
    pub(crate) fn is_due(&self, tick: u64, is_halted: impl FnOnce() -> bool) -> bool {
        self.coming
            .peek()
            .is_ok_and(|next| next.at_tick <= tick || is_halted() || next.claim.state() != ClaimState::Open)
    }

    /// The scene that a tick renders first. Hands back what was taken back meanwhile; all of it, if the
    /// rig is halted or the first change came after its tick: the later ones build on it.
    pub(crate) fn take_due(&mut self, tick: u64, mut is_halted: bool) -> Option<Box<CompiledScene>> {
        let mut reason = ClaimState::Halted;
        while self.is_due(tick, || is_halted) {
            let Ok(mut next) = self.coming.pop() else { break };
            if next.at_tick < tick && !is_halted && next.claim.state() == ClaimState::Open {
                (is_halted, reason) = (true, ClaimState::Missed);
            }
            let state = if is_halted { reason } else { ClaimState::Rendered(tick) };
            let is_rendered = next.claim.decide(state) && !is_halted;
            let scene = if is_rendered { next.scene.take() } else { None };
            if let Err(rtrb::PushError::Full(next)) = self.gone.push(next) {
                // It has room for all that are out; a leak is better than freeing here.
                std::mem::forget(next);
            }
            if is_rendered {
                return scene;
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use haptic_core::{Renderer, Scene, Scheme};

    fn change(at_tick: u64) -> ScheduledScene {
        let renderer = Renderer::new(&Scene::paper(), Scheme::Exact, 1e-3).expect("a valid scene");
        ScheduledScene {
            at_tick,
            scene: Some(Box::new(CompiledScene::at_once(renderer, at_tick))),
            claim: Arc::new(Claim::new()),
        }
    }

    fn sent(sender: &mut ScheduleSender, ticks: &[u64]) -> Vec<Arc<Claim>> {
        let changes: Vec<ScheduledScene> = ticks.iter().map(|tick| change(*tick)).collect();
        let claims = changes.iter().map(|change| Arc::clone(&change.claim)).collect();
        assert!(sender.send(changes));
        claims
    }

    fn states(claims: &[Arc<Claim>]) -> Vec<ClaimState> {
        claims.iter().map(|claim| claim.state()).collect()
    }

    #[test]
    fn scheduled_changes_are_rendered_each_in_its_tick() {
        let (mut sender, mut receiver) = schedule();
        let claims = sent(&mut sender, &[3, 4, 9]);
        let rendered: Vec<u64> = (0..20)
            .filter_map(|tick| Some((tick, receiver.take_due(tick, false)?.revision)))
            .map(|(tick, revision)| {
                assert_eq!(tick, revision);
                tick
            })
            .collect();
        assert_eq!(rendered, [3, 4, 9]);
        assert_eq!(states(&claims), [3, 4, 9].map(ClaimState::Rendered));
        assert_eq!(sender.room(), MAX_SCHEDULED_CHANGES);
        assert!(claims.iter().all(|claim| Arc::strong_count(claim) == 1));
    }

    #[test]
    fn one_that_was_taken_back_makes_room_before_its_tick() {
        let (mut sender, mut receiver) = schedule();
        let claims = sent(&mut sender, &[1000, 2000]);
        assert!(claims.iter().rev().all(|claim| claim.decide(ClaimState::Withdrawn)));
        let later = sent(&mut sender, &[6]);
        assert!((0..6).all(|tick| receiver.take_due(tick, false).is_none()));
        assert_eq!(receiver.take_due(6, false).map(|scene| scene.revision), Some(6));
        assert_eq!(
            (states(&claims), states(&later)),
            (vec![ClaimState::Withdrawn; 2], vec![ClaimState::Rendered(6)])
        );
    }

    #[test]
    fn halted_rig_or_missed_tick_drops_the_whole_schedule() {
        for (tick, is_halted, state) in [(1, true, ClaimState::Halted), (6, false, ClaimState::Missed)] {
            let (mut sender, mut receiver) = schedule();
            let claims = sent(&mut sender, &[5, 6, 7]);
            assert!(receiver.take_due(tick, is_halted).is_none());
            assert_eq!(states(&claims), [state; 3]);
            assert!((tick..20).all(|tick| receiver.take_due(tick, false).is_none()));
            assert_eq!(sender.room(), MAX_SCHEDULED_CHANGES);
        }
    }

    #[test]
    fn it_takes_as_many_as_it_says_and_no_part_of_more() {
        let (mut sender, mut receiver) = schedule();
        let ticks: Vec<u64> = (0..MAX_SCHEDULED_CHANGES as u64).collect();
        sent(&mut sender, &ticks[1..]);
        assert!(!sender.send(vec![change(300), change(301)]));
        sent(&mut sender, &[300]);
        assert_eq!(sender.room(), 0);
        let rendered = (0..400).filter_map(|tick| receiver.take_due(tick, false)).count();
        assert_eq!(rendered, MAX_SCHEDULED_CHANGES);
    }

    /// The loop is at most two ticks beyond the one that the control thread handles, so a change for the tick after
    /// those is never late, and one that is taken back about its tick races with the loop. Miri runs this with many
    /// seeds.
    #[test]
    fn a_change_is_rendered_or_taken_back_and_never_both() {
        let rounds: u64 = if cfg!(miri) { 20 } else { 2000 };
        let (mut sender, mut receiver) = schedule();
        let (to_control, from_loop) = std::sync::mpsc::sync_channel(1);
        let looping = std::thread::spawn(move || {
            let mut rendered = Vec::new();
            for tick in 0..rounds + 4 {
                if let Some(scene) = receiver.take_due(tick, false) {
                    assert_eq!(scene.revision, tick, "in its tick");
                    rendered.push(tick);
                }
                to_control.send(tick).expect("the control thread listens");
            }
            rendered
        });
        let mut claims = Vec::new();
        let mut taken_back = Vec::new();
        for tick in &from_loop {
            if tick < rounds {
                assert!(sender.room() > 0);
                claims.extend(sent(&mut sender, &[tick + 3]).pop().map(|claim| (tick + 3, claim)));
            }
            // Some at once, some when the loop may be about to render them, and some never.
            for (at_tick, claim) in claims.iter().rev().take(4) {
                let lead = match at_tick % 4 {
                    0 => 3,
                    1 => 2,
                    2 => 1,
                    _ => continue,
                };
                if *at_tick == tick + lead && claim.decide(ClaimState::Withdrawn) {
                    taken_back.push(*at_tick);
                }
            }
        }
        let rendered = looping.join().expect("it ends");
        for (at_tick, claim) in &claims {
            let is_taken_back = taken_back.contains(at_tick);
            assert_ne!(
                is_taken_back,
                rendered.contains(at_tick),
                "{at_tick}: {:?}",
                claim.state()
            );
            let state = if is_taken_back {
                ClaimState::Withdrawn
            } else {
                ClaimState::Rendered(*at_tick)
            };
            assert_eq!(claim.state(), state);
            assert!(
                at_tick % 4 != 0 || is_taken_back,
                "{at_tick}: it was taken back in time"
            );
        }
        assert_eq!(claims.len() as u64, rounds);
        assert_eq!(sender.room(), MAX_SCHEDULED_CHANGES, "all came back");
    }
}
