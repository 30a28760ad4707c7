//! Numbers at random, the same in every run.

/// Marsaglia's xorshift.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    /// From 0 to 1.
    pub(crate) fn share(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        f64::from(u32::try_from(self.0 >> 32).expect("32 bits")) / f64::from(u32::MAX)
    }

    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.share()
    }

    /// With equal chances for each factor of ten.
    pub(crate) fn decades(&mut self, low: f64, high: f64) -> f64 {
        low * (high / low).powf(self.share())
    }

    pub(crate) fn one_in(&mut self, count: u32) -> bool {
        self.share() * f64::from(count) < 1.0
    }

    pub(crate) fn one_of<X: Copy>(&mut self, choices: &[X]) -> X {
        let count = u32::try_from(choices.len()).expect("a few");
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "below the count")]
        let index = (self.share() * f64::from(count)).floor() as usize;
        choices[index.min(choices.len() - 1)]
    }
}
