//! The compiled form of a scene: its own parts and no others, behind one interface.

use crate::block::{BlockState, Coupling, EventSink, Rendered};
use crate::contact::{Contact, ContactMemory};
use crate::directional::Directional;
use crate::math::sqrt;
use crate::parameters::{Parameter, SceneError};
use crate::render::{BlockSetup, Surface, VisibleState};
use crate::scene::Scene;
use crate::scheme::Scheme;
use crate::snapshot::Archive;
use alloc::boxed::Box;
use core::fmt::Debug;

/// Greatest distance from the hand at which a block is re-seated when its coupling changes, m, unless it was
/// farther away already: a soft coupling would pull steadily wherever the hand went.
pub const FARTHEST_RESEAT_M: f64 = 0.02;

/// Renders a scene where a hand moves in a space of [`Vector`](crate::Vector)s.
pub trait Rendering<V>: Clone + Debug + Send + Sized {
    /// See [`Renderer::new`].
    ///
    /// # Errors
    /// The scene cannot be rendered.
    fn new(scene: &Scene, scheme: Scheme, period_s: f64) -> Result<Self, SceneError> {
        scene.check_ranges()?;
        Self::in_range(scene, scheme, period_s)
    }

    /// The same of a scene whose values are within their ranges.
    ///
    /// # Errors
    /// The scene cannot be rendered.
    fn in_range(scene: &Scene, scheme: Scheme, period_s: f64) -> Result<Self, SceneError>;

    /// The force that a step of the device makes within a tick, N/m: `K + B/T` of the coupling, or of the contact
    /// without one.
    fn stiffness(&self) -> f64;

    /// What a tick shows of the block.
    fn shown(&self) -> VisibleState<V>;

    /// Puts the block at the device (m), moving with it (m/s), so that the coupling starts without force.
    fn start_at(&mut self, position: V, velocity: V);

    /// Puts the block somewhere (m), in motion (m/s) or at rest, held by a device at another place; without a block the
    /// device alone. A block that moves slides.
    fn hold_at(&mut self, position: V, velocity: V, device_position: V, device_velocity: V);

    /// Moves on by `elapsed_s` seconds, in which the device went to `position` (m) and `velocity` (m/s). Returns the
    /// force of the coupling on the block, N.
    fn render(&mut self, elapsed_s: f64, position: V, velocity: V) -> V;

    /// The same, and tells `sink` of each change of contact, and what energy the friction of a block took.
    fn render_with_events(&mut self, elapsed_s: f64, position: V, velocity: V, sink: &mut dyn EventSink)
    -> Rendered<V>;

    /// See [`Renderer::take_over`].
    fn take_over(&mut self, old: &Self) -> V;

    /// Saves or loads all that a tick keeps for the next one.
    fn archive(&mut self, archive: &mut Archive<'_>);
}

impl Rendering<f64> for Renderer {
    fn in_range(scene: &Scene, scheme: Scheme, period_s: f64) -> Result<Self, SceneError> {
        scene.check_parts()?;
        scene.validate_rate(period_s)?;
        let held = match (&scene.block, &scene.coupling) {
            (Some(block), Some(coupling)) => Some((block.mass, *coupling)),
            _ => None,
        };
        let surface = match held {
            None => scene.friction.as_law().on_device(),
            Some((mass, coupling)) => scene
                .friction
                .as_law()
                .behind_block(&BlockSetup { mass, coupling, scheme }),
        };
        let (stiffness, damping) = match held {
            Some((_, coupling)) => (coupling.stiffness, coupling.damping),
            None => (
                scene.friction.contact_stiffness(true),
                scene.value(Parameter::Viscous).map_or(0.0, Directional::greatest),
            ),
        };
        Ok(Self {
            surface,
            held,
            stiffness: stiffness + damping / period_s,
        })
    }

    #[inline(always)]
    fn stiffness(&self) -> f64 {
        self.stiffness
    }

    #[inline(always)]
    fn shown(&self) -> VisibleState {
        self.surface.shown()
    }

    fn start_at(&mut self, position: f64, velocity: f64) {
        self.start_at(position, velocity);
    }

    fn hold_at(&mut self, position: f64, velocity: f64, device_position: f64, device_velocity: f64) {
        self.set_state(self.held_at(position, velocity, device_position, device_velocity));
    }

    #[inline(always)]
    fn render(&mut self, elapsed_s: f64, position: f64, velocity: f64) -> f64 {
        self.tick(elapsed_s, position, velocity).coupling_force
    }

    fn render_with_events(
        &mut self,
        elapsed_s: f64,
        position: f64,
        velocity: f64,
        sink: &mut dyn EventSink,
    ) -> Rendered {
        self.tick_with_events(elapsed_s, position, velocity, sink)
    }

    fn take_over(&mut self, old: &Self) -> f64 {
        self.take_over(old)
    }

    fn archive(&mut self, archive: &mut Archive<'_>) {
        self.surface.archive(archive);
    }
}

/// A scene, ready to be rendered.
#[derive(Clone, Debug)]
pub struct Renderer {
    surface: Box<dyn Surface>,
    /// The block's mass and its coupling, where there is one.
    held: Option<(f64, Coupling)>,
    stiffness: f64,
}

impl Renderer {
    /// Compiles a scene for ticks of about `period_s` seconds. The block starts at rest at the
    /// origin; see [`start_at`](Self::start_at).
    ///
    /// # Errors
    /// Those of [`Scene::validate`] and [`Scene::validate_rate`].
    pub fn new(scene: &Scene, scheme: Scheme, period_s: f64) -> Result<Self, SceneError> {
        <Self as Rendering<f64>>::new(scene, scheme, period_s)
    }

