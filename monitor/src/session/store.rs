//! What outlives a session (PMI 5.0): watch lists by name, set-ups of the scope, and the statements that
//! were chosen. One small file a program, in the user's state folder.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::Session;
use crate::{Format, Refusal, Reply, Trigger};

/// The longest file that is read, in bytes.
const MAX_FILE: u64 = 1 << 20;
/// The longest name of a list or a set-up, in characters.
const LONGEST_NAME: usize = 64;
/// The list that there is at first.
const FIRST_LIST: &str = "main";

/// An entry of a watch list.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Entry {
    pub(super) name: String,
    #[serde(default)]
    pub(super) format: Format,
}

/// A set-up of the scope.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct SavedScope {
    pub(super) names: Vec<String>,
    pub(super) width: u64,
    pub(super) trigger: Option<Trigger>,
}

/// The content of the file.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
struct Kept {
    list: String,
    lists: BTreeMap<String, Vec<Entry>>,
    scopes: BTreeMap<String, SavedScope>,
    /// The source line numbers of the chosen statements.
    statements: Option<Vec<String>>,
}

/// What is kept of a program, and where.
#[derive(Debug, Default)]
pub(super) struct Store {
    kept: Kept,
    file: Option<PathBuf>,
}

/// The folder in which a user's programs keep their state.
pub(crate) fn state_folder() -> Option<PathBuf> {
    let of =
        |name: &str| std::env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let folder = of("XDG_STATE_HOME").or_else(|| Some(of("HOME")?.join(".local/state")))?;
    Some(folder.join("plcc/monitor"))
}

impl Store {
    /// Reads what the folder holds for the program with this name; without a folder nothing is kept.
    pub(super) fn open(folder: Option<&Path>, program: &str) -> Self {
        let name = Path::new(program).file_name().unwrap_or_default().to_string_lossy();
        let is_plain = |c: char| c.is_alphanumeric() || matches!(c, '.' | '-' | '_');
        let name: String = name.chars().map(|c| if is_plain(c) { c } else { '_' }).collect();
        let name = if name.is_empty() { "program".to_owned() } else { name };
        let file = folder.map(|folder| folder.join(format!("{name}.json")));
        let kept = file.as_deref().and_then(read).unwrap_or_default();
        let mut store = Self { kept, file };
        if store.kept.list.is_empty() {
            store.kept.list = FIRST_LIST.into();
        }
        store
    }

    pub(super) fn list(&self) -> &str {
        &self.kept.list
    }

    pub(super) fn lists(&self) -> Vec<String> {
        let mut lists: Vec<String> = self.kept.lists.keys().cloned().collect();
        if !lists.contains(&self.kept.list) {
            lists.push(self.kept.list.clone());
        }
        lists
    }

    pub(super) fn entries(&self) -> &[Entry] {
        self.kept.lists.get(&self.kept.list).map_or(&[], Vec::as_slice)
    }

    fn entries_mut(&mut self) -> &mut Vec<Entry> {
        self.kept.lists.entry(self.kept.list.clone()).or_default()
    }

    /// Adds an entry to the present list. Gives whether the list did not have it.
    pub(super) fn add(&mut self, entry: Entry) -> bool {
        let entries = self.entries_mut();
        let is_new = entries.iter().all(|known| known.name != entry.name);
        if is_new {
            entries.push(entry);
        }
        is_new
    }

    /// Removes an entry from the present list. Gives whether the list had it.
    pub(super) fn remove(&mut self, name: &str) -> bool {
        let entries = self.entries_mut();
        let count = entries.len();
        entries.retain(|entry| entry.name != name);
        entries.len() < count
    }

    pub(super) fn clear(&mut self) {
        self.entries_mut().clear();
    }

    pub(super) fn set_format(&mut self, name: &str, format: Format) -> bool {
        let entry = self.entries_mut().iter_mut().find(|entry| entry.name == name);
        entry.map(|entry| entry.format = format).is_some()
    }

