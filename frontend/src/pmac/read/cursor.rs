//! Reading preprocessed text character by character.
//!
//! There are no tokens, since the language does not separate them: statements may follow each other
//! without blanks (`P1=0P2=1`), and some words may be split (`END IF`). So each rule of the parser
//! asks the cursor for the words that it can use.

use plcc_diag::MessageText;

use crate::pmac::origin::TextRange;

/// An error in the text: its code, its place in the preprocessed text, and what to do about it.
#[derive(Clone, Debug)]
pub(crate) struct ParseError {
    pub(crate) code: &'static str,
    pub(crate) at: TextRange,
    pub(crate) message: MessageText,
    pub(crate) help: Option<MessageText>,
}

/// The end of the message that something is missing at the end of a line.
pub(crate) const MISSING: &str = "is missing after this";

/// What a rule of the parser has read, or its error.
pub(crate) type Parsed<T> = Result<T, ParseError>;

/// The error `PMAC-3` (ERR003 of the controller) at a place.
pub(crate) fn syntax<T>(at: TextRange, message: impl Into<MessageText>) -> Parsed<T> {
    Err(ParseError { code: "PMAC-3", at, message: message.into(), help: None })
}

/// The same with what to do about it.
pub(crate) fn syntax_help<T>(
    at: TextRange,
    message: impl Into<MessageText>,
    help: impl Into<MessageText>,
) -> Parsed<T> {
    Err(ParseError { code: "PMAC-3", at, message: message.into(), help: Some(help.into()) })
}

/// A place in a text.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cursor<'a> {
    text: &'a str,
    pub(crate) pos: usize,
    /// Whether line ends count as blanks. They do in buffers; an on-line command ends with its
    /// line.
    pub(crate) crosses_lines: bool,
}

impl<'a> Cursor<'a> {
    pub(crate) fn new(text: &'a str) -> Self {
        Self { text, pos: 0, crosses_lines: false }
    }

    /// The byte at the cursor; 0 at the end of the text.
    pub(crate) fn byte(&self) -> u8 {
        self.byte_at(0)
    }

    /// The byte that is `ahead` bytes further on; 0 after the end of the text.
    pub(crate) fn byte_at(&self, ahead: usize) -> u8 {
        self.text.as_bytes().get(self.pos + ahead).copied().unwrap_or(0)
    }

    pub(crate) fn at_end(&self) -> bool {
        self.pos >= self.text.len()
    }

