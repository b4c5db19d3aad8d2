//! Reading a whole download: on-line commands and buffers, in the order of the text.

use plcc_abi::pmac::Kind;
use plcc_diag::Diagnostic;

use super::expr::Reader;
use super::kinematics::kinematics_name;
use super::motion_program::PendingMove;
use super::online::OnlineCommand;
use super::preprocess::Preprocessed;
use super::ranges::UsedL;
use super::structure::Frame;
use super::words::{self, Keyword, ONLINE};
use crate::common::Options;
use crate::pmac::ast::{Action, Buffer, Download, Online, Stmt, StmtKind, program_name};
use crate::pmac::origin::TextRange;

/// The buffer that is open.
#[derive(Default)]
pub(crate) struct Open {
    /// Whether it is a PLCC.
    pub(crate) compiled: bool,
    pub(crate) number: u8,
    /// Whether the number after OPEN is not known. The statements are read for their errors then,
    /// and dropped.
    pub(crate) discarded: bool,
    /// The IF and WHILE that are open, the innermost last.
    pub(crate) frames: Vec<Frame>,
    /// The first error of the structure: its place and what is wrong. It is reported at CLOSE.
    pub(crate) structure_error: Option<(TextRange, String)>,
    /// Whether it has a name that a missing file may define, so that errors of its structure
    /// are not reported.
    pub(crate) has_unknown_names: bool,
    /// The first IF that is after an ELSE on the same line.
    pub(crate) else_if: Option<TextRange>,
    /// Of a motion program its number; its lines are read by rules of their own.
    pub(crate) program: Option<u32>,
    /// Of a kinematic program its coordinate system and whether it is the inverse one; it is read as a PLC is.
    pub(crate) kinematics: Option<(u8, bool)>,
    /// The axis words of its present line.
    pub(crate) pending: Option<PendingMove>,
    /// Its last IF that ended with its line: the index of the branch, and that behind its statements.
    pub(crate) last_if: Option<(usize, u32)>,
    /// The number of the next word of its line where a program is called on it; 0 where none is.
    pub(crate) next_word: u16,
    /// How many diagnostics there were when it was opened.
    pub(crate) first_diagnostic: usize,
}

/// Reads a preprocessed text as a download.
pub(crate) struct DownloadReader<'a> {
    pub(crate) reader: Reader<'a>,
    pub(crate) preprocessed: &'a Preprocessed,
    pub(crate) download: Download,
    pub(crate) open: Option<Open>,
    pub(crate) diagnostics: Vec<Diagnostic>,
    /// Whether entries of a compensation table may follow.
    table: bool,
    /// The L-variables that PLCCs use, each use with the statement's number.
    pub(crate) l_uses: Vec<(u32, UsedL)>,
    /// How many statements were read.
    statements: u32,
    /// Whether something assigns to I5, without which no PLC runs.
    pub(crate) assigns_i5: bool,
    /// The last name whose beginning was taken for CLOSE, as in `closed_loop`.
    pub(crate) closed_by_name: Option<TextRange>,
    /// The first OPEN of a PLC or PLCC.
    pub(crate) has_plc: Option<TextRange>,
    /// How many errors are not reported, since a missing file may define the names in question.
    pub(crate) suppressed_errors: usize,
    /// How many bytes of definitions may still be searched for names inside COMMANDs.
    pub(crate) replacement_budget: usize,
    /// Whether the program will run with its motion simulated, so that errors of motion programs are errors.
    pub(crate) simulates: bool,
    /// The coordinate system that on-line commands have addressed last.
    system: u8,
    /// Whether there is a PRELUDE, so that each letter-number word of motion programs may have a call in front of it.
    pub(crate) has_prelude: bool,
}

/// Reads a download. PLCs whose IF and WHILE do not match their ends are reported and left empty.
/// What the reader has noted of definitions is judged in `analyse`.
pub(crate) fn read<'a>(preprocessed: &'a Preprocessed, options: &Options) -> DownloadReader<'a> {
    let mut reader = DownloadReader {
        reader: Reader::new(&preprocessed.text, options.controller),
        preprocessed,
        download: Download {
            controller: options.controller,
            ops: Vec::new(),
            plcs: vec![Buffer::default(); 32],
            plccs: vec![Buffer::default(); 32],
            progs: std::collections::BTreeMap::new(),
            kinematics: std::collections::BTreeMap::new(),
            motion: Vec::new(),
            online: Vec::new(),
            texts: Vec::new(),
            motion_commands: Vec::new(),
            commands: Vec::new(),
            defines: Vec::new(),
            l_defs: std::collections::BTreeMap::new(),
            origins: preprocessed.origins.clone(),
        },
        open: None,
        diagnostics: Vec::new(),
        table: false,
        l_uses: Vec::new(),
        statements: 0,
        assigns_i5: false,
        closed_by_name: None,
        has_plc: None,
        suppressed_errors: 0,
        replacement_budget: 16 << 20,
        simulates: options.simulate,
        system: 1,
        has_prelude: has_prelude(&preprocessed.text),
    };
    reader.run();
    reader
}

