//! The compiled form of a scene in the plane.

use super::block::{IsotropicKarnopp, PlanarBlock, PlanarState, SLIDING};
use super::spring::DraggedSpring;
use super::vector::Plane;
use crate::block::{Contact, Coupling, EventSink, Rendered};
use crate::directional::Directional;
use crate::friction::{Friction, Karnopp, Reseat};
use crate::math::sqrt;
use crate::parameters::{Parameter, SceneError};
use crate::render::VisibleState;
use crate::renderer::{FARTHEST_RESEAT_M, Rendering};
use crate::scene::Scene;
use crate::scheme::Scheme;
use crate::snapshot::Archive;
use crate::vector::Vector;
use alloc::boxed::Box;
use alloc::format;

/// A scene in the plane, ready to be rendered: a block on Karnopp's surface or on a viscous one, or either surface
/// under the device itself.
#[derive(Clone, Debug)]
pub struct PlanarRenderer {
    surface: Surface,
    /// The force that a step of the device makes within a tick, N/m.
    stiffness: f64,
}

#[derive(Clone, Debug)]
enum Surface {
    Block(Box<HeldBlock>),
    Spring(DraggedSpring),
    Drag(Drag),
}

/// A block, and how the hand holds it.
#[derive(Clone, Debug)]
struct HeldBlock {
    mass: f64,
    coupling: Coupling,
    block: PlanarBlock,
}

/// Drag on the device itself.
#[derive(Clone, Copy, Debug)]
struct Drag {
    /// `b`, N s/m.
    viscous: f64,
    position: Plane,
    velocity: Plane,
}

/// The value of a parameter that is the same both ways.
fn isotropic(parameter: Parameter, value: Directional) -> Result<f64, SceneError> {
    if value.is_symmetric() {
        Ok(value.positive)
    } else {
        Err(SceneError::PlaneHasNoDirection { param: parameter })
    }
}

fn one_axis_only(what: impl Into<alloc::string::String>, instead: &'static str) -> SceneError {
    SceneError::OneAxisOnly {
        what: what.into(),
        instead,
    }
}

/// Karnopp's law without options.
fn karnopp(law: &Karnopp) -> Result<IsotropicKarnopp, SceneError> {
    for (parameter, value) in [
        (Parameter::StribeckVelocity, law.stribeck_velocity),
        (Parameter::RisingRate, law.rising_rate),
    ] {
        if value != 0.0 {
            return Err(one_axis_only(
                format!("{} = {value} {}", parameter.info().name, parameter.info().unit),
                "in the plane it must be 0",
            ));
        }
    }
    Ok(IsotropicKarnopp {
        static_force: isotropic(Parameter::StaticForce, law.static_force)?,
        dynamic_force: isotropic(Parameter::DynamicForce, law.dynamic_force)?,
        viscous: isotropic(Parameter::Viscous, law.viscous)?,
        velocity_threshold: law.velocity_threshold,
    })
}

/// What the surface of a scene is.
fn friction_of(scene: &Scene) -> Result<IsotropicKarnopp, SceneError> {
    match &scene.friction {
        Friction::Karnopp(law) => karnopp(law),
        Friction::Viscous(law) => Ok(IsotropicKarnopp {
            static_force: 0.0,
            dynamic_force: 0.0,
            viscous: isotropic(Parameter::Viscous, law.viscous)?,
            velocity_threshold: 0.0,
        }),
        other => Err(one_axis_only(
            format!("the law `{}`", other.law()),
            "in the plane there are karnopp and viscous",
        )),
    }
}

impl Rendering<Plane> for PlanarRenderer {
    fn in_range(scene: &Scene, scheme: Scheme, period_s: f64) -> Result<Self, SceneError> {
        scene.check_parts()?;
        scene.validate_rate(period_s)?;
        if scheme != Scheme::Exact {
            return Err(one_axis_only(
                format!("the scheme `{scheme}`"),
                "in the plane there is exact",
            ));
        }
        let friction = friction_of(scene)?;
        let (Some(block), Some(coupling)) = (scene.block, scene.coupling) else {
            if let Friction::Karnopp(law) = &scene.friction {
                if law.reseat.is_some_and(|reseat| reseat != Reseat::Continuous) {
                    return Err(one_axis_only("reseat = slides", "in the plane it must be continuous"));
                }
                let stiffness = scene.friction.contact_stiffness(true);
                return Ok(Self {
                    surface: Surface::Spring(DraggedSpring::new(stiffness, friction)),
                    stiffness: stiffness + friction.viscous / period_s,
                });
            }
            return Ok(Self {
                surface: Surface::Drag(Drag {
                    viscous: friction.viscous,
                    position: Plane::ZERO,
                    velocity: Plane::ZERO,
                }),
                stiffness: friction.viscous / period_s,
            });
        };
        Ok(Self {
            surface: Surface::Block(Box::new(HeldBlock {
                mass: block.mass,
                coupling,
                block: PlanarBlock::new(block.mass, coupling, friction),
            })),
            stiffness: coupling.stiffness + coupling.damping / period_s,
        })
    }

    fn stiffness(&self) -> f64 {
        self.stiffness
    }

    fn shown(&self) -> VisibleState<Plane> {
        match &self.surface {
            Surface::Block(held) => {
                let state = held.block.state();
                VisibleState {
                    position: state.position,
                    velocity: state.velocity,
                    contact: state.contact,
                }
            }
            Surface::Spring(spring) => VisibleState {
                position: spring.position,
                velocity: spring.velocity,
                contact: spring.contact(),
            },
            Surface::Drag(drag) => VisibleState {
                position: drag.position,
                velocity: drag.velocity,
                contact: SLIDING,
            },
        }
    }

