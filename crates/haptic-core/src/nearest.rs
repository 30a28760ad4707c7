//! The known word that a misspelt one was probably meant to be.

use alloc::vec;

/// Longest word that is compared, bytes: the time grows with the word, and any client may send one.
const LONGEST: usize = 64;

/// The known word that `wrong` was most likely meant to be: one that begins with it, or one in which
/// at most a third of the letters differ. Case does not matter.
#[must_use]
pub fn nearest<'a>(wrong: &str, known: &[&'a str]) -> Option<&'a str> {
    if wrong.len() > LONGEST {
        return None;
    }
    let wrong = wrong.to_lowercase();
    let begun = known
        .iter()
        .find(|name| wrong.len() > 2 && name.to_lowercase().starts_with(&wrong));
    begun.copied().or_else(|| {
        known
            .iter()
            .map(|name| (distance(wrong.as_bytes(), name.to_lowercase().as_bytes()), *name))
            .min_by_key(|(distance, _)| *distance)
            .filter(|(distance, name)| *distance <= name.len() / 3)
            .map(|(_, name)| name)
    })
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
        assert_eq!(
            nearest("lurge", &known),
            Some("lugre"),
            "two letters swapped are one mistake"
        );
        assert_eq!(nearest("luger", &known), Some("lugre"));
        assert_eq!(nearest("ulger", &known), None, "two mistakes in five letters");
        assert_eq!(nearest("ice", &known), None);
        assert_eq!(nearest("", &known), None);
        let long = "lugre".repeat(20);
        assert_eq!(nearest(&long[1..], &[&long]), None, "a long word takes no time");
    }
}
