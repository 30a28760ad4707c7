//! The known word that was probably meant, in a message of serde's about an unknown one.

use haptic_core::nearest::nearest;

/// The word that was probably meant in a message of serde's about an unknown field or word, which
/// lists the known ones.
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