    fn start_at(&mut self, position: Plane, velocity: Plane) {
        self.hold_at(position, velocity, position, velocity);
    }

    fn hold_at(&mut self, position: Plane, velocity: Plane, device_position: Plane, device_velocity: Plane) {
        match &mut self.surface {
            Surface::Block(held) => {
                let mut state = PlanarState::new(position, velocity, device_position, device_velocity);
                if velocity == Plane::ZERO {
                    state.contact = held.block.at_rest();
                }
                held.block.set_state(state);
            }
            Surface::Spring(spring) => spring.put(device_position, device_velocity, Plane::ZERO),
            Surface::Drag(drag) => (drag.position, drag.velocity) = (device_position, device_velocity),
        }
    }

    fn render(&mut self, elapsed_s: f64, position: Plane, velocity: Plane) -> Plane {
        match &mut self.surface {
            Surface::Block(held) => held.block.tick(elapsed_s, position, velocity, &mut ()).coupling_force,
            Surface::Spring(spring) => {
                spring.advance(elapsed_s, position, velocity);
                spring.force()
            }
            Surface::Drag(drag) => {
                (drag.position, drag.velocity) = (position, velocity);
                drag.force()
            }
        }
    }

    fn render_with_events(
        &mut self,
        elapsed_s: f64,
        position: Plane,
        velocity: Plane,
        sink: &mut dyn EventSink,
    ) -> Rendered<Plane> {
        if let Surface::Block(held) = &mut self.surface {
            return held.block.tick(elapsed_s, position, velocity, sink);
        }
        let before = self.shown().contact;
        let coupling_force = self.render(elapsed_s, position, velocity);
        let contact = self.shown().contact;
        if contact != before {
            sink.contact_changed(elapsed_s, before, contact);
        }
        Rendered {
            coupling_force,
            events: u32::from(contact != before),
            work_exhausted: false,
        }
    }

    fn take_over(&mut self, old: &Self) -> Plane {
        let force = old.coupling_force();
        let mut state = old.state();
        match (&mut self.surface, &old.surface) {
            (Surface::Block(now), Surface::Block(was)) => {
                let velocity = state.velocity;
                let share = was.impedance() / now.impedance();
                // As on one axis: the block is slowed where a stiffer coupling would raise the force.
                if state.contact != Contact::Stuck && share < 1.0 {
                    state.velocity = state.device_velocity + (state.velocity - state.device_velocity) * share;
                }
                if now.coupling != was.coupling || state.velocity != velocity {
                    let farthest = FARTHEST_RESEAT_M.max(state.deflection().length());
                    now.seat(&mut state, force, farthest);
                }
                now.block.set_state(state);
            }
            (Surface::Block(now), _) => {
                now.seat(&mut state, force, FARTHEST_RESEAT_M);
                now.block.set_state(state);
            }
            (Surface::Spring(now), Surface::Spring(was)) => now.follow(was),
            (Surface::Spring(now), Surface::Block(was))
                if state.contact != Contact::Stuck
                    && was.block.at_rest() == Contact::Stuck
                    && state.velocity != Plane::ZERO =>
            {
                // Friction is along the block's motion, which in an overshoot is against the coupling's force.
                now.slide(state.device_position, state.device_velocity, state.velocity);
            }
            // What holds, holds what the hand felt.
            (Surface::Spring(now), _) => now.put(state.device_position, state.device_velocity, force),
            (Surface::Drag(now), _) => {
                (now.position, now.velocity) = (state.device_position, state.device_velocity);
            }
        }
        force - self.coupling_force()
    }

    fn archive(&mut self, archive: &mut Archive<'_>) {
        match &mut self.surface {
            Surface::Block(held) => held.block.archive(archive),
            Surface::Spring(spring) => spring.archive(archive),
            Surface::Drag(drag) => {
                archive.vector("device_position_m", &mut drag.position);
                archive.vector("device_velocity_mps", &mut drag.velocity);
            }
        }
    }
}

impl PlanarRenderer {
    fn coupling_force(&self) -> Plane {
        match &self.surface {
            Surface::Block(held) => held.block.coupling_force(),
            Surface::Spring(spring) => spring.force(),
            Surface::Drag(drag) => drag.force(),
        }
    }

    /// The block and the device; of a surface alone a block that rests where the surface sticks, and else goes with the
    /// device.
    fn state(&self) -> PlanarState {
        match &self.surface {
            Surface::Block(held) => held.block.state(),
            Surface::Spring(spring) => {
                let velocity = match spring.contact() {
                    Contact::Stuck => Plane::ZERO,
                    Contact::Sliding(_) => spring.velocity,
                };
                PlanarState::new(spring.position, velocity, spring.position, spring.velocity)
            }
            Surface::Drag(drag) => PlanarState::new(drag.position, drag.velocity, drag.position, drag.velocity),
        }
    }
}

impl HeldBlock {
    /// The force that a sudden velocity against the hand makes, N s/m.
    fn impedance(&self) -> f64 {
        let Coupling { stiffness, damping } = self.coupling;
        sqrt(damping * damping + stiffness * self.mass)
    }

    /// Puts a block where its coupling gives a force, N, or as near to it as it comes within a distance of the hand, m.
    fn seat(&self, state: &mut PlanarState, force: Plane, farthest: f64) {
        let Coupling { stiffness, damping } = self.coupling;
        if stiffness > 0.0 {
            let sprung = force - (state.device_velocity - state.velocity) * damping;
            // Not by a deflection that a soft coupling may put beyond the range of numbers.
            let deflection = if sprung.length() > farthest * stiffness {
                sprung.pointing(farthest)
            } else {
                sprung / stiffness
            };
            state.put(state.device_position - deflection);
        }
    }
}

impl Drag {
    fn force(&self) -> Plane {
        self.velocity * self.viscous
    }
}
