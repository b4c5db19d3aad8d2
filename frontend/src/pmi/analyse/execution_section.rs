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

/// How deep IFs may nest for the original compiler (PMI 3.3.3).
const LEVELS: usize = 4;
/// How deep they may nest with `--limits none`.
const MAX_LEVELS: usize = 256;
/// How many GOTOs a program may have for the original compiler (PMI 4.5, error 44).
const GOTOS: u32 = 1000;

/// An IF whose ENDIF has not come yet.
struct OpenIf {
    span: Span,
    /// The step of its last condition, whose target for false is not known yet.
    condition: Option<usize>,
    /// The steps at the ends of its bodies, which jump to the ENDIF.
    body_ends: Vec<usize>,
    has_else: bool,
}

/// The execution section's state.
pub(crate) struct ExecutionSection<'a> {
    names: &'a mut Names,
    checked: &'a mut Checked,
    limits: Limits,
    open_ifs: Vec<OpenIf>,
    gotos: u32,
    /// The steps of the GOTOs, each with the label that it names.
    jumps: Vec<(usize, SymbolId)>,
}

/// The keyword that the next token is, if it is one that begins a statement.
fn keyword<'c>(cursor: &Cursor<'c>) -> Option<&'c str> {
    let token = cursor.token().filter(|token| token.kind == Kind::Name)?;
    let word = cursor.slice(token);
    matches!(word, "IF" | "ELSEIF" | "ELSE" | "ENDIF" | "GOTO").then_some(word)
}

