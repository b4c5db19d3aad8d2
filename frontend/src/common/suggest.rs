//! "Did you mean".

/// The candidate nearest to `word`, if one is near enough to be a slip of the finger: at most one
/// edit for up to four characters, two for up to eight, else three. Case does not count.
pub fn closest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let length = word.chars().count();
    let allowed = match length {
        0 | 1 => return None,
        2..=4 => 1,
        5..=8 => 2,
        9..=64 => 3,
        // Nobody mistypes a name of this length; and distance takes quadratic time.
        _ => return None,
    };
    let word = word.to_lowercase();
    candidates
        .into_iter()
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
    fn near_names_only() {
        let names = ["@FRO", "@SSO", "@ESTOP"];
        assert_eq!(closest("@FRP", names), Some("@FRO"));
        assert_eq!(closest("@ESTPO", names), Some("@ESTOP"));
        assert_eq!(closest("@XYZ", names), None);
    }
}
