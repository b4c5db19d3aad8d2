//! Choosing and finding statements, and moving the cursor (PMI 5.1, NCT 5).

use plcc_frontend::presentation::{Block, Piece, Role};

use crate::session::Session;
use crate::{Refusal, Reply};

impl Session<'_> {
    pub(in crate::session) fn show_program(&mut self) -> Result<Reply, Refusal> {
        self.debugger()?;
        self.statements.chosen = None;
        Ok(Reply::default())
    }

    pub(in crate::session) fn clear_statements(&mut self) -> Result<Reply, Refusal> {
        self.debugger()?;
        self.statements.chosen = Some(vec![]);
        Ok(Reply::default())
    }

    pub(in crate::session) fn choose_statements(
        &mut self,
        rows: &[usize],
    ) -> Result<Reply, Refusal> {
        self.debugger()?;
        if let Some(wrong) = rows.iter().find(|row| **row >= self.text.rows.len()) {
            return Err(Refusal::new(format!("the program has no line {wrong}")));
        }
        for &row in rows {
            self.choose(row);
        }
        Ok(Reply::default())
    }

    /// Shows a row besides the chosen ones, and puts the cursor there.
    fn choose(&mut self, row: usize) {
        let chosen = self.statements.chosen.get_or_insert_default();
        if let Err(at) = chosen.binary_search(&row) {
            chosen.insert(at, row);
        }
        self.statements.cursor = row;
    }

    /// The rows with one of the names that were looked for.
    fn rows_with_names(&self) -> Vec<usize> {
        let matches = |piece: &Piece, is_first: bool, name: &str| {
            let label = name.strip_suffix(':').or_else(|| name.strip_prefix(':'));
            let is_same = piece.text.trim_start_matches('/').eq_ignore_ascii_case(name)
                || piece.name.as_deref().is_some_and(|own| own.eq_ignore_ascii_case(name));
            match (label, piece.role) {
                (Some(label), Role::Label) => {
                    is_first && piece.text.trim_matches(':').eq_ignore_ascii_case(label)
                }
                (None, Role::Keyword) => is_same,
                // A token that is a whole statement has its operand in it.
                (None, _) if piece.statement.is_some() => {
                    piece.text.to_uppercase().contains(&name.to_uppercase())
                }
                (None, Role::Variable) => is_same && (piece.target || self.statements.uses),
                _ => false,
            }
        };
        let rows = self.text.rows.iter().enumerate().filter(|(_, row)| {
            let visible = || row.pieces.iter().filter(|piece| piece.role != Role::Blank);
            self.statements
                .names
                .iter()
                .any(|name| visible().enumerate().any(|(at, piece)| matches(piece, at == 0, name)))
        });
        rows.map(|(row, _)| row).collect()
    }

    pub(in crate::session) fn find_names(
        &mut self,
        names: Vec<String>,
        uses: bool,
        all: bool,
    ) -> Result<Reply, Refusal> {
        self.debugger()?;
        let names: Vec<String> = names.iter().map(|name| name.trim().to_owned()).collect();
        (self.statements.names, self.statements.uses) = (names, uses);
        let found = self.rows_with_names();
        let Some(&first) = found.first() else {
            let names = self.statements.names.join(", ");
            return Err(Refusal::new(format!("no statement has {names}")));
        };
        match all {
            true => found.iter().rev().for_each(|&row| self.choose(row)),
            false => self.show_row(first),
        }
        let count = found.len();
        Ok(Reply::message(match (all, count) {
            (true, 1) => "1 statement".to_owned(),
            (true, _) => format!("{count} statements"),
            (false, _) => format!("1 of {count}"),
        }))
    }

    /// Shows a row: among the chosen ones, where some are chosen, else by moving the cursor there.
    fn show_row(&mut self, row: usize) {
        match self.statements.chosen {
            Some(_) => self.choose(row),
            None => self.statements.cursor = row,
        }
    }

    pub(in crate::session) fn find_next(&mut self) -> Result<Reply, Refusal> {
        self.debugger()?;
        if self.statements.names.is_empty() {
            return Err(Refusal::new("no name was given before"));
        }
        let found = self.rows_with_names();
        let next = found.iter().position(|&row| row > self.statements.cursor);
        let Some((at, &row)) = next.and_then(|at| Some((at, found.get(at)?))) else {
            return Err(Refusal::new("there is no further occurrence"));
        };
        self.show_row(row);
        Ok(Reply::message(format!("{} of {}", at + 1, found.len())))
    }

    pub(in crate::session) fn next_statement(&mut self) -> Result<Reply, Refusal> {
        self.debugger()?;
        let last = match &self.statements.chosen {
            Some(chosen) => chosen.last().copied(),
            None => Some(self.statements.cursor),
        };
        let from = last.map_or(self.statements.cursor, |last| last + 1);
        let has_statement = |row: &usize| self.directory_row(*row).is_some();
        let next = (from..self.text.rows.len()).find(has_statement);
        let next = next.ok_or_else(|| Refusal::new("this is the end of the program"))?;
        self.show_row(next);
        Ok(Reply::default())
    }

    pub(in crate::session) fn previous_statement(&mut self) -> Result<Reply, Refusal> {
        self.debugger()?;
        let first = match &self.statements.chosen {
            Some(chosen) => chosen.first().copied(),
            None => Some(self.statements.cursor),
        };
        let until = first.unwrap_or(self.statements.cursor);
        let has_statement = |row: &usize| self.directory_row(*row).is_some();
        let previous = (0..until).rev().find(has_statement);
        let previous =
            previous.ok_or_else(|| Refusal::new("this is the beginning of the program"))?;
        self.show_row(previous);
        Ok(Reply::default())
    }

    pub(in crate::session) fn move_cursor(&mut self, by: i64) -> Result<Reply, Refusal> {
        self.debugger()?;
        let shown = self.shown_rows();
        let at = shown.iter().position(|&row| row >= self.statements.cursor);
        let last = shown.len().saturating_sub(1);
        let to = (at.unwrap_or(last) as u64).saturating_add_signed(by).min(last as u64);
        if let Some(&row) = shown.get(to as usize) {
            self.statements.cursor = row;
        }
        Ok(Reply::default())
    }

    pub(in crate::session) fn put_cursor(&mut self, row: usize) -> Result<Reply, Refusal> {
        self.debugger()?;
        if row >= self.text.rows.len() {
            return Err(Refusal::new(format!("the program has no line {row}")));
        }
        self.show_row(row);
        Ok(Reply::default())
    }

    pub(in crate::session) fn module(&mut self, down: bool) -> Result<Reply, Refusal> {
        self.debugger()?;
        let begins = |row: &usize| self.text.rows.get(*row).is_some_and(|row| row.begins_part);
        let found = match down {
            true => (self.statements.cursor + 1..self.text.rows.len()).find(begins),
            false => (0..self.statements.cursor).rev().find(begins),
        };
        let row = found.ok_or_else(|| Refusal::new("there is no further module or label"))?;
        self.put_cursor(row)
    }

    /// From the beginning of a condition to its end, or back.
    pub(in crate::session) fn condition(&mut self) -> Result<Reply, Refusal> {
        self.debugger()?;
        let words = |row: usize| -> Vec<Block> {
            let pieces = self.text.rows.get(row).map_or(&[][..], |row| &row.pieces);
            pieces.iter().filter_map(|piece| piece.block).collect()
        };
        let cursor = self.statements.cursor;
        let nothing = || Refusal::new("no condition begins or ends in this line");
        let (mut opens, mut closes) = (0, 0);
        for word in words(cursor) {
            match word {
                Block::Opens => opens += 1,
                Block::Closes if opens > 0 => opens -= 1,
                Block::Closes => closes += 1,
            }
        }
        let found = if opens > 0 {
            let mut depth = opens;
            (cursor + 1..self.text.rows.len()).find(|&row| {
                words(row).into_iter().any(|word| {
                    match word {
                        Block::Opens => depth += 1,
                        Block::Closes => depth -= 1,
                    }
                    depth == 0
                })
            })
        } else if closes > 0 {
            let mut depth = closes;
            (0..cursor).rev().find(|&row| {
                words(row).into_iter().rev().any(|word| {
                    match word {
                        Block::Opens => depth -= 1,
                        Block::Closes => depth += 1,
                    }
                    depth == 0
                })
            })
        } else {
            return Err(nothing());
        };
        let row = found.ok_or_else(nothing)?;
        self.put_cursor(row)
    }

    pub(in crate::session) fn search(&mut self, text: &str, up: bool) -> Result<Reply, Refusal> {
        self.debugger()?;
        let compact = |text: &str| text.replace(char::is_whitespace, "").to_uppercase();
        let wanted = compact(text);
        if wanted.is_empty() {
            return Err(Refusal::new("there is nothing to search for"));
        }
        let has = |row: &usize| {
            self.text.rows.get(*row).is_some_and(|row| compact(&row.text()).contains(&wanted))
        };
        let cursor = self.statements.cursor;
        let found = match up {
            true => (0..cursor).rev().find(has),
            false => (cursor + 1..self.text.rows.len()).find(has),
        };
        let where_to = if up { "above" } else { "below" };
        let missing = || Refusal::new(format!("`{}` does not occur {where_to}", text.trim()));
        let row = found.ok_or_else(missing)?;
        self.put_cursor(row)
    }

    pub(in crate::session) fn toggle_values(&mut self) -> Result<Reply, Refusal> {
        self.debugger()?;
        self.statements.values = !self.statements.values;
        let state = if self.statements.values { "shown" } else { "hidden" };
        Ok(Reply::message(format!("values are {state}")))
    }
}
