//! The watch list (PMI 5.2, PMAC's watch window), and setting variables.

use std::collections::BTreeMap;

use plcc_frontend::presentation::WatchRow;
use plcc_runtime::Purpose;

use super::Session;
use super::machine::PRESS;
use super::read::formatted;
use super::store::{Entry, checked_name};
use crate::view::{Said, VariableRow, VariablesView};
use crate::{Format, Refusal, Reply, RunningProgram};

/// How many rows a list has at most. All of them are read from the control and shown ten times a second.
const MAX_LIST_ROWS: usize = 2000;

/// What the watch list holds beside what is kept in the file.
#[derive(Debug, Default)]
pub(super) struct WatchState {
    /// The values of the last view.
    last: BTreeMap<String, f64>,
}

impl Session<'_> {
    pub(super) fn variables_view(&mut self) -> Result<VariablesView, Refusal> {
        let entries = self.store.entries().to_vec();
        let rows: Vec<(Entry, WatchRow)> = entries
            .into_iter()
            .flat_map(|entry| {
                let rows = self.rows_of(&entry.name).unwrap_or_default();
                rows.into_iter().map(move |row| (entry.clone(), row))
            })
            .collect();
        let variables = rows.iter().filter(|(_, row)| row.fixed.is_none());
        let names: Vec<String> = variables.map(|(_, row)| row.name.clone()).collect();
        let moment = self.read(&names)?;
        let forces = self.forces();
        let language = self.language();
        let mut shown = vec![];
        for (entry, row) in rows {
            let number = row.fixed.or_else(|| moment.values.get(&row.name).copied());
            let last = self.watch.last.get(&row.name).copied();
            let said = self.said(&row.name);
            // The name by which the user called it, unless that is the one of the machine file.
            let called = || {
                let is_other = row.name != entry.name;
                let is_said = said.alias.eq_ignore_ascii_case(&entry.name);
                (is_other && !is_said).then(|| entry.name.clone())
            };
            shown.push(VariableRow {
                title: row.title.map(str::to_owned).or_else(called),
                said,
                value: number.map(|value| formatted(value, entry.format, language)),
                format: entry.format,
                logical: matches!(number, Some(value) if value == 0.0 || value == 1.0),
                forced: forces.iter().any(|force| force.name == row.name),
                changed: row.fixed.is_none() && last.is_some() && last != number,
                entry: entry.name,
                name: row.name,
            });
        }
        self.watch.last = moment.values;
        Ok(VariablesView {
            lists: self.store.lists(),
            list: self.store.list().to_owned(),
            rows: shown,
            moment: moment.text,
        })
    }

    /// What the machine file says of a variable, in columns.
    pub(super) fn said(&self, name: &str) -> Said {
        let program = self.debugger.as_ref().map(|debugger| debugger.program());
        let said = program.and_then(|program| program.given().said_of(name));
        let shown = |text: &str| plcc_abi::printable(text).into_owned();
        said.map_or_else(Said::default, |said| Said {
            alias: shown(&said.alias),
            text: shown(&said.text),
            device: shown(&said.device),
            at: shown(&said.at),
        })
    }

    /// The rows of an entry.
    fn rows_of(&self, entry: &str) -> Result<Vec<WatchRow>, Refusal> {
        match &self.debugger {
            Some(debugger) => {
                let program = debugger.program();
                let own = program.given().replaced(entry);
                let own = own.as_deref().unwrap_or(entry);
                program.checked().watch_rows(own).map_err(Refusal::new)
            }
            None => Ok(vec![WatchRow::of(entry)]),
        }
    }

    /// The variable for which the program defines a name.
    pub(super) fn defined_name(&self, word: &str) -> Option<String> {
        self.debugger.as_ref()?.program().defined_name(word)
    }

    pub(super) fn watch(&mut self, names: &[String]) -> Result<Reply, Refusal> {
        let names: Vec<&str> =
            names.iter().map(|name| name.trim()).filter(|name| !name.is_empty()).collect();
        let mut wanted = vec![];
        for name in &names {
            let rows = self.rows_of(name)?;
            wanted.extend(rows.into_iter().filter(|row| row.fixed.is_none()).map(|row| row.name));
        }
        let entries = self.store.entries().iter();
        let shown: usize =
            entries.map(|entry| self.rows_of(&entry.name).map_or(0, |rows| rows.len())).sum();
        if shown + wanted.len() > MAX_LIST_ROWS {
            let what = format!("a list has at most {MAX_LIST_ROWS} rows; begin another list");
            return Err(Refusal::new(what));
        }
        let found = self.read(&wanted)?;
        if let Some(missing) = wanted.iter().find(|name| !found.values.contains_key(*name)) {
            return Err(self.unknown(missing));
        }
        let mut added = 0;
        for name in names {
            if self.store.add(Entry { name: name.to_owned(), format: Format::Decimal }) {
                added += 1;
            }
        }
        self.save()?;
        Ok(Reply::message(match added {
            0 => "they are in the list already".to_owned(),
            1 => "1 entry was added".to_owned(),
            _ => format!("{added} entries were added"),
        }))
    }

    /// The error for a name that nothing has, with one that is similar.
    pub(super) fn unknown(&mut self, name: &str) -> Refusal {
        if let Some(debugger) = &mut self.debugger {
            let executive = debugger.history_mut().executive();
            if let Err(error) = executive.names().find(name, Purpose::Watch) {
                return Refusal::new(error.to_string());
            }
        }
        Refusal::new(format!("the program has no variable named `{name}`"))
    }

    pub(super) fn unwatch(&mut self, name: &str) -> Result<Reply, Refusal> {
        if !self.store.remove(name) {
            return Err(Refusal::new(format!("`{name}` is not in the list")));
        }
        self.save()
    }

    pub(super) fn clear_watch(&mut self) -> Result<Reply, Refusal> {
        self.store.clear();
        self.save()
    }

    pub(super) fn set_format(&mut self, name: &str, format: Format) -> Result<Reply, Refusal> {
        if !self.store.set_format(name, format) {
            return Err(Refusal::new(format!("`{name}` is not in the list")));
        }
        self.save()
    }

    pub(super) fn choose_list(&mut self, list: &str) -> Result<Reply, Refusal> {
        let list = checked_name(list)?;
        self.store.choose(list);
        self.save()?;
        Ok(Reply::message(format!("list {list}")))
    }

    pub(super) fn remove_list(&mut self, list: &str) -> Result<Reply, Refusal> {
        if !self.store.remove_list(list) {
            return Err(Refusal::new(format!("there is no list `{list}`")));
        }
        self.save()
    }

    /// Sets a variable once.
    pub(super) fn change(&mut self, name: &str, value: &str) -> Result<Reply, Refusal> {
        let name = self.defined_name(name).unwrap_or_else(|| name.trim().to_owned());
        if self.is_in_source(&name) {
            return self.change_source(&name, value);
        }
        if self.is_past() && self.is_command(&name) {
            return Err(Refusal::new(format!(
                "{name} acts on the machine as it is now, and the past is shown: go to the present first"
            )));
        }
        let presses = value == PRESS && self.is_command(&name);
        self.ask_before(&name, Some(value), false)?;
        let tick = match presses {
            true => self.press(&name)?,
            false => self.act(&name, Some(value), false)?,
        };
        Ok(Reply::message(format!("{name}={value} before tick {tick}")))
    }

    /// Whether a name is that of a command or a key: it can be set, and has no value.
    fn is_command(&mut self, name: &str) -> bool {
        let Some(debugger) = &mut self.debugger else { return false };
        let names = debugger.history_mut().executive().names();
        let found = |purpose| names.find(name, purpose).is_ok();
        found(Purpose::Stimulus) && !found(Purpose::Watch)
    }

    /// Whether a name means a number of the source.
    fn is_in_source(&self, name: &str) -> bool {
        let program = self.debugger.as_ref().map(|debugger| debugger.program());
        program.is_some_and(|program| program.checked().is_in_source(name))
    }

    /// Builds the program that the control runs with another delay or constant, and has it take the place of the one that
    /// runs (PMI 5.2 `change`).
    fn change_source(&mut self, name: &str, value: &str) -> Result<Reply, Refusal> {
        let place = self.debugger()?.program().checked().place_of_value(name);
        if place.is_none() {
            return Err(Refusal::new(format!(
                "{name} is neither the delay of a timer, as in TC#DELAY, nor a constant that is an INTEGER or LONG"
            )));
        }
        let value: i64 = value.parse().map_err(|_| {
            Refusal::new(format!("{name} takes a whole number, and `{value}` is not one"))
        })?;
        if self.link.is_some() && self.rebuilder.is_some() {
            self.ask_before(name, Some(&value.to_string()), false)?;
        }
        let (Some(link), Some(rebuilder)) = (&mut self.link, &mut self.rebuilder) else {
            return Err(Refusal::new(format!(
                "{name} is in the source; it can be changed from here only in a control that runs, named by its socket \
                 and --record"
            )));
        };
        // Another change may just have been made, which must not be lost.
        let status = link.ask_status()?;
        if !status.allow.iter().any(|word| word == "swap") {
            return Err(Refusal::new(format!(
                "{name} is in the source, so a change is another program: the control was started without --allow swap"
            )));
        }
        let running =
            RunningProgram { fingerprint: status.fingerprint, generation: status.generation };
        let rebuilt = rebuilder.rebuild(&running, name, value).map_err(Refusal::new)?;
        let tick = link.swap(&rebuilt.artifact)?;
        let artifact = rebuilt.artifact.file_name().unwrap_or_default().to_string_lossy();
        let old = rebuilt.old;
        Ok(Reply::message(format!("{name}={value} (was {old}) from tick {tick} on: {artifact}")))
    }

    /// Has the control run the program again that was replaced last.
    pub(super) fn rollback(&mut self) -> Result<Reply, Refusal> {
        let missing = || Refusal::new("only a control has programs that were replaced");
        let tick = self.link.as_mut().ok_or_else(missing)?.rollback()?;
        Ok(Reply::message(format!("the program before runs again from tick {tick} on")))
    }

    /// Sets a variable, or forces it (`force`), in the control or in the program that is run here; without a value
    /// ends its force. Gives the tick before which it is done.
    pub(super) fn act(
        &mut self,
        name: &str,
        value: Option<&str>,
        force: bool,
    ) -> Result<u64, Refusal> {
        // An operator need not be allowed to set variables.
        let presses_alone = self.operator && !self.allows("write");
        if let Some(link) = &mut self.link {
            return match (value, force) {
                (Some(value), false) if presses_alone => link.press(name, value != "0"),
                (Some(value), false) => link.set(name, value),
                (Some(value), true) => link.force(name, value),
                (None, _) => link.release(Some(name)),
            };
        }
        let tick = self.time.run_until;
        self.executive_tick = None;
        let debugger = self.debugger()?;
        if !debugger.may_change() {
            return Err(Refusal::new("a recording can't be changed"));
        }
        debugger.history_mut().change(tick, name, value, force)?;
        Ok(tick)
    }
}
