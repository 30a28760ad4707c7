//! A fake of another maker's motor controller behind a pseudo-terminal: the carriage of the fake rig,
//! with an ODrive that speaks its published protocol, and a line that can be made to fail.

use clap::{Parser, ValueEnum};
use device_boards::fake::{ODriveBoard, ODriveProperties};
use device_io::fake::{self, Fault, FaultyLine, Order, Place, ProgramOptions, RigProperties, TimedFault};
use device_io::now_ns;
use std::io;
use std::path::PathBuf;
use std::process::ExitCode;

/// A fake motor controller behind a pseudo-terminal, for `hapticd --device odrive:LINK?...`.
///
/// It speaks the protocol as its maker publishes it; it has not been compared with a real board.
/// Faults are lines such as `loss 0.05` or `at 2.5 hang-up 0.3`, from --fault, from a script, or on
/// standard input while it runs. There `force` prints the motor's force, and `quit` ends the program.
#[derive(Debug, Parser)]
#[command(name = "fake-board", version, max_term_width = 80)]
struct Options {
    /// Kind of board
    kind: BoardKind,

    /// Path of a symbolic link to a new pseudo-terminal; removed at the end
    #[arg(long, value_name = "LINK")]
    pty: PathBuf,

    /// Radius of the pulley, mm
    #[arg(long, value_name = "MM", default_value_t = 5.0)]
    radius_mm: f64,

    /// Firmware 0.6 instead of 0.5.6
    #[arg(long)]
    firmware_0_6: bool,

    /// Uncalibrated, so that it closes no loop
    #[arg(long)]
    uncalibrated: bool,

    /// A fault, now or `at` a time in seconds; may be given again
    #[arg(long, value_name = "FAULT", long_help = concat!(
        "A fault, now or `at` a time in seconds; may be given again: delay MS, jitter MS, loss SHARE, double SHARE, ",
        "corrupt SHARE, reorder SHARE, carry BYTES_PER_S, stall S, hang-up S, jump COUNTS; a share is of lines; and of the ",
        "board: ignore-off, stay-enabled, no-echo (no property is answered), honest"
    ))]
    fault: Vec<TimedFault>,

    #[command(flatten)]
    program: ProgramOptions,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum BoardKind {
    /// An ODrive with its ASCII protocol
    Odrive,
}

fn main() -> ExitCode {
    let options = Options::parse();
    let place = (Place::Pty(options.pty.clone()), b'\n');
    fake::run("fake-board", &options.program, &options.fault, place, |line| {
        Desk::new(board(&options)?, line).run()
    })
}

fn board(options: &Options) -> io::Result<ODriveBoard> {
    let BoardKind::Odrive = options.kind;
    let properties = ODriveProperties {
        firmware: if options.firmware_0_6 { [0, 6, 9] } else { [0, 5, 6] },
        radius_m: options.radius_mm * 1e-3,
        calibrated: !options.uncalibrated,
        ..ODriveProperties::default()
    };
    let hand = options.program.hand().map_err(io::Error::other)?;
    Ok(ODriveBoard::new(RigProperties::default(), hand, properties))
}

/// Step of the board's clock while nothing comes, ns.
const STEP_NS: u64 = 1_000_000;

/// Longest step of the board's clock, ns. If this process did not run for longer, the rest of that
/// time does not pass on the board: a real board never stands still because a machine is busy.
const MAX_STEP_NS: u64 = 5_000_000;

struct Desk {
    board: ODriveBoard,
    line: FaultyLine,
    /// The board's clock, and ours at the same time, ns.
    board_ns: u64,
    seen_ns: u64,
}

impl Desk {
    fn new(board: ODriveBoard, line: FaultyLine) -> Self {
        let began_ns = now_ns();
        Self {
            board,
            line,
            board_ns: began_ns,
            seen_ns: began_ns,
        }
    }

    /// Until standard input says `quit`, or for ever.
    fn run(&mut self) -> io::Result<()> {
        self.line.announce("fake-board")?;
        loop {
            let now = now_ns();
            self.board_ns += now.saturating_sub(self.seen_ns).min(MAX_STEP_NS);
            self.seen_ns = now;
            if self.take_orders(now) {
                return Ok(());
            }
            self.line.listen(now)?;
            while let Some(line) = self.line.receive(now) {
                for answer in self.board.receive(&line, self.board_ns) {
                    self.line.send(answer, now);
                }
            }
            self.board.live_until(self.board_ns);
            self.line.flush_and_wait(now + STEP_NS);
        }
    }

    /// Carries out all orders that are due; returns whether one of them ends the program.
    fn take_orders(&mut self, now: u64) -> bool {
        while let Some(order) = self.line.next_order(now) {
            match order {
                Order::Fail(fault) => self.fail(fault),
                Order::TellForce => println!(
                    "force {} largest {} on {} watchdog {}",
                    self.board.force_n(),
                    self.board.take_largest_force_n(),
                    u8::from(self.board.is_on()),
                    u8::from(self.board.watchdog_has_tripped())
                ),
                Order::Quit => return true,
            }
        }
        false
    }

    fn fail(&mut self, fault: Fault) {
        match fault {
            Fault::Jump(counts) => self.board.jump(counts),
            Fault::Firmware(misbehaviour) => self.board.misbehave(misbehaviour),
            // The line's own, or of a version or a clock, which a text protocol does not have.
            _ => {}
        }
    }
}
