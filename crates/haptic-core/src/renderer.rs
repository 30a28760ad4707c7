//! The compiled form of a scene: its own parts and no others, behind one interface.

use crate::block::{BlockState, Coupling, EventSink, Rendered};
use crate::bound_error::BoundError;
use crate::contact::Contact;
use crate::directional::Directional;
use crate::excitation::{Excitation, Follower};
use crate::math::sqrt;
use crate::parameters::{Parameter, SceneError};
use crate::pulse::{Pulse, PulseShape};
use crate::render::{BlockSetup, Shown, Surface};
use crate::scene::Scene;
use crate::scheme::Scheme;
use alloc::boxed::Box;

/// Greatest distance from the hand at which a block is re-seated when its coupling changes, m:
/// farther, a soft coupling would pull steadily wherever the hand went.
pub const FARTHEST_RESEAT_M: f64 = 0.02;

/// A scene, ready to be rendered.
#[derive(Debug)]
pub struct Renderer {
    surface: Box<dyn Surface>,
    /// The block's mass and its coupling, where there is one.
    held: Option<(f64, Coupling)>,
    stiffness: f64,
    is_motion: bool,
}

impl Clone for Renderer {
    fn clone(&self) -> Self {
        Self {
            surface: self.surface.boxed(),
            held: self.held,
            stiffness: self.stiffness,
            is_motion: self.is_motion,
        }
    }
}

impl Renderer {
    /// Compiles a scene for ticks of about `period_s` seconds. The block starts at rest at the
    /// origin; see [`start_at`](Self::start_at).
    ///
    /// # Errors
    /// Those of [`Scene::validate`] and [`Scene::validate_rate`].
    pub fn new(scene: &Scene, scheme: Scheme, period_s: f64) -> Result<Self, SceneError> {
        scene.validate()?;
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
            is_motion: false,
        })
    }

    /// A single pulse of force instead of a scene, for ticks of about `period_s` seconds. It begins
    /// with the tick after it has [taken over](Self::take_over), and at no other time: set to
    /// another state before its end, it gives no force any more.
    ///
    /// # Errors
    /// The pulse is not bounded as it must be.
    pub fn pulse(shape: PulseShape, period_s: f64) -> Result<Self, BoundError> {
        shape.check()?;
        Ok(Self::motion(Box::new(Pulse::new(shape, period_s))))
    }

    /// An excitation instead of a scene, for ticks of about `period_s` seconds. It begins and ends
    /// as a [pulse](Self::pulse) does. Its block is the reference, which is stuck once it has ended.
    ///
    /// # Errors
    /// The excitation is not bounded as it must be.
    pub fn excitation(excitation: Excitation, period_s: f64) -> Result<Self, BoundError> {
        excitation.check()?;
        Ok(Self::motion(Box::new(Follower::new(excitation, period_s))))
    }

    fn motion(surface: Box<dyn Surface>) -> Self {
        Self {
            surface,
            held: None,
            stiffness: 0.0,
            is_motion: true,
        }
    }

    /// Whether it is a pulse or an excitation instead of a scene.
    #[must_use]
    pub fn is_motion(&self) -> bool {
        self.is_motion
    }

    /// The force that a step of the device makes within a tick, N/m: `K + B/T` of the coupling, or of the contact without
    /// one.
    pub(crate) fn stiffness(&self) -> f64 {
        self.stiffness
    }

    /// The block and the last device sample. Without a block it is the contact at the device.
    #[must_use]
    pub fn state(&self) -> BlockState {
        self.surface.state()
    }

    /// The part of the [`state`](Self::state) that every tick shows.
    pub(crate) fn shown(&self) -> Shown {
        self.surface.shown()
    }

    /// Puts the block somewhere, in motion or at rest, without a tick.
    pub fn set_state(&mut self, state: BlockState) {
        self.surface.set_state(state);
    }

    /// Puts the block at the device, moving with it, so that the coupling starts without force.
    pub fn start_at(&mut self, position: f64, velocity: f64) {
        let mut state = BlockState::new(position, velocity, position, velocity);
        if velocity == 0.0 {
            state.contact = self.surface.at_rest();
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
    /// (m/s).
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
    /// The block keeps its position, velocity and contact, but for what a stiffer grip would make a
    /// kick of. Where the coupling itself changed, the block is re-seated so that the force in the
    /// coupling, which is what the hand feels, stays as it was. A contact that gives way is
    /// deflected so that its friction stays as it was. What the new scene cannot hold, as a
    /// coupling too soft for the force within [`FARTHEST_RESEAT_M`], is a step of force, whose
    /// value is returned, N (the old force less the new).
    pub fn take_over(&mut self, old: &Self) -> f64 {
        let state = old.state();
        match (self.held, old.held) {
            (Some(now), Some(was)) => self.take_over_block(state, old.surface.friction(), now, was),
            (Some(now), None) => self.introduce_block(state, old.surface.coupling_force(), now),
            (None, _) => {
                self.set_state(state);
                self.surface.seat(old.surface.coupling_force());
                old.surface.coupling_force() - self.surface.coupling_force()
            }
        }
    }

    /// One block takes over from another.
    fn take_over_block(&mut self, old: BlockState, friction: f64, now: (f64, Coupling), was: (f64, Coupling)) -> f64 {
        let mut state = old;
        let ((mass, now), (old_mass, was)) = (now, was);
        let mut step = 0.0;
        // In a stiffer grip, or with more mass, the same motion against the hand would swing to a
        // larger force, |v - w| sqrt(K M): it is slowed to what it would have come to. A stuck
        // block does not move, and is pulled as the new grip pulls.
        let swing = (was.stiffness * old_mass) / (now.stiffness * mass);
        if matches!(state.contact, Contact::Sliding(_)) && swing < 1.0 {
            state.velocity = state.device_velocity + (state.velocity - state.device_velocity) * sqrt(swing);
        }
        if now != was || state.velocity != old.velocity {
            let force = was.force(&old);
            let damped = now.damping * (state.device_velocity - state.velocity);
            (state.position, step) = seat_block(&state, now, force, damped);
        }
        self.set_state(state);
        self.surface.seat(friction);
        step
    }

    /// A block comes in where there was none: at rest on a surface that stuck, and moving with the
    /// hand on one that slid.
    fn introduce_block(&mut self, old: BlockState, force: f64, (_, now): (f64, Coupling)) -> f64 {
        let mut state = BlockState {
            velocity: match old.contact {
                Contact::Stuck => 0.0,
                Contact::Sliding(_) => old.device_velocity,
            },
            ..old
        };
        let damped = now.damping * (state.device_velocity - state.velocity);
        let step;
        (state.position, step) = seat_block(&state, now, force, damped);
        self.set_state(state);
        self.surface.seat(force);
        step
    }
}

/// Where a block is put so that its coupling gives `force`, of which `damped` comes from the
/// damper, and the force that is missing then.
fn seat_block(state: &BlockState, now: Coupling, force: f64, damped: f64) -> (f64, f64) {
    let deflection = if now.stiffness > 0.0 {
        ((force - damped) / now.stiffness).clamp(-FARTHEST_RESEAT_M, FARTHEST_RESEAT_M)
    } else {
        state.device_position - state.position
    };
    let stays = deflection.abs() < FARTHEST_RESEAT_M && now.stiffness > 0.0;
    let step = if stays {
        0.0
    } else {
        force - damped - now.stiffness * deflection
    };
    (state.device_position - deflection, step)
}
