//! The configuration file of a controller (`--config FILE.toml`).
//!
//! ```toml
//! artifact = "lathe.plcx"      # beside this file
//! period = 20
//! retain = "lathe.retained"
//! log = "/var/log/lathe.jsonl"
//! overrun = "skip"
//!
//! [safe]
//! PUMP = "hold"
//! BRAKE = 1
//! ```
//!
//! Each key is the option of the same name, and says nothing that the option could not. So a
//! configuration is read as words of a command line, which stand before those that the user wrote:
//! where both name an option, the user's comes last and counts.

use std::borrow::Cow;
use std::collections::{HashMap, HashSet, hash_map};
use std::fmt;
use std::path::{Path, PathBuf};

use crate::image_file::SymbolTable;
use clap::Command;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use plcc_abi::{Dialect, Program, closest, printable};
use plcc_files::{MAX_SETTINGS, read_regular, why_not_read};
use plcc_image::configuration::{self as wiring, Checked, Entry};
use plcc_image::latch::Rule;
use plcc_image::{Direction, Symbol};
use plcc_runtime::Names;
use toml::de::{DeTable, DeValue};

/// What the value of a key is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// The path of a file, relative to the folder of the configuration.
    Path,
    /// A text.
    Text,
    /// A number.
    Number,
    /// A list of texts, or one text.
    List,
    /// The table of safe outputs.
    Safe,
    /// The list of entries that connect variables with the outside.
    Wiring,
    /// The settings of the program `plcio`, which reads them itself.
    Plcio,
}

/// All keys.
const KEYS: &[(&str, Kind)] = &[
    ("artifact", Kind::Path),
    ("period", Kind::Number),
    ("retain", Kind::Path),
    ("record", Kind::Path),
    ("keep", Kind::Text),
    ("socket", Kind::Path),
    ("image", Kind::Path),
    ("log", Kind::Path),
    ("watchdog", Kind::Text),
    ("watchdog-device", Kind::Path),
    ("overrun", Kind::Text),
    ("restart", Kind::Number),
    ("key", Kind::Path),
    ("allow", Kind::List),
    ("allow-user", Kind::List),
    ("allow-group", Kind::List),
    ("safe", Kind::Safe),
    ("io", Kind::Wiring),
    ("plcio", Kind::Plcio),
];

/// Something that is wrong with a configuration.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Mistake {
    /// The line, from 1.
    pub line: usize,
    /// What is wrong, as a sentence without a full stop.
    pub message: String,
}

impl From<wiring::Mistake> for Mistake {
    fn from(wiring::Mistake { line, message }: wiring::Mistake) -> Self {
        Self { line, message }
    }
}

/// Compares the entries `[[io]]` with a program, whose names these are.
pub fn check_wiring(entries: &[Entry], program: &Program, names: &dyn Names) -> Checked {
    let symbols = SymbolTable::new(names).symbols;
    let names: HashSet<String> = names.declared().into_iter().map(|(name, _)| name).collect();
    let is_used_output =
        |symbol: &&Symbol| symbol.direction == Direction::Output && names.contains(&symbol.name);
    let outputs: Vec<String> =
        symbols.iter().filter(is_used_output).map(|symbol| symbol.name.clone()).collect();
    wiring::points(entries, &symbols, program.dialect() == Dialect::Nct, &outputs)
}

/// What entries without mistakes say of the variables that are given from outside, by the variables' names.
pub fn input_rules(checked: &Checked) -> Vec<(String, Rule)> {
    let given = checked.points.iter().filter(|point| point.is_input);
    given.map(|point| (point.symbol.name.clone(), point.rule())).collect()
}

/// A word of a command line that a configuration stands for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Word {
    /// The line of the key, from 1.
    pub line: usize,
    /// The word, such as `--overrun=skip`.
    pub text: String,
}

/// What a configuration says.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Configuration {
    /// The artifact, with the line of its key.
    pub artifact: Option<(usize, PathBuf)>,
    /// The options.
    pub options: Vec<Word>,
    /// The entries `[[io]]`.
    pub wiring: Vec<Entry>,
}

impl Configuration {
    /// The line of the key that stands for an option, such as `--log`; the first line if there is none.
    pub fn line_of(&self, option: &str) -> usize {
        let is_named = |word: &&Word| word.text.split('=').next() == Some(option);
        self.options.iter().find(is_named).map_or(1, |word| word.line)
    }
}

