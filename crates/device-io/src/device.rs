//! What every rig can do.

pub use haptic_core::sample::{DeviceError, Measurement, Motor};

/// What became of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Written {
    /// It has left this process whole, and nothing is written before it that has not. On a serial line it is with the system, which passes it on as fast as
    /// the line goes; on HID the transfer has ended; a rig in this process has carried it out. That the rig does as it was told it says in its samples.
    Taken,
    /// Not yet, or only in part: the link is busy with what came before. To be commanded again in the next tick, as every force is.
    Later,
}

/// A one-axis rig, as the real-time loop uses it.
///
/// No method but [`Self::description`] may allocate, lock or wait longer than the link needs. Dropping a device leaves it at zero force.
pub trait Device: Send {
    /// What the rig is, for people.
    fn description(&self) -> String;

    /// Distance between two positions that the rig can tell apart, m; 0 where it is perfect. It may be another after the rig was disconnected.
    fn resolution_m(&self) -> f64;

    /// Largest force that the rig gives, N; infinite where it names none. It may be another after the rig was disconnected.
    fn force_limit_n(&self) -> f64 {
        f64::INFINITY
    }

    /// Whether a link lies between: then the time that reading and writing take is of interest.
    fn is_linked(&self) -> bool {
        false
    }

    /// Which of its connections it is on, counted from 1, where a link lies between: another number is perhaps another device.
    fn connection(&self) -> u64 {
        0
    }

    /// Reads the newest sample. `now_ns` is the host's monotonic clock; a rig with a clock of its own needs it only to
    /// tell how old its sample is.
    ///
    /// # Errors
    /// The rig could not be read. The caller must not render an older position in its place.
    fn read(&mut self, now_ns: u64) -> Result<Measurement, DeviceError>;

    /// Commands the force on the hand, N, until the next command. Where the motor is not `enabled` it must not be driven, and a rig that can
    /// switches it off. Whether the device has taken that already is in what it returns; a command that is the same as the ones before it, tick by tick,
    /// counts as taken when the first of them was.
    ///
    /// # Errors
    /// The rig could not be written.
    fn write(&mut self, force_n: f64, enabled: bool) -> Result<Written, DeviceError>;
}
