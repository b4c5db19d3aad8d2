//! The whole file.

use std::collections::{BTreeMap, HashMap, hash_map};
use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;

use plcc_abi::{printable, time};
use plcc_files::{FileIdentity, MAX_SETTINGS, read_regular, why_not_read};
use toml::de::{DeTable, DeValue};

use crate::value::{self, Result};
use crate::{About, Entry, Keys, LineNumbers, Mistake, Plcio, Warning, drivers, entries};

/// What a configuration says. Paths are relative to the folder of the file no more.
#[derive(Clone, Debug)]
pub struct Configuration {
    /// The file itself.
    pub path: PathBuf,
    /// The artifact of the program.
    pub artifact: Option<PathBuf>,
    /// PMI: the time between two scans.
    pub period: Option<Duration>,
    /// The file that holds what survives power-off.
    pub retain: Option<PathBuf>,
    /// The record.
    pub record: Option<PathBuf>,
    /// How much the record keeps.
    pub keep: Option<String>,
    /// The socket.
    pub socket: Option<PathBuf>,
    /// The image file.
    pub image: Option<PathBuf>,
    /// The control's log.
    pub log: Option<PathBuf>,
    /// How long a scan may take.
    pub watchdog: Option<String>,
    /// The hardware watchdog.
    pub watchdog_device: Option<PathBuf>,
    /// What is done when a tick begins too late.
    pub overrun: Option<String>,
    /// How often a control that has died is started again.
    pub restart: Option<u32>,
    /// The public key with which artifacts must be signed.
    pub key: Option<PathBuf>,
    /// What may be done by the socket.
    pub allow: Vec<String>,
    /// Users who may use the socket.
    pub allow_user: Vec<String>,
    /// Groups whose members may use the socket.
    pub allow_group: Vec<String>,
    /// What outputs become when the program is stopped.
    pub safe: Vec<SafeEntry>,
    /// What is connected with what.
    pub entries: Vec<Entry>,
    /// The settings of the drivers.
    pub plcio: Plcio,
    /// The lines of the keys that are there.
    lines: BTreeMap<String, usize>,
    /// The same of those in `[plcio]`.
    plcio_lines: BTreeMap<String, usize>,
}

/// What an output becomes when the program is stopped.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SafeEntry {
    /// The line, from 1.
    pub line: usize,
    /// The output.
    pub name: String,
    /// `off`, `hold` or a number.
    pub value: String,
}

/// What is wrong with a configuration, in the order of the lines of each part.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Findings {
    /// What neither program can use: what is not TOML, and entries `[[io]]`.
    pub file: Vec<Mistake>,
    /// What the control can't use.
    pub control: Vec<Mistake>,
    /// What `plcio` can't use.
    pub plcio: Vec<Mistake>,
}

impl Findings {
    /// Mistakes that count for whoever uses these parts, in the order of their lines.
    fn sorted<const N: usize>(parts: [&Vec<Mistake>; N]) -> Vec<Mistake> {
        let mut all: Vec<Mistake> = parts.into_iter().flatten().cloned().collect();
        all.sort();
        all
    }

    /// What keeps a control from running.
    pub fn for_control(&self) -> Vec<Mistake> {
        Self::sorted([&self.file, &self.control])
    }

    /// What keeps `plcio` from running.
    pub fn for_plcio(&self) -> Vec<Mistake> {
        Self::sorted([&self.file, &self.plcio])
    }

    /// Everything.
    pub fn all(&self) -> Vec<Mistake> {
        Self::sorted([&self.file, &self.control, &self.plcio])
    }
}

/// A number as it would stand on a command line.
fn number_text(value: &DeValue<'_>) -> Option<String> {
    match value {
        DeValue::Float(number) => Some(number.as_str().to_owned()),
        other => value::integer(other).map(|number| number.to_string()),
    }
}

fn period(value: &DeValue<'_>) -> Result<Duration> {
    let text = value.as_str().map(str::to_owned).or_else(|| number_text(value));
    time::period(&text.ok_or("a time is expected, as in \"20ms\"")?)
}

fn restart(value: &DeValue<'_>) -> Result<u32> {
    let number = value::integer(value).and_then(|number| u32::try_from(number).ok());
    number.ok_or_else(|| "a number is expected: how often".into())
}

fn allow(value: &DeValue<'_>) -> Result<Vec<String>> {
    value::list(value).map_err(|expected| format!("{expected}, as in [\"write\", \"force\"]"))
}

/// A text, with examples of it.
fn text_as_in(examples: &str) -> impl FnOnce(&DeValue<'_>) -> Result<String> {
    move |value| value::text(value).map_err(|expected| format!("{expected}, as in {examples}"))
}

