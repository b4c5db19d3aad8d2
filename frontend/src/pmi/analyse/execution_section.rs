//! The execution section (PMI 3.3): assignments, IF, GOTO, labels.

use plcc_abi::pmi::Type;
use plcc_diag::{Diagnostic, Span};

use crate::common::Limits;
use crate::pmi::{
    analyse::{
        expression::{Index, Parser, Until},
        lookup::resolve,
        names::{Names, RESERVED},
        specification_section::{HelpIfNone, Result},
    },
    ast::{Action, Checked, Meaning, Step, SymbolId, Target},
    read::{cursor::Cursor, diagnostic::error, token::Kind},
};

/// IF levels that the original compiler allows (PMI 3.3.3).
const LEVELS: usize = 4;
/// Those that anybody may have.
const MAX_LEVELS: usize = 256;
/// GOTOs that the original compiler allows (PMI 4.5, 44).
const GOTOS: u32 = 1000;

/// An IF that is not over.
struct Frame {
    span: Span,
    /// The step of the condition whose target for false is not known yet.
    condition: Option<usize>,
    /// Jumps to the ENDIF.
    leave: Vec<usize>,
    has_else: bool,
}

/// The execution section's state.
pub(crate) struct ExecutionSection<'a> {
    names: &'a mut Names,
    checked: &'a mut Checked,
    limits: Limits,
    frames: Vec<Frame>,
    gotos: u32,
    /// GOTO steps and the labels they name.
    jumps: Vec<(usize, SymbolId)>,
}

/// Whether a token starts an IF, ELSE and so on.
fn keyword<'c>(cursor: &Cursor<'c>) -> Option<&'c str> {
    let token = cursor.token().filter(|token| token.kind == Kind::Name)?;
    let word = cursor.slice(token);
    matches!(word, "IF" | "ELSEIF" | "ELSE" | "ENDIF" | "GOTO").then_some(word)
}

/// Declares the labels and the implicit LOGICALs of a statement, before any is checked.
pub(crate) fn declare(names: &mut Names, cursor: &mut Cursor<'_>) {
    while cursor.kind() == Some(Kind::Name) && cursor.second_kind() == Some(Kind::Colon) {
        if let Some((name, span)) = cursor.name()
            && !RESERVED.contains(&name)
        {
            let _ = names.declare(name, span, Type::Logical, None, Meaning::Label(None));
        }
        cursor.at += 1;
    }
    if cursor.kind() == Some(Kind::Name)
        && cursor.second_kind() == Some(Kind::Eq)
        && let Some((name, span)) = cursor.name()
        && !RESERVED.contains(&name)
    {
        let _ = names.declare(name, span, Type::Logical, None, Meaning::Variable);
    }
}

impl<'a> ExecutionSection<'a> {
    pub(crate) fn new(names: &'a mut Names, checked: &'a mut Checked, limits: Limits) -> Self {
        Self { names, checked, limits, frames: vec![], gotos: 0, jumps: vec![] }
    }

    fn next_step(&self) -> u32 {
        self.checked.steps.len() as u32
    }

    fn step(&mut self, action: Action, span: Span) -> usize {
        self.checked.steps.push(Step { action, span, line: 0 });
        self.checked.steps.len() - 1
    }

    /// Reads one statement.
    pub(crate) fn statement(&mut self, cursor: &mut Cursor<'_>) -> Result {
        let label = self.label(cursor);
        let statement = match keyword(cursor) {
            Some("IF") => self.begin_if(cursor),
            Some("ELSEIF") => self.else_if(cursor),
            Some("ELSE") => self.else_(cursor),
            Some("ENDIF") => self.end_if(cursor),
            Some("GOTO") => self.goto(cursor),
            _ => self.statement_without_keyword(cursor),
        };
        label.and(statement)
    }

    /// The label in front of a statement.
    fn label(&mut self, cursor: &mut Cursor<'_>) -> Result {
        if cursor.kind() != Some(Kind::Name) || cursor.second_kind() != Some(Kind::Colon) {
            return Ok(());
        }
        let Some((name, span)) = cursor.name() else { return Ok(()) };
        cursor.at += 1;
        if RESERVED.contains(&name) {
            return Err(error(10, span, format!("{name} is a reserved word"))
                .help("IF, ELSE, ELSEIF, ENDIF, GOTO, T and F cannot be labels")
                .into());
        }
        let here = self.next_step();
        let known = self.names.find(name).and_then(|id| self.names.get_mut(id));
        match known {
            Some(symbol) if symbol.declared == Some(span) => {
                symbol.meaning = Meaning::Label(Some(here));
                Ok(())
            }
            Some(symbol) => {
                let problem = error(10, span, format!("{name} is declared a second time"));
                Err(match symbol.declared {
                    Some(at) => problem.label(at, "it is declared here already"),
                    None => problem,
                }
                .help("give one of the two another name")
                .into())
            }
            None => Ok(()),
        }
    }

