//! What a soak has shown: its claims and its faults, in Markdown.

use super::faults::{ALL, Fault};
use super::health::{History, MAX_DESCRIPTORS_MORE, MAX_GROWTH_KIB, MAX_MEMORY_KIB};
use super::load::Heard;
use super::recordings::Checked;
use super::rig::{FORCE_LIMIT_N, FORCE_UNIT_N};
use super::round::{End, Occurrence};
use super::{Plan, Report};
use std::time::Duration;

/// Times that a fault must have come before the quickest of them is held against the documents: a single one may have
/// been held up by the machine.
const TIMES: usize = 3;

/// By how much even the quickest may be held up on a busy machine.
const BUSY: Duration = Duration::from_millis(50);

/// All that was seen.
#[derive(Debug, Default)]
pub(super) struct Seen {
    pub(super) occurrences: Vec<Occurrence>,
    /// Revisions that the daemon answered to who changed its scene.
    pub(super) revisions: Vec<u64>,
    pub(super) heard: Heard,
    pub(super) recordings: Checked,
    pub(super) health: History,
    /// Descriptors before the first client came and after the last had gone.
    pub(super) descriptors_without_clients: [usize; 2],
    /// Largest forces of the motor by its own record, N: of all, and while the daemon reported none.
    pub(super) largest_n: [f64; 2],
    /// What never ended or ended in a panic.
    pub(super) broken: Vec<String>,
}

/// Something that must hold, whether it does, and what was seen of it.
type Claim = (&'static str, bool, String);

impl Report {
    pub(super) fn of(plan: &Plan, seen: &Seen) -> Self {
        let claims = [force(seen), served(seen), endured(plan, seen)].concat();
        let heading = format!(
            "{:.0} s with `--seed {}`; asked for {:?}.",
            plan.time_s(),
            plan.seed,
            plan.length
        );
        let mut lines = vec![format!("# Soak\n\n{heading}\n\n| claim | | seen |\n|---|---|---|")];
        for (text, holds, figure) in &claims {
            let holds = if *holds { "holds" } else { "**FAILS**" };
            lines.push(format!("| {text} | {holds} | {} |", figure.replace('|', "/")));
        }
        lines.push(format!(
            "\n## Faults\n\nZero force after: by the motor's own record, ms; of {TIMES} times or more, the quickest \
             must not be later than documented by more than {} ms. A fault that a busy machine brought about instead \
             was tried again.\n\n| fault | row of safety.md | documented end | documented, ms | median | longest \
             | times | busy machine |\n|---|---|---|---|---|---|---|---|",
            BUSY.as_millis()
        ));
        lines.extend(ALL.iter().map(|fault| row(fault, &seen.occurrences)));
        let failed = claims.into_iter().filter(|(_, holds, _)| !holds);
        Self {
            markdown: lines.join("\n") + "\n",
            failed: failed.map(|(text, _, figure)| format!("{text}: {figure}")).collect(),
        }
    }
}

fn force(seen: &Seen) -> Vec<Claim> {
    let reaches_limit = |largest_n: f64| largest_n <= FORCE_LIMIT_N + FORCE_UNIT_N && largest_n > 0.9 * FORCE_LIMIT_N;
    let ([largest_n, at_rest_n], heard) = (seen.largest_n, &seen.heard);
    vec![
        (
            "force reaches the limit and never exceeds it, by the motor's own record",
            reaches_limit(largest_n),
            format!("{largest_n:.3} of {FORCE_LIMIT_N} N"),
        ),
        (
            "no force where none may flow, by the motor's own record",
            at_rest_n == 0.0,
            format!("{at_rest_n:.3} N"),
        ),
        (
            "force reaches the limit and never exceeds it, by every tick",
            reaches_limit(heard.largest_n),
            format!("{:.3} N in {} ticks", heard.largest_n, heard.rows),
        ),
    ]
}

/// What clients were told.
fn served(seen: &Seen) -> Vec<Claim> {
    let (heard, recordings) = (&seen.heard, &seen.recordings);
    let unlogged = heard.unlogged(&seen.revisions);
    vec![
        (
            "every tick is received or reported lost",
            heard.missing_rows == 0 && heard.rows > 0,
            format!(
                "{} received, {} reported lost, {} missing",
                heard.rows, heard.dropped_rows, heard.missing_rows
            ),
        ),
        (
            "no entry of the journal is lost",
            heard.missing_entries == 0 && unlogged == 0 && !seen.revisions.is_empty() && heard.first_entry.is_some(),
            format!(
                "entries {} to {}: {} missing; {} changes answered, {unlogged} of them in no entry",
                heard.first_entry.unwrap_or(0),
                heard.last_entry,
                heard.missing_entries,
                seen.revisions.len()
            ),
        ),
        (
            "recordings read, lack no row unsaid, and replay with 0 differing",
            recordings.faults.is_empty() && recordings.compared > 0,
            format!("{recordings:?}"),
        ),
    ]
}

/// What the daemon went through, and what that took.
fn endured(plan: &Plan, seen: &Seen) -> Vec<Claim> {
    let wrong = wrong_faults(&seen.occurrences);
    let health = &seen.health;
    let (most_kib, growth) = (health.most_memory_kib(), health.growth_kib());
    let [before, after] = seen.descriptors_without_clients;
    let most = health.most_descriptors;
    vec![
        (
            "nothing hangs or gives up",
            seen.broken.is_empty(),
            format!("{:.0} s {}", plan.time_s(), seen.broken.join("; ")),
        ),
        (
            "every fault ends as documented",
            wrong.is_empty() && !seen.occurrences.is_empty(),
            format!("{} faults {}", seen.occurrences.len(), wrong.join("; ")),
        ),
        (
            "memory is bounded and flat",
            most_kib > 0 && most_kib <= MAX_MEMORY_KIB && growth.is_none_or(|growth| growth <= MAX_GROWTH_KIB),
            format!(
                "{most_kib} of at most {MAX_MEMORY_KIB} KiB; from the third quarter to the last {}",
                growth.map_or_else(
                    || "not judged, the histories still fill".to_owned(),
                    |growth| format!("{growth:+} KiB (at most {MAX_GROWTH_KIB})")
                )
            ),
        ),
        (
            "descriptors are bounded and all given back",
            before > 0 && after <= before && most <= before + MAX_DESCRIPTORS_MORE,
            format!("{before} before the clients came, {most} at most, {after} after they had gone"),
        ),
    ]
}

/// The ends of a fault.
fn ends<'a>(fault: &Fault, occurrences: &'a [Occurrence]) -> Vec<&'a End> {
    let same = occurrences.iter().filter(|one| one.fault == fault.name);
    same.map(|one| &one.end).collect()
}

