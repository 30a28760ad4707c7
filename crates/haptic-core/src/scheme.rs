//! How a block is moved on from one sample to the next.

use crate::nearest::meant_or_semicolon;
use alloc::string::{String, ToString};
use core::fmt;
use core::num::NonZeroU32;
use core::str::FromStr;
use thiserror::Error;

/// How the block is moved on from one sample to the next.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "serde", serde(into = "String", try_from = "String"))]
pub enum Scheme {
    /// Solved in closed form between the samples: see [`block::exact`](crate::block::exact).
    #[default]
    Exact,
    /// The paper's Euler step: see [`block::literal`](crate::block::literal).
    Literal {
        /// Steps a tick; the paper has one.
        substeps: NonZeroU32,
    },
    /// One backward-Euler step a tick, as time-stepping engines have it (Moreau 1988): for
    /// comparison.
    Implicit,
}

impl Scheme {
    /// The paper's own: one Euler step a tick.
    pub const LITERAL: Self = Self::Literal {
        substeps: NonZeroU32::MIN,
    };
}

impl fmt::Display for Scheme {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Exact => f.write_str("exact"),
            Self::Literal {
                substeps: NonZeroU32::MIN,
            } => f.write_str("literal"),
            Self::Literal { substeps } => write!(f, "literal:{substeps}"),
            Self::Implicit => f.write_str("implicit"),
        }
    }
}

/// A text that names no scheme.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error(
    "unknown scheme `{0}`{meant} the schemes are exact, implicit, literal, and literal:N with N steps a tick, from 1 \
     to {MAX_SUBSTEPS}",
    meant = meant_or_semicolon(.0, &["exact", "implicit", "literal"])
)]
pub struct UnknownScheme(String);

/// Most Euler steps a tick: more takes longer than any tick lasts.
const MAX_SUBSTEPS: u32 = 10_000;

impl FromStr for Scheme {
    type Err = UnknownScheme;

    fn from_str(text: &str) -> Result<Self, UnknownScheme> {
        let unknown = || UnknownScheme(text.to_string());
        match text {
            "exact" => Ok(Self::Exact),
            "implicit" => Ok(Self::Implicit),
            "literal" => Ok(Self::LITERAL),
            _ => {
                let substeps: NonZeroU32 = text
                    .strip_prefix("literal:")
                    .and_then(|count| count.parse().ok())
                    .filter(|count: &NonZeroU32| count.get() <= MAX_SUBSTEPS)
                    .ok_or_else(unknown)?;
                Ok(Self::Literal { substeps })
            }
        }
    }
}

#[cfg(feature = "serde")]
impl From<Scheme> for String {
    fn from(scheme: Scheme) -> Self {
        scheme.to_string()
    }
}

#[cfg(feature = "serde")]
impl TryFrom<String> for Scheme {
    type Error = UnknownScheme;

    fn try_from(text: String) -> Result<Self, UnknownScheme> {
        text.parse()
    }
}
