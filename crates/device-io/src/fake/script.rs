//! What a fake is told to do: faults from its command line and a script, and lines on its standard input.

use super::fault::{Fault, TimedFault};
use std::collections::VecDeque;
use std::io::BufRead;
use std::path::Path;
use std::sync::mpsc;
use std::time::Duration;

/// What a fake is to do now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Order {
    /// Let this go wrong.
    Fail(Fault),
    /// Print what the motor does.
    TellForce,
    /// End.
    Quit,
}

/// Orders as they fall due.
#[derive(Debug)]
pub struct Script {
    faults: VecDeque<TimedFault>,
    asked: mpsc::Receiver<String>,
    began_ns: u64,
}

impl Script {
    /// Faults of a command line and of a file, one a line and what follows a `#` a comment, from a time on, ns; and from now on those of standard input.
    ///
    /// # Errors
    /// The file cannot be read, or a line of it is no fault.
    pub fn new(faults: &[TimedFault], file: Option<&Path>, began_ns: u64) -> Result<Self, String> {
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

    /// The next order that is due at a time, ns. A line of standard input that asks for a fault is answered with `done` and the line, or with what is wrong with it.
    pub fn next(&mut self, now_ns: u64) -> Option<Order> {
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
