//! The two directions of motion along the device axis.

/// Direction of motion along the device axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Direction {
    /// Along the positive axis.
    Positive,
    /// Along the negative axis.
    Negative,
}

impl Direction {
    /// Both, positive first.
    pub const BOTH: [Self; 2] = [Self::Positive, Self::Negative];

    /// `+1` or `-1`.
    #[must_use]
    pub const fn sign(self) -> f64 {
        match self {
            Self::Positive => 1.0,
            Self::Negative => -1.0,
        }
    }

    /// The direction in which a force or velocity points; zero counts as positive.
    #[must_use]
    pub fn of(value: f64) -> Self {
        if value < 0.0 { Self::Negative } else { Self::Positive }
    }
}
