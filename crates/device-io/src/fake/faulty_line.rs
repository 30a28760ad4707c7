//! A line that fails on request, and the orders to the fake behind it: faults from its command line and a script, and
//! lines on its standard input.

use super::fault::{Channel, Fault, Quality, TimedFault};
use super::port::{Place, Port, PortClosed};
use crate::device::now_ns;
use nix::sys::signal::{SigSet, Signal};
use std::collections::VecDeque;
use std::io::{self, BufRead, Write};
use std::path::Path;
use std::sync::mpsc;
use std::time::Duration;

/// An order to a fake.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Order {
    /// Cause this fault.
    Fail(Fault),
    /// Print the force of the motor.
    TellForce,
    /// End.
    Quit,
}

/// Time between two looks for the place, ns.
const LOOK_NS: u64 = 20_000_000;

/// Both directions of a fake's line, with the faults of the line, and the orders to the whole fake.
#[derive(Debug)]
pub struct FaultyLine {
    /// The faults to come, by their times since the line began.
    faults: VecDeque<TimedFault>,
    asked: mpsc::Receiver<String>,
    began_ns: u64,
    quality: Quality,
    up: Channel,
    down: Channel,
    stalled_until_ns: u64,
    place: Place,
    port: Option<Port>,
    /// The byte that ends a frame of the host's.
    frame_end: u8,
    look_at_ns: u64,
    plug_in_at_ns: u64,
}

