//! Two axes: the vector Karnopp block on a plane, isotropic and exact to a tolerance, and what a
//! [`Servo`](crate::servo::Servo) in the plane is made of.

mod block;
mod landing;
mod renderer;
mod series;
mod spring;
mod stiff;
mod vector;

pub use block::{IsotropicKarnopp, PlanarBlock, PlanarState};
pub use renderer::PlanarRenderer;
pub use vector::{Plane, Workspace};

#[cfg(test)]
mod tests;
