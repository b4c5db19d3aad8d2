//! Messages as they go over a stream: a header with the length of the text, then the text, JSON
//! (Debug Adapter Protocol, Base Protocol).

use std::io::{self, BufRead, Write};

use serde_json::Value;

/// A message with more bytes is refused.
const MAX_BYTES: usize = 64 << 20;

/// The longest line of a header.
const MAX_HEADER: u64 = 4096;

/// Reads a message; `None` at the end of the stream. A text that is not JSON is `Null`.
///
/// # Errors
/// When the stream fails, ends in a message, or has no valid header.
pub(super) fn read(from: &mut impl BufRead) -> io::Result<Option<Value>> {
    let wrong = |what: &str| io::Error::new(io::ErrorKind::InvalidData, what.to_owned());
    let mut length = None;
    let mut is_first = true;
    loop {
        let mut line = vec![];
        io::Read::take(&mut *from, MAX_HEADER).read_until(b'\n', &mut line)?;
        if line.is_empty() && is_first {
            return Ok(None);
        }
        if line.last() != Some(&b'\n') {
            return Err(wrong("a message ends in its header"));
        }
        is_first = false;
        let line = String::from_utf8_lossy(&line);
        let line = line.trim();
        if line.is_empty() {
            break;
        }
        if let Some((name, value)) = line.split_once(':')
            && name.trim().eq_ignore_ascii_case("content-length")
        {
            length = value.trim().parse::<usize>().ok();
        }
    }
    let length = length.ok_or_else(|| wrong("a message has no valid Content-Length"))?;
    if length > MAX_BYTES {
        return Err(wrong("a message is longer than 64 MiB"));
    }
    let mut text = vec![0; length];
    from.read_exact(&mut text)?;
    Ok(Some(serde_json::from_slice(&text).unwrap_or(Value::Null)))
}

/// Writes a message.
///
/// # Errors
/// When the stream fails.
pub(super) fn write(to: &mut impl Write, message: &Value) -> io::Result<()> {
    let text = message.to_string();
    write!(to, "Content-Length: {}\r\n\r\n{text}", text.len())?;
    to.flush()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(mut bytes: &[u8]) -> (Vec<Value>, bool) {
        let mut messages = vec![];
        loop {
            match read(&mut bytes) {
                Ok(Some(message)) => messages.push(message),
                Ok(None) => return (messages, true),
                Err(_) => return (messages, false),
            }
        }
    }

    #[test]
    fn what_is_written_reads_back() {
        let mut bytes = vec![];
        for message in [serde_json::json!({"seq": 1}), serde_json::json!("é")] {
            write(&mut bytes, &message).unwrap();
        }
        let (messages, ended) = all(&bytes);
        assert_eq!(messages, [serde_json::json!({"seq": 1}), serde_json::json!("é")]);
        assert!(ended);
    }

    #[test]
    fn bad_streams_end_with_an_error() {
        let (messages, ended) = all(b"content-length: 2\nX: y\n\n{}Content-Length: 3\r\n\r\n{x}");
        assert_eq!(messages, [serde_json::json!({}), Value::Null]);
        assert!(ended);
        for bytes in [
            &b"Content-Length: 5\r\n\r\n{}"[..],
            b"Content-Length: x\r\n\r\n{}",
            b"Content-Length: 99999999999\r\n\r\n{}",
            b"\r\n\r\n",
            b"Content-Le",
            &[b'a'; 5000],
        ] {
            assert_eq!(all(bytes), (vec![], false), "{}", String::from_utf8_lossy(bytes));
        }
    }
}