/// Times until the motor gave no force, sorted.
fn zero_force(ends: &[&End]) -> Vec<Duration> {
    let zero = |end: &&End| match end {
        End::AsDocumented(zero) => *zero,
        _ => None,
    };
    let mut times: Vec<Duration> = ends.iter().filter_map(zero).collect();
    times.sort_unstable();
    times
}

/// What did not end as documented, or never came about.
fn wrong_faults(occurrences: &[Occurrence]) -> Vec<String> {
    let mut wrong = Vec::new();
    for one in occurrences {
        if let End::Wrong(why) = &one.end {
            wrong.push(format!("{} at {:.1} s: {why}", one.fault, one.time_s));
        }
    }
    for fault in ALL {
        let (name, ends) = (fault.name, ends(fault, occurrences));
        if ends.iter().all(|end| matches!(end, End::BusyMachine(_))) {
            wrong.push(format!("{name}: the machine interfered, {} times", ends.len()));
        }
        let times = zero_force(&ends);
        if let (Some(quickest), Some(documented_ms)) = (times.first(), fault.documented.zero_within_ms)
            && times.len() >= TIMES
            && *quickest > Duration::from_millis(documented_ms) + BUSY
        {
            wrong.push(format!(
                "{name}: zero force after {quickest:?} at the earliest, documented are {documented_ms} ms"
            ));
        }
    }
    wrong
}

fn row(fault: &Fault, occurrences: &[Occurrence]) -> String {
    let ends = ends(fault, occurrences);
    let shown = ends.iter().filter(|end| matches!(end, End::AsDocumented(_))).count();
    let busy = ends.iter().filter(|end| matches!(end, End::BusyMachine(_))).count();
    let times = zero_force(&ends);
    let ms = |time: Option<&Duration>| time.map_or("-".to_owned(), |time| format!("{:.1}", time.as_secs_f64() * 1e3));
    let documented = fault
        .documented
        .zero_within_ms
        .map_or("-".to_owned(), |ms| ms.to_string());
    format!(
        "| {} | {} | {} | {documented} | {} | {} | {shown} | {busy} |",
        fault.name,
        fault.documented.row,
        fault.documented.end,
        ms(times.get(times.len() / 2)),
        ms(times.last())
    )
}