/// Reads the table `[safe]`.
fn safe(keys: &mut Keys<'_>) -> Vec<SafeEntry> {
    let Some((line, value)) = keys.take("safe") else { return vec![] };
    let Some(table) = value.get_ref().as_table() else {
        let message = "`safe` is a table: [safe], and below it lines such as PUMP = \"hold\"";
        keys.wrong(line, message.into());
        return vec![];
    };
    let lines = keys.lines();
    let line_of = |key: &toml::Spanned<toml::de::DeString<'_>>| lines.line(key.span().start);
    let mut names: Vec<(usize, &str)> =
        table.keys().map(|name| (line_of(name), name.get_ref().as_ref())).collect();
    names.sort_unstable();
    // The line in which a name stands first, in whatever case its letters are.
    let mut first_lines = HashMap::new();
    for (line, name) in names {
        match first_lines.entry(name.to_ascii_uppercase()) {
            hash_map::Entry::Vacant(free) => {
                free.insert(line);
            }
            hash_map::Entry::Occupied(first) => {
                let (name, first) = (printable(name), first.get());
                keys.wrong(line, format!("`{name}` has a value in line {first} already"));
            }
        }
    }
    let mut entries = vec![];
    for (name, value) in table {
        let (line, value) = (line_of(name), value.get_ref());
        let name = name.get_ref().to_string();
        match value.as_str().map(str::to_owned).or_else(|| number_text(value)) {
            Some(value) => entries.push(SafeEntry { line, name, value }),
            None => {
                let name = printable(&name);
                let message = format!("`{name}` is \"off\", \"hold\" or a number in [safe]");
                keys.wrong(line, message);
            }
        }
    }
    entries.sort_by_key(|entry| entry.line);
    entries
}

/// The lines of the keys of a table.
fn key_lines(table: Option<&DeTable<'_>>, lines: &LineNumbers) -> BTreeMap<String, usize> {
    let keys = table.into_iter().flat_map(|table| table.keys());
    keys.map(|key| (key.get_ref().to_string(), lines.line(key.span().start))).collect()
}

impl Configuration {
    /// Reads a configuration file. Gives what it says, and all its mistakes.
    ///
    /// # Errors
    /// When the file can't be read, as a message with its name.
    pub fn open(path: &Path) -> std::result::Result<(Self, Findings), String> {
        let failed = |error: io::Error| format!("{}: {}", path.display(), why_not_read(&error));
        let bytes = read_regular(path, MAX_SETTINGS).map_err(failed)?;
        if bytes.contains(&0) {
            let why = "it is not text; the configuration of a control is expected";
            return Err(format!("{}: {why}", path.display()));
        }
        let text = String::from_utf8_lossy(&bytes);
        Ok(Self::read(text.strip_prefix('\u{feff}').unwrap_or(&text), path))
    }

    /// Reads the text of the configuration file at a path, and finds all its mistakes.
    pub fn read(text: &str, path: &Path) -> (Self, Findings) {
        let folder = path.parent().unwrap_or(Path::new(""));
        let lines = LineNumbers::new(text);
        let (table, errors) = DeTable::parse_recoverable(text);
        let table = table.get_ref();
        let mut findings = Findings::default();
        findings.file.extend(errors.iter().map(|error| Mistake {
            line: lines.line(error.span().map_or(0, |span| span.start)),
            message: format!("this is not valid TOML: {}", error.message()),
        }));
        let mut keys = Keys::new(Some(table), "", &lines, 1);
        let file = value::path_in(folder);
        let artifact = keys.read("artifact", |value| {
            file(value).map_err(|expected| format!("{expected}, as in \"lathe.plcx\""))
        });
        let retain = keys.read("retain", file);
        let record = keys.read("record", file);
        let image = keys.read("image", file);
        let log = keys.read("log", file);
        let entries = match keys.take("io") {
            Some((_, value)) => entries(value.get_ref(), &lines, &mut findings.file),
            None => vec![],
        };
        let name = image.as_ref().and_then(|image| image.file_stem());
        let name = name.map_or("control".into(), |name| name.to_string_lossy());
        let record_or_default =
            record.clone().unwrap_or_else(|| default_record(path, retain.as_deref()));
        let about = About {
            folder,
            name: &name,
            entries: &entries,
            log: log.as_deref(),
            record: &record_or_default,
        };
        let own = keys.take("plcio");
        let own_table = own.and_then(|(_, value)| value.get_ref().as_table());
        let own_line = own.map_or(1, |(line, _)| line);
        let mut own_keys = Keys::new(own_table, "[plcio]", &lines, own_line);
        let plcio = Plcio::read(&mut own_keys, &about);
        findings.plcio.extend(own_keys.finish().0);
        if own.is_some() && own_table.is_none() {
            let message = "`plcio` is a table: [plcio], and below it lines such as poll = \"20ms\"";
            findings.plcio.push(Mistake { line: own_line, message: message.into() });
        }
        let configuration = Self {
            path: path.to_owned(),
            artifact,
            period: keys.read("period", period),
            keep: keys.read("keep", text_as_in("\"200MB\" or \"10min\"")),
            socket: keys.read("socket", file),
            watchdog: keys.read("watchdog", text_as_in("\"60ms\" or \"off\"")),
            watchdog_device: keys.read("watchdog-device", file),
            overrun: keys.read("overrun", text_as_in("\"skip\" or \"catch-up=5\"")),
            restart: keys.read("restart", restart),
            key: keys.read("key", file),
            allow: keys.read("allow", allow).unwrap_or_default(),
            allow_user: keys.read("allow-user", allow).unwrap_or_default(),
            allow_group: keys.read("allow-group", allow).unwrap_or_default(),
            safe: safe(&mut keys),
            retain,
            record,
            image,
            log,
            plcio,
            entries,
            lines: key_lines(Some(table), &lines),
            plcio_lines: key_lines(own_table, &lines),
        };
        // A line with the key and a wrong value has a mistake of its own.
        let names_artifact = text.lines().any(|line| line.trim_start().starts_with("artifact"));
        if !keys.has("artifact") && !names_artifact {
            let message = "the key `artifact` is missing: the program that is to run";
            keys.wrong(1, message.into());
        }
        for list in ["allow", "allow-user", "allow-group"] {
            if keys.has(list) && !keys.has("socket") {
                keys.wrong(keys.line_of(list), format!("`{list}` needs the key `socket`"));
            }
        }
        if !keys.has("image") {
            let message = "the key `image` is missing: drivers need the image file of the control";
            findings.plcio.push(Mistake { line: 1, message: message.into() });
        }
        findings.control.extend(keys.finish().0);
        findings.plcio.extend(configuration.log_that_overwrites());
        (configuration, findings)
    }

