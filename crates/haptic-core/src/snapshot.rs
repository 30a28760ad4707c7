//! The state of a servo as named numbers, from which another servo goes on.
//!
//! A [`Snapshot`] is a list of fields, never an image of memory: `limiter.last_N` is a number whatever
//! the compiler makes of the limiter. Each type that keeps a state says once, in its `archive`, what
//! its fields are; the same lines save them and load them. What follows from a scene or from settings
//! is not among them.
//!
//! To take one allocates nothing and waits for nothing: it is done between two steps of a loop.

use crate::vector::Vector;
use alloc::format;
use alloc::string::{String, ToString};
use core::fmt;
use thiserror::Error;

/// Version of the fields. It changes where a field has another meaning; a field more or less is seen
/// as it is loaded.
pub const VERSION: u32 = 1;

/// Most fields of a servo: two scenes, the longest estimate of velocity, and all else.
const MAX_FIELDS: usize = 192;

/// Value of a field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FieldValue {
    /// A number in the unit that the field's name ends in.
    Number(f64),
    /// A count, a time in ns, a choice or a yes (1) and no (0).
    Count(u64),
}

#[cfg(feature = "serde")]
mod wire {
    use super::FieldValue;
    use core::fmt;
    use serde::de::{Error, Visitor};
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    /// A count is a whole number, a number has a point or an exponent, and what is no number is a word.
    impl Serialize for FieldValue {
        fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
            match *self {
                Self::Count(count) => serializer.serialize_u64(count),
                Self::Number(number) if number.is_finite() => serializer.serialize_f64(number),
                Self::Number(number) if number.is_nan() => serializer.serialize_str("nan"),
                Self::Number(number) => serializer.serialize_str(if number > 0.0 { "inf" } else { "-inf" }),
            }
        }
    }

    impl<'de> Deserialize<'de> for FieldValue {
        fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
            struct Value;

            impl Visitor<'_> for Value {
                type Value = FieldValue;

                fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                    f.write_str("a number, inf, -inf or nan")
                }

                fn visit_u64<E: Error>(self, count: u64) -> Result<FieldValue, E> {
                    Ok(FieldValue::Count(count))
                }

                fn visit_f64<E: Error>(self, number: f64) -> Result<FieldValue, E> {
                    Ok(FieldValue::Number(number))
                }

                fn visit_str<E: Error>(self, text: &str) -> Result<FieldValue, E> {
                    Ok(FieldValue::Number(match text {
                        "inf" => f64::INFINITY,
                        "-inf" => f64::NEG_INFINITY,
                        "nan" => f64::NAN,
                        _ => return Err(E::invalid_value(serde::de::Unexpected::Str(text), &self)),
                    }))
                }
            }

            deserializer.deserialize_any(Value)
        }
    }
}

/// A field: the part of the servo, the name in it, and the place in a list.
#[derive(Clone, Copy, Debug)]
struct Field {
    part: &'static str,
    name: &'static str,
    index: Option<u8>,
    value: FieldValue,
}

/// State of a servo between two steps.
#[derive(Clone, Copy)]
pub struct Snapshot {
    /// Revision of the scene that is rendered.
    pub revision: u64,
    /// Revision of the scene whose force fades out.
    pub fading_revision: Option<u64>,
    fields: [Field; MAX_FIELDS],
    count: usize,
}

impl Snapshot {
    pub(crate) const EMPTY: Self = Self {
        revision: 0,
        fading_revision: None,
        fields: [Field {
            part: "",
            name: "",
            index: None,
            value: FieldValue::Count(0),
        }; MAX_FIELDS],
        count: 0,
    };

    /// The fields, with their names.
    pub fn fields(&self) -> impl Iterator<Item = (String, FieldValue)> {
        self.fields[..self.count]
            .iter()
            .map(|field| (key(field.part, field.name, field.index), field.value))
    }
}

impl fmt::Debug for Snapshot {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_map().entries(self.fields()).finish()
    }
}

fn key(part: &str, name: &str, index: Option<u8>) -> String {
    match index {
        None => format!("{part}.{name}"),
        Some(index) => format!("{part}.{name}.{index}"),
    }
}

/// Why no servo goes on from a snapshot.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum SnapshotError {
    /// It lacks a field.
    #[error("the snapshot lacks {0}")]
    Missing(String),
    /// A field has no value that it can have.
    #[error("the snapshot has no such value of {name} as {value}")]
    Invalid {
        /// The field.
        name: String,
        /// Its value.
        value: String,
    },
}

/// Where the fields are saved to or loaded from.
enum Mode<'a> {
    Save(&'a mut Snapshot),
    Load {
        find: &'a dyn Fn(&str) -> Option<FieldValue>,
        error: Option<SnapshotError>,
    },
}

/// Takes the fields of a state, or gives them.
pub struct Archive<'a> {
    mode: Mode<'a>,
    part: &'static str,
}

impl<'a> Archive<'a> {
    pub(crate) fn saving(to: &'a mut Snapshot) -> Self {
        Self {
            mode: Mode::Save(to),
            part: "servo",
        }
    }

    /// Loads from what finds a field by its name.
    pub(crate) fn loading(find: &'a dyn Fn(&str) -> Option<FieldValue>) -> Self {
        Self {
            mode: Mode::Load { find, error: None },
            part: "servo",
        }
    }

