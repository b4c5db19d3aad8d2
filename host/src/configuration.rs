//! What the configuration of a controller (crate `plcc-configuration`) says of a run: it fills what the command line leaves open, and
//! its entries `[[io]]` are compared with the program.

use std::collections::{HashMap, HashSet};
use std::fmt::Display;
use std::path::Path;
use std::str::FromStr;

use plcc_abi::Program;
use plcc_configuration::{Checked, Configuration, Entry, Mistake, SafeEntry};
use plcc_image::latch::Rule;
use plcc_image::{Direction, Symbol};
use plcc_runtime::Names;
use plcc_runtime::safe_outputs::{SafeOutput, SafeValue};

use crate::args::{self, RunArgs};
use crate::image_file::SymbolTable;

/// Compares the entries `[[io]]` with a program, whose names these are.
pub fn check_wiring(entries: &[Entry], program: &Program, names: &dyn Names) -> Checked {
    let symbols = SymbolTable::new(names).symbols;
    let names: HashSet<String> = names.declared().into_iter().map(|(name, _)| name).collect();
    let is_used_output =
        |symbol: &&Symbol| symbol.direction == Direction::Output && names.contains(&symbol.name);
    let outputs: Vec<String> =
        symbols.iter().filter(is_used_output).map(|symbol| symbol.name.clone()).collect();
    plcc_configuration::points(entries, &symbols, program.dialect().names_end_in_bits(), &outputs)
}

/// A point outside to which a variable is wired.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Point {
    /// The driver.
    pub driver: &'static str,
    /// Its address; where it has none of its own, that of its entry.
    pub address: String,
    /// Which of the points of that address it is, from 1, and how many there are.
    pub number: (usize, usize),
}

impl std::fmt::Display for Point {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { driver, address, number: (number, count) } = self;
        write!(f, "{driver} {address}")?;
        if *count > 1 {
            write!(f, " (point {number} of {count})")?;
        }
        Ok(())
    }
}

/// The points to which a configuration wires the variables of a program, by the variables' canonical names.
///
/// # Errors
/// When the file can't be read, or an entry is wrong; the message has its line.
pub fn wired_points(
    path: &Path,
    program: &Program,
    names: &dyn Names,
) -> Result<HashMap<String, Point>, String> {
    let bytes = plcc_files::read_regular(path, plcc_files::MAX_SETTINGS);
    let bytes = bytes.map_err(|error| plcc_files::why_not_read(&error))?;
    let (configuration, findings) = Configuration::read(&String::from_utf8_lossy(&bytes), path);
    let checked = check_wiring(&configuration.entries, program, names);
    let mistakes = findings.file.iter().chain(&checked.mistakes);
    if let Some(Mistake { line, message }) = mistakes.min_by_key(|mistake| mistake.line) {
        return Err(format!("line {line}: {message}"));
    }
    let mut counts: HashMap<usize, usize> = HashMap::new();
    for point in &checked.points {
        *counts.entry(point.entry.line).or_default() += 1;
    }
    let mut numbers: HashMap<usize, usize> = HashMap::new();
    let mut points = HashMap::new();
    for point in &checked.points {
        let number = numbers.entry(point.entry.line).or_default();
        *number += 1;
        let count = counts.get(&point.entry.line).copied().unwrap_or(1);
        let own = point.address.as_ref().and_then(|address| address.written());
        let (address, number) = match own.filter(|_| count > 1) {
            Some(own) => (own, (1, 1)),
            None => (point.entry.address.clone(), (*number, count)),
        };
        let wired = Point { driver: point.entry.driver.name(), address, number };
        points.insert(point.symbol.name.clone(), wired);
    }
    Ok(points)
}

/// What entries without mistakes say of the variables that are given from outside, by the variables' names.
pub fn input_rules(checked: &Checked) -> Vec<(String, Rule)> {
    let given = checked.points.iter().filter(|point| point.is_input);
    given.map(|point| (point.symbol.name.clone(), point.rule())).collect()
}

/// What an entry of the table `[safe]` says.
pub fn safe_output(SafeEntry { name, value, .. }: &SafeEntry) -> SafeOutput {
    SafeOutput { name: name.trim().into(), value: SafeValue::parse(value) }
}