    /// The text from the cursor on.
    pub(crate) fn rest(&self) -> &'a str {
        self.text.get(self.pos..).unwrap_or("")
    }

    /// Skips blanks, control characters, no-break spaces and byte order marks.
    pub(crate) fn blanks(&mut self) {
        while !self.at_end() {
            match self.byte() {
                b'\n' | b'\r' if !self.crosses_lines => return,
                0..=b' ' | 0x7F => self.pos += 1,
                0xC2 if self.byte_at(1) == 0xA0 => self.pos += 2,
                0xEF if self.byte_at(1) == 0xBB && self.byte_at(2) == 0xBF => self.pos += 3,
                _ => return,
            }
        }
    }

    /// Skips blanks; returns the byte after them, 0 at the end of the text.
    pub(crate) fn peek(&mut self) -> u8 {
        self.blanks();
        self.byte()
    }

    /// Takes a character, given in capitals, if it comes next after the blanks.
    pub(crate) fn eat(&mut self, byte: u8) -> bool {
        let found = self.peek().to_ascii_uppercase() == byte && !self.at_end();
        self.pos += usize::from(found);
        found
    }

    /// Whether a word is at the cursor, in any case.
    pub(crate) fn starts_with(&self, word: &str) -> bool {
        self.text
            .as_bytes()
            .get(self.pos..self.pos + word.len())
            .is_some_and(|b| b.eq_ignore_ascii_case(word.as_bytes()))
    }

    /// Takes a word if it comes next after the blanks, whatever is after it.
    pub(crate) fn eat_word(&mut self, word: &str) -> bool {
        self.blanks();
        let found = self.starts_with(word);
        if found {
            self.pos += word.len();
        }
        found
    }

    /// Takes as many letters of `word` as are after the blanks, if these are its first `least`
    /// letters at least.
    pub(crate) fn eat_abbreviated(&mut self, word: &str, least: usize) -> bool {
        self.blanks();
        let bytes = self.text.as_bytes().get(self.pos..).unwrap_or(&[]);
        let same =
            bytes.iter().zip(word.bytes()).take_while(|(a, b)| a.eq_ignore_ascii_case(b)).count();
        if same >= least {
            self.pos += same;
        }
        same >= least
    }

    /// The range from an offset to the cursor, without blanks at its end.
    pub(crate) fn since(&self, start: usize) -> TextRange {
        let text = self.text.get(start..self.pos).unwrap_or("").trim_end();
        TextRange::new(
            start,
            if text.is_empty() { self.pos.max(start) } else { start + text.len() },
        )
    }

    /// The range of the next word or other character after the blanks, for an error that points at
    /// it. Of a word it has 64 bytes at most.
    pub(crate) fn next_word(&mut self) -> TextRange {
        self.blanks();
        let rest = self.rest();
        let length = rest
            .find(|c: char| !c.is_ascii_alphanumeric() && c != '_')
            .unwrap_or(rest.len())
            .max(rest.chars().next().map_or(0, char::len_utf8))
            .min(64);
        let length = (length..rest.len()).find(|&l| rest.is_char_boundary(l)).unwrap_or(rest.len());
        TextRange::new(self.pos, self.pos + length)
    }

    /// The text of a range, with the letters that are directly in front of it.
    pub(crate) fn glued_word(&self, at: TextRange) -> &'a str {
        let before = self.text.get(..at.start as usize).unwrap_or("");
        let start = before.trim_end_matches(|c: char| c.is_ascii_alphabetic()).len();
        self.text.get(start..at.end as usize).unwrap_or("")
    }

    /// The text of a range without blanks around it, for messages.
    pub(crate) fn text_at(&self, at: TextRange) -> &'a str {
        self.text.get(at.start as usize..at.end as usize).unwrap_or("").trim()
    }

    /// The error that `wanted` is expected at the next word. If that is on a later line, the
    /// error is at the end of the line before, and the cursor goes back there.
    pub(crate) fn expected<T>(&mut self, wanted: &str) -> Parsed<T> {
        self.blanks();
        let before = self.text.get(..self.pos).unwrap_or("");
        let blank = |c: char| c.is_whitespace() || c.is_control();
        let solid = before.trim_end_matches(blank);
        if let Some(line) = before.get(solid.len()..).and_then(|gap| gap.find('\n')) {
            self.pos = solid.len() + line;
            let last = solid.chars().next_back().map_or(0, char::len_utf8);
            let at = TextRange::new(solid.len() - last, solid.len());
            return syntax(at, format!("{wanted} {MISSING}"));
        }
        self.expected_at_once(wanted)
    }

    /// The error that `wanted` is expected at the next word, on whatever line that is.
    pub(crate) fn expected_at_once<T>(&mut self, wanted: &str) -> Parsed<T> {
        let at = self.next_word();
        if let Some(c) = self.rest().chars().next().filter(|c| !c.is_ascii()) {
            return Err(ParseError {
                code: "PMAC-4",
                at: TextRange::new(self.pos, self.pos + c.len_utf8()),
                message: format!("`{c}` is not a character of this language").into(),
                help: Some("only texts in quotes and comments may hold it".into()),
            });
        }
        match self.text.get(at.start as usize..at.end as usize).unwrap_or("").trim() {
            "" => syntax(at, format!("{wanted} is expected here, not the end of the line")),
            what => syntax(at, format!("{wanted} is expected here, not `{what}`")),
        }
    }

    /// Moves to the line's end.
    pub(crate) fn skip_line(&mut self) {
        let rest = self.rest();
        self.pos += rest.find('\n').unwrap_or(rest.len());
    }

    /// Takes an unsigned integer: decimal digits, or `$` and hexadecimal ones. Values beyond 64
    /// bits become the largest. If there is none the cursor stays.
    pub(crate) fn integer(&mut self) -> Option<u64> {
        self.blanks();
        let start = self.pos;
        let (radix, digits) = match self.byte() {
            b'$' => (16, 1),
            _ => (10, 0),
        };
        self.pos += digits;
        if radix == 16 {
            self.blanks();
        }
        let from = self.pos;
        let mut value = 0u64;
        while let Some(digit) = (self.byte() as char).to_digit(radix) {
            value = value.saturating_mul(u64::from(radix)).saturating_add(u64::from(digit));
            self.pos += 1;
        }
        if self.pos == from {
            self.pos = start;
            return None;
        }
        Some(value)
    }

    /// Takes a number without a sign: decimal, perhaps with a fraction, or `$` and hexadecimal
    /// digits. If there is none the cursor stays.
    pub(crate) fn number(&mut self) -> Option<f64> {
        self.blanks();
        if self.byte() == b'$' {
            let dollar = self.pos;
            self.integer()?;
            return Some(hexadecimal(self.text.get(dollar..self.pos).unwrap_or("")));
        }
        let start = self.pos;
        let mut digits = 0;
        while self.byte().is_ascii_digit() {
            self.pos += 1;
            digits += 1;
        }
        // Two points are a range, not a fraction.
        if self.byte() == b'.' && self.byte_at(1) != b'.' {
            self.pos += 1;
            while self.byte().is_ascii_digit() {
                self.pos += 1;
                digits += 1;
            }
        }
        if digits == 0 {
            self.pos = start;
            return None;
        }
        let text = self.text.get(start..self.pos).unwrap_or("");
        // Decimal digits with one point always parse; very many of them make an infinity.
        let value: f64 = text.parse().unwrap_or(0.0);
        Some(if value.is_finite() { value } else { f64::MAX })
    }
}