/// The mistakes of the configuration file at a path, as a message for people.
#[derive(Debug)]
pub struct Mistakes<'a>(
    /// The file.
    pub &'a Path,
    /// What is wrong in it.
    pub &'a [Mistake],
);

impl fmt::Display for Mistakes<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, Mistake { line, message }) in self.1.iter().enumerate() {
            let prefix = if index > 0 { "\nerror: " } else { "" };
            write!(f, "{prefix}{}:{line}: {message}", self.0.display())?;
        }
        Ok(())
    }
}

/// Reads a configuration file for a program with the options of `command`. Gives what it says, and all its
/// mistakes.
///
/// # Errors
/// When the file can't be read.
pub fn open(path: &Path, command: &Command) -> Result<(Configuration, Vec<Mistake>), String> {
    let failed = |error| format!("{}: {}", path.display(), why_not_read(&error));
    let bytes = read_regular(path, MAX_SETTINGS).map_err(failed)?;
    let text = String::from_utf8_lossy(&bytes);
    let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
    Ok(read(text, path.parent().unwrap_or(Path::new("")), command))
}

/// Reads the text of a configuration that lies in a folder, and finds all its mistakes, in the order
/// of their lines.
pub fn read(text: &str, folder: &Path, command: &Command) -> (Configuration, Vec<Mistake>) {
    let (table, errors) = DeTable::parse_recoverable(text);
    let lines = wiring::LineNumbers::new(text);
    let line_of = |at: usize| lines.line(at);
    let mut mistakes: Vec<Mistake> = errors
        .iter()
        .map(|error| Mistake {
            line: line_of(error.span().map_or(0, |span| span.start)),
            message: format!("this is not valid TOML: {}", error.message()),
        })
        .collect();
    let mut configuration = Configuration::default();
    for (key, value) in table.get_ref() {
        let (name, line) = (key.get_ref().as_ref(), line_of(key.span().start));
        let mut wrong = |line, message| mistakes.push(Mistake { line, message });
        let Some(&(_, kind)) = KEYS.iter().find(|(known, _)| *known == name) else {
            let nearest = closest(name, KEYS.iter().map(|(known, _)| *known));
            let hint = nearest.map_or_else(String::new, |near| format!("; did you mean `{near}`?"));
            wrong(line, format!("there is no key `{}`{hint}", printable(name)));
            continue;
        };
        if name == "artifact" {
            match text_of(value.get_ref()) {
                Some(path) => configuration.artifact = Some((line, folder.join(path))),
                None => {
                    wrong(line, "`artifact` is the path of a file, as in \"lathe.plcx\"".into())
                }
            }
            continue;
        }
        if kind == Kind::Wiring {
            let mut found = vec![];
            configuration.wiring = wiring::entries(value.get_ref(), &line_of, &mut found);
            mistakes.extend(found.into_iter().map(Mistake::from));
            continue;
        }
        if kind == Kind::Plcio {
            continue;
        }
        if !command.get_arguments().any(|option| option.get_long() == Some(name)) {
            wrong(line, format!("`{name}` is not available in this version of plcrt"));
            continue;
        }
        let texts = match kind {
            Kind::Wiring | Kind::Plcio => continue,
            Kind::Safe => match value.get_ref() {
                DeValue::Table(outputs) => {
                    let names = outputs.keys();
                    let names = names.map(|name| (line_of(name.span().start), name.get_ref()));
                    for (line, first, name) in repeated(names.collect()) {
                        let name = printable(name);
                        wrong(line, format!("`{name}` has a value in line {first} already"));
                    }
                    for (output, value) in outputs {
                        let line = line_of(output.span().start);
                        let output = output.get_ref();
                        match text_of(value.get_ref()).or_else(|| number_of(value.get_ref())) {
                            Some(value) => configuration
                                .options
                                .push(Word { line, text: format!("--safe={output}={value}") }),
                            None => wrong(
                                line,
                                format!(
                                    "`{}` is \"off\", \"hold\" or a number in [safe]",
                                    printable(output)
                                ),
                            ),
                        }
                    }
                    continue;
                }
                _ => Err("`safe` is a table: [safe], and below it lines such as PUMP = \"hold\""),
            },
            Kind::Path => text_of(value.get_ref())
                .map(|path| vec![folder.join(path).to_string_lossy().into_owned()])
                .ok_or("a path in quotes is expected"),
            Kind::Text => text_of(value.get_ref()).map(|text| vec![text]).ok_or(match name {
                "keep" => "a text in quotes is expected, as in \"200MB\" or \"10min\"",
                "watchdog" => "a text in quotes is expected, as in \"60ms\" or \"off\"",
                "overrun" => "a text in quotes is expected, as in \"skip\" or \"catch-up=5\"",
                _ => "a text in quotes is expected",
            }),
            Kind::Number => {
                number_of(value.get_ref()).map(|text| vec![text]).ok_or("a number is expected")
            }
            Kind::List => list_of(value.get_ref())
                .ok_or("a list of texts is expected, as in [\"write\", \"force\"]"),
        };
        match texts {
            Ok(texts) => configuration.options.extend(
                texts.into_iter().map(|text| Word { line, text: format!("--{name}={text}") }),
            ),
            Err(expected) => wrong(line, format!("`{name}`: {expected}")),
        }
    }
    // A line with the key and a wrong value has a mistake of its own.
    let names_artifact = text.lines().any(|line| line.trim_start().starts_with("artifact"));
    if configuration.artifact.is_none() && !names_artifact {
        let message = "the key `artifact` is missing: the program that is to run".into();
        mistakes.push(Mistake { line: 1, message });
    }
    let all = configuration.options.clone();
    configuration.options.retain(|word| match refusal(command, word, &all) {
        Some(message) => {
            mistakes.push(Mistake { line: word.line, message });
            false
        }
        None => true,
    });
    configuration.options.sort_by_key(|word| word.line);
    mistakes.sort();
    (configuration, mistakes)
}

