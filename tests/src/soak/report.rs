//! What a soak has shown: its claims, for people and as a document.

use super::faults::{ALL, Fault};
use super::health::{MAX_DESCRIPTORS_MORE, MAX_GROWTH_KIB, MAX_MEMORY_KIB};
use super::plan::Plan;
use super::rig::{FORCE_LIMIT_N, FORCE_UNIT_N};
use super::round::{End, Occurrence};
use super::{health, load, recordings, rig};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::time::Duration;

/// Times that a fault must have come before the quickest of them is held against the documents: a single one may have
/// been held up by the machine.
const TIMES: usize = 3;

/// By how much even the quickest may be held up on a busy machine.
const BUSY: Duration = Duration::from_millis(50);

/// All that was seen of one daemon.
#[derive(Debug)]
pub(super) struct Seen {
    pub(super) rig: &'static str,
    pub(super) occurrences: Vec<Occurrence>,
    pub(super) left_out: Vec<String>,
    pub(super) load: load::ClientRecord,
    pub(super) recordings: recordings::Checked,
    pub(super) health: health::History,
    pub(super) force: rig::ForceRecord,
    /// What never ended or ended in a panic.
    pub(super) broken: Vec<String>,
}

/// Something that must hold.
#[derive(Clone, Debug)]
pub struct Claim {
    /// In words, with the daemon that it is about.
    pub text: String,
    /// Whether it does.
    pub holds: bool,
    /// What was seen of it.
    pub seen: String,
}

/// What a soak has shown.
#[derive(Debug)]
pub struct Report {
    /// Its claims.
    pub claims: Vec<Claim>,
    /// What cannot be brought about on this machine, and why.
    pub left_out: Vec<String>,
    markdown: String,
}

impl Report {
    pub(super) fn of(plan: &Plan, seen: &[Seen]) -> Self {
        let claims: Vec<Claim> = seen.iter().flat_map(|seen| claims_of(plan, seen)).collect();
        let mut left_out: Vec<String> = seen.iter().flat_map(|seen| seen.left_out.iter().cloned()).collect();
        left_out.push("a journald that stands still: these daemons write to a pipe, which blocks instead".to_owned());
        Self {
            markdown: markdown(plan, seen, &claims, &left_out),
            claims,
            left_out,
        }
    }

    /// Whether every claim holds.
    pub fn holds(&self) -> bool {
        self.claims.iter().all(|claim| claim.holds)
    }

    /// The document, in Markdown.
    pub fn markdown(&self) -> &str {
        &self.markdown
    }

    pub(super) fn write(&self, folder: &Path) {
        fs::write(folder.join("report.md"), &self.markdown).expect("the report");
    }
}

fn claims_of(plan: &Plan, seen: &Seen) -> Vec<Claim> {
    let mut claims = Vec::new();
    let mut claim = |text: &str, holds: bool, figure: String| {
        claims.push(Claim {
            text: format!("{}: {text}", seen.rig),
            holds,
            seen: figure,
        });
    };
    claim(
        "nothing hangs or gives up",
        seen.broken.is_empty(),
        if seen.broken.is_empty() {
            format!("{:.0} s", plan.time_s())
        } else {
            seen.broken.join("; ")
        },
    );
    force(seen, &mut claim);
    ticks_and_journal(seen, &mut claim);
    faults(seen, &mut claim);
    memory_and_descriptors(seen, &mut claim);
    recordings(seen, &mut claim);
    claims
}

