//! What is shown of a program: what debuggers, displays and editors ask about its names and its text, so that they need
//! to know no language.
//!
//! [`Presentation`] is what they ask; the other files hold what they get, and what the languages make it with.

mod announced;
mod exchange;
mod fact;
mod io_point;
mod lines;
mod operator;
mod panel;
mod part;
mod places;
mod terminal;
#[cfg(test)]
pub(crate) mod testing;
mod text;
mod text_statement;
mod watch;

use std::collections::BTreeMap;

use plcc_diag::SourceMap;

use crate::common::Accessed;

pub use announced::Announced;
pub use exchange::{Exchange, Uses};
pub use fact::Fact;
pub use io_point::IoPoint;
pub use lines::Line;
pub use operator::operator_panel;
pub use panel::{Cell, PanelDraft, Shown};
pub use part::Part;
pub use places::{StatementPlace, StatementPlaces};
pub use terminal::{Answer, Desk, Terminal};
pub use text::{Block, Piece, Role, Row, Wording, rows};
pub use text_statement::TextStatement;
pub use watch::{MAX_ROWS, WatchRow};

/// Reads the values of variables at the moment that is shown. A name that has no value is left out.
pub type Read<'r> = &'r mut dyn FnMut(&[String]) -> Result<BTreeMap<String, f64>, String>;

/// What is shown of a checked program. Each language implements it in the folder `presentation` of its own.
pub trait Presentation {
    /// The name of a variable that a statement has accessed, as traces spell it. `None` for internal state without
    /// a name, such as the last clock of a flip-flop.
    fn name(&self, accessed: Accessed) -> Option<String>;

    /// What a name means, to compare it with what statements access: a variable, an element, or a whole array. `None` if
    /// no access is told by that name.
    fn accessed(&self, name: &str) -> Option<Accessed>;

    /// The canonical spelling of the name of a variable or a line; `None` if nothing has that name.
    fn canonical(&self, name: &str) -> Option<String> {
        self.name(self.accessed(name)?)
    }

    /// Whether a variable does not lie in the process image: its value is state of the executive.
    fn is_outside_image(&self, accessed: Accessed) -> bool;

    /// Whether a text can be nothing but a name, although a part of it would be an expression.
    fn is_only_a_name(&self, _text: &str) -> bool {
        false
    }

    /// The names of the bits of a word whose bits have names of their own, the lowest first.
    fn bit_names(&self, _name: &str) -> Vec<String> {
        vec![]
    }

    /// Variables that are shown among those of the program although it declares and names none of them.
    fn further_names(&self) -> Vec<String> {
        vec![]
    }

    /// The text of the program as the manual has it shown. `sources` are those that the program was read from, `places`
    /// says where its statements stand in them.
    fn text(&self, sources: &SourceMap, places: &StatementPlaces) -> Vec<Row>;

    /// Whether a variable that a statement accessed (`accessed`, as [`name`](Self::name) gives it) is the one that a
    /// [piece](Piece::name) of its text names.
    fn is_written_as(&self, accessed: &str, piece: &str) -> bool {
        accessed == piece
    }

    /// The row in which a task waits to users, if it was suspended after a statement in a row: a PMAC waits at the WHILE
    /// of the loop.
    fn waits_in(&self, _rows: &[Row], row: usize) -> usize {
        row
    }

    /// The name of the task that a row belongs to, where the text says so. `None` where its statements have to be executed
    /// to know.
    fn task_of(&self, _rows: &[Row], _row: usize) -> Option<String> {
        None
    }

    /// Whether a task is one of the user's, rather than one for the engine alone.
    fn is_users_task(&self, _name: &str) -> bool {
        true
    }

    /// What is shown beside the tasks, of which `tasks` are the names; `tick_ns` is the length of a tick.
    ///
    /// # Errors
    /// When a value can't be read.
    fn facts(
        &self,
        _tasks: &[String],
        _tick_ns: u64,
        _read: Read<'_>,
    ) -> Result<Vec<Fact>, String> {
        Ok(vec![])
    }

    /// The rows of an entry of the watch list.
    ///
    /// # Errors
    /// What is wrong with the entry.
    fn watch_rows(&self, entry: &str) -> Result<Vec<WatchRow>, String> {
        Ok(vec![WatchRow::of(entry)])
    }

    /// The variable for which the program defines a name. `None` where names mean variables themselves.
    fn defined_name(&self, _word: &str) -> Option<String> {
        None
    }

    /// Whether a name means a number of the source, of which [`place_of_value`](crate::CheckedProgram::place_of_value)
    /// gives the place.
    fn is_in_source(&self, _name: &str) -> bool {
        false
    }

    /// Whether the process image alone says which faults and messages are on. Otherwise the events say it.
    fn announces_by_image(&self) -> bool {
        false
    }

    /// All faults and messages that the program can announce, with what stays the same of their texts.
    fn announcements(&self) -> Vec<Announced> {
        vec![]
    }

    /// The faults and messages that are on in an image.
    fn announced(&self, _image: &[u8]) -> Vec<Announced> {
        vec![]
    }

    /// The statements that put out a text of their own, in their order.
    fn text_statements(&self) -> Vec<TextStatement> {
        vec![]
    }

    /// The inputs and outputs. `declared` are the names of the variables that the program declares or names, `image` is
    /// the present process image.
    fn io_points(&self, declared: &[String], image: &[u8]) -> Vec<IoPoint>;

    /// Panels, displays and tables of the control. `active` are the faults and messages that are on.
    ///
    /// # Errors
    /// When a value can't be read, or nothing is known of the control's panels.
    fn panels(&self, _active: &[Announced], _read: Read<'_>) -> Result<Vec<PanelDraft>, String> {
        Ok(vec![])
    }

    /// The control's terminal, if it has one, knowing the program.
    fn terminal(&self) -> Option<Box<dyn Terminal>> {
        None
    }

    /// Where the lines of an input or output were on the original control, by their names; `place` is that of its
    /// [point](IoPoint::place), where it is one.
    fn place_of_lines(&self, lines: &[String], _place: Option<&str>) -> String {
        match lines {
            [] => String::new(),
            [line] => line.clone(),
            [first, .., last] => format!("{first} to {last}"),
        }
    }

    /// The variable that a name of the [cross-reference](crate::CheckedProgram::cross_reference) stands for.
    fn stands_for(&self, name: &str) -> String {
        name.to_owned()
    }

    /// The variables that a variable's value comes of by itself, without a statement: of a timer's delayed contact its
    /// control contact and its counter, of a flip-flop's output its pins. Empty for all others.
    fn parts(&self, _name: &str, _image: &[u8]) -> Vec<Part> {
        vec![]
    }

    /// Whether time alone changes a variable: a timer or counter of time.
    fn counts_time(&self, _name: &str, _image: &[u8]) -> bool {
        false
    }

    /// Whether a place holds what one statement hands to the next, such as NCT's register OP.
    fn is_handed_on(&self, _accessed: Accessed) -> bool {
        false
    }

    /// Who gives a variable its value that the program exchanges with the machine; `None` for what is its own business.
    fn exchange(&self, _name: &str, uses: Uses) -> Option<Exchange> {
        uses.declared
    }
}
