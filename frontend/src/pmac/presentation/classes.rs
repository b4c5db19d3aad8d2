//! The classes of variables: their letters, and memory.

/// The titles of the classes, in the order in which they are shown.
pub(in crate::pmac) const CLASSES: &[&str] =
    &["P-variables", "Q-variables", "M-variables", "L-variables", "I-variables", "Memory"];

/// The title of a variable's class.
pub(in crate::pmac) fn title(name: &str) -> &'static str {
    let name = name.trim_start_matches(|c: char| c == '&' || c.is_ascii_digit());
    match name.chars().next() {
        _ if name.contains(':') => "Memory",
        Some('P') => "P-variables",
        Some('Q') => "Q-variables",
        Some('M') => "M-variables",
        Some('L') => "L-variables",
        _ => "I-variables",
    }
}
