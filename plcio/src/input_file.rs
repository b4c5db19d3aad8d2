//! Files that the configuration names and that are read: regular files only, up to a size, since a device or a pipe might never end.

use std::fs::{File, OpenOptions};
use std::io::{self, Read};
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;

/// The longest configuration and the longest list of users, in bytes.
const MAX_TEXT: u64 = 16 << 20;

/// Opens a regular file to read. Opening a pipe does not wait for its other end.
///
/// # Errors
/// When it can't be opened, or is something else.
pub(crate) fn open(path: &Path) -> io::Result<File> {
    let nonblock = rustix::fs::OFlags::NONBLOCK.bits() as i32;
    let file = OpenOptions::new().read(true).custom_flags(nonblock).open(path)?;
    match file.metadata()?.is_file() {
        true => Ok(file),
        false => Err(io::Error::other("it is no regular file")),
    }
}

/// Reads a text, without the mark (BOM) that some editors put before it.
///
/// # Errors
/// When it can't be read, is no regular file, has more than 16 MiB or is not UTF-8.
pub(crate) fn read_text(path: &Path) -> io::Result<String> {
    let mut text = String::new();
    open(path)?.take(MAX_TEXT + 1).read_to_string(&mut text)?;
    if text.len() as u64 > MAX_TEXT {
        return Err(io::Error::other("it has more than 16 MiB"));
    }
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
        assert_eq!(why(Path::new("/dev/zero")), "it is no regular file");
        let fifo = folder.join("fifo");
        let made = std::process::Command::new("mkfifo").arg(&fifo).status().unwrap();
        assert!(made.success());
        assert_eq!(why(&fifo), "it is no regular file");
        let file = folder.join("file");
        File::create(&file).unwrap().set_len(MAX_TEXT + 1).unwrap();
        assert_eq!(why(&file), "it has more than 16 MiB");
        std::fs::write(&file, b"\xEF\xBB\xBFkey = 1\n").unwrap();
        assert_eq!(read_text(&file).unwrap(), "key = 1\n");
        std::fs::write(&file, b"\xFF").unwrap();
        assert!(why(&file).contains("UTF-8"));
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
