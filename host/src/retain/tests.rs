//! Retained files on the real disk: generations, copies, locks, links and permissions.

use std::fs;

use super::*;

/// A folder that goes away with the test.
struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn file(&self) -> PathBuf {
        self.0.path().join("kept")
    }

    fn copy(&self) -> PathBuf {
        self.0.path().join("kept.bak")
    }

    /// The names of all files, sorted.
    fn names(&self) -> Vec<String> {
        let entries = fs::read_dir(self.0.path()).unwrap();
        let mut names: Vec<String> =
            entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }
}

fn load(path: &Path) -> Result<Option<Retained>, RetainError> {
    RetainedFile::open(path, Dialect::Nct)?.load()
}

fn store(path: &Path, payload: &[u8]) -> Result<(), RetainError> {
    RetainedFile::open(path, Dialect::Nct)?.store(payload)
}

#[test]
fn retained_data_that_was_stored_is_found() {
    let folder = Folder::new();
    let mut file = RetainedFile::open(&folder.file(), Dialect::Nct).unwrap();
    assert_eq!(file.load().unwrap(), None);
    file.store(&[1, 2, 3]).unwrap();
    file.store(&[4; 5000]).unwrap();
    drop(file);
    let saved = Retained { payload: vec![4; 5000], generation: 2, warnings: vec![] };
    assert_eq!(load(&folder.file()).unwrap(), Some(saved));
    assert_eq!(folder.names(), ["kept", "kept.bak"], "nothing is left over");
}

#[test]
fn generations_go_on_in_the_next_process() {
    let folder = Folder::new();
    for generation in 1..4 {
        let mut file = RetainedFile::open(&folder.file(), Dialect::Nct).unwrap();
        file.load().unwrap();
        file.store(&[5]).unwrap();
        assert_eq!(file.load().unwrap().unwrap().generation, generation);
    }
}

#[test]
fn the_copy_stands_in_for_a_damaged_file() {
    let folder = Folder::new();
    let (file, copy) = (folder.file(), folder.copy());
    store(&file, &[7; 40]).unwrap();
    let good = fs::read(&file).unwrap();
    for at in 0..good.len() {
        let mut bad = good.clone();
        bad[at] ^= 0x10;
        for bad in [&bad, &good[..at]] {
            fs::write(&file, bad).unwrap();
            let found = load(&file).unwrap().unwrap();
            assert_eq!(found.payload, [7; 40]);
            assert!(found.warnings[0].contains("the copy of the retained file"), "byte {at}");
        }
    }
    fs::remove_file(&file).unwrap();
    let found = load(&file).unwrap().unwrap();
    assert!(found.warnings[0].contains("it is missing"), "{found:?}");
    fs::write(&file, "").unwrap();
    fs::write(&copy, "nonsense").unwrap();
    assert!(matches!(load(&file), Err(RetainError::Damaged { .. })));
    fs::remove_file(&copy).unwrap();
    assert!(matches!(load(&file), Err(RetainError::Damaged { .. })));
}

#[test]
fn a_damaged_copy_is_told_and_the_file_is_used() {
    let folder = Folder::new();
    let (file, copy) = (folder.file(), folder.copy());
    store(&file, &[7; 40]).unwrap();
    let good = fs::read(&copy).unwrap();
    for (bytes, word) in [(&good[..9], "cut short"), (&b"nonsense"[..], "not a retained file")] {
        fs::write(&copy, bytes).unwrap();
        let found = load(&file).unwrap().unwrap();
        assert_eq!(found.payload, [7; 40]);
        assert!(found.warnings[0].contains(word), "{found:?}");
    }
    fs::remove_file(&copy).unwrap();
    fs::create_dir(&copy).unwrap();
    let found = load(&file).unwrap().unwrap();
    assert!(found.warnings[0].contains("it is a folder"), "{found:?}");
}

