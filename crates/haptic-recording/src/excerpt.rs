//! What stands in a file, shortened for messages.

/// The beginning of what stands in a file, for messages.
pub(crate) fn excerpt(text: &[u8]) -> String {
    const LONGEST: usize = 60;
    let text = String::from_utf8_lossy(text);
    let mut excerpt: String = text.chars().take(LONGEST).flat_map(char::escape_debug).collect();
    if text.chars().count() > LONGEST {
        excerpt.push_str("...");
    }
    excerpt
}