/// Declares the labels in front of a statement, and as a LOGICAL the variable that it assigns. This
/// is done for all statements before any is checked.
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
        Self { names, checked, limits, open_ifs: vec![], gotos: 0, jumps: vec![] }
    }

    /// The index of the step that is added next.
    fn next_step(&self) -> u32 {
        self.checked.steps.len() as u32
    }

    /// Adds a step and gives its index.
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

    /// An assignment, or the error of what begins no statement.
    fn statement_without_keyword(&mut self, cursor: &mut Cursor<'_>) -> Result {
        match cursor.kind() {
            None => Ok(()),
            Some(Kind::Directive) => {
                let what = format!("{} stands after $END", cursor.found());
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

    /// The parser of an expression at the cursor.
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
            // The index of an array that is not known is parsed too: it may have errors of its own.
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

    /// Where the label `name` is declared, if there is one.
    fn label_named(&self, name: &str) -> Option<Span> {
        let symbol = self.names.find(name).and_then(|id| self.names.get(id))?;
        matches!(symbol.meaning, Meaning::Label(_)).then_some(symbol.declared).flatten()
    }

    /// The error of a name after which neither `=` nor `[` stands.
    fn no_assignment(&mut self, cursor: &mut Cursor<'_>, name: &str) -> Result {
        let written = cursor
            .token()
            .and_then(|first| cursor.text.get(first.start as usize..cursor.statement.end as usize));
        let mut words = written.unwrap_or("").trim_end_matches(';').split_whitespace();
        if matches!(
            [words.next(), words.next(), words.next()],
            [Some("END_IF"), None, None] | [Some("END"), Some("IF"), None]
        ) {
            // It was meant to end its IF, of which nobody needs to be told that it has no ENDIF.
            self.open_ifs.pop();
        }
        cursor.at += 1;
        let help = match (name, keyword(cursor)) {
            ("END", Some("IF")) => "write ENDIF as one word",
            ("ELSE", Some("IF")) => "write ELSEIF as one word",
            ("GO", _) => "write GOTO as one word",
            _ => "an assignment is written name = expression",
        };
        let what = format!("`=` is expected after {name}, not {}", cursor.found());
        Err(cursor.error_here(11, what).help_if_none(help).into())
    }

    /// Refuses an assignment to what the program can only read.
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

    /// `(condition)` and nothing after it.
    fn condition(&mut self, cursor: &mut Cursor<'_>, word: &str) -> Result<crate::pmi::ast::Ops> {
        if !cursor.eat(Kind::LParen) {
            let what = format!("`(` is expected after {word}, not {}", cursor.found());
            return Err(cursor
                .error_here(11, what)
                .help_if_none(format!("write {word}(condition)"))
                .into());
        }
        let parsed = self.parser(cursor).parse(Until::Condition)?;
        if cursor.kind() == Some(Kind::RParen) {
            return Err(error(32, cursor.span(), "`)` has no `(`")
                .help("remove it, or open it further left")
                .into());
        }
        if cursor.kind().is_some() {
            let what = format!("{} stands after the condition", cursor.found());
            let help = "put the whole condition in one pair of parentheses, and statements in \
                        lines of their own";
            return Err(cursor.error_here(5, what).help_if_none(help).into());
        }
        Ok(parsed.ops)
    }

    fn begin_if(&mut self, cursor: &mut Cursor<'_>) -> Result {
        let word = cursor.span();
        cursor.at += 1;
        self.open_ifs.push(OpenIf {
            span: word,
            condition: None,
            body_ends: vec![],
            has_else: false,
        });
        let depth = self.open_ifs.len();
        if depth > MAX_LEVELS || depth > LEVELS && self.limits == Limits::Original {
            let most = if self.limits == Limits::Original { LEVELS } else { MAX_LEVELS };
            return Err(error(38, word, format!("more than {most} IFs are nested"))
                .help("combine conditions with &, or leave earlier with a GOTO")
                .into());
        }
        let condition = self.condition(cursor, "IF")?;
        let step = self.step(Action::If { condition, otherwise: 0 }, cursor.statement_span());
        if let Some(open_if) = self.open_ifs.last_mut() {
            open_if.condition = Some(step);
        }
        Ok(())
    }

    /// Ends a body of an IF: adds the jump to the ENDIF. If the body's condition was false,
    /// execution goes on after that jump.
    fn end_body(&mut self, span: Span) {
        let jump = self.step(Action::Jump { to: 0, is_goto: false }, span);
        let here = self.next_step();
        let condition = self.open_ifs.last_mut().and_then(|open_if| {
            open_if.body_ends.push(jump);
            open_if.condition.take()
        });
        self.set_otherwise(condition, here);
    }

    /// Makes `here` the step at which execution goes on if the condition is false.
    fn set_otherwise(&mut self, condition: Option<usize>, here: u32) {
        let step = condition.and_then(|index| self.checked.steps.get_mut(index));
        if let Some(Step { action: Action::If { otherwise, .. }, .. }) = step {
            *otherwise = here;
        }
    }

    /// The error of an ELSEIF, ELSE or ENDIF that has no IF or stands after an ELSE.
    fn misplaced(&self, span: Span, word: &str) -> Result {
        let problem = match self.open_ifs.last() {
            Some(open_if) => error(39, span, format!("{word} stands after ELSE"))
                .label(open_if.span, "of this IF")
                .help("ELSE is the last part of an IF"),
            None => error(39, span, format!("{word} has no IF"))
                .help("remove it, or put the IF in front of it"),
        };
        Err(problem.into())
    }

    fn else_if(&mut self, cursor: &mut Cursor<'_>) -> Result {
        let word = cursor.span();
        cursor.at += 1;
        if self.open_ifs.last().is_none_or(|open_if| open_if.has_else) {
            return self.misplaced(word, "ELSEIF");
        }
        self.end_body(cursor.statement_span());
        let condition = self.condition(cursor, "ELSEIF")?;
        let step = self.step(Action::If { condition, otherwise: 0 }, cursor.statement_span());
        if let Some(open_if) = self.open_ifs.last_mut() {
            open_if.condition = Some(step);
        }
        Ok(())
    }

    fn else_(&mut self, cursor: &mut Cursor<'_>) -> Result {
        let word = cursor.span();
        cursor.at += 1;
        if self.open_ifs.last().is_none_or(|open_if| open_if.has_else) {
            return self.misplaced(word, "ELSE");
        }
        self.end_body(cursor.statement_span());
        let split = keyword(cursor) == Some("IF");
        // ELSE IF was meant as an ELSEIF, after which ELSE may stand.
        if let Some(open_if) = self.open_ifs.last_mut() {
            open_if.has_else = !split;
        }
        self.expect_end_behind(cursor, "ELSE", if split { "write ELSEIF as one word" } else { "" })
    }

    fn end_if(&mut self, cursor: &mut Cursor<'_>) -> Result {
        let word = cursor.span();
        cursor.at += 1;
        let here = self.next_step();
        let Some(open_if) = self.open_ifs.pop() else {
            return self.misplaced(word, "ENDIF");
        };
        self.set_otherwise(open_if.condition, here);
        for jump in open_if.body_ends {
            self.set_jump_target(jump, here);
        }
        self.expect_end_behind(cursor, "ENDIF", "")
    }

    /// Makes `here` the step to which a jump leads.
    fn set_jump_target(&mut self, jump: usize, here: u32) {
        if let Some(Step { action: Action::Jump { to, .. }, .. }) = self.checked.steps.get_mut(jump)
        {
            *to = here;
        }
    }

    /// Refuses anything more in the statement after `word`. An empty `help` stands for the usual
    /// one.
    fn expect_end_behind(&self, cursor: &Cursor<'_>, word: &str, help: &'static str) -> Result {
        if cursor.kind().is_none() {
            return Ok(());
        }
        let help = if help.is_empty() { "put it on a line of its own" } else { help };
        let what = format!("{} stands after {word}", cursor.found());
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
            let what = format!("a label is expected after GOTO, not {}", cursor.found());
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

    /// Ends the section: reports the IFs that have no ENDIF, and sets the targets of the GOTOs.
    pub(crate) fn finish(mut self, diagnostics: &mut Vec<Diagnostic>) {
        for open_if in std::mem::take(&mut self.open_ifs) {
            diagnostics.push(
                error(39, open_if.span, "this IF has no ENDIF").help("put an ENDIF after its body"),
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
