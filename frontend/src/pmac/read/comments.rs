//! Comments of the download program: `;` and `//` to the line's end, `/* … */` over lines.

/// Whether a text ends inside a block comment that it opens itself.
pub(super) fn ends_inside_comment(mut text: &str) -> bool {
    loop {
        let before = strip_comment(text);
        let Some(comment) = text.get(before.len()..).and_then(|c| c.strip_prefix("/*")) else {
            return false;
        };
        match comment.find("*/") {
            Some(end) => text = comment.get(end + 2..).unwrap_or(""),
            None => return true,
        }
    }
}

/// A text up to its first comment outside of quotes.
pub(super) fn strip_comment(text: &str) -> &str {
    let mut quoted = false;
    let bytes = text.as_bytes();
    for (i, &b) in bytes.iter().enumerate() {
        let next = bytes.get(i + 1);
        match b {
            b'"' => quoted = !quoted,
            b';' if !quoted => return text.get(..i).unwrap_or(text),
            b'/' if !quoted && matches!(next, Some(b'/' | b'*')) => {
                return text.get(..i).unwrap_or(text);
            }
            _ => {}
        }
    }
    text
}
