//! Reads a log while it is written: the lines that are new, and the last ones.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

/// The longest line; of a longer one the end is missing.
const MAX_LINE: usize = 1 << 16;
/// How many bytes are read at once.
const BLOCK: usize = 1 << 16;

/// Opens a regular file.
fn open(path: &Path) -> io::Result<(File, std::fs::Metadata)> {
    let file = plcc_files::open_regular(path)?;
    let about = file.metadata()?;
    Ok((file, about))
}

/// Lines that are appended to a file.
pub(super) struct LogTail {
    path: PathBuf,
    /// The file with its inode and the position up to which it was read.
    file: Option<(File, u64, u64)>,
    /// The beginning of a line whose end is not there yet.
    line: Vec<u8>,
}

impl LogTail {
    /// Begins at the present end of the file, or at the beginning of one that is made later.
    pub(super) fn new(path: PathBuf) -> Self {
        let file = open(&path).ok().map(|(file, about)| (file, about.ino(), about.len()));
        Self { path, file, line: vec![] }
    }

    /// The lines that are new, at most a block of them. A file that has been replaced or emptied is read from its beginning.
    pub(super) fn new_lines(&mut self) -> Vec<String> {
        let now = std::fs::metadata(&self.path).ok().map(|about| (about.ino(), about.len()));
        let same = |&(_, inode, at): &(File, u64, u64)| {
            now.is_none_or(|(other, size)| other == inode && size >= at)
        };
        if !self.file.as_ref().is_some_and(same) {
            self.line.clear();
            self.file = open(&self.path).ok().map(|(file, about)| (file, about.ino(), 0));
        }
        let Some((file, _, at)) = &mut self.file else { return vec![] };
        let mut block = vec![0; BLOCK];
        let read = file.seek(SeekFrom::Start(*at)).and_then(|_| file.read(&mut block));
        let Ok(size) = read else { return vec![] };
        *at += size as u64;
        let mut lines = vec![];
        for &byte in block.iter().take(size) {
            if byte == b'\n' {
                lines.push(String::from_utf8_lossy(&self.line).into_owned());
                self.line.clear();
            } else if self.line.len() < MAX_LINE {
                self.line.push(byte);
            }
        }
        lines
    }
}

/// The last lines of a file, at most a block of them.
pub(super) fn last_lines(path: &Path) -> Vec<String> {
    let read = || -> io::Result<Vec<u8>> {
        let (mut file, about) = open(path)?;
        let from = about.len().saturating_sub(BLOCK as u64);
        file.seek(SeekFrom::Start(from))?;
        let mut bytes = vec![];
        file.take(BLOCK as u64).read_to_end(&mut bytes)?;
        // The first line is cut, unless the whole file was read.
        let whole = if from == 0 { Some(0) } else { bytes.iter().position(|&byte| byte == b'\n') };
        Ok(bytes.split_off(whole.unwrap_or(bytes.len())))
    };
    let bytes = read().unwrap_or_default();
    let text = String::from_utf8_lossy(&bytes);
    text.lines().filter(|line| !line.is_empty()).map(str::to_owned).collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use std::fs::OpenOptions;
    use std::io::Write;

    use super::*;

    #[test]
    fn new_lines_of_a_file_that_grows_is_replaced_and_emptied() {
        let folder = std::env::temp_dir().join(format!("plcio-log-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let path = folder.join("log.jsonl");
        let append = |text: &str| {
            let mut file = OpenOptions::new().create(true).append(true).open(&path).unwrap();
            file.write_all(text.as_bytes()).unwrap();
        };
        append("old\n");
        let mut tail = LogTail::new(path.clone());
        assert!(tail.new_lines().is_empty());
        append("a\nb");
        assert_eq!(tail.new_lines(), ["a"]);
        append("c\n");
        assert_eq!(tail.new_lines(), ["bc"]);
        assert_eq!(last_lines(&path), ["old", "a", "bc"]);
        std::fs::rename(&path, folder.join("log.1")).unwrap();
        assert!(tail.new_lines().is_empty());
        append("new\n");
        assert_eq!(tail.new_lines(), ["new"]);
        std::fs::write(&path, "x\n").unwrap();
        assert_eq!(tail.new_lines(), ["x"], "it was emptied");
        append(&"y".repeat(3 * MAX_LINE));
        append("\nend\n");
        let mut lines = vec![];
        while lines.last().is_none_or(|line| line != "end") {
            lines.extend(tail.new_lines());
        }
        assert_eq!((lines.len(), lines.first().map(String::len)), (2, Some(MAX_LINE)));
        assert_eq!(last_lines(&path), ["end"], "a line that is cut is left out");
        assert!(last_lines(&folder).is_empty() && last_lines(&folder.join("none")).is_empty());
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
