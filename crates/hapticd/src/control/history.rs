//! The scenes that were active: one undo history for all clients.

use crate::config::MAX_TITLE;
use crate::rt::outbox::TickRecord;
use crate::telemetry::subscribers::KnownScene;
use haptic_core::scene::SceneFile;
use haptic_core::{ParameterKey, Scene};
use haptic_ipc::{BUILT_IN_SCENES, LibraryScene, SceneRamp};
use std::collections::VecDeque;
use std::rc::Rc;

/// Revision of the daemon's first scene.
pub(crate) const FIRST_REVISION: u64 = 1;

/// Most scenes kept, and most steps that can be undone.
const MAX_KEPT: usize = 1000;

/// A scene with its title and the two counts of its sharing.
const SHARED_SCENE_BYTES: usize = size_of::<Scene>() + MAX_TITLE + 2 * size_of::<usize>();

// Scenes by revision with their ramps, to undo and to redo: the most that clients can make the
// history hold.
const _: () = assert!(
    MAX_KEPT
        * (3 * (size_of::<KnownScene>() + SHARED_SCENE_BYTES)
            + size_of::<SceneRamp>()
            + MAX_TITLE
            + size_of::<Origin>()
            + MAX_TITLE)
        <= 4 * 1024 * 1024
);

/// A scene of the library, as it was loaded or saved.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Origin {
    pub(crate) name: String,
    pub(crate) scene: Scene,
}

impl Origin {
    /// Whether a scene differs from it by no more than the title.
    fn feels_like(&self, scene: &Scene) -> bool {
        let title = self.scene.name.clone();
        self.scene
            == Scene {
                name: title,
                ..scene.clone()
            }
    }
}

/// A scene, and the one of the library that it comes from.
#[derive(Clone, Debug)]
struct Step {
    scene: Rc<Scene>,
    origin: Option<Rc<Origin>>,
}

/// The effect of a change on the history.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Move {
    /// A step of its own.
    Forward,
    /// A step of its own to another scene, perhaps of the library.
    Load(Option<Rc<Origin>>),
    /// A step that may be merged with the previous change, if that was of the same session to the
    /// same parameters.
    Merge(Drag),
    Undo,
    Redo,
}

/// A change of parameters by a session, perhaps one of many while a slider is dragged.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Drag {
    pub(crate) session: u64,
    pub(crate) parameters: Vec<ParameterKey>,
    /// Whether it continues the previous change.
    pub(crate) goes_on: bool,
}

#[derive(Debug)]
pub(crate) struct History {
    /// The scenes by revision, oldest first; never empty. The last is the newest, which may still
    /// be on its way to the real-time thread.
    scenes: VecDeque<KnownScene>,
    undo: VecDeque<Step>,
    redo: Vec<Step>,
    /// The scene of the library that the newest one comes from.
    origin: Option<Rc<Origin>>,
    /// The newest step, if further changes can be merged with it.
    dragged: Option<Drag>,
    /// Steps of the ramp to the newest scene; 0 without one.
    ramp_steps: usize,
}

/// The scene of every library that is equal to one.
fn built_in(scene: &Scene) -> Option<Rc<Origin>> {
    let is_same = |text: &str| toml::from_str::<SceneFile>(text).is_ok_and(|known| known.on(None) == *scene);
    let (name, _) = BUILT_IN_SCENES.iter().find(|(_, text)| is_same(text))?;
    Some(Rc::new(Origin {
        name: (*name).to_owned(),
        scene: scene.clone(),
    }))
}

impl History {
    /// A history that begins with the daemon's first scene, perhaps one of the library.
    pub(crate) fn new(revision: u64, scene: Rc<Scene>) -> Self {
        Self {
            origin: built_in(&scene),
            scenes: VecDeque::from([KnownScene {
                revision,
                scene,
                ramp: None,
                undo_depth: 0,
                redo_depth: 0,
            }]),
            undo: VecDeque::new(),
            redo: Vec::new(),
            dragged: None,
            ramp_steps: 0,
        }
    }

    /// The scenes kept, by revision.
    pub(crate) fn scenes(&self) -> &VecDeque<KnownScene> {
        &self.scenes
    }

    /// The newest scene.
    pub(crate) fn newest(&self) -> &KnownScene {
        self.scenes.back().expect("there is always a scene")
    }

    /// A scene that was active.
    pub(crate) fn scene(&self, revision: u64) -> Option<&Rc<Scene>> {
        KnownScene::of(revision, &self.scenes).map(|known| &known.scene)
    }

    /// The oldest revision kept.
    pub(crate) fn oldest(&self) -> u64 {
        self.scenes.front().map_or(0, |known| known.revision)
    }