/// The names that stand twice, in whatever case their letters are: the line of the later one, that of the first, and
/// the name.
fn repeated<'a>(mut names: Vec<(usize, &'a Cow<'_, str>)>) -> Vec<(usize, usize, &'a str)> {
    names.sort_unstable();
    let mut first_lines = HashMap::new();
    let mut found = vec![];
    for (line, name) in names {
        match first_lines.entry(name.to_ascii_uppercase()) {
            hash_map::Entry::Vacant(free) => {
                free.insert(line);
            }
            hash_map::Entry::Occupied(first) => found.push((line, *first.get(), name.as_ref())),
        }
    }
    found
}

/// Why the program does not take an option, if it does not. An option that needs another one, as
/// `--allow` needs `--socket`, is taken if that stands anywhere among all of them.
fn refusal(command: &Command, word: &Word, all: &[Word]) -> Option<String> {
    let words = ["plcrt", "--realtime", "artifact", word.text.as_str()];
    let error = command.clone().try_get_matches_from(words).err()?;
    if error.kind() == ErrorKind::MissingRequiredArgument
        && let Some(ContextValue::Strings(missing)) = error.get(ContextKind::InvalidArg)
    {
        // They stand there as in a help text: `--socket <PATH>`, or `<--config <FILE>|--socket <PATH>>` where one of
        // several is enough.
        let is_there = |name: &&str| {
            all.iter().any(|word| word.text.split_once('=').is_some_and(|(of, _)| of == *name))
        };
        let absent = missing.iter().find_map(|usage| {
            let names = usage.trim_start_matches('<').split('|');
            let names = names.filter_map(|usage| usage.split_whitespace().next());
            let names: Vec<&str> = names.map(|name| name.trim_end_matches("...")).collect();
            // This is a key's: a configuration names no other one.
            let key = names.iter().copied().find(|name| *name != "--config");
            key.filter(|_| !names.iter().any(is_there))
        })?;
        let (name, _) = word.text.split_once('=').unwrap_or((&word.text, ""));
        let key = |name: &str| name.trim_start_matches('-').to_owned();
        return Some(format!("`{}` needs the key `{}`", key(name), key(absent)));
    }
    let text = error.to_string();
    let line = text.lines().next().unwrap_or_default();
    Some(line.strip_prefix("error: ").unwrap_or(line).to_owned())
}

fn text_of(value: &DeValue<'_>) -> Option<String> {
    value.as_str().map(str::to_owned)
}

fn number_of(value: &DeValue<'_>) -> Option<String> {
    match value {
        DeValue::Integer(number) => {
            i64::from_str_radix(number.as_str(), number.radix()).ok().map(|it| it.to_string())
        }
        DeValue::Float(number) => Some(number.as_str().to_owned()),
        _ => None,
    }
}