    fn statement_without_keyword(&mut self, cursor: &mut Cursor<'_>) -> Result {
        match cursor.kind() {
            None => Ok(()),
            Some(Kind::Directive) => {
                let what = format!("{} stands behind $END", cursor.found());
                Err(cursor
                    .error_here(1, what)
                    .help_if_none(
                        "directives belong in front of $END; only $INCLUDE may stand here",
                    )
                    .into())
            }
            Some(Kind::Name | Kind::Executive) => self.assignment(cursor),
            Some(_) => {
                let what = format!("a name is expected, not {}", cursor.found());
                Err(cursor
                    .error_here(9, what)
                    .help_if_none(
                        "a statement is an assignment, an IF, ELSEIF, ELSE, ENDIF or a GOTO",
                    )
                    .into())
            }
        }
    }

    fn parser<'s, 'c>(&'s mut self, cursor: &'s mut Cursor<'c>) -> Parser<'s, 'c> {
        Parser::new(cursor, self.names, &mut self.checked.ops, self.limits)
    }

    fn assignment(&mut self, cursor: &mut Cursor<'_>) -> Result {
        let Some(token) = cursor.token() else { return Ok(()) };
        let (name, span) = (cursor.slice(token), cursor.span_of(token));
        let next = cursor.second_kind();
        let indexed = next == Some(Kind::LBracket);
        if !indexed && next != Some(Kind::Eq) {
            return self.no_assignment(cursor, name);
        }
        if matches!(name, "T" | "F") {
            return Err(error(41, span, format!("{name} is a constant"))
                .help("assign to a variable; T and F are true and false")
                .into());
        }
        if let Some(label) = self.label_named(name) {
            return Err(error(10, span, format!("{name} is a label"))
                .label(label, "it is declared here already")
                .help("give one of the two another name")
                .into());
        }
        let symbol = resolve(self.names, name, span, indexed)?;
        if let Some(id) = symbol {
            self.check_writable(id, span)?;
        }
        cursor.at += 1;
        let target = if indexed {
            cursor.at += 1;
            // What is not known is still parsed, for errors that follow from nothing else.
            let array = symbol.unwrap_or(SymbolId(u32::MAX));
            let index = self.parser(cursor).parse(Until::Index(array))?;
            if cursor.kind() != Some(Kind::Eq) {
                let what = format!("`=` is expected, not {}", cursor.found());
                return Err(cursor.error_here(11, what).into());
            }
            match index.index {
                Index::At(at) => Target::At(array, at),
                Index::Computed => Target::Element(array, index.ops),
            }
        } else {
            Target::Scalar(symbol.unwrap_or(SymbolId(u32::MAX)))
        };
        cursor.at += 1;
        let value = self.parser(cursor).parse(Until::End)?.ops;
        self.step(Action::Assign { target, value }, cursor.statement_span());
        Ok(())
    }

    fn label_named(&self, name: &str) -> Option<Span> {
        let symbol = self.names.find(name).and_then(|id| self.names.get(id))?;
        matches!(symbol.meaning, Meaning::Label(_)).then_some(symbol.declared).flatten()
    }

    /// A name that begins no statement.
    fn no_assignment(&mut self, cursor: &mut Cursor<'_>, name: &str) -> Result {
        cursor.at += 1;
        let help = match (name, keyword(cursor)) {
            ("END", Some("IF")) => "write ENDIF as one word",
            ("ELSE", Some("IF")) => "write ELSEIF as one word",
            ("GO", _) => "write GOTO as one word",
            _ => "an assignment is written name = expression",
        };
        let what = format!("`=` is expected behind {name}, not {}", cursor.found());
        Err(cursor.error_here(11, what).help_if_none(help).into())
    }

