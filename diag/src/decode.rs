//! Bytes to text, as the tools of the time wrote them.

/// Decodes a source: UTF-8 with or without a byte order mark, UTF-16 with one, else Windows-1252.
///
/// A DOS end-of-file mark (Ctrl-Z) and whatever stands behind it at the very end (only NUL or
/// further Ctrl-Z, as old editors pad with) is dropped. Line ends stay as they are.
pub(crate) fn decode(bytes: &[u8]) -> String {
    let (text, _, had_errors) = encoding_rs::UTF_8.decode(bytes);
    let text = if had_errors {
        // An editor may have put a mark in front of what it did not convert.
        let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        encoding_rs::WINDOWS_1252.decode_without_bom_handling(bytes).0
    } else {
        text
    };
    text.trim_end_matches(['\u{1a}', '\0']).to_owned()
}

#[cfg(test)]
mod tests {
    use super::decode;

    #[test]
    fn utf8_with_and_without_mark() {
        assert_eq!(decode(b"\xef\xbb\xbfA=1\r\n"), "A=1\r\n");
        assert_eq!(decode("é".as_bytes()), "é");
    }

    #[test]
    fn what_is_not_utf8_is_windows_1252() {
        assert_eq!(decode(b"\x93A\x94 \x96"), "\u{201c}A\u{201d} \u{2013}");
        assert_eq!(decode(b"\xef\xbb\xbf\x93A"), "\u{201c}A");
    }

    #[test]
    fn dos_end_of_file_is_dropped() {
        assert_eq!(decode(b"A=1\r\n\x1a\x1a\0"), "A=1\r\n");
    }

    #[test]
    fn utf16_with_mark() {
        assert_eq!(decode(b"\xff\xfeA\0=\0"), "A=");
    }
}
