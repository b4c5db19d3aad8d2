//! Finding an included file.

use std::path::{Path, PathBuf};

use super::FileLoader;

/// An included file that was found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Included {
    /// Its path, with capital and small letters as they are on disk.
    pub path: PathBuf,
    /// Its bytes.
    pub bytes: Vec<u8>,
}

/// Finds the file that a source at `includer` names as `written`.
///
/// The path, without a drive letter and without a `/` at its front, is tried in the includer's folder,
/// each time with one more folder left out at its front: for `c:\oem\f.pmi` these are `oem/f.pmi` and
/// `f.pmi`. Then the same is done in each of `dirs`. A path from the root of the file system is never
/// tried as it is, so that a source can't name any file of the computer.
/// Capital and small letters are the same unless the exact spelling exists; `\` separates folders
/// as `/` does.
///
/// `None` if no file is found that `loader` can read.
pub fn find_include(
    loader: &dyn FileLoader,
    includer: &Path,
    written: &str,
    dirs: &[PathBuf],
) -> Option<Included> {
    let slashed = written.trim().replace('\\', "/");
    let without_drive = match slashed.as_bytes() {
        [drive, b':', ..] if drive.is_ascii_alphabetic() => slashed.get(2..).unwrap_or(""),
        _ => &slashed,
    };
    let parts: Vec<&str> =
        without_drive.split('/').filter(|p| !p.is_empty() && *p != ".").collect();
    let home = includer.parent().unwrap_or(Path::new(""));
    std::iter::once(home)
        .chain(dirs.iter().map(PathBuf::as_path))
        .find_map(|dir| (0..parts.len()).find_map(|skip| resolve(loader, dir, parts.get(skip..)?)))
}

/// Follows `parts` down from `dir`: each in its exact spelling if that exists, otherwise in other
/// capital or small letters.
fn resolve(loader: &dyn FileLoader, dir: &Path, parts: &[&str]) -> Option<Included> {
    if parts.is_empty() {
        return None;
    }
    let mut exact = dir.to_path_buf();
    exact.extend(parts);
    if let Ok(bytes) = loader.read(&exact) {
        return Some(Included { path: exact, bytes });
    }
    let mut path = dir.to_path_buf();
    for part in parts {
        if *part == ".." {
            path.push(part);
            continue;
        }
        let mut names = loader.list(&path);
        names.sort_unstable();
        let name = names
            .iter()
            .find(|name| name == part)
            .or_else(|| names.iter().find(|name| name.to_lowercase() == part.to_lowercase()))?;
        path.push(name);
    }
    let bytes = loader.read(&path).ok()?;
    Some(Included { path, bytes })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::MemoryLoader;

    fn found(written: &str) -> Option<String> {
        let loader = MemoryLoader::new()
            .with("src/main.pmi", "")
            .with("src/F.PMI", "F")
            .with("src/oem/g.pmi", "G")
            .with("lib/Oem/h.pmi", "H")
            .with("up.pmi", "U");
        find_include(&loader, Path::new("src/main.pmi"), written, &["lib".into()])
            .map(|found| found.path.to_string_lossy().into_owned())
    }

    #[test]
    fn included_files_are_found_in_any_case_and_without_their_folders() {
        assert_eq!(found("f.pmi").as_deref(), Some("src/F.PMI"));
        assert_eq!(found("c:\\OEM\\G.PMI").as_deref(), Some("src/oem/g.pmi"));
        assert_eq!(found("c:\\any\\deep\\f.pmi").as_deref(), Some("src/F.PMI"));
        for path in [
            "C:\\PLC\\F.PMI",
            "C:F.PMI",
            "d:/f.Pmi",
            ".\\F.pmi",
            "..\\PLC\\f.pmi",
            "\\\\HOST\\PLC\\F.PMI",
        ] {
            assert_eq!(found(path).as_deref(), Some("src/F.PMI"), "{path}");
        }
        assert_eq!(found("/oem/h.pmi").as_deref(), Some("lib/Oem/h.pmi"));
        assert_eq!(found("../up.pmi").as_deref(), Some("src/../up.pmi"));
    }

    #[test]
    fn a_missing_included_file_is_not_found() {
        assert_eq!(found("none.pmi"), None);
        assert_eq!(found(""), None);
        assert_eq!(found("oem"), None);
    }
}
