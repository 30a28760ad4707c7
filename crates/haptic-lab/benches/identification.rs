//! How near to the truth an identification comes: `cargo bench -p haptic-lab --bench identification`.
//!
//! Every case is recorded with 100 seeds, or as many as the first argument says; a second one chooses the cases whose
//! names begin with it. For each parameter the table says in how many runs it was reported, in how many of those the
//! truth was inside the 95 % interval, the mean, the error (root mean square and worst) and half of the interval.

use haptic_lab::identify::study::Judgement;
use haptic_lab::identify::study::cases::{Case, cases};
use std::time::Instant;

/// Seeds of each case.
const SEEDS: u64 = 100;

fn main() {
    // Cargo adds `--bench`.
    let mut arguments = std::env::args().skip(1).filter(|argument| !argument.starts_with("--"));
    let seeds = arguments.next().and_then(|seeds| seeds.parse().ok()).unwrap_or(SEEDS);
    let begins = arguments.next().unwrap_or_default();
    for case in cases().iter().filter(|case| case.name.starts_with(&begins)) {
        print(case, seeds);
    }
}

fn print(case: &Case, seeds: u64) {
    let begun = Instant::now();
    let judgement = Judgement::of(case, 0..seeds);
    println!(
        "\n{} ({}; {:.1} s a record; doubted in {} of {seeds}){}\n",
        case.name,
        if case.is_hard { "hard" } else { "fair" },
        begun.elapsed().as_secs_f64() / seeds as f64,
        judgement.doubted,
        if case.is_hard {
            ", which the record cannot determine in full"
        } else {
            ""
        },
    );
    println!("| parameter | truth | mean | rms error | worst error | half interval | inside / reported |");
    println!("|---|---|---|---|---|---|---|");
    for (name, judged) in &judgement.parameters {
        if let Some(reason) = judged.refused.as_ref().filter(|_| judged.reported == 0) {
            println!("| {name} | | | | | | refused: {reason} |");
            continue;
        }
        let Some(truth) = judged.truth else {
            println!("| {name} | none | {:.5} | | | | {} |", judged.mean, judged.reported);
            continue;
        };
        let share = |value: f64| {
            if truth == 0.0 || name == "offset_N" {
                format!("{value:.4}")
            } else {
                format!("{:.2} %", 100.0 * value / truth.abs())
            }
        };
        println!(
            "| {name} | {truth} | {:.5} | {} | {} | {} | {} / {} |",
            judged.mean,
            share(judged.rms),
            share(judged.worst),
            share(judged.half),
            judged.inside,
            judged.reported
        );
    }
}