    /// The scene that `undo` leads to.
    pub(crate) fn undo_scene(&self) -> Option<&Rc<Scene>> {
        self.undo.back().map(|step| &step.scene)
    }

    /// The scene that `redo` leads to.
    pub(crate) fn redo_scene(&self) -> Option<&Rc<Scene>> {
        self.redo.last().map(|step| &step.scene)
    }

    /// How many steps can be undone, and redone.
    pub(crate) fn depth(&self) -> (usize, usize) {
        (self.undo.len(), self.redo.len())
    }

    /// Whether a change to the active scene itself is a no-op. `undo` and `redo` are not: a drag
    /// may have ended where it began.
    pub(crate) fn is_noop(&mut self, step: &Move) -> bool {
        match step {
            Move::Forward | Move::Load(None) => {}
            // It is the same scene, and now the one of that name.
            Move::Load(origin) => self.origin.clone_from(origin),
            Move::Merge(now) => {
                if now.goes_on {
                    return true;
                }
            }
            Move::Undo | Move::Redo => return false,
        }
        // Changes from here on are a step of their own.
        self.dragged = None;
        true
    }

    /// Records a change; returns the revision of its scene.
    pub(crate) fn moved(&mut self, step: Move, scene: Rc<Scene>) -> u64 {
        let before = Step {
            scene: Rc::clone(&self.newest().scene),
            origin: self.origin.clone(),
        };
        let dragged = match step {
            Move::Forward => {
                self.push(before);
                None
            }
            Move::Load(origin) => {
                self.push(before);
                self.origin = origin.or_else(|| self.origin_of(&scene.name));
                None
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
                Some(now)
            }
            Move::Undo => {
                self.origin = self.undo.pop_back().and_then(|step| step.origin);
                self.redo.push(before);
                None
            }
            Move::Redo => {
                self.origin = self.redo.pop().and_then(|step| step.origin);
                let kept = std::mem::take(&mut self.redo);
                self.push(before);
                self.redo = kept;
                None
            }
        };
        self.dragged = dragged;
        let revision = self.newest().revision + 1;
        if self.scenes.len() == MAX_KEPT {
            self.scenes.pop_front();
        }
        let (undo_depth, redo_depth) = self.depth();
        self.scenes.push_back(KnownScene {
            revision,
            scene,
            ramp: None,
            undo_depth,
            redo_depth,
        });
        self.ramp_steps = 0;
        revision
    }

    /// The scene of the library of this title that was active last: one that a client kept, as for a comparison, comes
    /// from there.
    fn origin_of(&self, title: &str) -> Option<Rc<Origin>> {
        let steps = self.undo.iter().rev().filter_map(|step| step.origin.as_ref());
        let is_active = self.newest().scene.name == title;
        let active = self.origin.iter().filter(|_| is_active);
        let named = self
            .origin
            .iter()
            .chain(steps)
            .filter(|origin| origin.scene.name == title);
        active.chain(named).next().cloned()
    }

    /// Keeps the ramp to the newest scene, and the number of its steps.
    pub(crate) fn keep_ramp(&mut self, ramp: Option<SceneRamp>, steps: usize) {
        if let Some(newest) = self.scenes.back_mut() {
            newest.ramp = ramp.map(Box::new);
        }
        self.ramp_steps = steps;
    }

    /// The ramp to the newest scene ends before its time.
    pub(crate) fn end_ramp(&mut self) {
        self.ramp_steps = 0;
    }

    /// Whether the ramp to the newest scene is under way, in the newest tick.
    pub(crate) fn is_ramping(&self, tick: Option<&TickRecord>) -> bool {
        self.ramped_share(tick) < 1.0
    }

    /// Time that the ramp to the newest scene takes after the newest tick, s.
    pub(crate) fn ramp_left_s(&self, tick: Option<&TickRecord>) -> f64 {
        let over_s = self.newest().ramp.as_ref().map_or(0.0, |ramp| ramp.over_s);
        over_s * (1.0 - self.ramped_share(tick))
    }

    /// The scene that the ramp to the newest one has reached in the newest tick; `None` without a ramp.
    pub(crate) fn ramped_scene(&self, tick: Option<&TickRecord>) -> Option<Scene> {
        let KnownScene { scene, ramp, .. } = self.newest();
        let SceneRamp { from, .. } = ramp.as_deref().filter(|_| self.ramp_steps > 0)?;
        let share = self.ramped_share(tick);
        Some(from.toward(scene, share).unwrap_or_else(|| Scene::clone(scene)))
    }