fn list_of(value: &DeValue<'_>) -> Option<Vec<String>> {
    match value {
        DeValue::Array(values) => values.iter().map(|value| text_of(value.get_ref())).collect(),
        other => text_of(other).map(|text| vec![text]),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use clap::Arg;

    use super::*;

    /// The options that these tests use.
    fn command() -> Command {
        let option = |name| Arg::new(name).long(name);
        Command::new("plcrt")
            .args_override_self(true)
            .arg(Arg::new("artifact"))
            .arg(option("realtime").num_args(0))
            .arg(option("period").value_parser(clap::value_parser!(f64)))
            .args(["retain", "log", "socket"].map(option))
            .arg(option("allow").requires("socket"))
            .arg(option("overrun").value_parser(["skip", "stop"]))
            .arg(option("safe").num_args(1))
    }

    fn mistakes(text: &str) -> Vec<(usize, String)> {
        let (_, mistakes) = read(text, Path::new("etc"), &command());
        mistakes.into_iter().map(|Mistake { line, message }| (line, message)).collect()
    }

    #[test]
    fn a_configuration_is_a_command_line() {
        let text = "artifact = \"lathe.plcx\"\nretain = \"/var/lathe\"\nperiod = 2.5\n\
                    log = 'lathe.jsonl'\n[safe]\nPUMP = \"hold\"\n\"PORT1.0\" = 1\n";
        let (configuration, mistakes) = read(text, Path::new("etc"), &command());
        assert_eq!(mistakes, []);
        assert_eq!(configuration.artifact, Some((1, "etc/lathe.plcx".into())));
        let words: Vec<_> = configuration.options.iter().map(|word| word.text.as_str()).collect();
        let expected = [
            "--retain=/var/lathe",
            "--period=2.5",
            "--log=etc/lathe.jsonl",
            "--safe=PUMP=hold",
            "--safe=PORT1.0=1",
        ];
        assert_eq!(words, expected);
    }

    #[test]
    fn a_key_that_needs_another_one_is_taken_if_that_is_there() {
        for text in ["socket = \"s\"\nallow = [\"stop\"]\n", "allow = [\"stop\"]\nsocket = \"s\"\n"]
        {
            assert_eq!(mistakes(&format!("artifact = \"a\"\n{text}")), []);
        }
        let alone = mistakes("artifact = \"a\"\nallow = [\"stop\"]\n");
        assert_eq!(alone, [(2, "`allow` needs the key `socket`".to_owned())]);
    }

    #[test]
    fn a_safe_value_that_stands_twice_is_a_mistake() {
        let text = "artifact = \"p.plcx\"\n[safe]\nPUMP = 1\nFAN = 0\nPump = \"off\"\n";
        assert_eq!(mistakes(text), [(5, "`Pump` has a value in line 3 already".into())]);
        assert_eq!(mistakes("artifact = \"p.plcx\"\nsafe = { A = 1, a = 0 }\n").len(), 1);
    }

    #[test]
    fn every_mistake_is_found_with_its_line() {
        let text = "artifact = 5\nretian = \"a\"\n\noverrun = \"skipp\"\nperiod = \"x\"\n\
                    record = \"r\"\nlog = 1\n[safe]\nPUMP = true\n[other]\nA = 1\n";
        let found = mistakes(text);
        let lines: Vec<usize> = found.iter().map(|&(line, _)| line).collect();
        assert_eq!(lines, [1, 2, 4, 5, 6, 7, 9, 10], "{found:?}");
        let holds = |index: usize, part: &str| assert!(found[index].1.contains(part), "{found:?}");
        holds(1, "there is no key `retian`; did you mean `retain`?");
        holds(2, "skipp");
        holds(3, "a number is expected");
        holds(4, "`record` is not available");
        holds(6, "\"off\", \"hold\" or a number");
        holds(7, "there is no key `other`");
    }

    #[test]
    fn what_is_no_toml_is_found_with_its_line_beside_the_rest() {
        let found = mistakes("artifact = \"a\"\nretain = \nlgo = 1\n");
        assert_eq!(found[0].0, 2, "{found:?}");
        assert!(found[0].1.starts_with("this is not valid TOML: "), "{found:?}");
        assert!(found.iter().any(|(line, _)| *line == 3), "{found:?}");
        for text in ["", "# the artifact comes later\n", "log = \"artifact.jsonl\"\n"] {
            assert!(mistakes(text)[0].1.contains("`artifact` is missing"), "{text}");
        }
    }
}
