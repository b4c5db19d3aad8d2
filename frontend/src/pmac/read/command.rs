//! COMMAND: the on-line commands in its text, and the statements that execute them.

use plcc_abi::pmac::motion::{MotionAction, MotionCommand};
use plcc_abi::pmac::{CommandStep, Controller, Define, Kind, Space, Text};
use plcc_diag::{Diagnostic, SourceMap};

use super::cursor::{Cursor, ParseError, Parsed, syntax, syntax_help};
use super::download::DownloadReader;
use super::expr::Reader;
use super::online::{OnlineCommand, control_character};
use super::preprocess::{is_word, replace_names};
use super::words::{self, Keyword, PLC};
use crate::pmac::ast::{Action, Stmt, StmtKind, Target, WriteKind};
use crate::pmac::reference::tables::i_default;

impl DownloadReader<'_> {
    /// COMMAND, whose word is taken and begins at the offset `start`. Its text is read here, and
    /// executed when the statement runs.
    pub(crate) fn command(&mut self, start: usize) -> Parsed<()> {
        // On Turbo PMAC a letter says to which port the answer goes. Commands have no answer here.
        let _ = words::port(&mut self.reader.cur);
        if self.reader.cur.peek() == b'^' {
            let text = self.quoted()?;
            let actions = control_character(text.as_bytes().get(1).copied().unwrap_or(0));
            self.push_command(text, Ok(actions), start)?;
        } else {
            self.command_text(start)?;
        }
        // A comma may be between two COMMAND statements.
        let mut ahead = self.reader.cur;
        if ahead.eat(b',') && is_command(ahead) {
            let _ = self.reader.cur.eat(b',');
        }
        Ok(())
    }

    /// The text in quotes of a COMMAND that begins at the offset `start`.
    fn command_text(&mut self, start: usize) -> Parsed<()> {
        let mut text = self.quoted()?;
        let at = self.reader.cur.since(start);
        let mut actions = self.actions(&text);
        if actions.is_err()
            && let Some(replaced) = self.names_replaced(&text)
            && let Ok(found) = self.actions(&replaced)
        {
            self.tell(at, |span| {
                let message = format!("defined names are replaced in this command: `{replaced}`");
                Diagnostic::standalone_note("PMAC-N2", span, message)
                    .note("without that the text is not a command; in other texts in quotes, names are not replaced")
            });
            (text, actions) = (replaced, Ok(found));
        }
        self.push_command(text, actions, start)
    }

    /// Appends a COMMAND statement, which reaches from the offset `start` to the cursor. `actions`
    /// is what its text asks for, or why the controller will refuse it.
    fn push_command(
        &mut self,
        text: String,
        actions: Parsed<Vec<Action>>,
        start: usize,
    ) -> Parsed<()> {
        let at = self.reader.cur.since(start);
        let (error, steps) = match actions {
            Ok(actions) => {
                for action in &actions {
                    self.note_i5(action);
                }
                (None, self.command_steps(actions, at))
            }
            // A limit of the compiler's own, of which the controller knows nothing.
            Err(error) if error.code == "PMAC-X4" => return Err(ParseError { at, ..error }),
            Err(error) => {
                self.tell(at, |span| {
                    let refused = "this command will be refused (ERR003)";
                    let diagnostic = Diagnostic::warning("PMAC-W4", span, refused);
                    let diagnostic = diagnostic.note(error.message);
                    match error.help {
                        Some(help) => diagnostic.help(help),
                        None => diagnostic,
                    }
                });
                (Some("ERR003".to_owned()), Vec::new())
            }
        };
        self.text(Text::Command { text, error, steps }, None, start);
        Ok(())
    }

    /// The actions of the on-line commands in a COMMAND's text.
    fn actions(&mut self, text: &str) -> Parsed<Vec<Action>> {
        let ops = std::mem::take(&mut self.reader.ops);
        let mut inner = Reader::new(text, self.reader.controller);
        inner.ops = ops;
        inner.range_budget = self.reader.range_budget;
        let actions = read_command(&mut inner);
        self.reader.range_budget = inner.range_budget;
        self.reader.ops = std::mem::take(&mut inner.ops);
        actions
    }

    /// A COMMAND's text in which the names that `#define` defines are replaced; `None` if it has no
    /// such name, or if the commands of the download have used up the limit for this work.
    fn names_replaced(&mut self, text: &str) -> Option<String> {
        let names = &self.preprocessed.names;
        let known =
            |word: &str| names.binary_search_by(|known| known.name.as_str().cmp(word)).is_ok();
        if !text.split(|c| !is_word(c)).any(known) {
            return None;
        }
        let size: usize = names.iter().map(|known| known.name.len() + known.body.len()).sum();
        self.replacement_budget = self.replacement_budget.checked_sub(size)?;
        let mut sources = SourceMap::new();
        let file = sources.add("command", text.as_bytes());
        let (preprocessed, diagnostics) = replace_names(&mut sources, file, names);
        let whole = !diagnostics.iter().any(Diagnostic::is_error);
        whole.then(|| preprocessed.text.trim_end().to_owned())
    }

    /// Divides `count` I-variables from `first` on, `step` apart, into runs with the same default.
    /// Returns for each the number of its first variable, how many it has, and the default.
    fn equal_defaults(&self, first: u16, count: u16, step: u16) -> Vec<(u16, u16, f64)> {
        let mut runs: Vec<(u16, u16, f64)> = Vec::new();
        for k in 0..count {
            let number = first + k * step;
            let value = i_default(self.download.controller, u32::from(number));
            match runs.last_mut() {
                Some((_, length, same)) if same.to_bits() == value.to_bits() => *length += 1,
                _ => runs.push((number, 1, value)),
            }
        }
        runs
    }

    /// What executes a COMMAND, in order: tasks, whose statements are stored in
    /// [`Download::commands`](crate::pmac::ast::Download::commands), and commands for motors and coordinate systems.
    fn command_steps(
        &mut self,
        actions: Vec<Action>,
        at: crate::pmac::origin::TextRange,
    ) -> Vec<CommandStep> {
        let (mut steps, mut code) = (Vec::new(), Vec::new());
        for action in actions {
            if let Action::System(system) = action {
                let text = format!("&{system}");
                self.motion_step(
                    MotionCommand { text, action: MotionAction::System(system) },
                    &mut steps,
                    &mut code,
                    at,
                );
                code.push(StmtKind::Address(None, Some(system)));
                continue;
            }
            match action {
                Action::Motion(command) => self.motion_step(command, &mut steps, &mut code, at),
                other => self.command_code(other, &mut code),
            }
        }
        self.task_step(&mut steps, &mut code, at);
        // Texts that only address something do nothing.
        let addresses = |step: &CommandStep| match *step {
            CommandStep::Task(_) => false,
            CommandStep::Motion(index) => {
                self.download.motion_commands.get(index as usize).is_some_and(|c| {
                    matches!(c.action, MotionAction::Motor(_) | MotionAction::System(_))
                })
            }
        };
        if steps.iter().all(addresses) {
            steps.clear();
        }
        steps
    }

    /// Appends a command for motors or coordinate systems behind what is to be done in front of it.
    fn motion_step(
        &mut self,
        command: MotionCommand,
        steps: &mut Vec<CommandStep>,
        code: &mut Vec<StmtKind>,
        at: crate::pmac::origin::TextRange,
    ) {
        self.task_step(steps, code, at);
        steps.push(CommandStep::Motion(self.download.motion_commands.len() as u32));
        self.download.motion_commands.push(command);
    }

    /// Makes a task of the statements so far, if they do more than to address a coordinate system. Such an ADDRESS
    /// stays for the next one.
    fn task_step(
        &mut self,
        steps: &mut Vec<CommandStep>,
        code: &mut Vec<StmtKind>,
        at: crate::pmac::origin::TextRange,
    ) {
        if !code.iter().any(|what| !matches!(what, StmtKind::Address(..))) {
            return;
        }
        let code = code.drain(..).map(|kind| Stmt { kind, at, integer: false }).collect();
        self.download.commands.push(code);
        steps.push(CommandStep::Task(self.download.commands.len() as u32 - 1));
    }

    /// Appends the statements that execute an action.
    fn command_code(&mut self, action: Action, code: &mut Vec<StmtKind>) {
        match action {
            Action::Assign(target, expr) => code.push(StmtKind::Assign(target, expr)),
            Action::Defaults(first, count, step) => {
                for (first, count, value) in self.equal_defaults(first, count, step) {
                    let expr = self.reader.constant(value);
                    let target = match count {
                        1 => Target::Var(Kind::I, first),
                        _ => Target::Range { kind: Kind::I, first, count, step },
                    };
                    code.push(StmtKind::Assign(target, expr));
                }
            }
            Action::Define(first, count, definition) => {
                let (first, last) = (u32::from(first), u32::from(first + count) - 1);
                self.download.defines.push(Define { first, last, definition });
                code.push(StmtKind::Define(self.download.defines.len() as u32 - 1));
            }
            Action::Plc(op, plcs) => code.push(StmtKind::Plc(op, plcs)),
            Action::Write(kind, addr, values) => {
                let space = match kind {
                    WriteKind::X => Space::X,
                    WriteKind::Y => Space::Y,
                    WriteKind::Long | WriteKind::Double | WriteKind::Program => return,
                };
                for (k, value) in values.into_iter().enumerate() {
                    code.push(StmtKind::Word(space, addr.wrapping_add(k as u32), value));
                }
            }
            Action::Save => code.push(StmtKind::Save),
            Action::DeletePlcc(_) | Action::System(_) | Action::Motion(_) => {}
        }
    }
}

