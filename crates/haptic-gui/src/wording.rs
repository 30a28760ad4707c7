//! Names of parameters and checks in words.

/// A name with spaces: `static_force` becomes `static force`.
pub(crate) fn spoken(name: &str) -> String {
    name.replace('_', " ")
}

/// What the value of a check is of; empty for a check that this program does not know.
pub(crate) fn subject(check: &str) -> &'static str {
    use haptic_core::adviser::Check;
    let subjects = [
        (Check::LimitCycle, "speed of the block"),
        (Check::LeastMass, "mass"),
        (Check::Ripple, "force"),
        (Check::Passivity, "the rig's damping"),
        (Check::LinearStability, "stiffness"),
        (Check::Friction, "stiffness"),
        (Check::Encoder, "stiffness"),
        (Check::FrictionPassivity, "drag"),
    ];
    let found = subjects.iter().find(|(known, _)| known.name() == check);
    found.map_or("", |(_, subject)| subject)
}

/// A name as the beginning of a line: `static_force` becomes `Static force`.
pub(crate) fn sentence_case(name: &str) -> String {
    let name = spoken(name);
    let mut letters = name.chars();
    letters
        .next()
        .map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}
