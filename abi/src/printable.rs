//! Texts from outside, made safe for a terminal.

use alloc::borrow::Cow;
use alloc::string::String;

/// The text without characters that a terminal obeys instead of showing them: control characters
/// (but line feeds and tabs) and those that change the direction of text. Each is replaced by a
/// character of as many bytes in UTF-8, so that places in the text stay what they are: `?` (1 byte),
/// `·` (2 bytes) or U+FFFD (3 bytes).
///
/// Every text that comes from a source, an artifact or another file goes through this function
/// before people see it. Otherwise a source could clear the screen, rename the window or hide its
/// own errors.
///
/// ```
/// use plcc_abi::printable;
///
/// assert_eq!(printable("A\u{1b}[2J\u{9b}1m\u{202e}B"), "A?[2J·1m\u{fffd}B");
/// assert_eq!(printable("É = 1\n"), "É = 1\n");
/// ```
pub fn printable(text: &str) -> Cow<'_, str> {
    if !text.chars().any(is_obeyed) {
        return Cow::Borrowed(text);
    }
    let shown = |character: char| match (is_obeyed(character), character.len_utf8()) {
        (false, _) => character,
        (true, 1) => '?',
        (true, 2) => '·',
        (true, _) => '\u{fffd}',
    };
    Cow::Owned(text.chars().map(shown).collect::<String>())
}

/// Whether a terminal does something on a character instead of showing it.
fn is_obeyed(character: char) -> bool {
    match character {
        '\n' | '\t' => false,
        // Marks, embeddings, overrides and isolates of text direction; line and paragraph separators.
        '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}' => {
            true
        }
        _ => character.is_control(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_character_that_is_obeyed_is_left_and_lengths_stay() {
        for character in '\0'..='\u{ffff}' {
            let mut bytes = [0; 4];
            let text: &str = character.encode_utf8(&mut bytes);
            let shown = printable(text);
            assert_eq!(shown.len(), text.len(), "{character:?}");
            assert!(!shown.chars().any(is_obeyed), "{character:?}");
        }
        assert_eq!(printable("\u{7}\r\u{7f}\u{85}\t\n"), "???·\t\n");
    }
}
