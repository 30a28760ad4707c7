//! How exact a scheme is: reference solutions, and hard cases to hold schemes against.

pub mod reference;