#[test]
fn a_file_that_was_put_back_is_used_though_its_copy_is_newer() {
    let folder = Folder::new();
    let file = folder.file();
    store(&file, &[1]).unwrap();
    let old = fs::read(&file).unwrap();
    let mut retained = RetainedFile::open(&file, Dialect::Nct).unwrap();
    retained.load().unwrap();
    retained.store(&[2]).unwrap();
    fs::write(&file, old).unwrap();
    let found = retained.load().unwrap().unwrap();
    assert_eq!((&found.payload[..], found.generation), (&[1][..], 1));
    assert!(found.warnings[0].contains("put back"), "{found:?}");
    retained.store(&[3]).unwrap();
    assert_eq!(retained.load().unwrap().unwrap().generation, 3, "later than both");
}

#[test]
fn other_languages_are_refused() {
    let folder = Folder::new();
    RetainedFile::open(&folder.file(), Dialect::Pmac).unwrap().store(&[]).unwrap();
    assert!(matches!(load(&folder.file()), Err(RetainError::Foreign(_, "pmac"))));
}

#[test]
fn one_process_uses_a_file_at_a_time() {
    let folder = Folder::new();
    let first = RetainedFile::open(&folder.file(), Dialect::Nct).unwrap();
    let error = RetainedFile::open(&folder.file(), Dialect::Nct).unwrap_err().to_string();
    assert!(error.contains(&format!("in use by process {}", std::process::id())), "{error}");
    drop(first);
    assert!(RetainedFile::open(&folder.file(), Dialect::Nct).is_ok());
    assert_eq!(folder.names(), [""; 0]);
}

#[test]
fn what_a_killed_process_left_is_cleaned_up() {
    let folder = Folder::new();
    fs::write(folder.0.path().join("kept.new"), "half a fi").unwrap();
    fs::write(folder.0.path().join("kept.lock"), "4000000\n").unwrap();
    store(&folder.file(), &[1]).unwrap();
    assert_eq!(folder.names(), ["kept", "kept.bak"]);
}

#[test]
fn the_old_file_is_kept_beside() {
    let folder = Folder::new();
    store(&folder.file(), &[1]).unwrap();
    let bytes = fs::read(folder.file()).unwrap();
    fs::write(folder.file(), "damaged").unwrap();
    let mut file = RetainedFile::open(&folder.file(), Dialect::Nct).unwrap();
    let old = file.keep_old().unwrap();
    assert_eq!(fs::read(old).unwrap(), bytes, "the copy's bytes, since the file is damaged");
    drop(file);
    assert_eq!(folder.names(), ["kept", "kept.bak", "kept.old"]);
}

/// The folder of a link's target is locked and written, and the link stays.
#[cfg(unix)]
#[test]
fn a_link_stays_and_its_target_is_written() {
    let folder = Folder::new();
    let link = folder.0.path().join("link");
    std::os::unix::fs::symlink("kept", &link).unwrap();
    for payload in [[1], [2]] {
        store(&link, &payload).unwrap();
        assert_eq!(load(&folder.file()).unwrap().unwrap().payload, payload);
    }
    assert!(link.is_symlink());
    assert_eq!(folder.names(), ["kept", "kept.bak", "link"]);
}

#[cfg(unix)]
#[test]
fn a_file_that_can_be_read_only_is_not_replaced_and_permissions_stay() {
    use std::os::unix::fs::PermissionsExt;
    let folder = Folder::new();
    store(&folder.file(), &[1]).unwrap();
    let mode = |mode| {
        fs::set_permissions(folder.file(), fs::Permissions::from_mode(mode)).unwrap();
    };
    mode(0o600);
    store(&folder.file(), &[2]).unwrap();
    assert_eq!(fs::metadata(folder.file()).unwrap().permissions().mode() & 0o777, 0o600);
    mode(0o444);
    let error = store(&folder.file(), &[3]).unwrap_err().to_string();
    assert!(error.contains("permission is denied"), "{error}");
    assert_eq!(load(&folder.file()).unwrap().unwrap().payload, [2]);
}
