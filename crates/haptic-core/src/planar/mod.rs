//! Two axes: the vector Karnopp block on a plane, isotropic and exact to a tolerance.

mod block;
mod landing;
mod series;
mod stiff;
mod vector;

pub use block::{IsotropicKarnopp, PlanarBlock, PlanarRendered, PlanarState};
pub use vector::Plane;
