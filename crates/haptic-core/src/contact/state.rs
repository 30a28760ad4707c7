//! Whether a body sticks or slides.

use crate::direction::Direction;

/// How the block touches the surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Contact {
    /// At rest; friction holds it.
    Stuck,
    /// Sliding in a direction.
    Sliding(Direction),
}

impl Contact {
    /// `0` stuck, `+1` and `-1` sliding: the number used in files and on the wire.
    #[must_use]
    pub const fn as_number(self) -> i8 {
        match self {
            Self::Stuck => 0,
            Self::Sliding(Direction::Positive) => 1,
            Self::Sliding(Direction::Negative) => -1,
        }
    }
}
