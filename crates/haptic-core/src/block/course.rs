//! The course of a tick through its pieces, common to all blocks that are solved piece by piece.
//!
//! A tick that is steady throughout is one piece. Any other is a sequence of pieces, each to the
//! next event or to where a series no longer converges. The work of a tick is bounded; when the
//! bound is reached, a few backward-Euler steps do the rest.

use super::body::{BlockState, Body, Coupling, EventSink, Load, Moving, Rendered, rounding};
use core::f64::consts::PI;

/// Backward-Euler steps that do the rest of a tick whose work is used up.
const FALLBACK_STEPS: u32 = 8;

/// A block in its coupling.
#[derive(Clone, Copy, Debug)]
pub(super) struct CoupledBlock {
    /// kg.
    pub(super) mass: f64,
    /// How the hand holds it.
    pub(super) coupling: Coupling,
    /// Where it is.
    pub(super) state: BlockState,
}

impl CoupledBlock {
    /// At rest at the origin.
    pub(super) fn new(mass: f64, coupling: Coupling) -> Self {
        Self {
            mass,
            coupling,
            state: BlockState::new(0.0, 0.0, 0.0, 0.0),
        }
    }

    /// N.
    pub(super) fn coupling_force(&self) -> f64 {
        self.coupling.force(&self.state)
    }
}

/// How far a tick has come.
pub(crate) struct Course {
    /// Duration of the tick, s.
    pub(super) elapsed_s: f64,
    pub(super) load: Load,
    /// Within this, N, a force on the block equals another.
    pub(super) rounding: f64,
    /// Time since the start of the tick, s.
    pub(super) time: f64,
    /// Displacement since the start of the tick, m: a small number keeps its digits.
    pub(super) moved: f64,
    /// Net force of the coming slide, N, after an event that fixes it better than subtraction can.
    pub(super) net_force: Option<f64>,
    /// Work done, and work that may be done.
    pub(super) work: u32,
    pub(super) budget: u32,
    pub(super) rendered: Rendered,
}

impl Course {
    fn new(block: &CoupledBlock, elapsed_s: f64, load: Load, budget: u32) -> Self {
        Self {
            elapsed_s,
            load,
            rounding: rounding(&block.coupling, &block.state),
            time: 0.0,
            moved: 0.0,
            net_force: None,
            work: 0,
            budget,
            rendered: Rendered::default(),
        }
    }

    /// Time to the end of the tick, s.
    pub(super) fn remaining(&self) -> f64 {
        self.elapsed_s - self.time
    }

    /// The coupling force if the block stood still where it is now, N.
    pub(super) fn at_rest(&self, coupling: &Coupling) -> f64 {
        self.load.at(self.time) - coupling.stiffness * self.moved
    }

    /// The same some time on.
    pub(super) fn at_rest_after(&self, step_s: f64, coupling: &Coupling) -> f64 {
        self.load.at(self.time + step_s) - coupling.stiffness * self.moved
    }

    fn is_exhausted(&self) -> bool {
        self.rendered.events >= self.budget || self.work >= self.budget
    }
}

/// Outcome of a piece.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Outcome {
    /// The next piece follows.
    NextPiece,
    /// The tick is over.
    TickEnds,
    /// The piece would take more work than is left: implicit steps follow.
    Exhausted,
}

/// A block that is solved piece by piece.
pub(super) trait PiecewiseBlock: Body + Clone + 'static {
    fn coupled(&self) -> &CoupledBlock;
    fn coupled_mut(&mut self) -> &mut CoupledBlock;

    /// Work that a tick may do.
    fn budget(&self, elapsed_s: f64) -> u32;

    /// The common tick without any event in it. Returns false, with nothing changed, where an event
    /// may lie in it.
    fn steady(&mut self, _elapsed_s: f64, _load: &Load, _sink: &mut impl EventSink) -> bool {
        false
    }

    /// The next piece.
    fn piece(&mut self, course: &mut Course, sink: &mut impl EventSink) -> Outcome;

    /// One backward-Euler step: stable and dissipative whatever its length.
    fn implicit_step(&mut self, course: &mut Course, step_s: f64, sink: &mut impl EventSink);

    /// Whether the contact's own state is a finite number.
    fn has_finite_contact(&self) -> bool {
        true
    }

    /// The block starts over from rest at the device.
    fn restarted(&mut self) {}
}

