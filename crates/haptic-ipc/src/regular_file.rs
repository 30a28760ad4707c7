//! Files from outside: scenes and configurations, which any user may have written.
//!
//! A FIFO without a writer is waited for for ever, /dev/zero has no end, and to open a device is to
//! do something to it. So only regular files are read, and of those that are held in memory no more
//! than [`MAX_BYTES`]. What this does not help against is a mount that does not answer: a
//! daemon reads on a thread that nobody waits for.

use rustix::fs::OFlags;
use std::fs::{File, FileType, OpenOptions};
use std::io::{self, ErrorKind, Read};
use std::os::unix::fs::{FileTypeExt, OpenOptionsExt};
use std::path::Path;

/// Largest file that is read into memory, bytes. A scene takes about one thousand.
pub const MAX_BYTES: u64 = 1024 * 1024;

/// Longest line of a file that an error shows, bytes.
const MAX_LINE_BYTES: usize = 200;

/// Opens a regular file for reading, without waiting.
///
/// # Errors
/// The system refuses, or it is another kind of file; the message does not name the path.
pub fn open(path: &Path) -> io::Result<File> {
    // Looked at before it is opened, since opening a device may act on it; and again after, since
    // it may have been exchanged between.
    accept(path.metadata()?.file_type())?;
    let flags = OFlags::NONBLOCK | OFlags::NOCTTY;
    let flags = i32::try_from(flags.bits()).map_err(io::Error::other)?;
    let file = OpenOptions::new().read(true).custom_flags(flags).open(path)?;
    accept(file.metadata()?.file_type())?;
    Ok(file)
}

/// Reads a regular file of at most [`MAX_BYTES`] as text.
///
/// # Errors
/// As [`open`], or it is larger, or not UTF-8; the message does not name the path.
pub fn read_text(path: &Path) -> io::Result<String> {
    read_text_of(path, MAX_BYTES)
}

/// Reads a regular file of at most a number of bytes as text.
///
/// # Errors
/// As [`read_text`].
pub fn read_text_of(path: &Path, largest_bytes: u64) -> io::Result<String> {
    let mut bytes = Vec::new();
    // What the system says of its size may be out of date, so it is counted as it is read.
    open(path)?.take(largest_bytes + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > largest_bytes {
        return Err(io::Error::new(
            ErrorKind::FileTooLarge,
            format!("it is larger than the limit of {largest_bytes} bytes"),
        ));
    }
    String::from_utf8(bytes)
        .map_err(|error| io::Error::new(ErrorKind::InvalidData, format!("it is not UTF-8: {error}")))
}

fn accept(found: FileType) -> io::Result<()> {
    let kind = if found.is_file() {
        return Ok(());
    } else if found.is_dir() {
        "a directory"
    } else if found.is_fifo() {
        "a FIFO"
    } else if found.is_socket() {
        "a socket"
    } else if found.is_char_device() || found.is_block_device() {
        "a device"
    } else {
        "something else"
    };
    Err(io::Error::new(
        ErrorKind::InvalidInput,
        format!("it is {kind}: only regular files are read"),
    ))
}

/// A parser's message, of whose lines, which may be the file's, none is longer than 200 bytes.
#[must_use]
pub fn with_short_lines(message: &str) -> String {
    let cut = |line: &str| {
        let (text, end) = line.split_at(line.trim_end_matches('\n').len());
        let kept = text.floor_char_boundary(MAX_LINE_BYTES);
        let mark = if kept < text.len() { "..." } else { "" };
        format!("{}{mark}{end}", &text[..kept])
    };
    message.split_inclusive('\n').map(cut).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rustix::fs::{CWD, FileType, Mode, mknodat};
    use std::os::unix::fs::symlink;
    use std::os::unix::net::UnixListener;
    use std::time::{Duration, Instant};

    #[test]
    fn a_message_shows_no_long_line() {
        let long = "ä".repeat(1000);
        let message = format!("at line 3\n{long}\n  ^\nunknown\n");
        let expected = format!("at line 3\n{}...\n  ^\nunknown\n", "ä".repeat(100));
        assert_eq!(with_short_lines(&message), expected);
        assert_eq!(with_short_lines("short"), "short");
    }

    // hazard: H14
    #[test]
    fn only_regular_files_of_limited_size_are_read() {
        let directory = std::env::temp_dir().join(format!("regular-file-{}", std::process::id()));
        std::fs::create_dir_all(&directory).expect("a directory");
        let at = |name: &str| directory.join(name);
        mknodat(CWD, at("fifo"), FileType::Fifo, Mode::from_raw_mode(0o600), 0).expect("a FIFO");
        let _socket = UnixListener::bind(at("socket")).expect("a socket");
        symlink(at("loop"), at("loop")).expect("a link");
        symlink(at("fifo"), at("to-fifo")).expect("a link");
        symlink("/dev/zero", at("to-zero")).expect("a link");
        std::fs::write(at("most"), "x".repeat(1024 * 1024)).expect("a file");
        std::fs::write(at("more"), "x".repeat(1024 * 1024 + 1)).expect("a file");
        std::fs::write(at("binary"), b"\xff").expect("a file");
        symlink(at("most"), at("to-most")).expect("a link");
        let began = Instant::now();
        for (name, part) in [
            ("fifo", "a FIFO"),
            ("to-fifo", "a FIFO"),
            ("socket", "a socket"),
            ("loop", "symbolic links"),
            ("to-zero", "a device"),
            ("more", "limit of 1048576 bytes"),
            ("binary", "UTF-8"),
            (".", "a directory"),
        ] {
            let error = read_text(&at(name)).expect_err(name).to_string();
            assert!(error.contains(part), "{name}: {error}");
        }
        assert_eq!(
            read_text(&at("missing")).expect_err("it is not there").kind(),
            ErrorKind::NotFound
        );
        for name in ["most", "to-most"] {
            assert_eq!(read_text(&at(name)).expect(name).len(), 1024 * 1024);
        }
        assert!(began.elapsed() < Duration::from_secs(10), "{:?}", began.elapsed());
        std::fs::remove_dir_all(&directory).expect("it is ours");
    }
}