/// The double that is nearest to hexadecimal digits, ties to even; what is not a digit does not count.
/// Beyond all doubles it is the largest.
fn hexadecimal(text: &str) -> f64 {
    // The first 60 bits or so decide, with one bit more that says whether anything follows them.
    let (mut head, mut dropped, mut rest) = (0u64, 0i32, false);
    for digit in text.chars().filter_map(|c| c.to_digit(16)) {
        if head >> 58 == 0 {
            head = head << 4 | u64::from(digit);
        } else {
            dropped = dropped.saturating_add(4);
            rest |= digit != 0;
        }
    }
    // The head has 59 bits at least where something was dropped, so its last bit is below half the
    // last place of a double.
    let nearest = (head | u64::from(rest)) as f64;
    let value = nearest * 2f64.powi(dropped);
    if value.is_finite() { value } else { f64::MAX }
}

#[cfg(test)]
mod tests {
    use super::Cursor;

    #[test]
    fn long_hexadecimal_constants_become_the_nearest_double() {
        let number = |text: &str| Cursor::new(text).number();
        assert_eq!(number("$FF"), Some(255.0));
        assert_eq!(number("$ 0ff"), Some(255.0));
        assert_eq!(number("$10000000000000000"), Some(18_446_744_073_709_551_616.0));
        assert_eq!(number("$FFFFFFFFFFFFFFFFFFFF"), Some(2f64.powi(80)));
        // Half of the last place: to even, but up where anything follows.
        assert_eq!(number("$20000000000001"), Some(2f64.powi(53)));
        assert_eq!(number("$20000000000003"), Some(2f64.powi(53) + 4.0));
        assert_eq!(number("$2000000000000100000000"), Some(2f64.powi(85)));
        let above = 2f64.powi(85) + 2f64.powi(33);
        assert_eq!(number("$2000000000000100000001"), Some(above));
        assert_eq!(number(&format!("$1{}", "0".repeat(300))), Some(f64::MAX));
        assert_eq!(number(&format!("${}", "0".repeat(300))), Some(0.0));
        assert_eq!(number("$"), None);
    }
}
