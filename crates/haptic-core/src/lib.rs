//! The physics of hapticd: a block that slides on a surface, felt through a virtual coupling.
//!
//! The model is the one of Richard and Cutkosky's friction rendering: the measured device position
//! `p` and velocity `v` drag a block of mass `M` through a spring `K` and a damper `B`, and the
//! block rubs on a surface under Karnopp's friction law (Karnopp 1985). The hand feels the
//! coupling.
//!
//! ```text
//!            K (p - x) + B (v - w) = F
//!   hand == device /\/\/\/ block --> x, w = x'        M w' = F - friction
//!             p, v         ======
//!                          surface: stuck while -Fs- <= F <= Fs+, else Fd and b w against the motion
//! ```
//!
//! ```
//! use haptic_core::{Renderer, Scene, Scheme};
//!
//! let period_s = 1e-3;
//! let mut renderer = Renderer::new(&Scene::light_block(), Scheme::Exact, period_s)?;
//! let mut force_on_hand_n = 0.0;
//! for tick in 0..1000 {
//!     // A hand that moves at 0.1 m/s; on a rig an encoder and an estimator of velocity give these two.
//!     let (position_m, velocity_mps) = (0.1 * period_s * f64::from(tick), 0.1);
//!     force_on_hand_n = -renderer.tick(period_s, position_m, velocity_mps).coupling_force;
//! }
//! // The block slides along, and its kinetic friction of 3.5 N pulls the hand back.
//! assert!((force_on_hand_n + 3.5).abs() < 1e-6);
//! # Ok::<(), haptic_core::SceneError>(())
//! ```
//!
//! Beside a motor use a [`Servo`](servo::Servo), which adds the velocity estimator, limits, ramps, stops and faults:
//! [`servo`] shows how.
//!
//! With the feature `serde` a text becomes a scene, also one that says `coupling = "rig"`:
//! `toml::from_str::<SceneFile>(text)?.on(None)`, with [`scene::SceneFile`]. [`Renderer::new`] checks values
//! for their ranges, and [`adviser`] whether a scene is stable on a rig.
//! `schema` adds JSON schemas. The crate is not on crates.io: depend on it by git, or from outside its checkout by path,
//! `haptic-core = { path = "PATH/crates/haptic-core", features = ["serde"] }`.
//!
//! * [`scene`] is the user's description; [`parameters`] is the one table of names, symbols,
//!   units and ranges behind the wire, the command line and the panel.
//! * [`friction`] has the laws: Karnopp's, which the block above slides under, and seven others,
//!   each behind a block or on the device itself.
//! * A scene compiles to a [`Renderer`]: one [`tick`](Renderer::tick) per measurement, by the
//!   [exact](block::exact) scheme or the paper's [literal](block::literal) one.
//! * [`planar`] has the same block in a plane, on a surface that is alike in all directions.
//! * [`sample_clock`] holds a device's clock against ours, and [`position_guard`] its positions
//!   against what a hand can do, before anything is made of them.
//! * [`own_motion`] moves the handle by the rig's own motor: by a pulse while a rig is commissioned, and along an
//!   [`excitation`] while it is identified.
//! * [`adviser`] tells whether a scene is stable and passive on a rig, and what would be.
//! * [`snapshot`] is the state of a servo, from which another one goes on.
//! * [`velocity`] estimates velocity from encoder positions, [`limiter`] is the last gate before
//!   the motor, and [`passivity`] watches the energy that sampling makes.
//! * [`rig_friction`] is what the rig itself takes from every motion, and [`compensation`] gives a
//!   share of it back.
//!
//! # Units and signs
//! SI units throughout. Positive position, velocity and force point the same way along the device
//! axis. The coupling force `F` drives the block; the force on the hand is `-F`.
//!
//! Nothing here does I/O, reads a clock, or allocates once a [`Renderer`] is built. The crate needs
//! only `core`, `alloc` and `libm`, and gives the same forces to the last bit in every build and on
//! every machine.
#![no_std]
#![forbid(unsafe_code)]
#![cfg_attr(not(test), deny(clippy::disallowed_types, clippy::disallowed_methods))]

extern crate alloc;
#[cfg(test)]
extern crate std;

pub mod adviser;
pub mod block;
mod bound_error;
pub mod compensation;
mod contact;
mod directional;
pub mod excitation;
pub mod friction;
pub mod limiter;
mod math;
pub mod nearest;
pub mod own_motion;
pub mod parameters;
pub mod passivity;
pub mod planar;
pub mod position_guard;
mod render;
mod renderer;
pub mod rig_friction;
pub mod sample;
pub mod sample_clock;
pub mod scene;
mod scheme;
mod series;
pub mod servo;
pub mod snapshot;
mod vector;
pub mod velocity;

pub use bound_error::BoundError;
pub use directional::{Direction, Directional};
pub use excitation::{Course, Excitation};
pub use own_motion::{MotionEnd, OwnMotion, PulseShape};
pub use parameters::{Parameter, ParameterKey};
pub use renderer::{FARTHEST_RESEAT_M, Renderer, Rendering};
pub use scene::{Scene, SceneError};
pub use scheme::{Scheme, UnknownScheme};
pub use vector::Vector;
