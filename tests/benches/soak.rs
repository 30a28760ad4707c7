//! The soak with faults: `tests/soak.sh --for 1h`, or by hand `cargo bench -p system-tests --bench soak -- --for 1h`.

use clap::Parser;
use rustix::process::{Signal, set_parent_process_death_signal};
use std::process::ExitCode;
use system_tests::soak::{self, Options};

/// Runs the real daemon at 1 kHz with clients, changes, schedules and recordings, brings one fault after another about
/// in a random order, and checks what must hold all the while.
///
/// The report is target/soak/report.md. The exit code is 0 if every claim of it holds, and 1
/// otherwise. A busy machine fails nothing: missed periods are reported, and a fault that it brings about itself is tried
/// again.
#[derive(Parser)]
#[command(name = "soak.sh", max_term_width = 80)]
struct Arguments {
    #[command(flatten)]
    options: Options,

    /// Test the unoptimised build, which is there sooner
    #[arg(long)]
    debug: bool,

    /// Cargo adds it.
    #[arg(long, hide = true)]
    bench: bool,
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    if arguments.bench {
        // Who ends cargo means the soak, and cargo passes nothing on.
        set_parent_process_death_signal(Some(Signal::TERM)).expect("Linux has it");
    }
    let report = soak::run(&arguments.options);
    println!("{}", report.markdown);
    for claim in &report.failed {
        eprintln!("FAILS: {claim}");
    }
    if report.failed.is_empty() {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}