/// Sets what a configuration says and the command line has left open; of `safe` the command line counts where both name an output.
/// Gives the values that a control does not take.
pub fn apply(configuration: &Configuration, run: &mut RunArgs) -> Vec<Mistake> {
    let Configuration { period, retain, record, socket, image, log, key, .. } = configuration;
    let or = |own: &mut Option<_>, configured: &Option<_>| {
        *own = own.take().or_else(|| configured.clone());
    };
    or(&mut run.retain, retain);
    or(&mut run.record, record);
    or(&mut run.socket, socket);
    or(&mut run.image, image);
    or(&mut run.log, log);
    or(&mut run.key, key);
    run.control.pmi.period = run.control.pmi.period.or(*period);
    let mut values = Values { configuration, mistakes: vec![] };
    let keep = values.parsed("keep", configuration.keep.as_ref(), str::parse);
    run.keep = run.keep.or(keep);
    let watchdog = values.parsed("watchdog", configuration.watchdog.as_ref(), args::watchdog);
    run.watchdog = run.watchdog.or(watchdog);
    let overrun = values.parsed("overrun", configuration.overrun.as_ref(), str::parse);
    run.overrun = run.overrun.or(overrun);
    values.list("allow", &configuration.allow, &mut run.allow);
    values.list("allow-user", &configuration.allow_user, &mut run.allow_user);
    values.list("allow-group", &configuration.allow_group, &mut run.allow_group);
    // The last one of a name counts.
    let safe = configuration.safe.iter().map(safe_output);
    run.safe.splice(0..0, safe);
    values.mistakes
}

/// Texts of a configuration while they are read.
struct Values<'a> {
    configuration: &'a Configuration,
    mistakes: Vec<Mistake>,
}

impl Values<'_> {
    /// The value of a text, if there is one that can be read.
    fn parsed<T, E: Display>(
        &mut self,
        key: &str,
        text: Option<&String>,
        parse: impl FnOnce(&str) -> Result<T, E>,
    ) -> Option<T> {
        let text = text?;
        let wrong = |why: E| Mistake {
            line: self.configuration.line_of(key),
            message: format!("`{key}`: \"{text}\" is not taken: {why}"),
        };
        parse(text).map_err(|why| self.mistakes.push(wrong(why))).ok()
    }

    /// Reads a list of texts, which counts where the command line has none.
    fn list<T: FromStr<Err: Display>>(&mut self, key: &str, texts: &[String], to: &mut Vec<T>) {
        let values: Vec<T> =
            texts.iter().filter_map(|text| self.parsed(key, Some(text), str::parse)).collect();
        if to.is_empty() {
            *to = values;
        }
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    fn applied(text: &str, mut run: RunArgs) -> (RunArgs, Vec<Mistake>) {
        let (configuration, findings) = Configuration::read(text, Path::new("etc/c.toml"));
        assert_eq!(findings.for_control(), []);
        let mistakes = apply(&configuration, &mut run);
        (run, mistakes)
    }

    #[test]
    fn the_command_line_counts_more() {
        let text = "artifact = \"p\"\nlog = \"l\"\nimage = \"i\"\nperiod = 5\nsocket = \"s\"\n\
                    allow = [\"stop\", \"swap\"]\nallow-user = \"7\"\n[safe]\nA = 1\n";
        let own = "B=2".parse::<SafeOutput>();
        let given = RunArgs {
            log: Some("own".into()),
            allow: "force".parse().into_iter().collect(),
            safe: own.into_iter().collect(),
            ..RunArgs::default()
        };
        let (run, mistakes) = applied(text, given);
        assert_eq!(mistakes, []);
        assert_eq!(run.log.as_deref(), Some(Path::new("own")));
        assert_eq!(run.image.as_deref(), Some(Path::new("etc/i")));
        assert_eq!(run.control.pmi.period, Some(Duration::from_millis(5)));
        assert_eq!((run.allow.len(), run.allow_user.len()), (1, 1));
        let names: Vec<_> = run.safe.iter().map(|safe| safe.name.as_str()).collect();
        assert_eq!(names, ["A", "B"], "the last one counts");
    }

    #[test]
    fn values_that_are_not_taken_have_lines() {
        let text = "artifact = \"p\"\nkeep = \"1\"\nwatchdog = \"5\"\noverrun = \"skipp\"\nsocket = \"s\"\n\
                    allow = [\"stop\", \"fly\"]\n";
        let (_, mistakes) = applied(text, RunArgs::default());
        let lines: Vec<_> = mistakes.iter().map(|mistake| mistake.line).collect();
        assert_eq!(lines, [2, 3, 4, 6], "{mistakes:?}");
    }
}
