//! What the tests of a session begin with.

use crate::fake::{Firmware, FirmwareProperties, Hand, Motion, RigProperties};
use crate::protocol::message::{DeviceHello, FromDevice, FromHost};

/// A fake firmware whose hand moves 30 mm to and fro once a second.
pub(super) fn firmware() -> Firmware {
    let motion = Motion::Sine {
        amplitude_m: 0.03,
        frequency_hz: 1.0,
    };
    Firmware::new(
        RigProperties::default(),
        Hand::Prescribed(motion),
        FirmwareProperties::default(),
    )
}

/// The same, and its answer to a hello at a time of ours, ns.
pub(super) fn greeted_firmware(now_ns: u64) -> (Firmware, DeviceHello) {
    let mut firmware = firmware();
    let Some(FromDevice::Hello(hello)) = firmware.receive(FromHost::Hello { nonce: 7 }, now_ns) else {
        panic!("it answers");
    };
    (firmware, hello)
}
