//! Names of parameters and checks in words.

/// A name with spaces: `static_force` becomes `static force`.
pub(crate) fn spoken(name: &str) -> String {
    name.replace('_', " ")
}

/// A name as the beginning of a line: `static_force` becomes `Static force`.
pub(crate) fn sentence_case(name: &str) -> String {
    let name = spoken(name);
    let mut letters = name.chars();
    letters
        .next()
        .map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}