impl<B: PiecewiseBlock> Moving for B {
    /// With `elapsed_s` of zero or less the block stands still and only the force is new.
    fn advance(&mut self, elapsed_s: f64, position: f64, velocity: f64, sink: &mut impl EventSink) -> Rendered {
        tick(self, elapsed_s, (position, velocity), |block, load| {
            under(block, elapsed_s, load, sink)
        })
    }

    fn advance_implicitly(
        &mut self,
        elapsed_s: f64,
        position: f64,
        velocity: f64,
        sink: &mut impl EventSink,
    ) -> Rendered {
        tick(self, elapsed_s, (position, velocity), |block, load| {
            let mut course = Course::new(block.coupled(), elapsed_s, load, 0);
            let from = block.coupled().state.contact;
            block.implicit_step(&mut course, elapsed_s, sink);
            let state = &mut block.coupled_mut().state;
            state.advance(course.moved);
            Rendered {
                events: u32::from(from != state.contact),
                ..Rendered::default()
            }
        })
    }
}

/// A tick under a load.
#[inline(always)]
pub(super) fn under<B: PiecewiseBlock>(
    block: &mut B,
    elapsed_s: f64,
    load: Load,
    sink: &mut impl EventSink,
) -> Rendered {
    if block.steady(elapsed_s, &load, sink) {
        return Rendered::default();
    }
    in_pieces(block, elapsed_s, load, sink)
}

/// The pieces of a tick. Apart from a steady tick, which then saves no registers for it.
#[inline(never)]
fn in_pieces<B: PiecewiseBlock>(block: &mut B, elapsed_s: f64, load: Load, sink: &mut impl EventSink) -> Rendered {
    let mut course = Course::new(block.coupled(), elapsed_s, load, block.budget(elapsed_s));
    while course.time < elapsed_s {
        let then = if course.is_exhausted() {
            Outcome::Exhausted
        } else {
            block.piece(&mut course, sink)
        };
        match then {
            Outcome::NextPiece => {}
            Outcome::TickEnds => break,
            Outcome::Exhausted => {
                let step_s = course.remaining() / f64::from(FALLBACK_STEPS);
                for _ in 0..FALLBACK_STEPS {
                    block.implicit_step(&mut course, step_s, sink);
                }
                course.rendered.work_exhausted = true;
                break;
            }
        }
    }
    block.coupled_mut().state.advance(course.moved);
    course.rendered
}

/// A tick to a sample of position and velocity, moved on by `motion`, with what holds for every
/// tick around it.
fn tick<B: PiecewiseBlock>(
    block: &mut B,
    elapsed_s: f64,
    (position, velocity): (f64, f64),
    motion: impl FnOnce(&mut B, Load) -> Rendered,
) -> Rendered {
    let mut rendered = Rendered::default();
    if elapsed_s > 0.0 {
        let &CoupledBlock { coupling, state, .. } = block.coupled();
        rendered = motion(block, Load::new(&coupling, &state, elapsed_s, position, velocity));
        let state = &mut block.coupled_mut().state;
        *state = state.flushed();
        if !(state.is_finite() && block.has_finite_contact()) {
            // Forces beyond the range of numbers.
            block.coupled_mut().state = BlockState::new(position, 0.0, position, velocity);
            block.restarted();
        }
    }
    let coupled = block.coupled_mut();
    coupled.state.device_position = position;
    coupled.state.device_velocity = velocity;
    rendered.coupling_force = coupled.coupling_force();
    rendered
}

/// Largest `omega_d T` accepted, rad: the work of a tick is bounded by the half-turns in it.
pub const MAX_PHASE_PER_TICK_RAD: f64 = 400.0;

/// Work that every tick may do, beside that of its half-turns.
const BASE_WORK: f64 = 16.0;

/// The work that a tick may do, with so much for each half-turn of the free oscillation.
pub(super) fn work_budget(half_turns: f64, for_each: f64, extra: u32) -> u32 {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "from 16 to some thousand"
    )]
    let budget = (BASE_WORK + for_each * half_turns.min(MAX_PHASE_PER_TICK_RAD / PI)) as u32;
    budget + extra
}
