//! Decodes source files as the DOS and Windows tools of the time wrote them.

/// Decodes a source file: UTF-8 with or without a byte order mark, UTF-16 with one, and everything
/// else as Windows-1252, in which every byte has a meaning.
///
/// DOS tools end a file with the character Ctrl-Z and may fill the rest of a disk block with
/// further ones or with NUL; at the end of the text these are dropped. Line ends stay as they are.
pub(crate) fn decode(bytes: &[u8]) -> String {
    let (text, _, had_errors) = encoding_rs::UTF_8.decode(bytes);
    let text = if had_errors {
        // An editor may have put the mark of UTF-8 in front of a text that it did not convert.
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
    fn utf8_is_read_with_and_without_byte_order_mark() {
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
    fn utf16_is_read_with_byte_order_mark() {
        assert_eq!(decode(b"\xff\xfeA\0=\0"), "A=");
    }
}
