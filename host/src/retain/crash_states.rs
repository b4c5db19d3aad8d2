//! What is found after a power failure at any moment, and after errors of any operation.
//!
//! [`Medium`] takes the place of the disk. It records every operation. A crash state is what a disk
//! may hold after a power failure: all that was synchronised, and any part of what was not. Names
//! in a folder are changed one by one or not at all. Of the bytes of a file each sector (512 or 4096
//! bytes) holds what was written, zeros, or something else, and the file has any length. After an
//! error of `sync` nothing of what was to be synchronised is certain, also not after a later `sync`
//! that reports success: Linux marks the pages as written.
//!
//! In every crash state the newest generation that `store` had reported as saved is found, or a newer
//! one of which `store` had begun, each with exactly its own bytes.
//!
//! Cases are numbered. `PLCC_CRASH_CASES` and `PLCC_FIRST` give another number of them than 200, and
//! the first one; `scripts/full power` sets them.

use std::collections::BTreeMap;

use plcc_random::Rng;

use super::*;

/// How many crash states are looked at in a case.
const STATES_PER_CASE: u64 = 20;
/// How many cases there are, unless the environment says another number.
const CASES: u64 = 200;

type Inode = usize;

/// A change of the names in the folder.
#[derive(Clone, Debug)]
enum NameChange {
    /// The file has the name from now on, and no longer the other one.
    Set { name: PathBuf, inode: Inode, former_name: Option<PathBuf> },
    /// Nothing has the name.
    Removed(PathBuf),
}

impl NameChange {
    fn apply(&self, names: &mut BTreeMap<PathBuf, Inode>) {
        match self {
            Self::Set { name, inode, former_name } => {
                if let Some(former) = former_name
                    && names.get(former) == Some(inode)
                {
                    names.remove(former);
                }
                names.insert(name.clone(), *inode);
            }
            Self::Removed(name) => {
                names.remove(name);
            }
        }
    }
}

/// An operation, and what the caller learnt of it.
#[derive(Clone, Debug)]
enum Operation {
    Name(NameChange),
    Write(Inode, Vec<u8>),
    /// All bytes of the file are on the medium.
    Synced(Inode),
    /// `sync` has failed: no byte of the file that is not on the medium will ever be.
    SyncFailed(Inode),
    /// All changes of names are on the medium.
    NamesSynced,
    /// Changes of names up to here are on the medium or not, whatever is synchronised later.
    NamesSyncFailed,
    /// `store` has begun.
    Begun(u64),
    /// `store` has reported success.
    Saved(u64),
}

/// A disk that records what is done to it, and fails on request.
#[derive(Debug, Default)]
struct Medium {
    /// What programs see.
    names: BTreeMap<PathBuf, Inode>,
    contents: Vec<Vec<u8>>,
    operations: Vec<Operation>,
    /// In how many of 100 operations an error is injected.
    error_percent: usize,
    /// Counts the operations down to one that fails, where a test asks for that.
    fails_in: Option<(usize, ErrorKind)>,
    rng: Option<Rng>,
}

impl Medium {
    /// The error that the next operation has to report, if it has to.
    fn injected(&mut self) -> Option<ErrorKind> {
        if let Some((left, kind)) = &mut self.fails_in {
            let now = *left == 0;
            *left = left.wrapping_sub(1);
            return now.then_some(*kind);
        }
        let percent = self.error_percent;
        let rng = self.rng.as_mut().filter(|_| percent > 0)?;
        // EIO has no kind of its own.
        let kinds = [ErrorKind::StorageFull, ErrorKind::Other, ErrorKind::Interrupted];
        rng.chance(percent).then(|| *rng.pick(&kinds))
    }

    /// Fails, where an error is to be injected; an interrupted operation has done nothing.
    fn may_fail(&mut self) -> io::Result<()> {
        self.injected().map_or(Ok(()), |kind| Err(kind.into()))
    }

    fn inode(&self, path: &Path) -> io::Result<Inode> {
        self.names.get(path).copied().ok_or(ErrorKind::NotFound.into())
    }

    fn change(&mut self, change: NameChange) {
        change.apply(&mut self.names);
        self.operations.push(Operation::Name(change));
    }