    /// The line of a key; the first line if it is not there.
    pub fn line_of(&self, key: &str) -> usize {
        self.lines.get(key).copied().unwrap_or(1)
    }

    /// Whether it wires anything: it has entries, or settings of drivers.
    pub fn is_wired(&self) -> bool {
        ["io", "plcio"].into_iter().any(|key| self.lines.contains_key(key))
    }

    /// The keys of `[plcio]` that are there, each with its line.
    pub fn plcio_keys(&self) -> impl Iterator<Item = (&str, usize)> {
        self.plcio_lines.iter().map(|(key, &line)| (key.as_str(), line))
    }

    /// Where the control is recorded.
    pub fn record_path(&self) -> PathBuf {
        let record = self.record.clone();
        record.unwrap_or_else(|| default_record(&self.path, self.retain.as_deref()))
    }

    /// That the log of `plcio` is a file that is something else already, if it is.
    fn log_that_overwrites(&self) -> Option<Mistake> {
        let log = self.plcio.log.as_ref()?;
        let identity = FileIdentity::of(log);
        let own_log = self.log.as_ref().filter(|path| path.as_os_str() != "-");
        let others = [
            ("the configuration", Some(&self.path)),
            ("`image`", self.image.as_ref()),
            ("`artifact`", self.artifact.as_ref()),
            ("the control's own log", own_log),
            ("`record`", self.record.as_ref()),
            ("`retain`", self.retain.as_ref()),
        ];
        let is_log = |path: &&PathBuf| FileIdentity::of(path).is_same(&identity);
        let mut others = others.into_iter().filter(|(_, path)| path.as_ref().is_some_and(is_log));
        let (name, _) = others.next()?;
        let message = format!("`log` in [plcio]: {} is {name}", log.display());
        Some(Mistake { line: self.plcio_lines.get("log").copied().unwrap_or(1), message })
    }

    /// What the drivers of entries need besides and `[plcio]` does not say: their points are not connected.
    pub fn warnings(&self) -> Vec<Warning> {
        let settings = &self.plcio.drivers;
        let warning = |driver: &'static dyn crate::Driver| {
            let entry = self.entries.iter().find(|entry| entry.driver == driver)?;
            let (key, name) = (driver.missing_setting(settings)?, driver.name());
            let message = format!("points of the driver {name} need the key {key}, in [plcio]");
            Some(Warning { line: Some(entry.line), message })
        };
        drivers::all().filter_map(warning).collect()
    }
}

/// Where a control is recorded whose configuration at `path` does not say it: beside the retained file, if there is one, else beside
/// the configuration.
fn default_record(path: &Path, retain: Option<&Path>) -> PathBuf {
    retain.unwrap_or(path).with_extension("plcrec")
}

#[cfg(test)]
mod tests;
