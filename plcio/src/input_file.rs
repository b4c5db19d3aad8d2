//! Texts that the configuration names and that are read.

use std::io;
use std::path::Path;

use plcc_files::read_regular;

/// The longest configuration and the longest list of users, in bytes.
const MAX_TEXT: u64 = 16 << 20;

/// Reads a text, without the mark (BOM) that some editors put before it.
///
/// # Errors
/// When it can't be read, is not a regular file, has more than 16 MiB or is not UTF-8.
pub(crate) fn read_text(path: &Path) -> io::Result<String> {
    let bytes = read_regular(path, MAX_TEXT)?;
    let text = String::from_utf8(bytes);
    let text = text.map_err(|_| io::Error::new(io::ErrorKind::InvalidData, "it is not UTF-8"))?;
    Ok(text.strip_prefix('\u{feff}').map(str::to_owned).unwrap_or(text))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn only_regular_files_up_to_a_size_are_read() {
        let folder = std::env::temp_dir().join(format!("plcio-input-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let why = |path: &Path| read_text(path).unwrap_err().to_string();
        assert_eq!(why(Path::new("/dev/zero")), "it is a device; only regular files are read");
        let fifo = folder.join("fifo");
        let made = std::process::Command::new("mkfifo").arg(&fifo).status().unwrap();
        assert!(made.success());
        assert_eq!(why(&fifo), "it is a pipe (FIFO); only regular files are read");
        let file = folder.join("file");
        std::fs::File::create(&file).unwrap().set_len(MAX_TEXT + 1).unwrap();
        assert_eq!(why(&file), "it has more than 16 MiB");
        std::fs::write(&file, b"\xEF\xBB\xBFkey = 1\n").unwrap();
        assert_eq!(read_text(&file).unwrap(), "key = 1\n");
        std::fs::write(&file, b"\xFF").unwrap();
        assert!(why(&file).contains("UTF-8"));
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
