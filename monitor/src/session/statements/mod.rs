//! The statement display: which lines are shown, and what their statements did (PMI 5.1, NCT 5).

mod find;
mod tokens;

use plcc_replay::Debugger;
use plcc_replay::trace::Access;

use super::{Session, values};
use crate::Refusal;
use crate::flow::Executed;
use crate::text::ProgramText;
use crate::view::{
    DirectoryRow, DirectoryView, Execution, NamedValue, ReferencesView, Role, StatementLayout,
    StatementLine, StatementsView,
};
use tokens::{statement_token, token};

/// What is shown of the program.
#[derive(Debug, Default)]
pub(in crate::session) struct StatementState {
    /// The rows that were chosen; `None` shows the whole program.
    chosen: Option<Vec<usize>>,
    /// The row with the cursor.
    cursor: usize,
    values: bool,
    /// What was looked for last, and whether uses count.
    names: Vec<String>,
    uses: bool,
    /// How many lines the display had last.
    count: usize,
    /// The first line that it showed.
    first: usize,
}

impl StatementState {
    /// What is shown at first: the statements of these source line numbers, or the whole program.
    pub(in crate::session) fn new(text: &ProgramText, numbers: Option<&[String]>) -> Self {
        let first = text.rows.iter().position(|row| !row.statements.is_empty());
        let rows = || text.rows.iter().enumerate();
        let chosen = numbers.map(|numbers| {
            let known = rows().filter(|(_, row)| numbers.contains(&row.number));
            known.map(|(row, _)| row).collect()
        });
        Self { chosen, cursor: first.unwrap_or(0), values: true, count: 20, ..Self::default() }
    }
}

impl StatementState {
    /// Puts the cursor on a row.
    pub(in crate::session) fn go_to(&mut self, row: usize) {
        self.cursor = row;
    }

    /// The source line numbers of the chosen statements; `None` for the whole program.
    pub(in crate::session) fn chosen_numbers(&self, text: &ProgramText) -> Option<Vec<String>> {
        let number = |&row: &usize| Some(text.rows.get(row)?.number.clone());
        self.chosen.as_ref().map(|chosen| chosen.iter().filter_map(number).collect())
    }
}

/// What the statements of a row did, taken together.
struct RowFlow {
    execution: Execution,
    times: u32,
    /// In order of execution.
    accesses: Vec<Access>,
    /// The statements and what each of them did.
    by_statement: Vec<(u32, Executed)>,
}

