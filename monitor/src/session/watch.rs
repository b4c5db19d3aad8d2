//! The watch list (PMI 5.2, PMAC's watch window), and setting variables.

use std::collections::BTreeMap;

use plcc_abi::Tables;
use plcc_abi::pmi::{PmiTables, Role, Symbol};

use super::Session;
use super::read::formatted;
use super::store::{Entry, checked_name};
use crate::view::{VariableRow, VariablesView};
use crate::{Format, Refusal, Reply, RunningProgram};

/// How many rows an entry has at most.
const MAX_ROWS: u32 = 1024;
/// How many rows a list has at most. All of them are read from the control and shown ten times a second.
const MAX_LIST_ROWS: usize = 2000;

/// What the watch list holds beside what is kept in the file.
#[derive(Debug, Default)]
pub(super) struct WatchState {
    /// The values of the last view.
    last: BTreeMap<String, f64>,
}

/// A row of the watch list. An entry such as `A[2-5]` has several.
#[derive(Clone, Debug, PartialEq)]
struct Row {
    name: String,
    title: Option<&'static str>,
    /// The value, for a row that is no variable: the delay of a timer.
    fixed: Option<f64>,
}

impl Row {
    fn of(name: impl Into<String>) -> Self {
        Self { name: name.into(), title: None, fixed: None }
    }

    fn titled(name: impl Into<String>, title: &'static str) -> Self {
        Self { title: Some(title), ..Self::of(name) }
    }
}

