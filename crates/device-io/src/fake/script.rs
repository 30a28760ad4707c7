//! The orders to a fake: faults from its command line and a script, and lines on its standard
//! input.

use super::fault::{Fault, TimedFault};
use std::collections::VecDeque;
use std::io::BufRead;
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

/// Orders as they fall due.
#[derive(Debug)]
pub(super) struct Script {
    faults: VecDeque<TimedFault>,
    asked: mpsc::Receiver<String>,
    began_ns: u64,
}

impl Script {
    /// Reads the faults of a command line and of a file, with one fault a line and comments behind
    /// `#`; their times count from `began_ns`. Standard input is read from now on.
    ///
    /// # Errors
    /// The file cannot be read, or a line of it is not a fault.
    pub(super) fn new(faults: &[TimedFault], file: Option<&Path>, began_ns: u64) -> Result<Self, String> {
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
            began_ns,
        })
    }

    /// The next order that is due at a time, ns. The answer to a fault on standard input is `done`
    /// and its line, or the error in it.
    pub(super) fn next(&mut self, now_ns: u64) -> Option<Order> {
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
}

/// Lines of standard input, as they come.
fn requests() -> mpsc::Receiver<String> {
    let (asks, asked) = mpsc::channel();
    std::thread::spawn(move || {
        for line in std::io::stdin().lock().lines().map_while(Result::ok) {
            if asks.send(line.trim().to_owned()).is_err() {
                return;
            }
        }
    });
    asked
}