    fn check_writable(&self, id: SymbolId, span: Span) -> Result {
        let Some(symbol) = self.names.get(id) else { return Ok(()) };
        let what = match &symbol.meaning {
            Meaning::Input(_) => "an input",
            Meaning::Constant(_) => "a constant",
            Meaning::ReadOnly => "a read-only variable of the executive",
            Meaning::Derived => "the output of a timer or flip-flop",
            Meaning::Variable
            | Meaning::Output(_)
            | Meaning::ResetOnly
            | Meaning::TimerControl(_)
            | Meaning::Clock(_)
            | Meaning::Pin(_)
            | Meaning::Label(_)
            | Meaning::Unknown => return Ok(()),
        };
        let problem = error(41, span, format!("{} is {what} and cannot be assigned", symbol.name));
        let problem = match symbol.declared {
            Some(at) => problem.label(at, "it is declared here"),
            None => problem,
        };
        Err(problem
            .help(match symbol.meaning {
                Meaning::ReadOnly => {
                    "only reading it is allowed; where the machine differs, a machine file says so \
                 (--machine)"
                }
                _ => "assign to a variable of your own; only reading it is allowed",
            })
            .into())
    }

    /// `(condition)` and nothing behind it.
    fn condition(&mut self, cursor: &mut Cursor<'_>, word: &str) -> Result<crate::pmi::ast::Ops> {
        if !cursor.eat(Kind::LParen) {
            let what = format!("`(` is expected behind {word}, not {}", cursor.found());
            return Err(cursor
                .error_here(11, what)
                .help_if_none(&format!("write {word}(condition)"))
                .into());
        }
        let parsed = self.parser(cursor).parse(Until::Condition)?;
        if cursor.kind() == Some(Kind::RParen) {
            return Err(error(32, cursor.span(), "`)` has no `(`")
                .help("remove it, or open it further left")
                .into());
        }
        if cursor.kind().is_some() {
            let what = format!("{} stands behind the condition", cursor.found());
            let help = "put the whole condition in one pair of parentheses, and statements in \
                        lines of their own";
            return Err(cursor.error_here(5, what).help_if_none(help).into());
        }
        Ok(parsed.ops)
    }

    fn begin_if(&mut self, cursor: &mut Cursor<'_>) -> Result {
        let word = cursor.span();
        cursor.at += 1;
        self.frames.push(Frame { span: word, condition: None, leave: vec![], has_else: false });
        let depth = self.frames.len();
        if depth > MAX_LEVELS || depth > LEVELS && self.limits == Limits::Original {
            let most = if self.limits == Limits::Original { LEVELS } else { MAX_LEVELS };
            return Err(error(38, word, format!("more than {most} IFs are nested"))
                .help("combine conditions with &, or leave earlier with a GOTO")
                .into());
        }
        let condition = self.condition(cursor, "IF")?;
        let step = self.step(Action::If { condition, otherwise: 0 }, cursor.statement_span());
        if let Some(frame) = self.frames.last_mut() {
            frame.condition = Some(step);
        }
        Ok(())
    }

    /// Ends a body: a jump to the ENDIF, and the false condition goes on behind it.
    fn end_body(&mut self, span: Span) {
        let jump = self.step(Action::Jump { to: 0, is_goto: false }, span);
        let here = self.next_step();
        let condition = self.frames.last_mut().and_then(|frame| {
            frame.leave.push(jump);
            frame.condition.take()
        });
        self.set_otherwise(condition, here);
    }

    fn set_otherwise(&mut self, condition: Option<usize>, here: u32) {
        let step = condition.and_then(|index| self.checked.steps.get_mut(index));
        if let Some(Step { action: Action::If { otherwise, .. }, .. }) = step {
            *otherwise = here;
        }
    }

    fn misplaced(&self, span: Span, word: &str) -> Result {
        let problem = match self.frames.last() {
            Some(frame) => error(39, span, format!("{word} stands behind ELSE"))
                .label(frame.span, "of this IF")
                .help("ELSE is the last part of an IF"),
            None => error(39, span, format!("{word} has no IF"))
                .help("remove it, or put the IF in front of it"),
        };
        Err(problem.into())
    }

    fn else_if(&mut self, cursor: &mut Cursor<'_>) -> Result {
        let word = cursor.span();
        cursor.at += 1;
        if self.frames.last().is_none_or(|frame| frame.has_else) {
            return self.misplaced(word, "ELSEIF");
        }
        self.end_body(cursor.statement_span());
        let condition = self.condition(cursor, "ELSEIF")?;
        let step = self.step(Action::If { condition, otherwise: 0 }, cursor.statement_span());
        if let Some(frame) = self.frames.last_mut() {
            frame.condition = Some(step);
        }
        Ok(())
    }