impl FaultyLine {
    /// A line at a place, whose host ends frames with this byte, with the faults of a command line and of a file, with
    /// one fault a line and comments behind `#`; their times count from now on. Standard input is read from now on. The
    /// same seed gives the same random faults.
    ///
    /// # Errors
    /// The place cannot be made, the file cannot be read, or a line of it is not a fault.
    pub(super) fn new(
        (place, frame_end): (Place, u8),
        faults: &[TimedFault],
        file: Option<&Path>,
        seed: u64,
    ) -> Result<Self, String> {
        let mut faults = faults.to_vec();
        if let Some(path) = file {
            let text = std::fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))?;
            for (index, line) in text.lines().enumerate() {
                let line = line.split('#').next().unwrap_or_default().trim();
                if !line.is_empty() {
                    let fault = line
                        .parse()
                        .map_err(|error| format!("{}: line {}: {error}", path.display(), index + 1))?;
                    faults.push(fault);
                }
            }
        }
        faults.sort_by(|a, b| a.at_s.unwrap_or(0.0).total_cmp(&b.at_s.unwrap_or(0.0)));
        Ok(Self {
            faults: faults.into(),
            asked: requests(),
            began_ns: now_ns(),
            quality: Quality::default(),
            up: Channel::new(seed),
            down: Channel::new(seed.wrapping_add(1)),
            stalled_until_ns: 0,
            port: opened(&place).map_err(|error| format!("{}: {error}", place.path().display()))?,
            place,
            frame_end,
            look_at_ns: 0,
            plug_in_at_ns: 0,
        })
    }

    /// Says on standard output that a fake is there, and where.
    ///
    /// # Errors
    /// Nobody reads it.
    pub fn announce(&self, name: &str) -> io::Result<()> {
        println!("{name}: {}", self.place.path().display());
        io::stdout().flush()
    }

    /// The next order that is due at a time, ns, whomever it concerns. The answer to a fault on standard input is
    /// `done` and its line, or the error in it.
    fn next_due(&mut self, now_ns: u64) -> Option<Order> {
        let elapsed_s = Duration::from_nanos(now_ns.saturating_sub(self.began_ns)).as_secs_f64();
        if let Some(due) = self.faults.pop_front_if(|fault| elapsed_s >= fault.at_s.unwrap_or(0.0)) {
            return Some(Order::Fail(due.fault));
        }
        while let Ok(line) = self.asked.try_recv() {
            match line.as_str() {
                "quit" => return Some(Order::Quit),
                "force" => return Some(Order::TellForce),
                _ => {}
            }
            match line.parse::<TimedFault>() {
                Ok(fault) => {
                    println!("done {line}");
                    if fault.at_s.is_none() {
                        return Some(Order::Fail(fault.fault));
                    }
                    let after = |other: &TimedFault| other.at_s > fault.at_s;
                    let at = self.faults.iter().position(after).unwrap_or(self.faults.len());
                    self.faults.insert(at, fault);
                }
                Err(why) => println!("error {why}"),
            }
        }
        None
    }

    /// The next order that is due at a time, ns, and concerns the device. The line takes its own faults itself.
    pub fn next_order(&mut self, now_ns: u64) -> Option<Order> {
        let after =
            |seconds: f64| now_ns + u64::try_from(Duration::from_secs_f64(seconds).as_nanos()).unwrap_or(u64::MAX / 2);
        loop {
            match self.next_due(now_ns)? {
                Order::Fail(fault) => match self.quality.take(fault) {
                    Ok(()) => {}
                    Err(Fault::Stall(seconds)) => self.stalled_until_ns = after(seconds),
                    Err(Fault::HangUp(seconds)) => {
                        self.plug_in_at_ns = after(seconds);
                        self.leave();
                    }
                    Err(fault) => return Some(Order::Fail(fault)),
                },
                order => return Some(order),
            }
        }
    }

    /// Whether the device stands still.
    #[must_use]
    pub fn is_stalled(&self, now_ns: u64) -> bool {
        now_ns < self.stalled_until_ns
    }

    /// Takes what the host has sent. Opens the place when it appears, and closes it when it disappears.
    ///
    /// # Errors
    /// There is no pseudo-terminal to be had.
    pub fn listen(&mut self, now_ns: u64) -> io::Result<()> {
        if now_ns >= self.look_at_ns {
            self.look_at_ns = now_ns + LOOK_NS;
            if self.port.as_ref().is_some_and(|port| !port.is_there()) {
                self.leave();
            }
            if self.port.is_none() && now_ns >= self.plug_in_at_ns {
                self.port = opened(&self.place)?;
            }
        }
        let Self {
            port: Some(port),
            frame_end,
            quality,
            down,
            ..
        } = self
        else {
            return Ok(());
        };
        if let Err(PortClosed) = port.read_frames(*frame_end, |frame| down.send(frame, quality, now_ns)) {
            self.leave();
        }
        Ok(())
    }

    /// The next frame that has reached the device; none while that stands still.
    pub fn receive(&mut self, now_ns: u64) -> Option<Vec<u8>> {
        if self.is_stalled(now_ns) {
            return None;
        }
        self.down.receive(now_ns)
    }

    /// Puts a frame of the device on the line.
    pub fn send(&mut self, frame: Vec<u8>, now_ns: u64) {
        // What the device takes slowly, it does not send slowly.
        let quality = Quality {
            ns_per_byte: 0.0,
            ..self.quality
        };
        if self.port.is_some() {
            self.up.send(frame, &quality, now_ns);
        }
    }

    /// Gives the host the frames that have reached it, and waits until another is due or bytes come, at the latest
    /// until a time, ns. Returns when it was to go on, ns.
    pub fn flush_and_wait(&mut self, by_ns: u64) -> u64 {
        let now = now_ns();
        let mut written = self.port.as_mut().map_or(Ok(()), Port::flush);
        while written.is_ok()
            && let Some(port) = &mut self.port
            && let Some(frame) = self.up.receive(now)
        {
            written = port.write(&frame);
        }
        if let Err(PortClosed) = written {
            self.leave();
        }
        let down = self.down.next_due_ns().filter(|_| !self.is_stalled(now));
        let due_ns = [self.up.next_due_ns(), down]
            .into_iter()
            .flatten()
            .fold(by_ns, u64::min);
        Port::wait(
            self.port.as_ref(),
            Duration::from_nanos(due_ns.saturating_sub(now_ns())),
        );
        due_ns
    }

    /// Leaves the place; all frames on the line are lost.
    fn leave(&mut self) {
        self.port = None;
        self.up.clear();
        self.down.clear();
    }
}

/// The port at a place; nothing where the place is not made here and does not exist yet.
fn opened(place: &Place) -> io::Result<Option<Port>> {
    match Port::open(place.clone()) {
        Ok(port) => Ok(Some(port)),
        Err(error) if matches!(place, Place::Pty(_)) => Err(error),
        Err(_) => Ok(None),
    }
}

/// Lines of standard input, as they come; a signal that ends the program is a `quit`.
fn requests() -> mpsc::Receiver<String> {
    let (asks, asked) = mpsc::channel();
    // Threads inherit what is blocked; where nothing can be, a signal ends the program as it is.
    let ends = SigSet::from_iter([Signal::SIGHUP, Signal::SIGINT, Signal::SIGTERM]);
    if ends.thread_block().is_ok() {
        let asks = asks.clone();
        std::thread::spawn(move || while ends.wait().is_ok() && asks.send("quit".to_owned()).is_ok() {});
    }
    std::thread::spawn(move || {
        for line in std::io::stdin().lock().lines().map_while(Result::ok) {
            if asks.send(line.trim().to_owned()).is_err() {
                return;
            }
        }
    });
    asked
}
