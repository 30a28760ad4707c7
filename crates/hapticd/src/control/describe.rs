//! `describe`: the scene's rows of the parameter table and the columns of a sample.

use crate::control::RigHandle;
use haptic_core::friction::LAWS;
use haptic_ipc::{Description, ParameterDescription, SAMPLE_COLUMNS};

pub(super) fn describe(rig: &RigHandle) -> Description {
    let scene = rig.scene();
    Description {
        law: scene.friction.law().to_owned(),
        laws: LAWS.iter().map(ToString::to_string).collect(),
        parameters: ParameterDescription::all_of(&scene),
        sample_columns: SAMPLE_COLUMNS.iter().map(ToString::to_string).collect(),
    }
}