    fn else_(&mut self, cursor: &mut Cursor<'_>) -> Result {
        let word = cursor.span();
        cursor.at += 1;
        if self.frames.last().is_none_or(|frame| frame.has_else) {
            return self.misplaced(word, "ELSE");
        }
        self.end_body(cursor.statement_span());
        if let Some(frame) = self.frames.last_mut() {
            frame.has_else = true;
        }
        let split = keyword(cursor) == Some("IF");
        self.expect_end_behind(cursor, "ELSE", if split { "write ELSEIF as one word" } else { "" })
    }

    fn end_if(&mut self, cursor: &mut Cursor<'_>) -> Result {
        let word = cursor.span();
        cursor.at += 1;
        let here = self.next_step();
        let Some(frame) = self.frames.pop() else {
            return self.misplaced(word, "ENDIF");
        };
        self.set_otherwise(frame.condition, here);
        for jump in frame.leave {
            self.set_jump_target(jump, here);
        }
        self.expect_end_behind(cursor, "ENDIF", "")
    }

    fn set_jump_target(&mut self, jump: usize, here: u32) {
        if let Some(Step { action: Action::Jump { to, .. }, .. }) = self.checked.steps.get_mut(jump)
        {
            *to = here;
        }
    }

    fn expect_end_behind(&self, cursor: &Cursor<'_>, word: &str, help: &str) -> Result {
        if cursor.kind().is_none() {
            return Ok(());
        }
        let help = if help.is_empty() { "put it on a line of its own" } else { help };
        let what = format!("{} stands behind {word}", cursor.found());
        Err(cursor.error_here(5, what).help_if_none(help).into())
    }

    fn goto(&mut self, cursor: &mut Cursor<'_>) -> Result {
        let word = cursor.span();
        cursor.at += 1;
        self.gotos += 1;
        if self.gotos > GOTOS && self.limits == Limits::Original {
            return Err(error(44, word, "a program has 1000 GOTOs at most")
                .help("use IFs, or compile with `--limits none`")
                .into());
        }
        let reserved = cursor.token().is_some_and(|token| RESERVED.contains(&cursor.slice(token)));
        let Some((name, span)) = (if reserved { None } else { cursor.name() }) else {
            let what = format!("a label is expected behind GOTO, not {}", cursor.found());
            return Err(cursor
                .error_here(46, what)
                .help_if_none("write GOTO and the label's name")
                .into());
        };
        let id = self.names.find(name);
        match id.and_then(|id| self.names.get(id)).map(|symbol| (&symbol.meaning, symbol.declared))
        {
            Some((Meaning::Label(None), _)) => {}
            Some((Meaning::Label(Some(_)), at)) => {
                let problem = error(47, span, format!("{name} does not come later in the program"));
                let problem = match at {
                    Some(at) => problem.label(at, "it stands here"),
                    None => problem,
                };
                return Err(problem.help("a GOTO goes forward only; a scan ends by itself").into());
            }
            Some((Meaning::Unknown, _)) => return Ok(()),
            _ => {
                let problem = error(46, span, format!("no label is named {name}"));
                return Err(match self.names.suggest(name, true) {
                    Some(near) => problem.help(format!("did you mean {near}?")),
                    None => problem.help("put the label and a colon in front of a later statement"),
                }
                .into());
            }
        }
        self.expect_end_behind(cursor, "the label", "")?;
        let step = self.step(Action::Jump { to: 0, is_goto: true }, cursor.statement_span());
        self.jumps.extend(id.map(|id| (step, id)));
        Ok(())
    }

    /// Ends the section: what is still open, and where the GOTOs go.
    pub(crate) fn finish(mut self, diagnostics: &mut Vec<Diagnostic>) {
        for frame in std::mem::take(&mut self.frames) {
            diagnostics.push(
                error(39, frame.span, "this IF has no ENDIF").help("put an ENDIF behind its body"),
            );
        }
        for (step, label) in std::mem::take(&mut self.jumps) {
            if let Some(Meaning::Label(Some(to))) = self.names.get(label).map(|s| &s.meaning) {
                let to = *to;
                self.set_jump_target(step, to);
            }
        }
    }
}
