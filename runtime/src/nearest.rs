//! "Did you mean".

/// The candidate nearest to `word`, if one is near enough to be a slip of the finger: at most one
/// edit for up to four characters, two for up to eight, else three. Case does not count.
pub(crate) fn nearest<'a>(
    word: &str,
    candidates: impl IntoIterator<Item = &'a str>,
) -> Option<&'a str> {
    let allowed = match word.chars().count() {
        2..=4 => 1,
        5..=8 => 2,
        9..=64 => 3,
        // One letter is like any other, and nobody mistypes a name of more than 64.
        _ => return None,
    };
    let word = word.to_lowercase();
    candidates
        .into_iter()
        .map(|name| (strsim::osa_distance(&word, &name.to_lowercase()), name))
        .filter(|&(distance, _)| distance <= allowed)
        .min_by_key(|&(distance, _)| distance)
        .map(|(_, name)| name)
}
