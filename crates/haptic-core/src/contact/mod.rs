//! The contact with the surface: whether it sticks, and the parts of which the laws build contacts.

mod bristle;
mod device;
mod level;
mod spring;
mod state;
mod static_limit;
mod yielding;

pub use level::SUDDEN_FALL_MPS;
pub use spring::Reseat;
pub use state::Contact;

pub(crate) use bristle::{Bristle, FullPlasticity, Plasticity, flow_in_pieces};
#[cfg(test)]
pub(crate) use device::cells_and_error;
pub(crate) use device::{
    DeviceContact, DeviceElastoPlastic, DeviceLugre, EnergyMeter, FlowLevel, Leg, MasterLaw, ORDER, PathBristle,
    Series, series_product,
};
pub(crate) use level::{Level, Stribeck, stribeck};
pub(crate) use spring::{SpringContact, SpringState};
pub(crate) use static_limit::{ConstantLimit, RisingLimit, StaticLimit};
pub(crate) use yielding::{AdvanceCost, Stroke, Tangent, YieldingContact, by_elastic_share};