    /// What a disk may hold if the power fails after so many operations.
    fn after_power_failure(&self, operations: usize, rng: &mut Rng) -> Self {
        let sector = *rng.pick(&[512, 4096]);
        let mut names = BTreeMap::new();
        // Changes of names that are not on the medium, with whether they ever will be.
        let mut open_names: Vec<(NameChange, bool)> = vec![];
        // For each file the bytes that are on the medium, those that are not, and whether a `sync` of it
        // has failed, so that they never will be.
        let mut files: Vec<(Vec<u8>, Vec<u8>, bool)> =
            vec![Default::default(); self.contents.len()];
        for operation in &self.operations[..operations] {
            match operation {
                Operation::Name(change) => open_names.push((change.clone(), true)),
                Operation::Write(inode, bytes) => files[*inode].1.extend(bytes),
                Operation::Synced(inode) => {
                    let (synced, open, lost) = &mut files[*inode];
                    if !*lost {
                        synced.append(open);
                    }
                }
                Operation::SyncFailed(inode) => files[*inode].2 = true,
                Operation::NamesSynced => {
                    // What a failed `sync` has left in doubt happened before or not at all.
                    open_names.retain(|(change, certain)| {
                        if *certain || rng.chance(50) {
                            change.apply(&mut names);
                        }
                        false
                    });
                }
                Operation::NamesSyncFailed => {
                    open_names.iter_mut().for_each(|(_, certain)| *certain = false);
                }
                Operation::Begun(_) | Operation::Saved(_) => {}
            }
        }
        for (change, _) in open_names {
            if rng.chance(50) {
                change.apply(&mut names);
            }
        }
        let contents = files.into_iter().map(|(synced, open, _)| {
            let mut bytes = synced;
            for piece in open.chunks(sector) {
                match rng.below(5) {
                    0 => bytes.extend(piece.iter().map(|_| 0)),
                    1 => bytes.extend(piece.iter().map(|_| rng.bits() as u8)),
                    // The file ends here.
                    2 => break,
                    _ => bytes.extend(piece),
                }
            }
            bytes
        });
        Self { names, contents: contents.collect(), ..Self::default() }
    }

    /// The last generation that was reported as saved in the first operations, and the last one that
    /// was begun.
    fn saved_and_begun(&self, operations: usize) -> (u64, u64) {
        let (mut saved, mut begun) = (0, 0);
        for operation in &self.operations[..operations] {
            match operation {
                Operation::Saved(generation) => saved = *generation,
                Operation::Begun(generation) => begun = *generation,
                _ => {}
            }
        }
        (saved, begun)
    }
}

impl Storage for Medium {
    type File = Inode;

    fn read(&mut self, path: &Path) -> io::Result<Vec<u8>> {
        Ok(self.contents[self.inode(path)?].clone())
    }

    fn create(&mut self, path: &Path, _: &Path) -> io::Result<Inode> {
        self.may_fail()?;
        if self.names.contains_key(path) {
            return Err(ErrorKind::AlreadyExists.into());
        }
        let inode = self.contents.len();
        self.contents.push(vec![]);
        self.change(NameChange::Set { name: path.to_owned(), inode, former_name: None });
        Ok(inode)
    }

    fn write(&mut self, file: &mut Inode, bytes: &[u8]) -> io::Result<usize> {
        self.may_fail()?;
        let count = self.rng.as_mut().map_or(bytes.len(), |rng| match rng.chance(30) {
            true => 1 + rng.below(bytes.len()),
            false => bytes.len(),
        });
        let bytes = &bytes[..count];
        self.contents[*file].extend(bytes);
        self.operations.push(Operation::Write(*file, bytes.to_owned()));
        Ok(count)
    }

    fn sync(&mut self, file: &mut Inode) -> io::Result<()> {
        match self.injected() {
            Some(ErrorKind::Interrupted) => Err(ErrorKind::Interrupted.into()),
            Some(kind) => {
                self.operations.push(Operation::SyncFailed(*file));
                Err(kind.into())
            }
            None => {
                self.operations.push(Operation::Synced(*file));
                Ok(())
            }
        }
    }

    fn rename(&mut self, from: &Path, to: &Path) -> io::Result<()> {
        let failure = self.injected();
        // An error of the medium does not say whether the name was changed.
        let happens = match failure {
            None => true,
            Some(ErrorKind::Other) => self.rng.as_mut().is_some_and(|rng| rng.chance(50)),
            Some(_) => false,
        };
        if happens {
            let (inode, former_name) = (self.inode(from)?, Some(from.to_owned()));
            self.change(NameChange::Set { name: to.to_owned(), inode, former_name });
        }
        failure.map_or(Ok(()), |kind| Err(kind.into()))
    }

    fn sync_folder_of(&mut self, _: &Path) -> io::Result<()> {
        match self.injected() {
            Some(ErrorKind::Interrupted) => Err(ErrorKind::Interrupted.into()),
            Some(kind) => {
                self.operations.push(Operation::NamesSyncFailed);
                Err(kind.into())
            }
            None => {
                self.operations.push(Operation::NamesSynced);
                Ok(())
            }
        }
    }

    fn remove(&mut self, path: &Path) -> io::Result<()> {
        self.may_fail()?;
        self.inode(path)?;
        self.change(NameChange::Removed(path.to_owned()));
        Ok(())
    }
}

/// The bytes of a generation, different for each.
fn payload(generation: u64, length: usize) -> Vec<u8> {
    let mut rng = Rng::new(generation);
    (0..length).map(|_| rng.bits() as u8).collect()
}

fn copies(medium: Medium) -> Copies<Medium> {
    Copies::new("kept".into(), Dialect::Pmac, medium)
}

