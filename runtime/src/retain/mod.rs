//! Reads and writes the retained file (`--retain`), which holds the data that survives power-off.
//!
//! The file is never half written: the new contents are written to a file beside it, forced to the
//! disk, and then take the old file's place. A second copy, `FILE.bak`, is written in the same way;
//! it is used where the file is damaged. Both have a checksum.

use std::fs;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use plcc_abi::Dialect;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::files::{Durable, replace};

/// The first bytes of every such file.
const MAGIC: [u8; 8] = *b"PLCCRET1";
/// Bytes of the header: magic and checksum.
const HEADER: usize = 12;

#[derive(Serialize, Deserialize)]
struct Content {
    dialect: Dialect,
    payload: Vec<u8>,
}

/// What is found in a retained file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Retained {
    /// The bytes that [`Executive::retained`](crate::Executive::retained) gave.
    pub payload: Vec<u8>,
    /// What is wrong with the file itself, where the second copy was used in its place.
    pub damaged: Option<String>,
}

/// Why a retained file can't be used.
#[derive(Debug, Error)]
pub enum RetainError {
    /// Neither it nor its copy is whole.
    #[error(
        "{0} can't be used as the retained file ({1}), nor can its copy {2} ({3}); if --retain names \
         the right file, put back a saved copy, or remove both to begin with nothing retained"
    )]
    Damaged(PathBuf, String, PathBuf, String),
    /// It is of another language.
    #[error("the retained file {0} belongs to a program in another language ({1})")]
    Foreign(PathBuf, &'static str),
    /// It can't be read or written.
    #[error("the retained file {0} can't be {1}: {2}")]
    Io(PathBuf, &'static str, io::Error),
}

/// Where the second copy is.
pub(crate) fn copy_of(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".bak");
    name.into()
}

/// The content of a retained file, or what is wrong with its bytes.
fn open(bytes: &[u8]) -> Result<Content, String> {
    let (magic, rest) = bytes.split_at_checked(MAGIC.len()).ok_or("it is cut short")?;
    if magic != MAGIC {
        return Err("it is no retained file".into());
    }
    let (sum, body) = rest.split_first_chunk().ok_or("it is cut short")?;
    if u32::from_le_bytes(*sum) != crc32fast::hash(body) {
        return Err("its checksum is wrong".into());
    }
    postcard::from_bytes(body).map_err(|_| "its content is of another version".into())
}

/// Reads the retained file of a program, or its copy; nothing where there is neither.
///
/// # Errors
/// When it can't be read, is of another dialect, or neither it nor its copy is whole.
pub fn load(path: &Path, dialect: Dialect) -> Result<Option<Retained>, RetainError> {
    let copy = copy_of(path);
    let read = |path: &Path| match fs::read(path) {
        Ok(bytes) => Ok(Some(bytes)),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(None),
        Err(error) => Err(RetainError::Io(path.to_owned(), "read", error)),
    };
    let first = match read(path)? {
        Some(bytes) => open(&bytes),
        None => Err("it is missing".into()),
    };
    let (content, damaged) = match first {
        Ok(content) => (content, None),
        Err(why) => match read(&copy)?.map(|bytes| open(&bytes)) {
            Some(Ok(content)) => (content, Some(why)),
            Some(Err(worse)) => {
                return Err(RetainError::Damaged(path.to_owned(), why, copy, worse));
            }
            None if !path.exists() => return Ok(None),
            None => {
                let missing = "it is missing".to_owned();
                return Err(RetainError::Damaged(path.to_owned(), why, copy, missing));
            }
        },
    };
    if content.dialect != dialect {
        return Err(RetainError::Foreign(path.to_owned(), content.dialect.name()));
    }
    Ok(Some(Retained { payload: content.payload, damaged }))
}

/// Writes the retained file and its copy.
///
/// # Errors
/// When one can't be written; the old ones then are whole still.
pub fn store(path: &Path, dialect: Dialect, payload: Vec<u8>) -> Result<(), RetainError> {
    let io = |error| RetainError::Io(path.to_owned(), "written", error);
    let body = postcard::to_allocvec(&Content { dialect, payload })
        .map_err(|error| io(io::Error::other(error)))?;
    let mut bytes = Vec::with_capacity(HEADER + body.len());
    bytes.extend(MAGIC);
    bytes.extend(crc32fast::hash(&body).to_le_bytes());
    bytes.extend(body);
    replace(path, &bytes, Durable::Yes).map_err(io)?;
    replace(&copy_of(path), &bytes, Durable::Yes).map_err(io)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A folder that goes away with the test.
    struct Folder(PathBuf);

    impl Folder {
        fn new(name: &str) -> Self {
            let path = std::env::temp_dir().join(format!("plcc-{name}-{}", std::process::id()));
            fs::create_dir_all(&path).unwrap();
            Self(path)
        }
    }

    impl Drop for Folder {
        fn drop(&mut self) {
            let _ = fs::remove_dir_all(&self.0);
        }
    }

    fn load(path: &Path) -> Result<Option<Retained>, RetainError> {
        super::load(path, Dialect::Nct)
    }

    #[test]
    fn retained_data_that_was_stored_is_found() {
        let folder = Folder::new("stored");
        let file = folder.0.join("kept");
        assert!(load(&file).unwrap().is_none());
        store(&file, Dialect::Nct, vec![1, 2, 3]).unwrap();
        store(&file, Dialect::Nct, vec![4; 5000]).unwrap();
        let whole = Retained { payload: vec![4; 5000], damaged: None };
        assert_eq!(load(&file).unwrap(), Some(whole));
        assert_eq!(fs::read_dir(&folder.0).unwrap().count(), 2, "nothing is left over");
    }

    #[test]
    fn the_copy_stands_in_for_a_damaged_file() {
        let folder = Folder::new("damaged");
        let file = folder.0.join("kept");
        store(&file, Dialect::Nct, vec![7; 40]).unwrap();
        let good = fs::read(&file).unwrap();
        for at in 0..good.len() {
            let mut bad = good.clone();
            bad[at] ^= 0x10;
            fs::write(&file, &bad).unwrap();
            let found = load(&file).unwrap().unwrap();
            assert_eq!(found.payload, [7; 40]);
            assert!(found.damaged.is_some(), "byte {at}");
            fs::write(&file, &good[..at]).unwrap();
            assert!(load(&file).unwrap().unwrap().damaged.is_some(), "cut at {at}");
        }
        fs::remove_file(&file).unwrap();
        let found = load(&file).unwrap().unwrap();
        assert_eq!(found.damaged.as_deref(), Some("it is missing"));
        fs::write(&file, "").unwrap();
        fs::write(copy_of(&file), "nonsense").unwrap();
        assert!(matches!(load(&file), Err(RetainError::Damaged(..))));
        fs::remove_file(copy_of(&file)).unwrap();
        assert!(matches!(load(&file), Err(RetainError::Damaged(..))));
    }

    #[test]
    fn other_languages_are_refused() {
        let folder = Folder::new("foreign");
        let file = folder.0.join("kept");
        store(&file, Dialect::Pmac, vec![]).unwrap();
        assert!(matches!(load(&file), Err(RetainError::Foreign(_, "pmac"))));
    }
}