    /// What went wrong first as the fields were loaded.
    pub(crate) fn end(self) -> Result<(), SnapshotError> {
        match self.mode {
            Mode::Load { error: Some(error), .. } => Err(error),
            Mode::Load { .. } | Mode::Save(_) => Ok(()),
        }
    }

    pub(crate) fn is_loading(&self) -> bool {
        matches!(self.mode, Mode::Load { .. })
    }

    /// The fields of a part.
    pub(crate) fn part(&mut self, part: &'static str, fields: impl FnOnce(&mut Self)) {
        let outer = core::mem::replace(&mut self.part, part);
        fields(self);
        self.part = outer;
    }

    /// A number.
    pub(crate) fn number(&mut self, name: &'static str, number: &mut f64) {
        self.number_at(name, None, number);
    }

    /// A number, or one for each axis.
    pub(crate) fn vector<V: Vector>(&mut self, name: &'static str, vector: &mut V) {
        for (index, number) in (0..).zip(vector.parts()) {
            self.number_at(name, (V::AXES > 1).then_some(index), number);
        }
    }

    /// A list of numbers.
    pub(crate) fn numbers<'n>(&mut self, name: &'static str, numbers: impl IntoIterator<Item = &'n mut f64>) {
        for (index, number) in (0..).zip(numbers) {
            self.number_at(name, Some(index), number);
        }
    }

    fn number_at(&mut self, name: &'static str, index: Option<u8>, number: &mut f64) {
        match self.exchange(name, index, FieldValue::Number(*number)) {
            Some(FieldValue::Number(loaded)) => *number = loaded,
            Some(FieldValue::Count(_)) => self.refuse(name, index),
            None => {}
        }
    }

    /// A count up to `most`.
    pub(crate) fn count(&mut self, name: &'static str, count: &mut u64, most: u64) {
        match self.exchange(name, None, FieldValue::Count(*count)) {
            Some(FieldValue::Count(loaded)) if loaded <= most => *count = loaded,
            Some(_) => self.refuse(name, None),
            None => {}
        }
    }

    /// A difference of counts, as its two's complement.
    pub(crate) fn difference(&mut self, name: &'static str, difference: &mut i64) {
        let mut bits = difference.cast_unsigned();
        self.count(name, &mut bits, u64::MAX);
        *difference = bits.cast_signed();
    }

    /// A count of 32 bits.
    pub(crate) fn count_u32(&mut self, name: &'static str, count: &mut u32) {
        let mut wide = u64::from(*count);
        self.count(name, &mut wide, u32::MAX.into());
        *count = u32::try_from(wide).unwrap_or(*count);
    }

    /// A place in a list.
    pub(crate) fn place(&mut self, name: &'static str, place: &mut usize, most: usize) {
        let mut wide = *place as u64;
        self.count(name, &mut wide, most as u64);
        *place = usize::try_from(wide).unwrap_or(*place);
    }

    /// A yes or no.
    pub(crate) fn flag(&mut self, name: &'static str, flag: &mut bool) {
        self.choice(name, flag, &[false, true]);
    }

    /// One of a few.
    pub(crate) fn choice<T: Copy + PartialEq>(&mut self, name: &'static str, chosen: &mut T, all: &[T]) {
        let mut place = all.iter().position(|one| one == chosen).unwrap_or(0);
        self.place(name, &mut place, all.len() - 1);
        *chosen = all[place];
    }

    /// What there may be: its fields follow where it is there. `blank` is what they are loaded into.
    pub(crate) fn option<T>(
        &mut self,
        name: &'static str,
        value: &mut Option<T>,
        blank: T,
        fields: impl FnOnce(&mut Self, &mut T),
    ) {
        let mut is_there = value.is_some();
        self.flag(name, &mut is_there);
        if !is_there {
            *value = None;
        } else if let Some(value) = value {
            fields(self, value);
        } else {
            fields(self, value.insert(blank));
        }
    }

    /// Saves a value, or finds the one to load.
    fn exchange(&mut self, name: &'static str, index: Option<u8>, value: FieldValue) -> Option<FieldValue> {
        let part = self.part;
        match &mut self.mode {
            Mode::Save(snapshot) => {
                if let Some(field) = snapshot.fields.get_mut(snapshot.count) {
                    *field = Field {
                        part,
                        name,
                        index,
                        value,
                    };
                    snapshot.count += 1;
                }
                None
            }
            Mode::Load { find, error } => {
                let key = key(part, name, index);
                let found = find(&key);
                if found.is_none() {
                    error.get_or_insert(SnapshotError::Missing(key));
                }
                found
            }
        }
    }

    /// The value that was found is none for this field.
    fn refuse(&mut self, name: &'static str, index: Option<u8>) {
        if let Mode::Load { find, error } = &mut self.mode {
            let name = key(self.part, name, index);
            let value = match find(&name) {
                Some(FieldValue::Number(number)) => number.to_string(),
                Some(FieldValue::Count(count)) => count.to_string(),
                None => String::new(),
            };
            error.get_or_insert(SnapshotError::Invalid { name, value });
        }
    }
}
