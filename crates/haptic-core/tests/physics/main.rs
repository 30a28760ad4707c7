//! The core's promises, seen from outside: the reference data, the schemes, every law, and the
//! same forces on every machine.

mod explore;
mod invariants;
mod laws;
mod metamorphic;
mod no_subnormals;
mod on_device;
mod planar;
mod planar_servo;
mod properties;
mod random;
mod random_laws;
mod reference;
mod same_everywhere;
mod schemes;
mod split_ticks;
