//! The fake rig as a device in this process.

use super::hand::Hand;
use super::mechanics::RigTime;
use super::plant::{Plant, RigProperties};
use super::pointer::Pointer;
use crate::device::{Device, DeviceBounds, DeviceError, Measurement, Written};

/// A rig in the same process. It has no clock: between two reads it lives through the time that the
/// caller gives, so a run with the same times is the same to the last bit.
#[derive(Debug)]
pub struct FakeRig {
    plant: Plant,
    force_n: f64,
    sequence: u32,
    time: RigTime,
    /// The hand, while it is off the handle.
    off: Option<Hand>,
}

impl FakeRig {
    /// A rig whose hand begins to move at the first read.
    #[must_use]
    pub fn new(properties: RigProperties, hand: Hand) -> Self {
        Self {
            plant: Plant::new(&properties, hand),
            force_n: 0.0,
            sequence: 0,
            time: RigTime::default(),
            off: None,
        }
    }

    /// Its properties.
    #[must_use]
    pub fn properties(&self) -> &RigProperties {
        self.plant.properties()
    }

    /// The pointer that its hand reaches for, where it has such a hand.
    #[must_use]
    pub fn pointer(&self) -> Option<&Pointer> {
        match self.plant.hand() {
            Hand::Pointer(arm) => Some(arm.pointer()),
            _ => None,
        }
    }

    /// Takes the hand off the handle, or lays it on again.
    pub fn let_go(&mut self, is_off: bool) {
        if is_off == self.off.is_some() {
            return;
        }
        let hand = self.off.take().unwrap_or(Hand::Free);
        let before = self.plant.take_in_hand(hand);
        self.off = is_off.then_some(before);
    }

    /// Lives until `now_ns`, ns. It begins at the first time.
    pub fn live_until(&mut self, now_ns: u64) {
        let (elapsed_s, now_s) = self.time.go_on(now_ns);
        self.plant.advance(elapsed_s, now_s, self.force_n);
    }

    /// Sets the force of the motor, N, until the next call.
    pub fn drive(&mut self, force_n: f64) {
        self.force_n = force_n;
    }

    /// The true state of the carriage, which the encoder only counts.
    #[must_use]
    pub fn plant(&self) -> &Plant {
        &self.plant
    }
}

impl Device for FakeRig {
    fn description(&self) -> String {
        format!(
            "fake rig: {} kg, {} N and {} N s/m of friction, encoder {} um, hand: {}",
            self.properties().mass_kg,
            self.properties().friction_n,
            self.properties().damping_ns_per_m,
            self.properties().resolution_m * 1e6,
            self.plant.hand()
        )
    }

    fn bounds(&self) -> DeviceBounds {
        DeviceBounds {
            resolution_m: self.properties().resolution_m,
            ..DeviceBounds::default()
        }
    }

    fn read(&mut self, now_ns: u64) -> Result<Measurement, DeviceError> {
        self.live_until(now_ns);
        self.sequence = self.sequence.wrapping_add(1);
        let resolution = self.properties().resolution_m;
        let position = self.plant.position_m();
        let counted = if resolution > 0.0 {
            (position / resolution).round() * resolution
        } else {
            position
        };
        Ok(Measurement::new(self.sequence, self.time.ns(), counted))
    }

    fn write(&mut self, force_n: f64, enabled: bool) -> Result<Written, DeviceError> {
        self.drive(if enabled { force_n } else { 0.0 });
        Ok(Written::Taken)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fake::HandMotion;
    use std::f64::consts::TAU;

    const MOTION: HandMotion = HandMotion::Sine {
        amplitude_m: 0.03,
        frequency_hz: 2.0,
    };

    fn arm() -> Hand {
        Hand::arm(MOTION)
    }

    #[test]
    fn the_encoder_counts_and_the_hand_moves() {
        let mut rig = FakeRig::new(RigProperties::default(), Hand::Prescribed(MOTION));
        for k in 0..1000_u64 {
            let sample = rig.read(5_000_000_000 + k * 1_000_000).expect("it is there");
            let exact = -0.03 * (TAU * 2.0 * k as f64 * 1e-3).cos();
            assert!((sample.position_m - exact).abs() <= 5.001e-6, "{sample:?} for {exact}");
            let counts = sample.position_m / 10e-6;
            assert!((counts - counts.round()).abs() < 1e-6, "{sample:?}");
            assert_eq!(sample.time_ns, k * 1_000_000);
        }
    }

    #[test]
    fn a_hand_that_is_off_moves_nothing_until_it_is_back() {
        let mut rig = FakeRig::new(RigProperties::default(), arm());
        let travel = |rig: &mut FakeRig, from_ms: u64| {
            let places = (from_ms..from_ms + 500).map(|ms| rig.read(ms * 1_000_000).expect("there").position_m);
            let (least, most) = places.fold((f64::MAX, f64::MIN), |(least, most), at| (least.min(at), most.max(at)));
            most - least
        };
        assert!(travel(&mut rig, 0) > 0.02);
        rig.let_go(true);
        rig.let_go(true);
        // It coasts to a stop.
        travel(&mut rig, 500);
        assert!(travel(&mut rig, 1000) < 1e-6);
        rig.let_go(false);
        assert!(travel(&mut rig, 1500) > 0.02);
    }

    #[test]
    fn two_runs_are_the_same_to_the_last_bit() {
        let run = || {
            let mut rig = FakeRig::new(RigProperties::default(), arm());
            for k in 0..2000_u64 {
                let sample = rig.read(k * 1_000_000 + (k * 7919) % 300_000).expect("it is there");
                rig.write(-300.0 * sample.position_m, true).expect("it is there");
            }
            rig.plant().position_m()
        };
        assert_eq!(run().to_bits(), run().to_bits());
    }
}
