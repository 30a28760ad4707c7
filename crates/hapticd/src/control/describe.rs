//! `describe`: the parameter table and the columns of a sample.

use crate::control::RigHandle;
use haptic_core::parameters::TABLE;
use haptic_ipc::{Description, ParameterDescription, SAMPLE_COLUMNS};

pub(super) fn describe(rig: &RigHandle) -> Description {
    let scene = rig.scene();
    Description {
        parameters: TABLE
            .iter()
            .map(|row| ParameterDescription::new(row, scene.value(row.parameter)))
            .collect(),
        sample_columns: SAMPLE_COLUMNS.iter().map(ToString::to_string).collect(),
    }
}
