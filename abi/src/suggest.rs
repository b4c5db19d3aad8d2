//! The name that was probably meant: what messages suggest after "did you mean".

use alloc::string::String;

/// The candidate that is nearest to `word`, if one is near enough to be a typing error: at most one
/// edit (a letter changed, added, left out, or two neighbours swapped) for up to four characters,
/// two for up to eight, else three. Case does not count. `None` for words of one character, which
/// resemble everything, and of more than 64.
pub fn closest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let allowed = match word.chars().count() {
        2..=4 => 1,
        5..=8 => 2,
        9..=64 => 3,
        // Computing the distance takes quadratic time.
        _ => return None,
    };
    let word: String = word.to_lowercase();
    candidates
        .into_iter()
        // A cheap test first: an edit changes the length in bytes by at most three.
        .filter(|name| name.len().abs_diff(word.len()) <= 3 * allowed)
        .map(|name| (strsim::osa_distance(&word, &name.to_lowercase()), name))
        .filter(|&(distance, _)| distance <= allowed)
        .min_by_key(|&(distance, _)| distance)
        .map(|(_, name)| name)
}

#[cfg(test)]
mod tests {
    use super::closest;

    #[test]
    fn only_a_similar_name_is_suggested() {
        let names = ["@FRO", "@SSO", "@ESTOP"];
        assert_eq!(closest("@FRP", names), Some("@FRO"));
        assert_eq!(closest("@ESTPO", names), Some("@ESTOP"));
        assert_eq!(closest("@XYZ", names), None);
    }
}
