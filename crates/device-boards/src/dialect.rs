//! The words of one maker's protocol: all that a conversation does not share with those of other
//! makers.

use crate::axis::Axis;
use crate::text::Text;
use device_io::DeviceError;

/// One maker's protocol. It knows nothing of serial lines, and waits for nothing.
pub(crate) trait Dialect: Send {
    /// Interprets a line of the controller, without its end.
    fn receive(&mut self, line: &[u8], axis: &mut Axis, now_ns: u64);

    /// An error of the position sensor, whatever the motor does.
    fn sensor_error(&self) -> Option<DeviceError> {
        None
    }

    /// Whether the controller has contradicted for too long that its motor is on.
    fn is_contradicted(&self, _now_ns: u64) -> bool {
        false
    }

    /// Writes the question for the position; whether there was room for it.
    fn ask_position(&self, out: &mut Text) -> bool;

    /// Writes a target, in the controller's unit.
    fn drive(&self, target: f64, out: &mut Text);

    /// Asks from time to time whether the motor is still on.
    fn watch_on(&mut self, axis: &mut Axis, now_ns: u64, out: &mut Text);

    /// Writes the commands that switch the motor off.
    fn switch_off(&self, out: &mut Text);

    /// The motor has been commanded off, for the first time since it was on.
    fn begin_off(&mut self, _axis: &mut Axis) {}

    /// Asks whether the motor is off. Not needed where the answer to [`Self::switch_off`] says so.
    fn confirm_off(&mut self, _axis: &mut Axis, _now_ns: u64, _out: &mut Text) {}

    /// Asks from time to time whether the motor is still off.
    fn watch_off(&mut self, axis: &mut Axis, now_ns: u64, out: &mut Text);

    /// Force is wanted, for the first time since the motor was off.
    fn begin_arming(&mut self);

    /// One step towards a motor that is on.
    fn arm(&mut self, axis: &mut Axis, now_ns: u64, out: &mut Text);
}
