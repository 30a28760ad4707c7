//! What the adviser knows of a rig and of the link to it.

/// Facts of a rig that the adviser needs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigFacts {
    /// Time between ticks, s.
    pub period_s: f64,
    /// Time between two samples of the device, s; 0 where it measures whenever it is read.
    pub sample_period_s: f64,
    /// From a sample to the motor that gives the force for it, s.
    pub delay_s: f64,
    /// Mass of the moving part, kg; `None` where it is not known, as for a rig that was not
    /// identified.
    pub mass: Option<f64>,
    /// Viscous damping of the rig itself, N s/m.
    pub damping: f64,
    /// Coulomb friction of the rig itself, N.
    pub friction: f64,
    /// One count of the encoder, m; 0 for a perfect one.
    pub resolution: f64,
}

impl RigFacts {
    /// Time between two forces that differ, s.
    #[must_use]
    pub fn effective_period_s(&self) -> f64 {
        self.period_s.max(self.sample_period_s)
    }
}

/// Measured times of the link to a rig, s.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LinkTimes {
    /// Time between two samples of the device.
    pub sample_period_s: f64,
    /// From the sending of a command to the arrival of the first sample that knows it.
    pub round_trip_s: f64,
    /// How old a sample gets before the next one is there.
    pub age_s: f64,
}

impl LinkTimes {
    /// From a sample to the motor that gives the force for it, s, for a loop with such a period.
    /// Before anything is measured it is a period of the slower side.
    #[must_use]
    pub fn delay_s(&self, period_s: f64) -> f64 {
        if self.round_trip_s <= 0.0 {
            return period_s.max(self.sample_period_s);
        }
        // Until the next sample comes a sample grows as old as a period of the device's, and is
        // read up to one of ours later: that is `T`, not delay.
        self.round_trip_s + (self.age_s - self.sample_period_s - period_s).max(0.0)
    }
}