    /// The share of the ramp to the newest scene that is behind it in the newest tick; 1 without a ramp.
    fn ramped_share(&self, tick: Option<&TickRecord>) -> f64 {
        let rendered = tick.filter(|tick| tick.revision >= self.newest().revision);
        let taken = rendered.map_or(0, |tick| tick.ramp_steps);
        match self.ramp_steps {
            0 => 1.0,
            #[expect(clippy::cast_precision_loss, reason = "a few hundred")]
            steps => (f64::from(taken) / steps as f64).min(1.0),
        }
    }

    /// The scene of the library that the newest one comes from, as it was loaded or saved.
    pub(crate) fn origin(&self) -> Option<&Rc<Origin>> {
        self.origin.as_ref()
    }

    /// The scene of the library that the newest one comes from, and whether it was changed since.
    pub(crate) fn library_scene(&self) -> Option<LibraryScene> {
        self.origin.as_ref().map(|origin| LibraryScene {
            name: origin.name.clone(),
            changed: !origin.feels_like(&self.newest().scene),
        })
    }

    /// The title with which the newest scene is saved under a name: its own, unless that is of a scene of the library
    /// from which it was changed. No two scenes of one title have different values.
    pub(crate) fn title_to_save(&self, name: &str) -> String {
        let scene = &*self.newest().scene;
        match self.origin.as_deref() {
            None => scene.name.clone(),
            Some(origin) if origin.name == name || origin.feels_like(scene) => origin.scene.name.clone(),
            Some(_) => name.to_owned(),
        }
    }

    /// Notes that a scene was saved in the library; the newest one comes from there if it is the same, perhaps but for
    /// its title.
    pub(crate) fn saved(&mut self, name: &str, scene: &Scene) {
        self.forget_origin(name);
        let origin = Origin {
            name: name.to_owned(),
            scene: scene.clone(),
        };
        if origin.feels_like(&self.newest().scene) {
            self.origin = Some(Rc::new(origin));
        }
    }

    /// Notes that a scene of the library has another name.
    pub(crate) fn renamed(&mut self, from: &str, to: &str) {
        // A scene that had the new name is replaced.
        self.forget_origin(to);
        self.change_origins(|origin| {
            if origin.as_ref().is_some_and(|origin| origin.name == from) {
                *origin = origin.as_ref().map(|origin| {
                    Rc::new(Origin {
                        name: to.to_owned(),
                        scene: origin.scene.clone(),
                    })
                });
            }
        });
    }

    /// Notes that the library no longer has a scene as it was.
    pub(crate) fn forget_origin(&mut self, name: &str) {
        self.change_origins(|origin| *origin = origin.take().filter(|origin| origin.name != name));
    }

    fn change_origins(&mut self, change: impl Fn(&mut Option<Rc<Origin>>)) {
        let steps = self.undo.iter_mut().chain(&mut self.redo);
        steps
            .map(|step| &mut step.origin)
            .chain([&mut self.origin])
            .for_each(change);
    }

