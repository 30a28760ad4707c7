//! A JSON object as it was written, and how a typed field is read from it.

use crate::error::WireError;
use crate::refusal;
use haptic_core::parameters::TABLE;
use serde::de::{DeserializeOwned, MapAccess, Visitor};
use serde::{Deserialize, Deserializer};
use serde_json::value::RawValue;
use std::collections::HashSet;
use std::fmt;

/// A type that a field can have.
pub(crate) trait Field: Sized {
    /// The expected value of a field of this name, for people.
    fn expected(name: &str, limits: Option<Limits>) -> String;

    /// Reads a value.
    ///
    /// # Errors
    /// The value is not of this type, or out of range.
    fn read(given: &FieldValue<'_>) -> Result<Self, WireError>;
}

/// The range of a number, in the unit that its field's name ends with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Limits {
    pub(crate) min: u32,
    pub(crate) max: u32,
    /// The meaning of 0, if it is allowed beside the range.
    pub(crate) zero: Option<&'static str>,
}

impl Limits {
    pub(crate) const fn new(min: u32, max: u32) -> Self {
        Self { min, max, zero: None }
    }

    /// The smallest number accepted.
    #[cfg(feature = "schema")]
    pub(crate) const fn smallest(self) -> u32 {
        if self.zero.is_some() { 0 } else { self.min }
    }
}

/// A value as it was written, and its place.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FieldValue<'a> {
    /// The object that holds it; empty for the line itself.
    pub(crate) object: &'a str,
    pub(crate) name: &'a str,
    /// JSON.
    pub(crate) text: &'a str,
    pub(crate) limits: Option<Limits>,
}

impl<'a> FieldValue<'a> {
    /// The same, called by its name instead of its path.
    pub(crate) const fn alone(self) -> Self {
        Self { object: "", ..self }
    }

    /// Its path, as in `scene.block.mass`.
    pub(crate) fn path(&self) -> String {
        if self.object.is_empty() {
            self.name.to_owned()
        } else {
            format!("{}.{}", self.object, self.name)
        }
    }

    /// The value as serde reads it.
    pub(crate) fn json<T: DeserializeOwned>(&self) -> Option<T> {
        serde_json::from_str(self.text).ok()
    }

    /// The value as serde reads it, with what it borrows from the line.
    pub(crate) fn borrowed<T: Deserialize<'a>>(&self) -> Option<T> {
        serde_json::from_str(self.text).ok()
    }

    /// The refusal of a value of the wrong type.
    pub(crate) fn is_not(&self, expected: &str) -> WireError {
        refusal::wrong_type(&self.path(), self.name, self.text, expected)
    }
}

/// The fields of an object in their order, each with its JSON. A field that is given twice is kept
/// twice.
#[derive(Debug)]
pub(crate) struct Object<'a> {
    /// Its path; empty for the line itself.
    path: String,
    fields: Vec<(String, &'a str)>,
}

impl<'a> Object<'a> {
    /// Reads a line.
    ///
    /// # Errors
    /// It is not JSON, or not an object.
    pub(crate) fn line(line: &'a str) -> Result<Self, serde_json::Error> {
        Self::at(String::new(), line)
    }

    /// Reads a field that holds an object.
    pub(crate) fn of(given: &FieldValue<'a>) -> Option<Self> {
        Self::at(given.path(), given.text).ok()
    }

    fn at(path: String, text: &'a str) -> Result<Self, serde_json::Error> {
        serde_json::from_str(text).map(|Pairs(fields)| Self { path, fields })
    }

    /// The JSON of a field, once for each time it is given.
    pub(crate) fn all(&self, name: &str) -> impl Iterator<Item = &'a str> {
        let named = self.fields.iter().filter(move |(field, _)| field == name);
        named.map(|(_, text)| *text)
    }

    /// All fields.
    pub(crate) fn values(&self) -> impl Iterator<Item = FieldValue<'_>> {
        self.fields.iter().map(|(name, text)| FieldValue {
            object: &self.path,
            name,
            text,
            limits: None,
        })
    }

    /// Refuses a field that is given twice, or a parameter under two names.
    pub(crate) fn no_field_twice(&self) -> Result<(), WireError> {
        // One pass: a line has room for thousands of fields, and other clients wait meanwhile.
        let mut seen = HashSet::new();
        let mut names = self.fields.iter().map(|(name, _)| name.as_str());
        let twice = names.find(|name| {
            let row = TABLE.iter().find(|row| row.is_called(name));
            !seen.insert(row.map_or(*name, |row| row.name))
        });
        twice.map_or(Ok(()), |name| Err(refusal::given_twice(name)))
    }

    /// Refuses an unknown field; `object` is the object's name for people.
    pub(crate) fn no_field_but(&self, object: &str, known: &[&str]) -> Result<(), WireError> {
        let mut names = self.fields.iter().map(|(name, _)| name.as_str());
        match names.find(|name| !known.contains(name)) {
            Some(name) => Err(refusal::unknown_field(object, name, known)),
            None => Ok(()),
        }
    }

    /// Removes and returns a field.
    pub(crate) fn take(&mut self, name: &str) -> Option<&'a str> {
        let index = self.fields.iter().position(|(field, _)| field == name)?;
        Some(self.fields.remove(index).1)
    }

    /// Reads a required field; `object` is the object's name for people.
    pub(crate) fn needed<T: Field>(&self, object: &str, name: &str, limits: Option<Limits>) -> Result<T, WireError> {
        match self.given(name, limits) {
            Some(given) => T::read(&given),
            None => Err(refusal::missing(
                &format!("`{object}`"),
                name,
                &T::expected(name, limits),
            )),
        }
    }

    /// Reads an optional field.
    pub(crate) fn optional<T: Field + Default>(&self, name: &str, limits: Option<Limits>) -> Result<T, WireError> {
        self.given(name, limits)
            .map_or_else(|| Ok(T::default()), |given| T::read(&given))
    }

    fn given<'b>(&'b self, name: &'b str, limits: Option<Limits>) -> Option<FieldValue<'b>> {
        Some(FieldValue {
            object: &self.path,
            name,
            text: self.all(name).next()?,
            limits,
        })
    }
}

struct Pairs<'a>(Vec<(String, &'a str)>);

impl<'de: 'a, 'a> Deserialize<'de> for Pairs<'a> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Map;
        impl<'de> Visitor<'de> for Map {
            type Value = Vec<(String, &'de str)>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("an object")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
                let mut fields = Vec::new();
                while let Some((name, text)) = map.next_entry::<String, &'de RawValue>()? {
                    fields.push((name, text.get()));
                }
                Ok(fields)
            }
        }
        deserializer.deserialize_map(Map).map(Self)
    }
}
