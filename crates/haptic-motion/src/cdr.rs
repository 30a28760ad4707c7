//! Messages of fixed structs in CDR, as a schema in the language of ROS 2 says.

/// The bytes before a message, which say how it is encoded.
pub const HEADER: usize = 4;

/// A field of a message.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Field {
    /// Its name.
    pub name: String,
    /// Its type, as in `float64`.
    pub kind: String,
    /// Its place in the message after the header, bytes.
    pub offset: usize,
    /// Its size, bytes.
    pub size: usize,
}

/// The fields of a schema: a type and a name in each line. CDR places each at a multiple of its size. They end at the
/// first whose type has no fixed size, since the place of what follows depends on what the message holds: its type and
/// name are returned too.
#[must_use]
pub fn fields(schema: &str) -> (Vec<Field>, Option<(String, String)>) {
    let mut fields: Vec<Field> = Vec::new();
    // Behind a line of `=` are other types, which this one uses.
    for line in schema.lines().take_while(|line| !line.starts_with("===")) {
        let text = line.split('#').next().unwrap_or_default().trim();
        let mut words = text.split_whitespace();
        let (Some(kind), Some(name)) = (words.next(), words.next()) else {
            continue;
        };
        // A constant has no place in a message.
        if text.contains('=') {
            continue;
        }
        let size = match kind {
            "bool" | "byte" | "char" | "int8" | "uint8" => 1,
            "int16" | "uint16" => 2,
            "int32" | "uint32" | "float32" => 4,
            "int64" | "uint64" | "float64" => 8,
            _ => return (fields, Some((kind.to_owned(), name.to_owned()))),
        };
        let end = fields.last().map_or(0, |field| field.offset + field.size);
        fields.push(Field {
            name: name.to_owned(),
            kind: kind.to_owned(),
            offset: end.next_multiple_of(size),
            size,
        });
    }
    (fields, None)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_schema_gives_each_field_its_place() {
        let schema = "# a motion\nuint8 state # of the rig\nuint8 IDLE=0\n\nfloat64 t_s\nfloat32 position_m 0.0\n\
                      uint16 flags\nstring name\nfloat64 late\n===\nMSG: other/Type\nfloat64 x\n";
        let (found, end) = fields(schema);
        let found: Vec<(&str, usize)> = found.iter().map(|field| (field.name.as_str(), field.offset)).collect();
        assert_eq!(found, [("state", 0), ("t_s", 8), ("position_m", 16), ("flags", 20)]);
        assert_eq!(end, Some(("string".to_owned(), "name".to_owned())));
    }
}
