//! Ranges of names, in the numbering of a language: `LS1..LS16`, `M11..M18`, and NCT's `I000..I027`, whose last
//! digit is a bit from 0 to 7, so that they are 24 points.

/// The most names that a range may have.
const MAX_NAMES: u64 = 4096;

/// The names of a range, or the one name. `ends_in_bit` says that the last digit of a number is a bit from 0 to 7.
///
/// # Errors
/// If it is not a range: the reason, as a message.
pub(super) fn names(text: &str, ends_in_bit: bool) -> Result<Vec<String>, String> {
    let Some((first, last)) = text.split_once("..") else { return Ok(vec![text.trim().into()]) };
    let (first, last) = (first.trim(), last.trim());
    let parts = |name: &str| {
        let at = name.rfind(|c: char| !c.is_ascii_digit()).map_or(0, |at| at + 1);
        let (letters, digits) = name.split_at(at);
        digits.parse().ok().map(|number: u64| (letters.to_owned(), digits.len(), number))
    };
    let no_range = || {
        format!(
            "`{text}` is not a range: two names that end in numbers are expected, as in LS1..LS16"
        )
    };
    let (letters, width, from) = parts(first).ok_or_else(no_range)?;
    let (other, _, to) = parts(last).ok_or_else(no_range)?;
    if letters != other {
        return Err(format!("the names of the range `{text}` begin with different letters"));
    }
    if from > to {
        return Err(format!("the range `{text}` goes backwards"));
    }
    if to - from >= MAX_NAMES {
        return Err(format!("the range `{text}` has more than {MAX_NAMES} names"));
    }
    // If the first number begins with 0, all have as many digits as it.
    let padded = first.as_bytes().get(letters.len()) == Some(&b'0') && width > 1;
    let numbers = (from..=to).filter(|number| !ends_in_bit || number % 10 < 8);
    Ok(numbers
        .map(|number| match padded {
            true => format!("{letters}{number:0width$}"),
            false => format!("{letters}{number}"),
        })
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_go_by_the_numbering_of_the_language() {
        let all = |text, octal| names(text, octal).map(|names| names.join(" "));
        assert_eq!(all("LS9..LS11", false), Ok("LS9 LS10 LS11".into()));
        assert_eq!(all("M11", false), Ok("M11".into()));
        assert_eq!(all("I006..I011", true), Ok("I006 I007 I010 I011".into()));
        assert_eq!(names("I000..I027", true).map(|names| names.len()), Ok(24));
        assert_eq!(all("F0996..F1001", true), Ok("F0996 F0997 F1000 F1001".into()));
        for text in
            ["A..B", "A1..B2", "A2..A1", "A1..", "..", "A1..A9999999", "A1..A99999999999999999999"]
        {
            assert!(names(text, false).is_err(), "{text}");
        }
    }
}
