//! Reads a scene's friction field by field, so that a value of the wrong kind is reported where it
//! stands: a law is named by its tag, for which a table is read whole first, without its places.

use crate::directional::{Directional, NumberOrPair};
use crate::friction::{Friction, LAWS};
use alloc::string::{String, ToString};
use alloc::vec::Vec;
use core::fmt;
use serde::de::value::{MapDeserializer, StrDeserializer};
use serde::de::{self, Deserialize, DeserializeSeed, Deserializer, IntoDeserializer, MapAccess, Visitor};

/// The fields whose values are words.
const WORDS: [&str; 2] = ["law", "reseat"];

/// Reads the friction of a scene.
pub(super) fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Friction, D::Error> {
    let fields = deserializer.deserialize_map(Fields)?;
    Friction::deserialize(MapDeserializer::new(fields.into_iter()))
}

struct Fields;

impl<'de> Visitor<'de> for Fields {
    type Value = Vec<(String, Field)>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a table with a law and its parameters")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
        let mut fields = Vec::new();
        let mut law = None;
        while let Some(key) = map.next_key_seed(Key { law: law.as_deref() })? {
            let field = if key == "law" {
                Field::Word(law.insert(map.next_value_seed(Law)?).clone())
            } else if WORDS.contains(&key.as_str()) {
                Field::Word(map.next_value()?)
            } else {
                Field::Value(map.next_value()?)
            };
            fields.push((key, field));
        }
        Ok(fields)
    }
}

/// A field's name, refused where it stands: by the law, where that comes first.
struct Key<'a> {
    law: Option<&'a str>,
}

impl<'de> DeserializeSeed<'de> for Key<'_> {
    type Value = String;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<String, D::Error> {
        let key = String::deserialize(deserializer)?;
        let Some(law) = self.law else { return Ok(key) };
        // Other errors are reported of the whole.
        let alone = [
            ("law", Field::Word(law.into())),
            (&key, Field::Value(NumberOrPair::Number(0.0))),
        ];
        let found = Friction::deserialize(MapDeserializer::<_, de::value::Error>::new(alone.into_iter()));
        match found.map_err(|error| error.to_string()) {
            Err(error) if error.starts_with("unknown field") => Err(de::Error::custom(error)),
            _ => Ok(key),
        }
    }
}

/// A law's name, refused where it stands.
struct Law;

impl<'de> DeserializeSeed<'de> for Law {
    type Value = String;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<String, D::Error> {
        let law = String::deserialize(deserializer)?;
        if LAWS.contains(&law.as_str()) {
            return Ok(law);
        }
        Err(de::Error::unknown_variant(&law, &LAWS))
    }
}

/// A value as it was written.
enum Field {
    Word(String),
    Value(NumberOrPair),
}

impl<'de, E: de::Error> IntoDeserializer<'de, E> for Field {
    type Deserializer = FieldDeserializer<E>;

    fn into_deserializer(self) -> Self::Deserializer {
        FieldDeserializer(self, core::marker::PhantomData)
    }
}

struct FieldDeserializer<E>(Field, core::marker::PhantomData<E>);

impl<'de, E: de::Error> Deserializer<'de> for FieldDeserializer<E> {
    type Error = E;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, E> {
        match self.0 {
            Field::Word(word) => StrDeserializer::new(&word).deserialize_any(visitor),
            Field::Value(NumberOrPair::Number(number)) => visitor.visit_f64(number),
            Field::Value(NumberOrPair::Pair(Directional { positive, negative })) => {
                let pair = [("positive", positive), ("negative", negative)];
                visitor.visit_map(MapDeserializer::new(pair.into_iter()))
            }
        }
    }

    serde::forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf option unit unit_struct
        newtype_struct seq tuple tuple_struct map struct enum identifier ignored_any
    }
}

#[cfg(test)]
mod tests {
    use crate::Scene;
    use alloc::format;
    use alloc::string::ToString;

    #[test]
    fn a_value_of_the_wrong_kind_is_reported_where_it_stands() {
        for (line, place, what) in [
            ("Fd = \"three\"", "line 5, column 6", ""),
            ("DV = \"0.1\"", "line 5, column 6", ""),
            ("Fd = { positive = \"3\", negative = 3 }", "line 5, column 19", ""),
            ("Fd = true", "line 5, column 6", ""),
            ("reseat = 3", "line 5, column 10", ""),
            ("viscos = 1", "line 5, column 1", "unknown field `viscos`"),
            ("sigma1 = 1", "line 5, column 1", "unknown field `sigma1`"),
            ("law = \"karnop\"", "line 5, column 7", "unknown variant `karnop`"),
        ] {
            let law = if line.starts_with("law") {
                ""
            } else {
                "law = \"karnopp\""
            };
            let text = format!("name = \"x\"\n[friction]\n{law}\nFs = 4\n{line}\n");
            let error = toml::from_str::<Scene>(&text).expect_err(line).to_string();
            let says = |part| error.contains(part);
            assert!(says(place) && says(line) && says(what), "{error}");
        }
        // Whole numbers, pairs and words are what they were.
        let text = "[friction]\nlaw = \"reset-integrator\"\nFs = 4\nFd = { positive = 3, negative = 2 }\nsigma = \
                    1e5\nreseat = \"slides\"\n";
        let scene: Scene = toml::from_str(text).expect("a scene");
        assert_eq!(
            toml::from_str::<Scene>(&toml::to_string(&scene).expect("writes")).expect("reads"),
            scene
        );
        let json = serde_json::to_string(&scene).expect("writes");
        assert_eq!(serde_json::from_str::<Scene>(&json).expect("reads"), scene);
    }
}
