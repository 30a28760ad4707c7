//! The fake rig of two axes as a device in this process: from its encoders' counts to the hand, and from a force on the
//! hand to the efforts of its motors.

use super::planar_rig::{PlanarProperties, PlanarRig};
use crate::device::{Device, DeviceBounds, DeviceError, Measurement, Written};
use crate::kinematics::Jacobian;
use haptic_core::planar::Plane;

/// A rig of two axes in the same process. It has no clock: it lives through the times of its reads.
#[derive(Debug)]
pub struct PlanarFake {
    rig: PlanarRig,
    sequence: u32,
    /// Where the hand was read last; `None` where the linkage is singular, and no motor is driven.
    jacobian: Option<Jacobian>,
}

impl PlanarFake {
    /// A rig whose hand begins to move at the first read.
    #[must_use]
    pub fn new(rig: PlanarRig) -> Self {
        Self {
            rig,
            sequence: 0,
            jacobian: None,
        }
    }

    /// Its properties.
    #[must_use]
    pub fn properties(&self) -> &PlanarProperties {
        self.rig.properties()
    }
}

impl Device<Plane> for PlanarFake {
    fn description(&self) -> String {
        let properties = self.properties();
        format!(
            "fake rig of two axes: {}, {} kg, {} N and {} N s/m of friction, hand: {}",
            self.rig.kinematics(),
            properties.mass_kg,
            properties.friction_n,
            properties.damping_ns_per_m,
            self.rig.path().map_or_else(|| "none".to_owned(), ToString::to_string)
        )
    }

    fn bounds(&self) -> DeviceBounds {
        DeviceBounds {
            resolution_m: self.rig.kinematics().coarsest_step([self.properties().count; 2]).value,
            ..DeviceBounds::default()
        }
    }

    fn read(&mut self, now_ns: u64) -> Result<Measurement<Plane>, DeviceError> {
        self.rig.live_until(now_ns);
        self.sequence = self.sequence.wrapping_add(1);
        let (home, count) = (
            self.rig.kinematics().home().unwrap_or_default(),
            self.properties().count,
        );
        let counts = self.rig.counts();
        let motors = [0, 1].map(|motor| home[motor] + f64::from(counts[motor]) * count);
        let position;
        (position, self.jacobian) = self.rig.kinematics().reading(motors).parts();
        Ok(Measurement::new(self.sequence, self.rig.time_ns(), position))
    }

    fn write(&mut self, force_n: Plane, enabled: bool) -> Result<Written, DeviceError> {
        let jacobian = self.jacobian.filter(|_| enabled);
        self.rig
            .drive(jacobian.map_or([0.0; 2], |jacobian| jacobian.efforts(force_n)));
        Ok(Written::Taken)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fake::{Figure, Path};

    /// Where the hand is after a second of a circle, with a force on it, N.
    fn pushed(force_n: Plane) -> Plane {
        let kinematics = "h-belt".parse().expect("a belt");
        let path = Path::Figure {
            figure: Figure::Circle,
            middle: Plane::ZERO,
            amplitude_m: 0.03,
            frequency_hz: 0.5,
        };
        let rig = PlanarRig::new(PlanarProperties::of(&kinematics), kinematics, Some(path)).expect("in reach");
        let mut device = PlanarFake::new(rig);
        let mut position = Plane::ZERO;
        for tick in 0..3000_u64 {
            position = device.read(tick * 1_000_000).expect("it is there").position_m;
            device.write(force_n, true).expect("it is there");
        }
        position
    }

    #[test]
    fn a_force_on_the_hand_pushes_it_that_way() {
        let free = pushed(Plane::ZERO);
        for force in [Plane::new(5.0, 0.0), Plane::new(0.0, 5.0), Plane::new(-3.0, 4.0)] {
            let gone = pushed(force) - free;
            // 5 N at 500 N/m; its friction takes a little.
            let along = gone.dot(force) / force.length();
            assert!((along - 0.01).abs() < 1e-3, "{gone:?} by {force:?}");
            assert!(gone.cross(force).abs() / force.length() < 1e-3, "{gone:?} by {force:?}");
        }
    }
}