    /// The block and the last device sample. Without a block it is the contact at the device.
    #[must_use]
    pub fn state(&self) -> BlockState {
        BlockState {
            memory: self.surface.memory(),
            ..self.surface.state()
        }
    }

    /// Puts the block somewhere, in motion or at rest, without a tick.
    pub fn set_state(&mut self, state: BlockState) {
        self.surface.set_state(state);
    }

    /// A block somewhere, at rest where it does not move, held by a device at another place.
    fn held_at(&self, position: f64, velocity: f64, device_position: f64, device_velocity: f64) -> BlockState {
        let mut state = BlockState::new(position, velocity, device_position, device_velocity);
        if velocity == 0.0 {
            state.contact = self.at_rest();
        }
        state
    }

    /// Puts the block at the device, moving with it, so that the coupling starts without force.
    pub fn start_at(&mut self, position: f64, velocity: f64) {
        let mut state = self.held_at(position, velocity, position, velocity);
        if self.held.is_none() {
            // What the hand itself slides on begins without force, too.
            state.memory = ContactMemory::RESTED;
        }
        self.set_state(state);
    }

    /// The contact of a block at rest: sliding where no friction can hold it.
    #[must_use]
    pub fn at_rest(&self) -> Contact {
        self.surface.at_rest()
    }

    /// Bytes that a tick keeps: the scene's own parts.
    #[must_use]
    pub fn state_bytes(&self) -> usize {
        size_of_val(&*self.surface)
    }

    /// Moves on by `elapsed_s` seconds, in which the device went to `position` (m) and `velocity`
    /// (m/s). What is not a finite number gives a force that is none: a [`Servo`](crate::servo::Servo) lets none in.
    pub fn tick(&mut self, elapsed_s: f64, position: f64, velocity: f64) -> Rendered {
        self.surface.tick(elapsed_s, position, velocity)
    }

    /// Like [`tick`](Self::tick), and tells `sink` of each change of contact.
    pub fn tick_with_events(
        &mut self,
        elapsed_s: f64,
        position: f64,
        velocity: f64,
        sink: &mut dyn EventSink,
    ) -> Rendered {
        self.surface.tick_with_events(elapsed_s, position, velocity, sink)
    }

    /// Takes over the motion of the renderer that this one replaces, so that the hand feels no
    /// jerk.
    ///
    /// The block keeps its position and velocity, but is slowed where a stiffer coupling would raise the force,
    /// and its contact goes on with what it [remembers](crate::block::ContactMemory): its deflection, its
    /// slide, its rest. Where the coupling itself changed, the block is re-seated so that the force in the coupling,
    /// which is what the hand feels, stays as it was. What the new scene cannot hold, as a coupling
    /// too soft for the force within [`FARTHEST_RESEAT_M`] or a friction that is another, is a step
    /// of force, whose value is returned, N (the old force less the new).
    pub fn take_over(&mut self, old: &Self) -> f64 {
        let (mut state, force) = (old.state(), old.surface.coupling_force());
        match (self.held, old.held) {
            (Some((mass, now)), Some((old_mass, was))) => {
                let velocity = state.velocity;
                // In a stiffer coupling, or with more mass, the same motion against the hand would make a
                // larger force, |v - w| sqrt(B^2 + K M): it is slowed to what it would have come to. A
                // stuck block does not move, and is pulled as the new coupling pulls.
                let impedance = |held: Coupling, mass: f64| sqrt(held.damping * held.damping + held.stiffness * mass);
                let share = impedance(was, old_mass) / impedance(now, mass);
                if matches!(state.contact, Contact::Sliding(_)) && share < 1.0 {
                    state.velocity = state.device_velocity + (state.velocity - state.device_velocity) * share;
                }
                if now != was || state.velocity != velocity {
                    let farthest = FARTHEST_RESEAT_M.max(state.deflection().abs());
                    state.position = seat(&state, now, force, farthest);
                }
            }
            (Some((_, now)), None) => {
                // At rest on a surface that stuck, and moving with the hand on one that slid.
                state.velocity = match state.contact {
                    Contact::Stuck => 0.0,
                    Contact::Sliding(_) => state.device_velocity,
                };
                state.position = seat(&state, now, force, FARTHEST_RESEAT_M);
            }
            // What holds, holds what the hand felt.
            (None, Some(_)) if state.memory.slide.is_none() => state.memory.force = force,
            (None, _) => {}
        }
        self.set_state(state);
        force - self.surface.coupling_force()
    }
}

/// Where a block is put so that its coupling gives `force`, N, or as near to it as it comes within a distance of the
/// hand, m.
fn seat(state: &BlockState, now: Coupling, force: f64, farthest: f64) -> f64 {
    if now.stiffness == 0.0 {
        return state.position;
    }
    let damped = now.damping * (state.device_velocity - state.velocity);
    let deflection = (force - damped) / now.stiffness;
    state.device_position - deflection.clamp(-farthest, farthest)
}
