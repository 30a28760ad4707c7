//! The text of a file of any program.

use encoding_rs::{Encoding, UTF_8, UTF_16BE, UTF_16LE, WINDOWS_1252};

/// The text of bytes: UTF-8, UTF-16, or else Windows' Latin-1; `None` where it is none.
#[must_use]
pub fn decoded(bytes: &[u8]) -> Option<String> {
    /// Bytes in which a file that is not text shows it.
    const BEGINNING: usize = 4096;
    let beginning = &bytes[..bytes.len().min(BEGINNING)];
    let has_zeros = |from: usize| beginning.iter().skip(from).step_by(2).any(|byte| *byte == 0);
    // Of a part of a file the last letter may be cut.
    let is_utf_8 = || std::str::from_utf8(bytes).map_or_else(|error| error.error_len().is_none(), |_| true);
    let encoding = match (Encoding::for_bom(bytes), has_zeros(0), has_zeros(1)) {
        (Some((encoding, _)), ..) => encoding,
        (None, false, false) if is_utf_8() => UTF_8,
        (None, false, false) => WINDOWS_1252,
        (None, false, true) => UTF_16LE,
        (None, true, false) => UTF_16BE,
        (None, true, true) => return None,
    };
    Some(encoding.decode(bytes).0.into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_of_any_program_is_decoded() {
        let text = "t_s,Kraft \u{b5}N\n";
        let utf_16 = |of: fn(u16) -> [u8; 2]| text.encode_utf16().flat_map(of).collect::<Vec<u8>>();
        let (little, big) = (utf_16(u16::to_le_bytes), utf_16(u16::to_be_bytes));
        let windows: Vec<u8> = text
            .chars()
            .map(|letter| u8::try_from(letter).expect("Latin-1"))
            .collect();
        for bytes in [
            text.as_bytes().to_vec(),
            [b"\xef\xbb\xbf", text.as_bytes()].concat(),
            [b"\xff\xfe", &little[..]].concat(),
            [b"\xfe\xff", &big[..]].concat(),
            little,
            big,
            windows,
        ] {
            assert_eq!(decoded(&bytes).as_deref(), Some(text), "{bytes:x?}");
        }
        assert_eq!(decoded(b"PK\0\0\x08"), None);
        // A part of a file may end within a letter.
        assert_eq!(decoded("\u{b5}".as_bytes().split_at(1).0).as_deref(), Some("\u{fffd}"));
    }
}
