//! The line around the place of an error, for messages that say what was probably meant.

/// How many bytes of the line are looked at on either side. The limit keeps the time linear for a
/// line with very many errors.
const REACH: usize = 256;

/// A part of a line, and what is on the same line around it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Surroundings<'a> {
    /// The text from the line's beginning to the part, or its last 256 bytes.
    pub(crate) before: &'a str,
    /// The part itself, up to the line's end.
    pub(crate) at: &'a str,
    /// The text after the part up to the line's end, or its first 256 bytes.
    pub(crate) after: &'a str,
}

impl<'a> Surroundings<'a> {
    /// What is around `text[start..end]`. Offsets that are none of the text give empty parts.
    pub(crate) fn new(text: &'a str, start: usize, end: usize) -> Self {
        let to = (end..=end.saturating_add(REACH)).rev().find(|at| text.is_char_boundary(*at));
        let before = Self::before(text, start);
        let line = before.rfind(['\r', '\n']).map_or(0, |at| at + 1);
        let first_line = |text: &'a str| text.split(['\r', '\n']).next().unwrap_or("");
        let at = text.get(start..end).unwrap_or("");
        let after = text.get(end..to.unwrap_or(end)).unwrap_or("");
        let one_line = first_line(at).len() == at.len();
        Self {
            before: before.get(line..).unwrap_or(""),
            at: first_line(at),
            after: if one_line { first_line(after) } else { "" },
        }
    }

    /// The last 256 bytes of what is in front of an offset, on whatever line.
    pub(crate) fn before(text: &'a str, end: usize) -> &'a str {
        let from = (end.saturating_sub(REACH)..=end).find(|at| text.is_char_boundary(*at));
        text.get(from.unwrap_or(end)..end).unwrap_or("")
    }

    /// Whether `sign` follows the part, with blanks between or without.
    pub(crate) fn is_followed_by(&self, sign: &str) -> bool {
        self.after.trim_start().starts_with(sign)
    }

    /// The word around the beginning of the part, made of characters that `is_part` takes: its text
    /// and the offset in the line at which it begins.
    pub(crate) fn word(&self, is_part: impl Fn(char) -> bool) -> (String, usize) {
        let from = self.before.trim_end_matches(&is_part).len();
        let mut word = self.before.get(from..).unwrap_or("").to_owned();
        word.extend(self.at.chars().chain(self.after.chars()).take_while(|c| is_part(*c)));
        (word, from)
    }
}

#[cfg(test)]
mod tests {
    use super::Surroundings;

    #[test]
    fn only_the_line_is_seen() {
        let text = "one\nP1 = TWO (3)\nfour";
        let start = text.find("TWO").unwrap();
        let found = Surroundings::new(text, start, start + 3);
        assert_eq!(found, Surroundings { before: "P1 = ", at: "TWO", after: " (3)" });
        assert!(found.is_followed_by("("));
        let inside = Surroundings::new(text, start + 1, start + 2);
        assert_eq!(inside.word(char::is_alphabetic), ("TWO".to_owned(), 5));
        let none = Surroundings::new(text, 100, 200);
        assert_eq!(none, Surroundings { before: "", at: "", after: "" });
    }

    #[test]
    fn a_long_line_is_seen_in_part() {
        let text = "é".repeat(1000);
        let found = Surroundings::new(&text, 1000, 1002);
        assert_eq!((found.before.len(), found.at, found.after.len()), (256, "é", 256));
    }
}
