//! Where reading goes on behind an error: the next statement of the same line, or the line's end.
//!
//! Each statement that has an error is told, but none twice. So a word only counts as a statement's
//! beginning where it can't be the rest of the wrong one: outside parentheses and quotes, and behind
//! something that an expression can end with.

/// Words that shape the program.
const SHAPES: &[&str] = &["ENDI", "ENDW", "END IF", "END W", "ELSE", "IF", "WHILE", "CLOSE"];

/// Words that begin a statement when `PLC` follows, of which three letters are enough.
const SWITCHES: &[&str] = &["ENABLE", "DISABLE", "PAUSE", "RESUME"];

/// Words that begin a statement when a text follows.
const TEXTS: &[&str] =
    &["COMMAND", "COMM", "CMD", "SEND", "SENDS", "SENDP", "SENDR", "SENDA", "DISPLAY", "DISP"];

/// So many bytes of a line are looked ahead into, however many errors it has.
const FAR: usize = 1024;

/// The offset of the next statement behind `pos`, or of the line's end, in `text`, where the wrong
/// statement begins at `start`. On-line text has no words that shape a program.
pub(super) fn next_statement(text: &str, start: usize, pos: usize, online: bool) -> usize {
    let bytes = text.as_bytes();
    let byte = |at: usize| bytes.get(at).copied().unwrap_or(b'\n');
    let starts = |at: usize, words: &[&str]| {
        words.iter().any(|word| {
            bytes.get(at..at + word.len()).is_some_and(|b| b.eq_ignore_ascii_case(word.as_bytes()))
        })
    };
    let (mut depth, mut quoted) = (0usize, false);
    // Whether a condition's parentheses are still to come.
    let mut awaited = starts(start, &["IF", "WHI", "AND", "OR"]);
    // Quotes that are left: where their number is odd, one of them is missing.
    let line = bytes.iter().skip(pos).take(FAR).take_while(|b| **b != b'\n');
    let mut quotes = line.filter(|b| **b == b'"').count();
    let mut letter = false;
    let mut last = b'\n';
    let mut at = start;
    while at < text.len() {
        let here = byte(at);
        if here == b'\n' {
            if at >= pos {
                return at;
            }
            quoted = false;
        }
        if !quoted && !letter {
            if at >= pos && at > start && !online && starts(at, SHAPES) {
                return at;
            }
            if depth == 0 && starts(at, &["AND", "OR"]) {
                awaited = true;
            }
            let ends = last.is_ascii_alphanumeric() || matches!(last, b')' | b'"' | b'.');
            let rest = bytes.get(at..).unwrap_or(&[]);
            let open = depth > 0 || awaited || quotes % 2 != 0;
            if at >= pos && at > start && !open && ends && begins(rest) {
                return at;
            }
        }
        match here {
            b'"' => {
                quoted = !quoted;
                quotes -= usize::from(at >= pos && quotes > 0);
            }
            b'(' if !quoted => depth += 1,
            b')' if !quoted => {
                depth = depth.saturating_sub(1);
                awaited &= depth != 0;
            }
            _ => {}
        }
        letter = here.is_ascii_alphabetic() || here == b'_';
        if here > b' ' {
            last = here;
        }
        at += 1;
    }
    text.len()
}

/// Whether a text begins with an assignment or a statement that can't be taken for anything else.
fn begins(text: &[u8]) -> bool {
    let letters = text.iter().take_while(|b| b.is_ascii_alphabetic()).count();
    let (word, rest) = text.split_at(letters);
    let is = |words: &[&str]| words.iter().any(|w| word.eq_ignore_ascii_case(w.as_bytes()));
    let rest = rest.trim_ascii_start();
    match word {
        [b'P' | b'Q' | b'M' | b'I' | b'L' | b'p' | b'q' | b'm' | b'i' | b'l'] => assigned(rest),
        _ if is(TEXTS) => matches!(rest.first(), Some(b'"' | b'^')),
        _ if is(&["ADDRESS", "ADDR", "ADR"]) => matches!(rest.first(), Some(b'#' | b'&')),
        _ => {
            let upper = word.to_ascii_uppercase();
            let glued = upper.strip_suffix(b"PLCC").or_else(|| upper.strip_suffix(b"PLC"));
            let switch = glued.unwrap_or(&upper);
            let follows = rest.get(..3).is_some_and(|b| b.eq_ignore_ascii_case(b"PLC"));
            (glued.is_some() || follows)
                && switch.len() >= 3
                && SWITCHES.iter().any(|word| word.as_bytes().starts_with(switch))
        }
    }
}

/// Whether a number, a range or an expression in parentheses stands here, and then `=`.
fn assigned(text: &[u8]) -> bool {
    let number = |b: &&u8| b.is_ascii_digit() || matches!(b, b'.' | b',');
    let mut length = text.iter().take_while(number).count();
    if text.first() == Some(&b'(') {
        let mut depth = 0usize;
        for byte in text.iter().take_while(|b| !matches!(b, b'\n' | b'"')) {
            length += 1;
            match byte {
                b'(' => depth += 1,
                b')' => depth -= 1,
                _ => {}
            }
            if depth == 0 {
                break;
            }
        }
        if depth != 0 {
            return false;
        }
    }
    let rest = text.get(length..).unwrap_or(&[]).trim_ascii_start();
    let rest = rest
        .strip_prefix(b"|")
        .or(rest.strip_prefix(b"&"))
        .or(rest.strip_prefix(b"^"))
        .unwrap_or(rest);
    length > 0 && rest.first() == Some(&b'=')
}
