//! The keys of a table, read one by one, so that each mistake is found, with its line.

use std::collections::HashSet;
use std::time::Duration;

use plcc_abi::{closest, printable};
use toml::de::{DeTable, DeValue};

use crate::value::{self, Result};
use crate::{LineNumbers, Mistake};

/// A table while its keys are read.
#[derive(Debug)]
pub struct Keys<'a> {
    table: Option<&'a DeTable<'a>>,
    /// How messages name the table.
    name: &'static str,
    lines: &'a LineNumbers,
    /// The line of the table, for what is missing in it.
    line: usize,
    known: Vec<&'static str>,
    mistakes: Vec<Mistake>,
    /// Whether all values so far were of their kind.
    is_usable: bool,
}

impl<'a> Keys<'a> {
    /// The keys of a table; without one they are all missing. `name` is how messages name it, such as `[plcio]`, and `line` its line.
    pub fn new(
        table: Option<&'a DeTable<'a>>,
        name: &'static str,
        lines: &'a LineNumbers,
        line: usize,
    ) -> Self {
        let (known, mistakes) = (vec![], vec![]);
        Self { table, name, lines, line, known, mistakes, is_usable: true }
    }

    /// Which line an offset is in.
    pub fn lines(&self) -> &'a LineNumbers {
        self.lines
    }

    /// The value of a key, and the key's line; from now on there is a key of this name.
    pub fn take(&mut self, key: &'static str) -> Option<(usize, &'a toml::Spanned<DeValue<'a>>)> {
        self.known.push(key);
        let (found, value) = self.table?.get_key_value(key)?;
        Some((self.lines.line(found.span().start), value))
    }

    /// The value of a key, read by a function of [`value`](mod@value) or one like them.
    pub fn read<T>(
        &mut self,
        key: &'static str,
        read: impl FnOnce(&DeValue<'_>) -> Result<T>,
    ) -> Option<T> {
        let (line, value) = self.take(key)?;
        match read(value.get_ref()) {
            Ok(value) => Some(value),
            Err(expected) => {
                self.wrong(line, format!("`{key}`: {expected}"));
                self.is_usable = false;
                None
            }
        }
    }

    /// The value of a key that has an older name as well, with another kind of value.
    pub fn read_renamed<T>(
        &mut self,
        key: &'static str,
        read: impl FnOnce(&DeValue<'_>) -> Result<T>,
        old_key: &'static str,
        read_old: impl FnOnce(&DeValue<'_>) -> Result<T>,
    ) -> Option<T> {
        let new = self.read(key, read);
        if self.has(key)
            && let Some((line, _)) = self.take(old_key)
        {
            self.wrong(
                line,
                format!("`{old_key}` is an older name of `{key}`, which is there too"),
            );
            return new;
        }
        new.or(self.read(old_key, read_old))
    }

    /// A time of a driver: `key` has it with its unit, and `old_key` as a number of milliseconds.
    pub fn time(&mut self, key: &'static str, old_key: &'static str) -> Option<Duration> {
        self.read_renamed(key, value::time, old_key, value::milliseconds)
    }

    /// Whether a key is there.
    pub fn has(&self, key: &str) -> bool {
        self.table.is_some_and(|table| table.contains_key(key))
    }

    /// The line of a key that is there, else that of the table.
    pub fn line_of(&self, key: &str) -> usize {
        let found = self.table.and_then(|table| table.get_key_value(key));
        found.map_or(self.line, |(key, _)| self.lines.line(key.span().start))
    }

    /// Notes a mistake in a line.
    pub fn wrong(&mut self, line: usize, message: String) {
        self.mistakes.push(Mistake { line, message });
    }

    /// Notes that the value of a key can't be used.
    pub fn refuse(&mut self, line: usize, message: String) {
        self.wrong(line, message);
        self.is_usable = false;
    }

    /// Notes mistakes that were found otherwise.
    pub fn add(&mut self, mistakes: impl IntoIterator<Item = Mistake>) {
        self.mistakes.extend(mistakes);
    }

    /// Notes a key that is missing.
    pub fn require(&mut self, key: &'static str) {
        if !self.has(key) {
            let message = format!("the key `{key}` is missing in this {}", self.name);
            self.refuse(self.line, message);
        }
    }

    /// Notes the keys that there are not, and gives all mistakes, and whether all values were of their kind.
    pub fn finish(mut self) -> (Vec<Mistake>, bool) {
        let taken: HashSet<&str> = self.known.iter().copied().collect();
        for (key, _) in self.table.into_iter().flatten() {
            let (name, line) = (key.get_ref().as_ref(), self.lines.line(key.span().start));
            if !taken.contains(name) {
                // The beginning of a key, such as `desc`, may be far from it in letters.
                let begins = || self.known.iter().copied().find(|known| known.starts_with(name));
                let near = closest(name, self.known.iter().copied()).or_else(begins);
                let near = near.map(|near| format!("; did you mean `{near}`?"));
                let place =
                    if self.name.is_empty() { String::new() } else { format!(" in {}", self.name) };
                let (name, near) = (printable(name), near.unwrap_or_default());
                self.mistakes.push(Mistake {
                    line,
                    message: format!("there is no key `{name}`{place}{near}"),
                });
            }
        }
        (self.mistakes, self.is_usable)
    }
}