fn force(seen: &Seen, claim: &mut impl FnMut(&str, bool, String)) {
    let (force, rows) = (&seen.force, &seen.load.rows);
    let limit = |largest_n: f64| largest_n <= FORCE_LIMIT_N + FORCE_UNIT_N && largest_n > 0.9 * FORCE_LIMIT_N;
    if force.is_independent {
        claim(
            "force reaches the limit and never exceeds it, by the motor's own record",
            limit(force.largest_n),
            format!("{:.3} of {FORCE_LIMIT_N} N", force.largest_n),
        );
        claim(
            "no force where none may flow, by the motor's own record",
            force.largest_at_rest_n == 0.0,
            format!("{:.3} N", force.largest_at_rest_n),
        );
    }
    claim(
        "force reaches the limit and never exceeds it, by every tick",
        limit(rows.largest_n),
        format!("{:.3} N in {} ticks", rows.largest_n, rows.received),
    );
}

fn ticks_and_journal(seen: &Seen, claim: &mut impl FnMut(&str, bool, String)) {
    let (load, rows) = (&seen.load, &seen.load.rows);
    claim(
        "every tick is received or reported lost",
        rows.missing == 0 && rows.received > 0,
        format!(
            "{} received, {} reported lost, {} missing",
            rows.received, rows.dropped, rows.missing
        ),
    );
    let journal = &load.journal;
    claim(
        "no entry of the journal is lost",
        journal.missing == 0 && journal.unlogged == 0 && journal.first.is_some(),
        format!(
            "entries {} to {}: {} missing; {} changes answered, {} of them in no entry",
            journal.first.unwrap_or(0),
            journal.last,
            journal.missing,
            load.changes.revisions.len(),
            journal.unlogged
        ),
    );
}

fn faults(seen: &Seen, claim: &mut impl FnMut(&str, bool, String)) {
    let wrong = wrong_faults(&seen.occurrences);
    let shown = seen
        .occurrences
        .iter()
        .filter(|one| matches!(one.end, End::AsDocumented(_)));
    claim(
        "every fault ends as documented",
        wrong.is_empty() && !seen.occurrences.is_empty(),
        if wrong.is_empty() {
            format!("{} faults", shown.count())
        } else {
            wrong.join("; ")
        },
    );
}

fn recordings(seen: &Seen, claim: &mut impl FnMut(&str, bool, String)) {
    let recordings = &seen.recordings;
    claim(
        "recordings read, lack no row unsaid, and replay with 0 differing",
        recordings.faults.is_empty() && recordings.compared > 0,
        format!(
            "{} recordings, {} rows ({} reported lost), {} compared ({} with force), {} differ{}",
            recordings.recordings,
            recordings.rows,
            recordings.lost,
            recordings.compared,
            recordings.with_force,
            recordings.differing,
            recordings
                .faults
                .iter()
                .fold(String::new(), |text, fault| text + "; " + fault),
        ),
    );
}

fn memory_and_descriptors(seen: &Seen, claim: &mut impl FnMut(&str, bool, String)) {
    let health = &seen.health;
    let most_kib = health.most_memory_kib();
    let growth = health.growth_kib();
    claim(
        "memory is bounded and flat",
        most_kib > 0 && most_kib <= MAX_MEMORY_KIB && growth.is_none_or(|growth| growth <= MAX_GROWTH_KIB),
        format!(
            "{most_kib} of at most {MAX_MEMORY_KIB} KiB; from the third quarter to the last {}",
            growth.map_or_else(
                || "not judged, the histories still fill".to_owned(),
                |growth| format!("{growth:+} KiB (at most {MAX_GROWTH_KIB})")
            )
        ),
    );
    let [before, after] = health.descriptors_without_clients;
    let most = health.most_descriptors();
    claim(
        "descriptors are bounded and all given back",
        before > 0 && after <= before && most <= before + MAX_DESCRIPTORS_MORE,
        format!("{before} before the clients came, {most} at most, {after} after they had gone"),
    );
}

