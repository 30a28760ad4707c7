//! A limit that may differ by the direction of motion.

/// One value for motion along the positive axis and one for motion along the negative axis.
///
/// In TOML and JSON it is a number when both are equal and `{ positive = 5.0, negative = 3.0 }`
/// when not.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Directional {
    /// While the block moves, or is pushed, along the positive axis.
    pub positive: f64,
    /// While the block moves, or is pushed, along the negative axis.
    pub negative: f64,
}

impl Directional {
    /// A value for each direction.
    #[must_use]
    pub const fn new(positive: f64, negative: f64) -> Self {
        Self { positive, negative }
    }

    /// The same value in both directions.
    #[must_use]
    pub const fn both(value: f64) -> Self {
        Self::new(value, value)
    }

    /// The value for one direction.
    #[must_use]
    pub const fn get(self, direction: Direction) -> f64 {
        match direction {
            Direction::Positive => self.positive,
            Direction::Negative => self.negative,
        }
    }

    /// The value for one direction, to change.
    pub(crate) fn get_mut(&mut self, direction: Direction) -> &mut f64 {
        match direction {
            Direction::Positive => &mut self.positive,
            Direction::Negative => &mut self.negative,
        }
    }

    /// Whether both directions are alike.
    #[must_use]
    #[expect(clippy::float_cmp, reason = "alike means the same number, not a near one")]
    pub fn is_symmetric(self) -> bool {
        self.positive == self.negative || (self.positive.is_nan() && self.negative.is_nan())
    }

    /// The larger of the two.
    #[must_use]
    pub fn greatest(self) -> f64 {
        self.positive.max(self.negative)
    }

    /// The smaller of the two.
    #[must_use]
    pub fn least(self) -> f64 {
        self.positive.min(self.negative)
    }

    /// The mean of the two.
    #[must_use]
    pub(crate) fn mean(self) -> f64 {
        0.5 * (self.positive + self.negative)
    }

    /// A value for each direction from the values of both.
    #[must_use]
    pub(crate) fn zip(self, other: Self, combine: impl Fn(f64, f64) -> f64) -> Self {
        Self::new(
            combine(self.positive, other.positive),
            combine(self.negative, other.negative),
        )
    }
}

impl From<f64> for Directional {
    fn from(value: f64) -> Self {
        Self::both(value)
    }
}

#[cfg(feature = "serde")]
pub(crate) use wire::NumberOrPair;

#[cfg(feature = "serde")]
mod wire {
    use super::Directional;
    use core::fmt;
    use serde::de::{self, MapAccess, Visitor};
    use serde::ser::SerializeStruct;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    impl Serialize for Directional {
        fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
            if self.is_symmetric() {
                return serializer.serialize_f64(self.positive);
            }
            let mut pair = serializer.serialize_struct("Directional", 2)?;
            pair.serialize_field("positive", &self.positive)?;
            pair.serialize_field("negative", &self.negative)?;
            pair.end()
        }
    }

    impl<'de> Deserialize<'de> for Directional {
        fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
            Ok(match NumberOrPair::deserialize(deserializer)? {
                NumberOrPair::Number(value) => Self::both(value),
                NumberOrPair::Pair(pair) => pair,
            })
        }
    }

    /// As it was written: a pair may be of equal numbers.
    pub(crate) enum NumberOrPair {
        Number(f64),
        Pair(Directional),
    }

    impl<'de> Deserialize<'de> for NumberOrPair {
        fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
            deserializer.deserialize_any(Written)
        }
    }

    struct Written;

    impl<'de> Visitor<'de> for Written {
        type Value = NumberOrPair;

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.write_str("a number, or a pair { positive, negative } of numbers")
        }

        fn visit_f64<E: de::Error>(self, value: f64) -> Result<NumberOrPair, E> {
            Ok(NumberOrPair::Number(value))
        }

        #[expect(clippy::cast_precision_loss, reason = "no limit in use is near 2^53")]
        fn visit_i64<E: de::Error>(self, value: i64) -> Result<NumberOrPair, E> {
            Ok(NumberOrPair::Number(value as f64))
        }

        #[expect(clippy::cast_precision_loss, reason = "no limit in use is near 2^53")]
        fn visit_u64<E: de::Error>(self, value: u64) -> Result<NumberOrPair, E> {
            Ok(NumberOrPair::Number(value as f64))
        }

        fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<NumberOrPair, A::Error> {
            #[derive(Deserialize)]
            #[serde(deny_unknown_fields)]
            struct Pair {
                positive: f64,
                negative: f64,
            }
            let pair = Pair::deserialize(de::value::MapAccessDeserializer::new(map))?;
            Ok(NumberOrPair::Pair(Directional::new(pair.positive, pair.negative)))
        }
    }
}

#[cfg(feature = "schema")]
impl schemars::JsonSchema for Directional {
    fn schema_name() -> alloc::borrow::Cow<'static, str> {
        "Directional".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({
            "description": "One value, or one for each direction of motion.",
            "oneOf": [
                { "type": "number" },
                {
                    "type": "object",
                    "properties": {
                        "positive": { "type": "number", "description": "Along the positive axis." },
                        "negative": { "type": "number", "description": "Along the negative axis." },
                    },
                    "required": ["positive", "negative"],
                    "additionalProperties": false,
                },
            ],
        })
    }
}

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
