//! The contact with the surface: whether it sticks, and the parts of which the laws build contacts.

mod bristle;
mod bristle_series;
mod device;
mod leg;
mod level;
mod power_series;
mod spring;
mod state;
mod yielding;

pub use level::SUDDEN_FALL_MPS;
pub use spring::Reseat;
pub use state::{Contact, ContactMemory};

pub(crate) use state::LawContact;

pub(crate) use bristle::{Bristle, FullPlasticity, Plasticity, flow_in_pieces};
pub(crate) use bristle_series::{
    BristleForce, LOOK_BACK_ON_CURVE, MIN_ON_CURVE, RatioSeries, SETTLED_N, TowardsLimit, UnderCurve,
};
#[cfg(test)]
pub(crate) use device::cells_and_error;
pub(crate) use device::{
    DeviceContact, DeviceElastoPlastic, DeviceLugre, EnergyMeter, FlowLevel, MasterLaw, ORDER, PathBristle, PathSeries,
    series_product,
};
pub(crate) use leg::Leg;
pub(crate) use level::{Fall, FallSeries, Level, Stribeck, fallen_from};
pub(crate) use power_series::PowerSeries;
pub(crate) use spring::{SpringContact, SpringState};
pub(crate) use state::{ConstantLimit, RisingLimit, StaticLimit};
pub(crate) use yielding::{FrictionLine, StraightContact, YieldingContact, by_elastic_share};
