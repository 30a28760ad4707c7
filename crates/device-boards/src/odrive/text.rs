//! Lines of text without allocation: incoming lines in pieces, outgoing lines, and the numbers in
//! them.

use device_io::link::MAX_AT_ONCE;
use std::fmt;

/// Longest incoming line, bytes; a controller's answers are shorter than 64.
const MAX_LINE: usize = 128;

/// A line that is longer than any answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct TooLong;

/// Cuts incoming bytes into lines.
#[derive(Debug)]
pub(crate) struct Lines {
    bytes: [u8; MAX_LINE],
    length: usize,
    /// The rest of a line that was too long is left out, too.
    skipping: bool,
}

impl Default for Lines {
    fn default() -> Self {
        Self {
            bytes: [0; MAX_LINE],
            length: 0,
            skipping: false,
        }
    }
}

impl Lines {
    /// Takes in bytes, and gives away every line that has ended, without its end; empty ones are
    /// left out.
    pub(crate) fn take(&mut self, bytes: &[u8], mut each: impl FnMut(Result<&[u8], TooLong>)) {
        for &byte in bytes {
            if byte == b'\n' || byte == b'\r' {
                if self.skipping {
                    each(Err(TooLong));
                } else if self.length > 0 {
                    each(Ok(&self.bytes[..self.length]));
                }
                self.length = 0;
                self.skipping = false;
            } else if self.length == MAX_LINE {
                self.skipping = true;
            } else {
                self.bytes[self.length] = byte;
                self.length += 1;
            }
        }
    }
}

/// Lines to be sent at once.
#[derive(Debug)]
pub(crate) struct Text {
    bytes: [u8; MAX_AT_ONCE],
    length: usize,
}

impl Default for Text {
    fn default() -> Self {
        Self {
            bytes: [0; MAX_AT_ONCE],
            length: 0,
        }
    }
}

impl fmt::Write for Text {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        let end = self.length + text.len();
        self.bytes
            .get_mut(self.length..end)
            .ok_or(fmt::Error)?
            .copy_from_slice(text.as_bytes());
        self.length = end;
        Ok(())
    }
}

impl Text {
    /// What has been written.
    pub(crate) fn as_bytes(&self) -> &[u8] {
        &self.bytes[..self.length]
    }

    /// Writes something whole or not at all: half a command may be another command. Whether it was
    /// written.
    pub(crate) fn whole(&mut self, write: impl FnOnce(&mut Self) -> fmt::Result) -> bool {
        let before = self.length;
        let written = write(self).is_ok();
        if !written {
            self.length = before;
        }
        written
    }

    /// What has been written after the first `length` bytes.
    pub(crate) fn since(&self, length: usize) -> &[u8] {
        self.as_bytes().get(length..).unwrap_or_default()
    }
}

/// A plain decimal number, `-12.5`: no infinity, no exponent, nothing around it.
pub(crate) fn number(text: &[u8]) -> Option<f64> {
    let digits = text.strip_prefix(b"-").unwrap_or(text);
    let plain = digits.first().is_some_and(u8::is_ascii_digit)
        && digits.iter().all(|byte| byte.is_ascii_digit() || *byte == b'.');
    plain
        .then(|| std::str::from_utf8(text).ok()?.parse().ok())
        .flatten()
        .filter(|number: &f64| number.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::fmt::Write as _;

    fn lines(pieces: &[&[u8]]) -> Vec<Result<Vec<u8>, TooLong>> {
        let mut cut = Lines::default();
        let mut all = Vec::new();
        for piece in pieces {
            cut.take(piece, |line| all.push(line.map(<[u8]>::to_vec)));
        }
        all
    }

    #[test]
    fn lines_are_whole_however_they_come() {
        let long = vec![b'x'; 300];
        let came = lines(&[b"\r\n1.5 2", b".5*3", b"\r\n\n", &long, b"\nend\n", b"half"]);
        assert_eq!(came, [Ok(b"1.5 2.5*3".to_vec()), Err(TooLong), Ok(b"end".to_vec())]);
    }

    #[test]
    fn a_number_is_a_plain_decimal_one() {
        assert_eq!(number(b"-12.5"), Some(-12.5));
        assert_eq!(number(b"0.000001"), Some(1e-6));
        let endless = [b'9'; 400];
        for wrong in [
            &b""[..],
            b"-",
            b"nan",
            b"inf",
            b"-inf",
            b"1e5",
            b"1.2.3",
            b" 1",
            b"1 ",
            b"--1",
            b"+1",
            b".5",
            b"1,5",
            &endless,
        ] {
            assert_eq!(number(wrong), None, "{}", String::from_utf8_lossy(wrong));
        }
    }

    #[test]
    fn a_command_is_written_whole_or_not_at_all() {
        let mut text = Text::default();
        while text.whole(|text| writeln!(text, "c 0 {:.5}", 0.1)) {}
        assert!(text.as_bytes().len() > 200 && text.as_bytes().ends_with(b"\n"));
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn any_bytes_are_cut_into_short_lines(bytes in prop::collection::vec(any::<u8>(), 0..2000)) {
            for line in lines(&[&bytes]).into_iter().flatten() {
                prop_assert!(!line.is_empty() && line.len() <= MAX_LINE);
                prop_assert!(!line.contains(&b'\n') && !line.contains(&b'\r'));
            }
        }

        #[test]
        fn what_is_taken_for_a_number_is_finite(text in "[-+0-9.eEinfa]{0,40}") {
            if let Some(number) = number(text.as_bytes()) {
                prop_assert!(number.is_finite());
            }
        }
    }
}