/// What did not end as documented, or never came about.
fn wrong_faults(occurrences: &[Occurrence]) -> Vec<String> {
    let mut wrong: Vec<String> = occurrences
        .iter()
        .filter_map(|one| match &one.end {
            End::Wrong(why) => Some(format!("{} at {:.1} s: {why}", one.fault, one.time_s)),
            _ => None,
        })
        .collect();
    for (name, of_it) in by_fault(occurrences) {
        if of_it.iter().all(|end| matches!(end, End::BusyMachine(_))) {
            wrong.push(format!("{name}: the machine interfered, {} times", of_it.len()));
        }
        let times = zero_force(&of_it);
        let documented = ALL
            .iter()
            .find(|fault| fault.name == name)
            .and_then(|fault| fault.zero_within_ms);
        if let (Some(quickest), Some(documented_ms)) = (times.first(), documented)
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

fn by_fault(occurrences: &[Occurrence]) -> BTreeMap<&'static str, Vec<&End>> {
    let mut by_fault: BTreeMap<&'static str, Vec<&End>> = BTreeMap::new();
    for one in occurrences {
        by_fault.entry(one.fault).or_default().push(&one.end);
    }
    by_fault
}

/// Times until the motor gave no force, sorted.
fn zero_force(ends: &[&End]) -> Vec<Duration> {
    let mut times: Vec<Duration> = ends
        .iter()
        .filter_map(|end| match end {
            End::AsDocumented(zero) => *zero,
            _ => None,
        })
        .collect();
    times.sort_unstable();
    times
}

fn markdown(plan: &Plan, seen: &[Seen], claims: &[Claim], left_out: &[String]) -> String {
    let mut text = format!(
        "# Soak\n\n{:.0} s with `--seed {}`; asked for {:?}.\n\n| claim | | seen |\n|---|---|---|\n",
        plan.time_s(),
        plan.seed,
        plan.length
    );
    // Writing into a string cannot fail.
    let mut line = |row: std::fmt::Arguments<'_>| writeln!(text, "{row}").expect("a string takes all");
    for claim in claims {
        let holds = if claim.holds { "holds" } else { "**FAILS**" };
        line(format_args!(
            "| {} | {holds} | {} |",
            claim.text,
            claim.seen.replace('|', "/")
        ));
    }
    line(format_args!(
        "\n## Faults\n\nZero force after: by the motor's own record behind the link, ms; of three times or more, the quickest must not be \
         later than documented by more than {} ms. A fault that a busy machine brought about instead was tried again.\n\n\
         | fault | rows of safety.md | documented end | documented, ms | median | longest | link | in process | busy machine |\n\
         |---|---|---|---|---|---|---|---|---|",
        BUSY.as_millis()
    ));
    for fault in ALL {
        line(format_args!("{}", fault_row(fault, seen)));
    }
    line(format_args!("\n## Left out\n"));
    for one in left_out {
        line(format_args!("- {one}"));
    }
    text
}

fn fault_row(fault: &Fault, seen: &[Seen]) -> String {
    let of_rig = |index: usize| -> Vec<&End> {
        seen.get(index).map_or(Vec::new(), |seen| {
            let same = seen.occurrences.iter().filter(|one| one.fault == fault.name);
            same.map(|one| &one.end).collect()
        })
    };
    let (link, in_process) = (of_rig(0), of_rig(1));
    let shown = |ends: &[&End]| ends.iter().filter(|end| matches!(end, End::AsDocumented(_))).count();
    let busy = link
        .iter()
        .chain(&in_process)
        .filter(|end| matches!(end, End::BusyMachine(_)))
        .count();
    let times = zero_force(&link);
    let ms = |time: Option<&Duration>| time.map_or("-".to_owned(), |time| format!("{:.1}", time.as_secs_f64() * 1e3));
    let documented = fault.zero_within_ms.map_or("-".to_owned(), |ms| ms.to_string());
    format!(
        "| {} | {} | {} | {documented} | {} | {} | {} | {} | {busy} |",
        fault.name,
        fault.rows,
        fault.ends_in,
        ms(times.get(times.len() / 2)),
        ms(times.last()),
        shown(&link),
        shown(&in_process)
    )
}
