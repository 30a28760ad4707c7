//! What an hour at 1 kHz costs in each format: size, processor time to write and to read it, memory.
//!
//! `cargo bench -p haptic-recording --bench recording`; `-- 5` is for five minutes, and `-- 5 FOLDER` keeps
//! the files for other programs to be tried with.
#![expect(clippy::cast_sign_loss, reason = "what is cast is positive")]

use haptic_core::Scene;
use haptic_core::servo::RigState;
use haptic_ipc::Sample;
use haptic_recording::{Format, Metadata, Writer, export};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Rows of a call, as the daemon sends them every 20 ms.
const BATCH: u64 = 20;

fn main() {
    // Cargo adds `--bench`.
    let mut arguments = std::env::args().skip(1).filter(|argument| !argument.starts_with("--"));
    let minutes = arguments.next().and_then(|argument| argument.parse::<u64>().ok());
    let rows = minutes.unwrap_or(60) * 60_000;
    let temporary = tempfile::tempdir().expect("a directory");
    let directory = arguments.next().map_or(temporary.path().to_path_buf(), PathBuf::from);
    let of = |format: Format| directory.join("recording").with_extension(format.ending());
    println!("{rows} rows, {} minutes at 1 kHz\n", rows / 60_000);
    println!("| format | size, MB | write, s of processor | read, s | memory of the reader, MB |");
    println!("|---|---|---|---|---|");
    for format in Format::ALL {
        let began = processor_time();
        let totals = write(&of(format), rows);
        let wrote = processor_time() - began;
        let memory_before = memory_mb();
        let began = Instant::now();
        read(&of(format), rows);
        let read = began.elapsed();
        println!(
            "| {format} | {:.0} | {:.1} | {:.1} | {:.0} |",
            totals.bytes as f64 * 1e-6,
            wrote.as_secs_f64(),
            read.as_secs_f64(),
            memory_mb() - memory_before,
        );
    }
    let began = Instant::now();
    export(&of(Format::Mcap), &of(Format::Parquet), true).expect("exported");
    println!("\nMCAP to Parquet: {:.1} s", began.elapsed().as_secs_f64());
}

fn metadata() -> Metadata {
    Metadata {
        server: "hapticd".into(),
        device: "a rig".into(),
        axes: 1,
        loop_rate_hz: 1000.0,
        rate_hz: 1000.0,
        recorded_by: None,
        started_unix_s: 1.76e9,
        revision: 1,
        scene: Scene::paper(),
        servo: None,
        notes: None,
        configuration: None,
    }
}

fn write(path: &Path, rows: u64) -> haptic_recording::Totals {
    let mut writer = Writer::create(path, &metadata(), true).expect("begun");
    let mut signal = Signal { noise: 1 };
    let mut batch = Vec::new();
    for begin in (0..rows).step_by(BATCH as usize) {
        batch.clear();
        batch.extend((begin..(begin + BATCH).min(rows)).map(|tick| signal.row(tick)));
        writer.rows(&batch, &[]).expect("written");
    }
    writer.finish().expect("written")
}

fn read(path: &Path, rows: u64) {
    let (mut count, mut sum) = (0, 0.0);
    for entry in haptic_recording::open(path).expect("reads") {
        if let haptic_recording::Entry::Row(row, _) = entry.expect("reads") {
            count += 1;
            sum += row.command_force_n;
        }
    }
    assert_eq!(count, rows);
    assert!(sum.is_finite());
}

/// A hand that goes to and fro on a block with friction: an encoder of 10 um, velocities and forces
/// with the noise of its steps, a loop and a link with jitter.
struct Signal {
    noise: u64,
}

impl Signal {
    fn row(&mut self, tick: u64) -> Sample {
        let time_s = tick as f64 * 1e-3;
        let hand_m =
            |time_s: f64| 0.02 * (time_s * 4.4).sin() + 0.005 * (time_s * 1.3).sin() + 1e-5 * (time_s * 57.0).sin();
        let position_m = ((hand_m(time_s) + 2e-6 * self.random()) * 1e5).round() * 1e-5;
        let velocity_mps = (hand_m(time_s + 5e-4) - hand_m(time_s - 5e-4)) * 1e3 + 5e-4 * self.random();
        let block_position_m = hand_m(time_s - 4e-3);
        let block_velocity_mps = (hand_m(time_s - 3e-3) - hand_m(time_s - 5e-3)) * 500.0;
        let force_n = 2000.0 * (position_m - block_position_m) + 5.0 * (velocity_mps - block_velocity_mps);
        let wake_latency_ns = (3000.0 + 2000.0 * self.random().abs()) as u64;
        Sample {
            tick,
            t_s: (tick * 1_000_000 + wake_latency_ns) as f64 * 1e-9,
            state: RigState::Engaged,
            contact: if block_velocity_mps > 0.0 { 1 } else { -1 },
            device_position_m: position_m,
            device_velocity_mps: velocity_mps,
            block_position_m,
            block_velocity_mps,
            coupling_force_n: force_n,
            command_force_n: -force_n,
            revision: 1,
            wake_latency_ns,
            tick_ns: (9000.0 + 900.0 * self.random().abs()) as u64,
            device_round_trip_ns: (7000.0 + 800.0 * self.random().abs()) as u64,
            elapsed_ns: (1e6 + 1000.0 * self.random()) as u64,
            device_sequence: tick as u32,
            device_time_ns: tick * 1_000_000 + (self.random().abs() * 200.0) as u64,
            sample_position_m: position_m,
            input_flags: 8,
            error_detail: 0,
        }
    }

    /// Some number with a mean of zero and a deviation of one.
    fn random(&mut self) -> f64 {
        let mut sum = 0.0;
        for _ in 0..3 {
            self.noise ^= self.noise << 13;
            self.noise ^= self.noise >> 7;
            self.noise ^= self.noise << 17;
            sum += self.noise as f64 / u64::MAX as f64 - 0.5;
        }
        2.0 * sum
    }
}

/// Processor time of this process with its threads.
fn processor_time() -> Duration {
    let stat = std::fs::read_to_string("/proc/self/stat").expect("a Linux");
    let fields: Vec<&str> = stat.rsplit(')').next().unwrap_or_default().split_whitespace().collect();
    // User and system time, in hundredths of a second.
    let ticks = [11, 12].map(|index| fields[index].parse::<u64>().expect("a number"));
    Duration::from_millis(10 * (ticks[0] + ticks[1]))
}

/// Most memory of this process so far, MB.
fn memory_mb() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").expect("a Linux");
    let line = status
        .lines()
        .find_map(|line| line.strip_prefix("VmHWM:"))
        .expect("it is there");
    let kilobytes: f64 = line.trim().trim_end_matches("kB").trim().parse().expect("a number");
    kilobytes * 1.024e-3
}
