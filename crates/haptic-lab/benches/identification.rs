//! How near to the truth an identification comes: `cargo bench -p haptic-lab --bench identification`.
//!
//! Every case is recorded with 100 seeds, or as many as the first argument says; a second one chooses the cases whose
//! names begin with it. For each parameter the table says in how many runs it was reported, in how many of those the
//! truth was inside the 95 % interval, the mean, the error (root mean square and worst) and half of the interval.
//!
//! `-- kinds` instead asks how often intervals hold: a line for each kind of record under each condition, for 400
//! records of a mass and friction drawn by chance, or as many as the next argument says; one more chooses the lines
//! that contain it. A line says how often mass, viscous and dynamic friction (of two recorders the shift as well) were
//! answered, how often their intervals then held the truth, and half of the usual interval: of the truth, N s/m, of the
//! truth, ms.

use haptic_lab::identify::study::Judgement;
use haptic_lab::identify::study::cases::{Case, cases};
use haptic_lab::identify::study::coverage::{Coverage, Found};
use haptic_lab::identify::study::kinds::{Conditions, Kind};
use std::time::Instant;

/// Seeds of each case.
const SEEDS: u64 = 100;
/// Records of each kind.
const RECORDS: u64 = 400;

fn main() {
    // Cargo adds `--bench`.
    let mut arguments = std::env::args().skip(1).filter(|argument| !argument.starts_with("--"));
    let first = arguments.next().unwrap_or_default();
    if first == "kinds" {
        let records = arguments.next().and_then(|records| records.parse().ok());
        print_kinds(records.unwrap_or(RECORDS), &arguments.next().unwrap_or_default());
        return;
    }
    let seeds = first.parse().unwrap_or(SEEDS);
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

fn print_kinds(records: u64, part: &str) {
    println!("| kind | condition | answered, % | held, % | half of the interval | ms a record |");
    println!("|---|---|---|---|---|---|");
    for conditions in &Conditions::ALL {
        for (kind, name) in Kind::ALL {
            let line = format!("{name} | {}", conditions.name);
            if !line.contains(part) || (conditions.backlash_m > 0.0 && !kind.is_by_hand()) {
                continue;
            }
            let begun = Instant::now();
            let found = Coverage::of(kind, conditions, 0..records);
            let mut values = vec![&found.mass, &found.viscous, &found.dynamic];
            if conditions.shift_s != 0.0 {
                values.push(&found.shift);
            }
            let row =
                |of: &dyn Fn(&Found) -> String| values.iter().map(|found| of(found)).collect::<Vec<_>>().join(" / ");
            let share = |count: usize, all: usize| format!("{:.0}", 100.0 * count as f64 / all.max(1) as f64);
            println!(
                "| {line} | {} | {} | {} | {:.0} |",
                row(&|found| share(found.answered, records as usize)),
                row(&|found| share(found.held, found.answered)),
                row(&|found| found
                    .median_half()
                    .map_or_else(|| "-".to_owned(), |half| format!("{half:.3}"))),
                1e3 * begun.elapsed().as_secs_f64() / records as f64
            );
        }
    }
}
