//! Mass, dynamic and viscous friction, offset and static friction (Karnopp 1985).

use super::{Identified, ModelKind, Options, Record};

/// Identifies a record that was checked.
pub(super) fn identify(_record: &Record, _options: &Options) -> Identified {
    Identified::empty(ModelKind::Karnopp)
}