impl Session<'_> {
    pub(super) fn variables_view(&mut self) -> Result<VariablesView, Refusal> {
        let entries = self.store.entries().to_vec();
        let rows: Vec<(Entry, Row)> = entries
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
            let resolved =
                (row.name != entry.name && row.title.is_none()).then(|| entry.name.clone());
            shown.push(VariableRow {
                title: row.title.map(str::to_owned).or(resolved),
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

    /// The rows of an entry.
    fn rows_of(&self, entry: &str) -> Result<Vec<Row>, Refusal> {
        match self.tables() {
            Some(Tables::Pmi(tables)) => pmi_rows(tables, entry),
            Some(Tables::Pmac(_)) => pmac_rows(entry, &|word| self.defined_name(word)),
            _ => Ok(vec![Row::of(entry)]),
        }
    }

    /// The variable for which a PMAC program defines a name. In the other languages a name means the variable itself, and
    /// `TC#COUNT` is no expression of PMI, where `#` ends the line.
    pub(super) fn defined_name(&self, word: &str) -> Option<String> {
        if !matches!(self.tables(), Some(Tables::Pmac(_))) {
            return None;
        }
        let expression = self.debugger.as_ref()?.program().expression(word).ok()?;
        match expression.variables() {
            [name] if !name.eq_ignore_ascii_case(word) => Some(name.clone()),
            _ => None,
        }
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
            if let Err(error) = executive.find(name, plcc_runtime::Purpose::Watch) {
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
        let tick = self.act(&name, Some(value), false)?;
        Ok(Reply::message(format!("{name}={value} before tick {tick}")))
    }

    /// Whether a name means a number of the source: the delay of a PMI timer, or a constant.
    fn is_in_source(&self, name: &str) -> bool {
        let Some(Tables::Pmi(tables)) = self.tables() else { return false };
        let base = name.split_once('[').map_or(name, |(base, _)| base);
        let symbol = tables.symbols.iter().find(|symbol| symbol.name == base);
        name.ends_with("#DELAY") || symbol.is_some_and(|symbol| symbol.role == Role::Constant)
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
        let value: i64 = value
            .parse()
            .map_err(|_| Refusal::new(format!("`{value}` is no whole number, which {name} is")))?;
        let (Some(link), Some(rebuilder)) = (&mut self.link, &mut self.rebuilder) else {
            return Err(Refusal::new(format!(
                "{name} stands in the source; only in a control that runs, named by its socket and --record, can it be \
                 changed from here"
            )));
        };
        // Another change may just have been made, which must not be lost.
        let status = link.ask_status()?;
        if !status.allow.iter().any(|word| word == "swap") {
            return Err(Refusal::new(format!(
                "{name} stands in the source, so a change is another program: the control was started without --allow swap"
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
        if let Some(link) = &mut self.link {
            return match (value, force) {
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

/// The rows of an entry of PMI (PMI 5.2).
fn pmi_rows(tables: &PmiTables, entry: &str) -> Result<Vec<Row>, Refusal> {
    let (base, index) = match entry.split_once('[') {
        Some((base, rest)) => (base.trim(), rest.strip_suffix(']').map(str::trim)),
        None => (entry, None),
    };
    let find = |name: &str| tables.symbols.iter().find(|symbol| symbol.name == name);
    let Some(symbol) = find(base) else { return Ok(vec![Row::of(entry)]) };
    if let Some(elements) = symbol.elements {
        let (first, last) = match index {
            None | Some("*") => (0, elements.saturating_sub(1)),
            Some(range) => {
                let (first, last) = range.split_once('-').unwrap_or((range, range));
                let number = |text: &str| text.trim().parse::<u32>().ok();
                let wrong = || Refusal::new(format!("`{range}` is neither `*`, N nor M-N"));
                (number(first).ok_or_else(wrong)?, number(last).ok_or_else(wrong)?)
            }
        };
        if first > last || last >= elements {
            let end = elements.saturating_sub(1);
            return Err(Refusal::new(format!("the elements are {base}[0] to {base}[{end}]")));
        }
        let last = last.min(first + MAX_ROWS - 1);
        return Ok((first..=last).map(|index| Row::of(format!("{base}[{index}]"))).collect());
    }
    let name_at = |offset: u32| {
        let at = |symbol: &&Symbol| symbol.offset == offset && symbol.elements.is_none();
        tables.symbols.iter().find(at).map(|symbol| symbol.name.clone())
    };
    if let Role::TimerControl(timer) = symbol.role
        && let Some(timer) = tables.timers.get(timer as usize)
    {
        let delay = Row::titled(format!("{base}#DELAY"), "delay value");
        let delay = Row { fixed: Some(f64::from(timer.preset)), ..delay };
        let contact = name_at(timer.delayed).map(|name| Row::titled(name, "delayed contact"));
        let mut rows = vec![Row::titled(base, "control contact")];
        rows.extend(contact);
        rows.extend([delay, Row::titled(format!("{base}#COUNT"), "timer counter")]);
        return Ok(rows);
    }
    let flip_flop = tables.flipflops.iter().find(|one| one.q == symbol.offset);
    if let Some(one) = flip_flop {
        let pins = [
            (Some(one.q), "Q"),
            (one.d, "D"),
            (one.clock, "CK"),
            (one.preset, "PR"),
            (one.clear, "CL"),
        ];
        let rows =
            pins.into_iter().filter_map(|(offset, pin)| Some(Row::titled(name_at(offset?)?, pin)));
        return Ok(rows.collect());
    }
    Ok(vec![Row::of(entry)])
}

/// The rows of an entry of PMAC: a range as in `P1..5`, a variable, a name that the program defines.
fn pmac_rows(entry: &str, defined: &dyn Fn(&str) -> Option<String>) -> Result<Vec<Row>, Refusal> {
    if let Some((first, last)) = entry.split_once("..") {
        let digits = first.find(|c: char| c.is_ascii_digit()).unwrap_or(first.len());
        let (letters, first) = first.split_at_checked(digits).unwrap_or((first, ""));
        let wrong = || Refusal::new(format!("`{entry}` is no range: one is written P1..5"));
        let first: u32 = first.parse().map_err(|_| wrong())?;
        let last: u32 = last.trim().parse().map_err(|_| wrong())?;
        if first > last {
            return Err(wrong());
        }
        let last = last.min(first.saturating_add(MAX_ROWS - 1));
        let letters = letters.to_uppercase();
        return Ok((first..=last).map(|number| Row::of(format!("{letters}{number}"))).collect());
    }
    Ok(vec![Row::of(defined(entry).unwrap_or_else(|| entry.to_uppercase()))])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_range_may_end_at_the_largest_number() {
        let rows = pmac_rows("P4294967294..4294967295", &|_| None).unwrap();
        assert_eq!(rows, [Row::of("P4294967294"), Row::of("P4294967295")]);
    }
}