impl Session<'_> {
    /// The rows that are shown.
    fn shown_rows(&self) -> Vec<usize> {
        match &self.statements.chosen {
            Some(chosen) => chosen.clone(),
            None => (0..self.text.rows.len()).collect(),
        }
    }

    pub(in crate::session) fn cursor_row(&self) -> Option<usize> {
        (self.statements.cursor < self.text.rows.len()).then_some(self.statements.cursor)
    }

    pub(in crate::session) fn statements_view(
        &mut self,
        first: Option<usize>,
        count: usize,
    ) -> Result<StatementsView, Refusal> {
        let scan = self.scan_text()?;
        let shown = self.shown_rows();
        let cursor = shown.iter().position(|&row| row >= self.statements.cursor);
        let cursor = cursor.unwrap_or(shown.len().saturating_sub(1));
        let first = match first {
            Some(first) => first.min(shown.len().saturating_sub(1)),
            None => {
                let last = self.statements.first;
                let lowest = (cursor + 1).saturating_sub(count);
                last.clamp(lowest, cursor.max(lowest))
            }
        };
        (self.statements.first, self.statements.count) = (first, count);
        let rows: Vec<usize> = shown.iter().skip(first).take(count).copied().collect();
        let waits = self.waiting_rows()?;
        let mut lines = vec![];
        for &row in &rows {
            let mut line = self.line(row)?;
            let here = waits.iter().filter(|(_, at)| *at == row);
            line.waits = here.map(|(task, _)| task.clone()).collect();
            lines.push(line);
        }
        let layout = match self.debugger()?.program().language().chooses_statements() {
            true => StatementLayout::ValuesAbove,
            false => StatementLayout::ValuesRight,
        };
        Ok(StatementsView {
            layout,
            chosen: self.statements.chosen.is_some(),
            values: self.statements.values,
            total: shown.len(),
            first,
            cursor,
            last_number: lines.last().map_or_else(String::new, |line| line.number.clone()),
            lines,
            scan,
        })
    }

    /// Which scan is shown.
    fn scan_text(&mut self) -> Result<String, Refusal> {
        let tick = self.time.shown;
        let names: Vec<String> = {
            let tasks = &self.debugger()?.program().tables().tasks;
            tasks.iter().map(|task| task.name.clone()).collect()
        };
        let flow = self.flow()?;
        let scans: Vec<String> = flow
            .tasks
            .iter()
            .map(|(task, scan)| {
                let name = names.get(*task).map_or("", String::as_str);
                match (scan.tick == tick, scan.begun == scan.tick) {
                    (true, true) => name.to_owned(),
                    (false, true) => format!("{name} in {}", scan.tick),
                    _ => format!("{name} in {}-{}", scan.begun, scan.tick),
                }
            })
            .collect();
        Ok(match scans.as_slice() {
            [] => format!("tick {tick}: no statement was executed"),
            _ => format!("tick {tick}: {}", scans.join(", ")),
        })
    }

    /// The tasks that wait in the middle of their text, with the row.
    pub(in crate::session) fn waiting_rows(&mut self) -> Result<Vec<(String, usize)>, Refusal> {
        let waiting: Vec<(usize, u32)> = {
            let tasks = self.flow()?.tasks.iter();
            tasks
                .filter_map(|(&task, scan)| Some((task, scan.last.filter(|_| scan.waits)?)))
                .collect()
        };
        let mut found = vec![];
        for (task, last) in waiting {
            let Some(row) = self.text.row_of(last) else { continue };
            let program = self.debugger.as_ref().map(Debugger::program);
            let Some(program) = program else { continue };
            let row = program.checked().waits_in(&self.text.rows, row);
            let tasks = &program.tables().tasks;
            let name = tasks.get(task).map_or_else(String::new, |task| task.name.clone());
            found.push((name, row));
        }
        Ok(found)
    }

    /// What the statements of a row did.
    fn row_flow(&mut self, row: usize) -> Result<RowFlow, Refusal> {
        let statements = self.text.rows.get(row).map_or(vec![], |row| row.statements.clone());
        let flow = self.flow()?;
        let by_statement: Vec<(u32, Executed)> = statements
            .iter()
            .filter_map(|statement| Some((*statement, flow.executed.get(statement)?.clone())))
            .collect();
        let execution = match (statements.is_empty(), by_statement.is_empty()) {
            (true, _) => Execution::NoStatement,
            (false, true) => Execution::NotExecuted,
            (false, false) => Execution::Executed,
        };
        let times = by_statement.iter().map(|(_, executed)| executed.times).max().unwrap_or(0);
        let accesses = by_statement.iter().flat_map(|(_, executed)| executed.accesses.clone());
        Ok(RowFlow { execution, times, accesses: accesses.collect(), by_statement })
    }

    /// A line with its values.
    fn line(&mut self, row: usize) -> Result<StatementLine, Refusal> {
        let flow = self.row_flow(row)?;
        let missing = || Refusal::new(format!("the program has no line {row}"));
        let content = self.text.rows.get(row).ok_or_else(missing)?;
        let (file, number) = (content.file, content.number.clone());
        let (pieces, comment) = (content.pieces.clone(), content.comment.clone());
        let comment = plcc_abi::printable(&comment).into_owned();
        let Some(debugger) = &self.debugger else { return Err(missing()) };
        let program = debugger.program();
        let named: Vec<(String, Access)> = flow
            .accesses
            .iter()
            .filter_map(|access| Some((program.name(access.variable)?, *access)))
            .collect();
        let mut used = vec![false; named.len()];
        let tokens = pieces.iter().map(|piece| match piece.statement {
            Some(statement) => statement_token(piece, statement, &flow, program),
            None => token(piece, &named, &mut used, program),
        });
        let tokens = tokens.collect();
        let mut values: Vec<NamedValue> = vec![];
        if self.statements.values {
            for (name, access) in &named {
                let value = values::shown(access.value, program.language());
                let shown = NamedValue { name: name.clone(), value, written: access.is_write };
                match values.iter_mut().find(|known| known.name == *name) {
                    Some(known) => *known = shown,
                    None => values.push(shown),
                }
            }
        }
        Ok(StatementLine {
            row,
            number,
            file: program.sources().path(file).into(),
            tokens,
            comment,
            values,
            execution: flow.execution,
            times: flow.times,
            waits: vec![],
        })
    }

    pub(in crate::session) fn directory(&mut self) -> Result<DirectoryView, Refusal> {
        self.debugger()?;
        let rows = (0..self.text.rows.len()).filter_map(|row| self.directory_row(row));
        Ok(DirectoryView { rows: rows.collect() })
    }

    fn directory_row(&self, row: usize) -> Option<DirectoryRow> {
        let content = self.text.rows.get(row)?;
        let is_label = content.pieces.iter().any(|piece| piece.role == Role::Label);
        if content.statements.is_empty() && !is_label {
            return None;
        }
        let chosen = self.statements.chosen.as_ref().is_none_or(|chosen| chosen.contains(&row));
        Some(DirectoryRow {
            row,
            number: content.number.clone(),
            name: content.name.clone(),
            chosen,
        })
    }

    /// Where a variable, label or statement occurs.
    pub(in crate::session) fn references(&mut self, name: &str) -> Result<ReferencesView, Refusal> {
        let program = self.debugger()?.program();
        let own = program.given().replaced(name);
        let wanted = own.as_deref().unwrap_or(name).trim().to_uppercase();
        let reference = program.checked().cross_reference();
        let files: Vec<(String, plcc_diag::FileId)> = (0..program.sources().len() as u32)
            .map(plcc_diag::FileId)
            .map(|file| (program.sources().path(file).to_owned(), file))
            .collect();
        let mut view = ReferencesView {
            name: name.trim().into(),
            meaning: None,
            written: vec![],
            read: vec![],
            tested: vec![],
            others: vec![],
        };
        let resolved = self.canonical_name(&wanted);
        let same = |row: &&plcc_frontend::common::CrossReferenceRow| {
            row.name.eq_ignore_ascii_case(&wanted) || row.name == resolved
        };
        for row in reference.rows.iter().filter(same) {
            view.meaning = view.meaning.or_else(|| row.meaning.clone());
            let Some((_, file)) = files.iter().find(|(path, _)| *path == row.file) else {
                continue;
            };
            let of = |lines: &[u32]| -> Vec<DirectoryRow> {
                let rows = lines.iter().filter_map(|&line| self.text.row_at(*file, line));
                rows.filter_map(|row| self.any_row(row)).collect()
            };
            view.written.extend(of(&row.written));
            view.read.extend(of(&row.read));
            view.tested.extend(of(&row.tested));
        }
        let known: Vec<usize> = [&view.written, &view.read, &view.tested]
            .into_iter()
            .flatten()
            .map(|row| row.row)
            .collect();
        let compact = |text: &str| text.replace(char::is_whitespace, "").to_uppercase();
        let wanted = compact(&wanted);
        let others = (0..self.text.rows.len()).filter(|row| !known.contains(row)).filter(|&row| {
            let pieces = self.text.rows.get(row).map_or(&[][..], |row| &row.pieces);
            pieces.iter().any(|piece| compact(&piece.text) == wanted)
        });
        view.others = others.filter_map(|row| self.any_row(row)).collect();
        let is_empty = known.is_empty() && view.others.is_empty();
        if is_empty {
            return Err(Refusal::new(format!("`{}` does not occur in the program", view.name)));
        }
        Ok(view)
    }

    /// A row for a list, also one without a statement; its name is its whole text.
    fn any_row(&self, row: usize) -> Option<DirectoryRow> {
        let content = self.text.rows.get(row)?;
        let chosen = self.statements.chosen.as_ref().is_none_or(|chosen| chosen.contains(&row));
        let name = content.text().trim().to_owned();
        Some(DirectoryRow { row, number: content.number.clone(), name, chosen })
    }

    /// A name as traces spell it, where the program has its own word for it.
    fn canonical_name(&self, name: &str) -> String {
        let rows = self.text.rows.iter().flat_map(|row| &row.pieces);
        let mut same = rows.filter(|piece| piece.text.eq_ignore_ascii_case(name));
        same.find_map(|piece| piece.name.clone()).unwrap_or_else(|| name.to_owned())
    }
}