impl DownloadReader<'_> {
    fn run(&mut self) {
        loop {
            self.reader.cur.crosses_lines = true;
            self.reader.cur.blanks();
            if self.reader.cur.at_end() {
                break;
            }
            if self.open.as_ref().is_some_and(|open| open.program.is_some()) {
                self.motion_line();
            } else if self.open.is_some() {
                let (start, first) = (self.reader.cur.pos, self.next_index());
                match self.statement() {
                    Ok(()) => self.only_calculates(first, start),
                    Err(error) => {
                        self.report(error);
                        self.recover(start);
                    }
                }
                self.note_l_uses();
            } else {
                self.reader.cur.crosses_lines = false;
                self.online_line();
            }
        }
        if let Some(open) = &self.open {
            let is_motion = open.program.is_some();
            let at = self.warn_unclosed();
            if is_motion {
                self.close_motion(at);
            } else {
                self.close(at);
            }
        }
        self.download.ops = std::mem::take(&mut self.reader.ops);
    }

    /// Warns at the last line that a CLOSE is missing. Returns the place of the warning.
    pub(crate) fn warn_unclosed(&mut self) -> TextRange {
        let end = self.preprocessed.text.len();
        let at = TextRange::new(end.saturating_sub(1), end);
        self.tell(at, |span| {
            Diagnostic::warning("PMAC-W1", span, "the last buffer is not closed")
                .help("end it with CLOSE")
        });
        at
    }

    /// On-line commands up to the line's end, or to an OPEN.
    fn online_line(&mut self) {
        loop {
            self.reader.cur.blanks();
            if matches!(self.reader.cur.byte(), b'\n' | 0) {
                return;
            }
            let start = self.reader.cur.pos;
            match self.reader.online(&mut self.table) {
                Ok(command) => {
                    if self.execute(command, self.reader.cur.since(start)) {
                        return;
                    }
                }
                Err(error) => {
                    let opens = words::find(self.reader.cur_at(start), ONLINE)
                        .is_some_and(|(word, _)| word.keyword == Keyword::Open);
                    let judged = self.report(error);
                    // The fault may have been found to lie on the line before.
                    self.reader.cur.pos = self.reader.cur.pos.max(start);
                    if !opens {
                        self.recover(start);
                        continue;
                    }
                    if judged {
                        self.skip_refused();
                        return;
                    }
                    // A missing file may define its number: the statements are read.
                    self.reader.cur.skip_line();
                    self.open = Some(Open { discarded: true, ..Open::default() });
                    return;
                }
            }
            if self.reader.cur.pos == start {
                // This does not happen, but without it a command of no characters would never end.
                self.reader.cur.pos += 1;
            }
        }
    }

    /// Does what an on-line command at `at` asks for. Returns whether a buffer is open now.
    pub(crate) fn execute(&mut self, command: OnlineCommand, at: TextRange) -> bool {
        match command {
            OnlineCommand::Do(actions) => {
                for action in actions {
                    self.note_i5(&action);
                    if let Action::System(system) = action {
                        self.system = system;
                    }
                    self.download.online.push(Online { action, at });
                }
            }
            OnlineCommand::DefineL(first, count, definition) => {
                for number in first..first + count {
                    self.download.l_defs.insert(number, definition);
                }
            }
            OnlineCommand::OpenMotion(None) => self.skip_motion(at),
            OnlineCommand::OpenKinematics(inverse) => {
                self.open_kinematics(self.system, inverse, at);
                return true;
            }
            OnlineCommand::OpenMotion(Some(number)) => {
                self.open_program(number, at);
                return true;
            }
            OnlineCommand::OpenPlc { compiled, number } => {
                self.has_plc.get_or_insert(at);
                self.reader.l_used = compiled.then(Vec::new);
                self.open = Some(Open { compiled, number, ..Open::default() });
                if let Some(buffer) = self.buffer() {
                    buffer.opened = Some(at);
                }
                return true;
            }
        }
        false
    }

    /// Opens a motion program. What is in it already stays in front, without the RETURN that its CLOSE has appended.
    fn open_program(&mut self, number: u32, at: TextRange) {
        self.reader.l_used = None;
        let first_diagnostic = self.diagnostics.len();
        self.open = Some(Open { program: Some(number), first_diagnostic, ..Open::default() });
        if let Some(buffer) = self.buffer() {
            buffer.opened = Some(at);
            buffer.code.pop();
        }
    }

    /// The buffer that is open, if its statements are kept.
    pub(crate) fn buffer(&mut self) -> Option<&mut Buffer> {
        let open = self.open.as_ref()?;
        if open.discarded {
            return None;
        }
        if let Some(number) = open.program {
            return Some(self.download.progs.entry(number).or_default());
        }
        if let Some(of) = open.kinematics {
            return Some(self.download.kinematics.entry(of).or_default());
        }
        let buffers =
            if open.compiled { &mut self.download.plccs } else { &mut self.download.plcs };
        buffers.get_mut(usize::from(open.number))
    }

    /// The index that the next statement will have in its buffer.
    pub(crate) fn next_index(&mut self) -> u32 {
        self.buffer().map_or(0, |buffer| buffer.code.len() as u32)
    }

    /// Appends a statement to the open buffer. It reaches in the text from the offset `start` to
    /// the cursor.
    pub(crate) fn push(&mut self, kind: StmtKind, start: usize) {
        let at = self.reader.cur.since(start);
        if let StmtKind::Assign(crate::pmac::ast::Target::Var(Kind::I, 5), _) = kind {
            self.assigns_i5 = true;
        }
        if let Some(buffer) = self.buffer() {
            buffer.code.push(Stmt { kind, at, integer: false });
        }
    }

    /// Ends a statement: takes over the L-variables that it uses.
    fn note_l_uses(&mut self) {
        self.statements += 1;
        if let Some(used) = &mut self.reader.l_used {
            self.l_uses.extend(used.drain(..).map(|used| (self.statements, used)));
        }
    }

    /// Records whether an on-line command assigns to I5.
    pub(crate) fn note_i5(&mut self, action: &Action) {
        use crate::pmac::ast::Target;
        self.assigns_i5 |= match action {
            Action::Assign(Target::Var(Kind::I, number), _) => *number == 5,
            Action::Assign(Target::Range { kind: Kind::I, first, count, step }, _) => {
                let away = 5u32.checked_sub(u32::from(*first));
                let step = u32::from(*step).max(1);
                away.is_some_and(|a| a % step == 0 && a / step < u32::from(*count))
            }
            _ => false,
        };
    }

    /// Closes the buffer. Errors of its structure are reported at `at`, the place of the CLOSE.
    pub(crate) fn close(&mut self, at: TextRange) {
        let Some(open) = &self.open else { return };
        let (kinematics, first) = (open.kinematics, open.first_diagnostic);
        let is_lost = open.discarded || open.has_unknown_names;
        if let Some((guilty, message)) = open.structure_error().filter(|_| !is_lost) {
            let name = match (open.program, open.kinematics) {
                (Some(number), _) => format!("motion program {number}"),
                (None, Some(of)) => kinematics_name(of),
                (None, None) => program_name(open.compiled, open.number.into()),
            };
            let (place, _) = self.preprocessed.origins.place(guilty);
            let else_if = open.else_if;
            let else_if = else_if.map(|at| self.preprocessed.origins.place(at).0);
            self.tell(at, |span| {
                let diagnostic = Diagnostic::error(
                    "PMAC-9",
                    span,
                    format!("the IF and WHILE of {name} do not match"),
                )
                .label(place, message);
                match else_if {
                    Some(place) => diagnostic
                        .label(place, "this IF after ELSE needs an ENDIF of its own")
                        .help("there is no ELSEIF: end each IF that follows an ELSE"),
                    None => diagnostic.help("each IF needs its ENDIF, each WHILE its ENDWHILE"),
                }
            });
            if let Some(buffer) = self.buffer() {
                buffer.code.clear();
                buffer.broken = true;
            }
        }
        self.note_l_uses();
        self.open = None;
        self.reader.l_used = None;
        if let Some(of) = kinematics {
            self.leave_out(first, at, &kinematics_name(of), |download| {
                download.kinematics.get_mut(&of)
            });
        }
    }
}

/// Whether a text has the word PRELUDE.
fn has_prelude(text: &str) -> bool {
    text.as_bytes().windows(7).any(|word| word.eq_ignore_ascii_case(b"PRELUDE"))
}