    fn push(&mut self, before: Step) {
        if self.undo.len() == MAX_KEPT {
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

    fn named(name: u32) -> Rc<Scene> {
        Rc::new(Scene {
            name: name.to_string(),
            ..Scene::paper()
        })
    }

    fn heavy(kg: f64) -> Scene {
        Scene::paper()
            .with(&[("mass".parse().expect("a parameter"), kg)])
            .expect("valid")
    }

    #[test]
    fn drag_is_undone_in_one_step_without_foreign_changes() {
        let mut history = History::new(1, named(0));
        let dragged = |session, goes_on| {
            Move::Merge(Drag {
                session,
                parameters: vec!["mass".parse().expect("a parameter")],
                goes_on,
            })
        };
        history.moved(dragged(1, false), named(1));
        history.moved(dragged(1, true), named(2));
        assert_eq!((history.depth().0, history.undo_scene()), (1, Some(&named(0))));
        history.moved(dragged(2, true), named(3));
        history.moved(dragged(1, true), named(4));
        assert_eq!((history.depth().0, history.undo_scene()), (3, Some(&named(3))));
        history.moved(dragged(1, false), named(5));
        assert_eq!(history.depth().0, 4, "a new drag is a new step");
        assert!(history.is_noop(&dragged(1, false)) && history.is_noop(&dragged(1, true)));
        history.moved(dragged(1, true), named(6));
        assert_eq!(history.depth().0, 5, "also one that begins where the last one ended");
        assert!(!history.is_noop(&Move::Undo), "a step back is always one");
    }

    #[test]
    fn a_ramp_is_where_the_newest_tick_has_come() {
        let (from, to) = (heavy(1.0), heavy(4.0));
        let mut history = History::new(1, from.clone().into());
        let revision = history.moved(Move::Forward, to.into());
        let ramp = SceneRamp { from, over_s: 0.01 };
        history.keep_ramp(Some(ramp), 10);
        let at = |history: &History, revision: u64, ramp_steps: u16| {
            let tick = TickRecord {
                revision,
                ramp_steps,
                ..crate::rt::outbox::tests::record(9)
            };
            let scene = history.ramped_scene(Some(&tick));
            let mass = scene.and_then(|scene| scene.block).map(|block| block.mass);
            (mass.map(f64::round), history.is_ramping(Some(&tick)))
        };
        assert_eq!(at(&history, 1, 7), (Some(1.0), true), "another ramp's steps");
        assert_eq!(at(&history, revision, 5), (Some(2.0), true), "by equal ratios");
        assert_eq!(history.ramp_left_s(None), 0.01, "it is not begun");
        assert_eq!(at(&history, revision, 10), (Some(4.0), false));
        history.end_ramp();
        assert_eq!(at(&history, revision, 5), (None, false));
    }

    #[test]
    fn changed_scene_is_not_saved_under_its_old_title() {
        let ice = |mass: f64| {
            Rc::new(Scene {
                name: "thin ice".to_owned(),
                ..heavy(mass)
            })
        };
        let mut history = History::new(1, ice(1.0));
        history.moved(Move::Forward, ice(2.0));
        assert_eq!(history.title_to_save("mine"), "thin ice", "it is in no library");
        history.saved("ice", &ice(2.0));
        assert_eq!(history.title_to_save("mine"), "thin ice", "nothing has changed");
        history.moved(Move::Forward, ice(3.0));
        assert_eq!(history.title_to_save("mine"), "mine");
        assert_eq!(history.title_to_save("ice"), "thin ice", "it replaces what it was");
        let mine = Scene {
            name: "mine".to_owned(),
            ..heavy(3.0)
        };
        history.saved("mine", &mine);
        let saved = |name: &str, changed| {
            let name = name.to_owned();
            Some(LibraryScene { name, changed })
        };
        assert_eq!(history.library_scene(), saved("mine", false), "it is what was saved");
        assert_eq!(history.title_to_save("copy"), "mine", "a copy has the same title");
        history.moved(Move::Forward, ice(4.0));
        assert_eq!(history.library_scene(), saved("mine", true));
        assert_eq!(history.title_to_save("mine"), "mine");
        assert_eq!(history.title_to_save("yours"), "yours");
        // As in a comparison of two that a client keeps.
        for (scene, of) in [
            (named(1), None),
            (Rc::new(mine.clone()), saved("mine", false)),
            (ice(4.0), saved("ice", true)),
        ] {
            history.moved(Move::Load(None), scene);
            assert_eq!(history.library_scene(), of);
        }
        for _ in 0..3 {
            history.moved(Move::Undo, ice(4.0));
        }
        history.moved(Move::Undo, ice(3.0));
        history.moved(Move::Undo, ice(2.0));
        assert_eq!(history.title_to_save("mine"), "thin ice");
    }

    proptest! {
        /// Against two plain stacks.
        #[test]
        fn steps_lead_back_and_forth_through_the_same_scenes(moves in prop::collection::vec(0..4u8, 0..200)) {
            let mut history = History::new(1, named(0));
            let (mut back, mut forth, mut now, mut next) = (Vec::new(), Vec::new(), 0, 1);
            for step in moves {
                match step {
                    0 | 1 => {
                        let set = Move::Merge(Drag { session: 1, parameters: Vec::new(), goes_on: false });
                        history.moved(if step == 0 { set } else { Move::Forward }, named(next));
                        back.push(now);
                        forth.clear();
                        (now, next) = (next, next + 1);
                    }
                    2 => if let Some(to) = back.pop() {
                        prop_assert_eq!(history.undo_scene().cloned(), Some(named(to)));
                        history.moved(Move::Undo, named(to));
                        forth.push(now);
                        now = to;
                    },
                    _ => if let Some(to) = forth.pop() {
                        prop_assert_eq!(history.redo_scene().cloned(), Some(named(to)));
                        history.moved(Move::Redo, named(to));
                        back.push(now);
                        now = to;
                    },
                }
                prop_assert_eq!(history.depth(), (back.len(), forth.len()));
                prop_assert_eq!(&history.newest().scene, &named(now));
                prop_assert_eq!(history.scene(history.newest().revision), Some(&named(now)));
            }
        }
    }
}
