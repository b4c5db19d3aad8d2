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

/// Where the comments of a file's text begin and end. A block comment that nothing closes ends with its line, as the
/// preprocessor has it.
pub(crate) fn comments(text: &str) -> Vec<(usize, usize)> {
    let bytes = text.as_bytes();
    let line_end = |from: usize| {
        let rest = text.get(from..).unwrap_or("");
        from + rest.find(['\r', '\n']).unwrap_or(rest.len())
    };
    let (mut found, mut quoted, mut at) = (vec![], false, 0);
    // Once a block comment is not closed, no later one is.
    let mut closes = true;
    while let Some(&b) = bytes.get(at) {
        let next = bytes.get(at + 1);
        match b {
            b'\r' | b'\n' => quoted = false,
            b'"' => quoted = !quoted,
            b'/' if !quoted && next == Some(&b'*') => {
                let rest = text.get(at + 2..).filter(|_| closes);
                let close = rest.and_then(|rest| rest.find("*/")).map(|close| at + close + 4);
                closes = close.is_some();
                let end = close.unwrap_or_else(|| line_end(at));
                found.push((at, end));
                at = end;
                continue;
            }
            b';' | b'/' if !quoted && (b == b';' || next == Some(&b'/')) => {
                let end = line_end(at);
                found.push((at, at + text.get(at..end).unwrap_or("").trim_end().len()));
                at = end;
                continue;
            }
            _ => {}
        }
        at += 1;
    }
    found
}

#[cfg(test)]
mod tests {
    use super::comments;

    #[test]
    fn comments_are_found_outside_of_quotes() {
        let text = "P1=1 ; one \nSEND\"a;b\" // two\n/* three\n*/P2=3/*four\nP3=1";
        let found: Vec<&str> =
            comments(text).into_iter().map(|(start, end)| text.get(start..end).unwrap()).collect();
        assert_eq!(found, ["; one", "// two", "/* three\n*/", "/*four"]);
    }
}
