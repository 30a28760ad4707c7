//! Changes of the scene that the loop makes in ticks to come: compiled by the control thread, kept here until their
//! tick, and freed by the control thread again. A [`Claim`] decides between the loop and a cancellation.

use crate::rt::shared::{Claim, ClaimState};
use crate::rt::space::CompiledIn;
use haptic_ipc::MAX_SCHEDULED_CHANGES;
use std::collections::VecDeque;
use std::sync::Arc;

/// A change on its way to the loop and back.
#[derive(Debug)]
pub(crate) struct ScheduledScene {
    /// The tick that renders it first.
    pub(crate) at_tick: u64,
    /// The scene, until it is rendered.
    pub(crate) scene: Option<CompiledIn>,
    pub(crate) claim: Arc<Claim>,
}

/// The changes that wait for their tick, in its order. The memory for all that can be scheduled is there from the
/// beginning.
#[derive(Debug)]
pub(crate) struct ScheduledScenes(VecDeque<ScheduledScene>);

impl ScheduledScenes {
    pub(crate) fn new() -> Self {
        Self(VecDeque::with_capacity(MAX_SCHEDULED_CHANGES))
    }

    /// Number of changes that wait.
    pub(crate) fn len(&self) -> usize {
        self.0.len()
    }

    /// Adds a change after those that wait. Returns one that there is no room for, which the control thread does not
    /// send.
    pub(crate) fn add(&mut self, change: ScheduledScene) -> Option<ScheduledScene> {
        if self.0.len() == MAX_SCHEDULED_CHANGES {
            change.claim.decide(ClaimState::Missed);
            return Some(change);
        }
        self.0.push_back(change);
        None
    }

    /// Whether a tick has anything to do here.
    #[inline]
    pub(crate) fn is_due(&self, tick: u64, is_halted: impl FnOnce() -> bool) -> bool {
        self.0
            .front()
            .is_some_and(|next| next.at_tick <= tick || is_halted() || next.claim.state() != ClaimState::Open)
    }

    /// The scene that a tick renders first. Hands back, to `decided`, what was taken back meanwhile; all of it, if the
    /// rig is halted or the first change came after its tick: the later ones build on it.
    pub(crate) fn take_due(
        &mut self,
        tick: u64,
        mut is_halted: bool,
        mut decided: impl FnMut(ScheduledScene),
    ) -> Option<CompiledIn> {
        let mut reason = ClaimState::Halted;
        while self.is_due(tick, || is_halted) {
            let mut next = self.0.pop_front()?;
            if next.at_tick < tick && !is_halted && next.claim.state() == ClaimState::Open {
                (is_halted, reason) = (true, ClaimState::Missed);
            }
            let state = if is_halted { reason } else { ClaimState::Rendered(tick) };
            let is_rendered = next.claim.decide(state) && !is_halted;
            let scene = if is_rendered { next.scene.take() } else { None };
            decided(next);
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
    use crate::rt::tick::tests::compiled;
    use haptic_core::Scene;

    fn change(at_tick: u64) -> ScheduledScene {
        ScheduledScene {
            at_tick,
            scene: Some(compiled(&Scene::paper(), at_tick).into()),
            claim: Arc::new(Claim::new()),
        }
    }

    fn added(scenes: &mut ScheduledScenes, ticks: &[u64]) -> Vec<Arc<Claim>> {
        let add = |tick: &u64| {
            let change = change(*tick);
            let claim = Arc::clone(&change.claim);
            assert!(scenes.add(change).is_none());
            claim
        };
        ticks.iter().map(add).collect()
    }

    fn states(claims: &[Arc<Claim>]) -> Vec<ClaimState> {
        claims.iter().map(|claim| claim.state()).collect()
    }

    /// Revision of the scene that a tick renders first.
    fn rendered(scenes: &mut ScheduledScenes, tick: u64, is_halted: bool) -> Option<u64> {
        let scene = scenes.take_due(tick, is_halted, drop)?;
        Some(scene.revision())
    }

    #[test]
    fn scheduled_changes_are_rendered_each_in_its_tick() {
        let mut scenes = ScheduledScenes::new();
        let claims = added(&mut scenes, &[3, 4, 9]);
        let seen: Vec<(u64, u64)> = (0..20)
            .filter_map(|tick| Some((tick, rendered(&mut scenes, tick, false)?)))
            .collect();
        assert_eq!(seen, [(3, 3), (4, 4), (9, 9)]);
        assert_eq!(states(&claims), [3, 4, 9].map(ClaimState::Rendered));
        assert!(
            claims.iter().all(|claim| Arc::strong_count(claim) == 1),
            "all came back"
        );
    }

    #[test]
    fn one_that_was_taken_back_makes_room_before_its_tick() {
        let mut scenes = ScheduledScenes::new();
        let claims = added(&mut scenes, &[1000, 2000]);
        assert!(claims.iter().rev().all(|claim| claim.decide(ClaimState::Withdrawn)));
        let later = added(&mut scenes, &[6]);
        assert!((0..6).all(|tick| rendered(&mut scenes, tick, false).is_none()));
        assert_eq!(scenes.len(), 1);
        assert_eq!(rendered(&mut scenes, 6, false), Some(6));
        assert_eq!(
            (states(&claims), states(&later)),
            (vec![ClaimState::Withdrawn; 2], vec![ClaimState::Rendered(6)])
        );
    }

    #[test]
    fn halted_rig_or_missed_tick_drops_the_whole_schedule() {
        for (tick, is_halted, state) in [(1, true, ClaimState::Halted), (6, false, ClaimState::Missed)] {
            let mut scenes = ScheduledScenes::new();
            let claims = added(&mut scenes, &[5, 6, 7]);
            assert!(rendered(&mut scenes, tick, is_halted).is_none());
            assert_eq!(states(&claims), [state; 3]);
            assert!((tick..20).all(|tick| rendered(&mut scenes, tick, false).is_none()));
            assert_eq!(scenes.len(), 0);
        }
    }

    #[test]
    fn a_change_beyond_the_room_comes_back_decided() {
        let mut scenes = ScheduledScenes::new();
        let ticks: Vec<u64> = (0..MAX_SCHEDULED_CHANGES as u64).collect();
        added(&mut scenes, &ticks);
        let refused = scenes.add(change(300)).expect("it comes back");
        assert_eq!((refused.claim.state(), scenes.len()), (ClaimState::Missed, ticks.len()));
    }
}
