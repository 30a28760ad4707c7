//! The word that was probably meant by an unknown word.

/// Longest word that is compared, bytes: the time grows with the word, and any client may send one.
const LONGEST: usize = 64;

/// The known word that was most likely meant: one that begins with it, or one of which at most a
/// third of the letters differ. Case does not matter.
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
            .map(|name| (strsim::osa_distance(&wrong, &name.to_lowercase()), *name))
            .min()
            .filter(|(distance, name)| *distance <= name.len() / 3)
            .map(|(_, name)| name)
    })
}

/// The same as a part of a message, on the way to what there is: `, did you mean ...?`, or a
/// semicolon.
#[must_use]
pub fn meant_or_semicolon(wrong: &str, known: &[&str]) -> String {
    nearest(wrong, known).map_or_else(|| ";".to_owned(), |meant| format!(", did you mean `{meant}`?"))
}

/// The same for a message of serde's about an unknown field or word, which lists those that there
/// are.
#[must_use]
pub fn meant_in(message: &str) -> Option<&str> {
    let (_, listed) = message
        .split_once("unknown field `")
        .or_else(|| message.split_once("unknown variant `"))?;
    let (wrong, listed) = listed.split_once('`')?;
    let known: Vec<&str> = listed.split('`').skip(1).step_by(2).collect();
    nearest(wrong, &known)
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
        assert_eq!(nearest("lurge", &known), Some("lugre"));
        assert_eq!(nearest("ice", &known), None);
        let long = "lugre".repeat(20);
        assert_eq!(nearest(&long[1..], &[&long]), None, "a long word takes no time");
    }

    #[test]
    fn what_serde_lists_is_looked_through() {
        let meant = |message| meant_in(message);
        assert_eq!(
            meant("unknown field `visous`, expected `viscous` or `b`"),
            Some("viscous")
        );
        assert_eq!(
            meant("unknown variant `lugr`, expected one of `karnopp`, `lugre`"),
            Some("lugre")
        );
        assert_eq!(meant("unknown field `colour`, there are no fields"), None);
        assert_eq!(meant("missing field `viscous`"), None);
    }
}