/// Saves the next generation and records when that began and ended.
fn save(copies: &mut Copies<Medium>, payloads: &mut BTreeMap<u64, Vec<u8>>, length: usize) -> bool {
    let generation = copies.generation + 1;
    let payload = payload(generation, length);
    payloads.insert(generation, payload.clone());
    copies.storage.operations.push(Operation::Begun(generation));
    let saved = copies.store(&payload).is_ok();
    if saved {
        copies.storage.operations.push(Operation::Saved(generation));
    }
    saved
}

/// Sees that a crash state holds what it must.
fn check(
    medium: Medium,
    (saved, begun): (u64, u64),
    payloads: &BTreeMap<u64, Vec<u8>>,
    case: &str,
) {
    let found = copies(medium).load();
    let found = found.unwrap_or_else(|error| panic!("{case}: {error}"));
    let generation = found.as_ref().map_or(0, |found| found.generation);
    assert!(
        (saved..=begun).contains(&generation),
        "{case}: generation {generation} is found; {saved} was saved and {begun} begun"
    );
    if let Some(found) = found {
        assert_eq!(Some(&found.payload), payloads.get(&generation), "{case}: {generation}");
    }
}

fn from_environment(name: &str, default: u64) -> u64 {
    std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(default)
}

#[test]
fn after_a_power_failure_the_newest_saved_generation_is_found() {
    let first = from_environment("PLCC_FIRST", 0);
    for number in first..first + from_environment("PLCC_CRASH_CASES", CASES) {
        let mut rng = Rng::new(number);
        let error_percent = *rng.pick(&[0, 0, 2, 10, 40]);
        let medium = Medium { error_percent, rng: Some(rng.clone()), ..Medium::default() };
        let (mut copies, mut payloads) = (copies(medium), BTreeMap::new());
        for _ in 0..1 + rng.below(5) {
            let length = *rng.pick(&[0, 20, 470, 600, 5000, 9000]);
            save(&mut copies, &mut payloads, length);
        }
        for state in 0..STATES_PER_CASE {
            let count = rng.below(copies.storage.operations.len() + 1);
            let medium = copies.storage.after_power_failure(count, &mut rng);
            let bounds = copies.storage.saved_and_begun(count);
            check(medium, bounds, &payloads, &format!("case {number}, state {state}"));
        }
    }
}

/// Each operation of a save fails once, with each error. Afterwards another save succeeds, and before
/// and after it the power may fail.
#[test]
fn after_an_error_of_any_operation_nothing_is_lost() {
    let mut rng = Rng::new(1);
    let errors = [ErrorKind::StorageFull, ErrorKind::Other, ErrorKind::ReadOnlyFilesystem];
    let mut failed = 0;
    for kind in errors {
        for at in 0..20 {
            let (mut copies, mut payloads) = (copies(Medium::default()), BTreeMap::new());
            assert!(save(&mut copies, &mut payloads, 700));
            copies.storage.fails_in = Some((at, kind));
            if save(&mut copies, &mut payloads, 700) {
                continue;
            }
            failed += 1;
            copies.storage.fails_in = None;
            let before = copies.storage.operations.len();
            assert!(save(&mut copies, &mut payloads, 700), "{kind} at operation {at}");
            assert_eq!(copies.load().unwrap().unwrap().generation, 3);
            assert!(!copies.storage.names.contains_key(Path::new("kept.new")));
            for count in before..=copies.storage.operations.len() {
                for _ in 0..20 {
                    let medium = copies.storage.after_power_failure(count, &mut rng);
                    let bounds = copies.storage.saved_and_begun(count);
                    check(medium, bounds, &payloads, &format!("{kind} at operation {at}"));
                }
            }
        }
    }
    // Two copies, each by: remove (which finds nothing), create, write, sync, rename, sync.
    assert!(failed >= 3 * 10, "{failed}");
}

/// A signal that interrupts an operation does not make the save fail.
#[test]
fn interrupted_operations_are_repeated() {
    for at in 0..20 {
        let (mut copies, mut payloads) = (copies(Medium::default()), BTreeMap::new());
        copies.storage.fails_in = Some((at, ErrorKind::Interrupted));
        assert!(save(&mut copies, &mut payloads, 700), "operation {at}");
    }
}

/// The crash states find mistakes: without `sync` of the file, and without that of the folder, some
/// state loses what was saved.
#[test]
fn crash_states_show_a_missing_sync() {
    let skipped: [fn(&Operation) -> bool; 2] = [
        |operation| matches!(operation, Operation::Synced(_)),
        |operation| matches!(operation, Operation::NamesSynced),
    ];
    for skipped in skipped {
        let (mut copies, mut payloads) = (copies(Medium::default()), BTreeMap::new());
        for _ in 0..3 {
            assert!(save(&mut copies, &mut payloads, 700));
        }
        let mut rng = Rng::new(5);
        let medium = &mut copies.storage;
        medium.operations.retain(|operation| !skipped(operation));
        let count = medium.operations.len();
        let lost = (0..200).filter(|_| {
            let found =
                super::crash_states::copies(medium.after_power_failure(count, &mut rng)).load();
            !found.is_ok_and(|found| found.is_some_and(|found| found.generation == 3))
        });
        assert!(lost.count() > 0);
    }
}