/// Whether the word COMMAND is at `cur`.
pub(crate) fn is_command(cur: Cursor<'_>) -> bool {
    words::find(cur, PLC).is_some_and(|(word, _)| word.keyword == Keyword::Command)
}

/// What a line of on-line commands does that somebody types; `None` if there is a mistake in it.
pub(in crate::pmac) fn online_actions(text: &str, controller: Controller) -> Option<Vec<Action>> {
    read_command(&mut Reader::new(text, controller)).ok()
}

/// Reads a COMMAND's text.
fn read_command(reader: &mut Reader<'_>) -> Parsed<Vec<Action>> {
    let mut actions = Vec::new();
    let mut table = false;
    loop {
        reader.cur.blanks();
        if reader.cur.at_end() {
            return Ok(actions);
        }
        let start = reader.cur.pos;
        if reader.cur.byte() == b'^' {
            reader.cur.pos += 1;
            let message =
                "in quotes, `^` is the character itself: a text has no control characters";
            let help = "write a control character without quotes, as in COMMAND^D";
            return syntax_help(reader.cur.since(start), message, help);
        }
        match reader.online(&mut table)? {
            OnlineCommand::Do(more) => actions.extend(more),
            OnlineCommand::OpenPlc { .. }
            | OnlineCommand::OpenMotion(_)
            | OnlineCommand::OpenKinematics(_) => {
                let text = reader.cur.text_at(reader.cur.since(start)).to_owned();
                let action = MotionAction::Refused("PMAC-X9".to_owned());
                actions.push(Action::Motion(MotionCommand { text, action }));
            }
            OnlineCommand::DefineL(..) => {
                let message = "a COMMAND cannot define L-variables, which only the compiler knows";
                return syntax(reader.cur.since(start), message);
            }
        }
    }
}
