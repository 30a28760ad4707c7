//! What a person says while a recording runs: keys of a terminal, or lines of a program.
//!
//! A key that stops the rig elsewhere (`top`: space, escape) does nothing here and says so.

use rustix::event::{PollFd, PollFlags, poll};
use rustix::process::getpgrp;
use rustix::termios::{LocalModes, OptionalActions, Termios, tcgetattr, tcgetpgrp, tcsetattr};
use std::io::{self, BufRead, IsTerminal};
use std::time::Duration;
use tokio::sync::mpsc::{self, UnboundedReceiver, UnboundedSender};

/// The line below the progress.
pub(super) const KEYS: &str = "m or 1 to 9: marker, q: end";

/// The same after any other key.
pub(super) const OTHER_KEY: &str = "no key here stops the rig: `haptic-ctl stop` does; m or 1 to 9: marker, q: end";

/// Longest text of a marker, characters.
const MAX_TEXT: usize = 200;

/// Time between two looks whether the program is in the foreground again.
const BACKGROUND_PERIOD: Duration = Duration::from_millis(200);

/// What a person wants.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Input {
    /// A marker, with its text where the person gave one.
    Marker(Option<String>),
    /// The end of the recording.
    End,
    /// The end of the lines.
    LastLine,
    /// A key that means nothing here.
    OtherKey,
}

/// The person who makes the recording.
pub(super) struct Person {
    inputs: UnboundedReceiver<Input>,
    /// Where keys are read; put back on drop.
    terminal: Option<KeyMode>,
}

impl Person {
    /// Listens to lines, if that is asked for, or else to the keys of a terminal. Nobody is listened
    /// to where standard input is something else: it may be meant for another program.
    pub(super) fn new(from_lines: bool) -> Self {
        let (sender, inputs) = mpsc::unbounded_channel();
        let terminal = if from_lines { None } else { KeyMode::enter() };
        // The thread may wait for ever; the program ends without it.
        if from_lines {
            std::thread::spawn(move || read_lines(&sender));
        } else if terminal.is_some() {
            std::thread::spawn(move || read_keys(&sender));
        }
        Self { inputs, terminal }
    }

    /// The keys, where there are some.
    pub(super) fn keys(&self) -> Option<&'static str> {
        self.terminal.as_ref().map(|_| KEYS)
    }

    /// The next input; `None` after the last one. Safe to cancel.
    pub(super) async fn next(&mut self) -> Option<Input> {
        self.inputs.recv().await
    }
}

/// A terminal that gives each key at once and does not show it. Signals still come from their keys.
struct KeyMode {
    before: Termios,
}

impl KeyMode {
    fn enter() -> Option<Self> {
        let stdin = io::stdin();
        if !stdin.is_terminal() || !is_in_foreground() {
            return None;
        }
        let before = tcgetattr(&stdin).ok()?;
        let mut keys = before.clone();
        keys.local_modes.remove(LocalModes::ICANON | LocalModes::ECHO);
        tcsetattr(&stdin, OptionalActions::Now, &keys).ok()?;
        Some(Self { before })
    }
}

impl Drop for KeyMode {
    fn drop(&mut self) {
        if is_in_foreground() {
            // A terminal that is gone needs no modes.
            tcsetattr(io::stdin(), OptionalActions::Now, &self.before).unwrap_or_default();
        }
    }
}

/// Whether the terminal is this program's to read and set: the kernel stops a program that touches it
/// from the background. Without job control it always is.
fn is_in_foreground() -> bool {
    tcgetpgrp(io::stdin()).map_or(true, |group| group == getpgrp())
}

fn read_keys(sender: &UnboundedSender<Input>) {
    let stdin = io::stdin();
    let mut bytes = [0; 32];
    loop {
        if !is_in_foreground() {
            std::thread::sleep(BACKGROUND_PERIOD);
            continue;
        }
        let waited = poll(&mut [PollFd::new(&stdin, PollFlags::IN)], None);
        if waited.is_err() || !is_in_foreground() {
            continue;
        }
        let read = match rustix::io::read(&stdin, &mut bytes) {
            Ok(0) => return,
            Ok(read) => read,
            Err(rustix::io::Errno::INTR) => continue,
            Err(_) => return,
        };
        for input in inputs(&bytes[..read]) {
            if sender.send(input).is_err() {
                return;
            }
        }
    }
}

/// The inputs of some bytes that came together.
fn inputs(bytes: &[u8]) -> Vec<Input> {
    // A key such as an arrow comes as escape and further bytes.
    if bytes.first() == Some(&0x1b) {
        return vec![Input::OtherKey];
    }
    bytes
        .iter()
        .map(|byte| match byte {
            b'm' => Input::Marker(None),
            b'1'..=b'9' => Input::Marker(Some(char::from(*byte).to_string())),
            b'q' => Input::End,
            _ => Input::OtherKey,
        })
        .collect()
}

fn read_lines(sender: &UnboundedSender<Input>) {
    for line in io::stdin().lock().lines().map_while(Result::ok) {
        let text: String = line.trim().chars().take(MAX_TEXT).collect();
        if !text.is_empty() && sender.send(Input::Marker(Some(text))).is_err() {
            return;
        }
    }
    // A recording that has ended hears nothing.
    sender.send(Input::LastLine).unwrap_or_default();
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_that_stops_a_rig_elsewhere_is_no_marker_and_no_end() {
        for key in [" ", "\x1b", "\x1b[A", "s", "e", "r", "\r", "0", "M", "\x1b[15~"] {
            assert_eq!(inputs(key.as_bytes()), [Input::OtherKey], "{key:?}");
        }
        assert_eq!(
            inputs(b"m7q"),
            [Input::Marker(None), Input::Marker(Some("7".to_owned())), Input::End]
        );
    }
}