    pub(super) fn choose(&mut self, list: &str) {
        self.kept.list = list.into();
        self.entries_mut();
    }

    pub(super) fn remove_list(&mut self, list: &str) -> bool {
        let was_there = self.kept.lists.remove(list).is_some();
        if self.kept.list == list {
            let next = self.kept.lists.keys().next().cloned();
            self.kept.list = next.unwrap_or_else(|| FIRST_LIST.into());
        }
        was_there
    }

    pub(super) fn scopes(&self) -> Vec<String> {
        self.kept.scopes.keys().cloned().collect()
    }

    pub(super) fn scope(&self, name: &str) -> Option<&SavedScope> {
        self.kept.scopes.get(name)
    }

    pub(super) fn keep_scope(&mut self, name: &str, scope: SavedScope) {
        self.kept.scopes.insert(name.into(), scope);
    }

    pub(super) fn statements(&self) -> Option<&[String]> {
        self.kept.statements.as_deref()
    }

    /// Keeps the numbers of the chosen statements. Gives whether these are others than before.
    pub(super) fn keep_statements(&mut self, numbers: Option<Vec<String>>) -> bool {
        let is_new = self.kept.statements != numbers;
        self.kept.statements = numbers;
        is_new
    }

    /// Writes the file: a new one, which takes the place of the old one when it is whole.
    fn write(&self) -> std::io::Result<()> {
        let Some(file) = &self.file else { return Ok(()) };
        if let Some(folder) = file.parent() {
            fs::create_dir_all(folder)?;
        }
        let text = serde_json::to_vec_pretty(&self.kept)?;
        if text.len() as u64 > MAX_FILE {
            // It would not be read again.
            return Err(std::io::Error::other("the lists of this program take more than 1 MiB"));
        }
        let new = file.with_extension(format!("new-{}", std::process::id()));
        fs::write(&new, text)?;
        fs::rename(&new, file)
    }
}

/// The name of a list or a set-up as a user has typed it, without blanks around it.
///
/// # Errors
/// When it is empty, longer than a line has room for, or has control characters.
pub(super) fn checked_name(text: &str) -> Result<&str, Refusal> {
    let name = text.trim();
    match name.chars().count() {
        0 => Err(Refusal::new("a name is missing")),
        1..=LONGEST_NAME if !name.contains(char::is_control) => Ok(name),
        1..=LONGEST_NAME => Err(Refusal::new("a name has no control characters")),
        _ => Err(Refusal::new(format!("a name has at most {LONGEST_NAME} characters"))),
    }
}

fn read(file: &Path) -> Option<Kept> {
    let bytes = plcc_files::read_regular(file, MAX_FILE).ok()?;
    serde_json::from_slice(&bytes).ok()
}

impl Session<'_> {
    /// Writes what is kept.
    pub(super) fn save(&mut self) -> Result<Reply, Refusal> {
        match self.store.write() {
            Ok(()) => Ok(Reply::default()),
            Err(error) => Ok(Reply::message(format!("done, but it can't be kept: {error}"))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_are_kept_by_name() {
        let folder = std::env::temp_dir().join(format!("plcc-store-{}", std::process::id()));
        let entry = |name: &str| Entry { name: name.into(), format: Format::Binary };
        let mut store = Store::open(Some(&folder), "shop/lathe.pmi");
        assert!(store.add(entry("A")) && !store.add(entry("A")));
        store.choose("second");
        store.add(entry("B"));
        store.write().unwrap();
        let again = Store::open(Some(&folder), "other/lathe.pmi");
        assert_eq!((again.list(), again.lists()), ("second", vec!["main".into(), "second".into()]));
        assert_eq!(again.entries(), [entry("B")]);
        assert!(folder.join("lathe.pmi.json").exists());
        // Another file counts as none.
        fs::write(folder.join("lathe.pmi.json"), "{").unwrap();
        assert_eq!(Store::open(Some(&folder), "lathe.pmi").entries(), []);
        fs::remove_dir_all(&folder).unwrap();
    }
}
