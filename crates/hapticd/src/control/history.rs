//! The scenes that were in force, and the way back through them: one way for all clients.

use haptic_core::{ParameterKey, Scene};
use std::collections::VecDeque;

/// Scenes kept, and steps that can be taken back.
const KEPT: usize = 1000;

/// What a change is to the history.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Move {
    /// Something new.
    Forward,
    /// Something new, which may be one step with what the same session did to the same parameters just before.
    Merge(Dragged),
    Undo,
    Redo,
}

/// Who changed which parameters.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Dragged {
    pub(crate) session: u64,
    pub(crate) parameters: Vec<ParameterKey>,
    /// Whether it goes on with what was done before.
    pub(crate) goes_on: bool,
}

/// The history of the scene.
#[derive(Debug, Default)]
pub(crate) struct History {
    /// Every scene by its revision, oldest first.
    past: VecDeque<(u64, Scene)>,
    undo: VecDeque<Scene>,
    redo: Vec<Scene>,
    /// What the newest step back would take back, where it can grow.
    dragged: Option<Dragged>,
}

impl History {
    /// Keeps a scene that is now the newest.
    pub(crate) fn keep(&mut self, revision: u64, scene: Scene) {
        if self.past.len() == KEPT {
            self.past.pop_front();
        }
        self.past.push_back((revision, scene));
    }

    /// A scene that was in force.
    pub(crate) fn scene(&self, revision: u64) -> Option<&Scene> {
        let index = self.past.binary_search_by_key(&revision, |(known, _)| *known).ok()?;
        self.past.get(index).map(|(_, scene)| scene)
    }

    /// The oldest revision that is still known.
    pub(crate) fn oldest(&self) -> u64 {
        self.past.front().map_or(0, |(revision, _)| *revision)
    }

    /// The scene to which a step back leads.
    pub(crate) fn back(&self) -> Option<&Scene> {
        self.undo.back()
    }

    /// The scene to which a step forth leads.
    pub(crate) fn forth(&self) -> Option<&Scene> {
        self.redo.last()
    }

    /// How many steps there are, back and forth.
    pub(crate) fn depth(&self) -> (usize, usize) {
        (self.undo.len(), self.redo.len())
    }

    /// Takes a change in that leads away from `before`.
    pub(crate) fn moved(&mut self, how: Move, before: Scene) {
        match how {
            Move::Forward => {
                self.push(before);
                self.dragged = None;
            }
            Move::Merge(now) => {
                let one_step = now.goes_on
                    && self
                        .dragged
                        .as_ref()
                        .is_some_and(|was| (was.session, &was.parameters) == (now.session, &now.parameters));
                if !one_step {
                    self.push(before);
                }
                self.dragged = Some(now);
            }
            Move::Undo => {
                self.undo.pop_back();
                self.redo.push(before);
                self.dragged = None;
            }
            Move::Redo => {
                self.redo.pop();
                let kept = std::mem::take(&mut self.redo);
                self.push(before);
                self.redo = kept;
                self.dragged = None;
            }
        }
    }

    fn push(&mut self, before: Scene) {
        if self.undo.len() == KEPT {
            self.undo.pop_front();
        }
        self.undo.push_back(before);
        self.redo.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn named(name: u32) -> Scene {
        Scene {
            name: name.to_string(),
            ..Scene::paper()
        }
    }

    #[test]
    fn what_is_dragged_goes_back_in_one_step_and_what_another_did_between_does_not() {
        let mut history = History::default();
        let dragged = |session, goes_on| {
            Move::Merge(Dragged {
                session,
                parameters: vec!["mass".parse().expect("a parameter")],
                goes_on,
            })
        };
        history.moved(dragged(1, false), named(0));
        history.moved(dragged(1, true), named(1));
        assert_eq!((history.depth().0, history.back()), (1, Some(&named(0))));
        history.moved(dragged(2, true), named(2));
        history.moved(dragged(1, true), named(3));
        assert_eq!((history.depth().0, history.back()), (3, Some(&named(3))));
        history.moved(dragged(1, false), named(4));
        assert_eq!(history.depth().0, 4, "a new drag is a new step");
    }

    proptest! {
        /// Against two plain stacks.
        #[test]
        fn steps_lead_back_and_forth_through_the_same_scenes(moves in prop::collection::vec(0..4u8, 0..200)) {
            let mut history = History::default();
            let (mut back, mut forth, mut now, mut next) = (Vec::new(), Vec::new(), 0, 1);
            for step in moves {
                match step {
                    0 | 1 => {
                        let set = Move::Merge(Dragged { session: 1, parameters: Vec::new(), goes_on: false });
                        history.moved(if step == 0 { set } else { Move::Forward }, named(now));
                        back.push(now);
                        forth.clear();
                        (now, next) = (next, next + 1);
                    }
                    2 => if let Some(to) = back.pop() {
                        prop_assert_eq!(history.back().cloned(), Some(named(to)));
                        history.moved(Move::Undo, named(now));
                        forth.push(now);
                        now = to;
                    },
                    _ => if let Some(to) = forth.pop() {
                        prop_assert_eq!(history.forth().cloned(), Some(named(to)));
                        history.moved(Move::Redo, named(now));
                        back.push(now);
                        now = to;
                    },
                }
                prop_assert_eq!(history.depth(), (back.len(), forth.len()));
            }
        }
    }
}
