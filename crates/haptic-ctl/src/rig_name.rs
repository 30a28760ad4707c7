//! Names of rigs, on the command line.

use haptic_ipc::socket_path::is_rig_name;

/// Reads the name of a rig.
pub(crate) fn rig_name(given: &str) -> Result<String, String> {
    if is_rig_name(given) {
        return Ok(given.to_owned());
    }
    Err("the name of a rig has 1 to 64 letters, digits, `_`, `.` and `-`".to_owned())
}
