//! The known word that a misspelt one was probably meant to be: the guess in every message about an unknown word.

use alloc::string::String;
use alloc::vec;

/// Longest word that is compared, bytes: the time grows with the word, and any client may send one.
const MAX_WORD: usize = 64;

/// Shortest part of a name that stands for it, bytes: `on` and `with` do not.
const MIN_PART: usize = 5;

/// Words that people use for something which has another name here.
const SYNONYMS: &[(&str, &[&str])] = &[
    ("mass", &["weight", "inertia", "heaviness"]),
    ("Fs", &["stiction", "breakaway", "breakaway_force", "static_friction"]),
    (
        "Fd",
        &["coulomb", "kinetic", "kinetic_force", "kinetic_friction", "friction"],
    ),
    ("viscous", &["viscosity", "drag"]),
    ("stiffness", &["spring"]),
    ("damping", &["damper"]),
    ("device_position_m", &["position", "x"]),
    ("device_velocity_mps", &["velocity", "speed"]),
    ("command_force_N", &["force"]),
    ("t_s", &["time", "t"]),
    (
        "log",
        &["events", "watch", "stream", "tail", "follow", "journal", "history"],
    ),
    ("anyway", &["force"]),
    ("replace", &["force", "overwrite"]),
    ("kg", &["kgs", "kilo", "kilogram", "kilograms"]),
    ("g", &["gram", "grams", "gr"]),
    ("N", &["newton", "newtons"]),
    ("m", &["meter", "meters", "metre", "metres"]),
    ("mm", &["millimeter", "millimeters", "millimetre", "millimetres"]),
    ("s", &["sec", "secs", "second", "seconds"]),
    ("ms", &["msec", "millisecond", "milliseconds"]),
    ("Hz", &["hertz"]),
    ("%", &["percent"]),
];

/// The known word that `wrong` was most likely meant to be: one that it is a synonym of, one that begins with it,
/// or one in which at most a third of the letters differ; where there is none, the only one of which a part between
/// hyphens is so. Case does not matter.
#[must_use]
pub fn nearest<'a>(wrong: &str, known: &[&'a str]) -> Option<&'a str> {
    if wrong.len() > MAX_WORD {
        return None;
    }
    let wrong = wrong.to_lowercase();
    let synonyms = SYNONYMS.iter().filter(|(_, words)| words.contains(&wrong.as_str()));
    let mut meant = synonyms.filter_map(|(word, _)| known.iter().find(|name| *name == word));
    if let Some(meant) = meant.next() {
        return Some(meant);
    }
    let begun = known
        .iter()
        .find(|name| wrong.len() > 2 && name.to_lowercase().starts_with(&wrong));
    begun.copied().or_else(|| {
        let near = known.iter().filter_map(|name| Some((near(&wrong, name)?, *name)));
        let whole = near.min_by_key(|(distance, _)| *distance).map(|(_, name)| name);
        whole.or_else(|| by_a_part(&wrong, known))
    })
}

/// The only name of which a part between hyphens begins with a word, or is near it. What a `no` denies is not
/// meant.
fn by_a_part<'a>(wrong: &str, known: &[&'a str]) -> Option<&'a str> {
    let is_meant = |part: &str| {
        let is_long = part.len() >= MIN_PART && wrong.len() >= MIN_PART;
        is_long && (part.to_lowercase().starts_with(wrong) || near(wrong, part).is_some())
    };
    let mut meant = known
        .iter()
        .filter(|name| name.contains('-') && name.split('-').any(is_meant));
    let only = meant.next().filter(|_| meant.next().is_none())?;
    (!only.split('-').any(|part| part == "no")).then_some(*only)
}

/// By how many letters a word differs from a known one, if it is at most a third of them.
fn near(wrong: &str, known: &str) -> Option<usize> {
    let distance = distance(wrong.as_bytes(), known.to_lowercase().as_bytes());
    (distance <= known.len() / 3).then_some(distance)
}

/// The part of a message between an unknown word and the list of known ones: `, did you mean ...?` or a semicolon.
#[must_use]
pub fn meant_or_semicolon(wrong: &str, known: &[&str]) -> String {
    suggestion(nearest(wrong, known))
}

/// The same, of a guess.
#[must_use]
pub fn suggestion(nearest: Option<&str>) -> String {
    nearest.map_or_else(
        || String::from(";"),
        |meant| alloc::format!(", did you mean `{meant}`?"),
    )
}

/// Optimal string alignment distance: letters inserted, removed, replaced, or swapped with the next.
fn distance(a: &[u8], b: &[u8]) -> usize {
    let width = b.len() + 1;
    let mut table = vec![0; (a.len() + 1) * width];
    for i in 0..=a.len() {
        for j in 0..=b.len() {
            let at = i * width + j;
            if i == 0 || j == 0 {
                table[at] = i + j;
                continue;
            }
            let replaced = table[at - width - 1] + usize::from(a[i - 1] != b[j - 1]);
            table[at] = replaced.min(table[at - 1] + 1).min(table[at - width] + 1);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                table[at] = table[at].min(table[at - 2 * width - 2] + 1);
            }
        }
    }
    table[a.len() * width + b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_word_is_one_that_could_have_been_meant() {
        let known = ["viscous-drag", "lugre", "no-friction"];
        assert_eq!(nearest("viscus-drag", &known), Some("viscous-drag"));
        assert_eq!(nearest("visc", &known), Some("viscous-drag"));
        assert_eq!(nearest("LUGRE", &known), Some("lugre"));
        // Two letters swapped are one mistake.
        assert_eq!(nearest("lurge", &known), Some("lugre"));
        assert_eq!(nearest("luger", &known), Some("lugre"));
        assert_eq!(nearest("ulger", &known), None, "two mistakes in five letters");
        assert_eq!(nearest("ice", &known), None);
        assert_eq!(nearest("", &known), None);
        let scenes = ["no-friction", "aluminium-on-teflon", "felt"];
        // A part of a name.
        assert_eq!(nearest("telfon", &scenes), Some("aluminium-on-teflon"));
        assert_eq!(nearest("fel", &scenes), Some("felt"), "the whole name first");
        assert_eq!(nearest("frictoin", &scenes), None, "what a `no` denies");
        // Two have it.
        assert_eq!(nearest("friction", &["simulated-friction", "measured-friction"]), None);
        let parameters = ["mass", "static_force", "Fs", "Fd"];
        assert_eq!(nearest("msas", &parameters), Some("mass"));
        assert_eq!(nearest("Weight", &parameters), Some("mass"));
        assert_eq!(nearest("stiction", &parameters), Some("Fs"));
        assert_eq!(nearest("stiction", &["lugre"]), None, "only a word that is known here");
        let long = "lugre".repeat(20);
        assert_eq!(nearest(&long[1..], &[&long]), None, "a long word takes no time");
    }
}
