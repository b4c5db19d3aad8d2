//! The execution section (PMI 3.3): assignments, IF, GOTO, labels.

use plcc_abi::pmi::Type;
use plcc_diag::{Diagnostic, Span};

use crate::common::Limits;
use crate::pmi::{
    analyse::{
        expression::{CheckedExpression, ExpressionCheck, Index},
        lookup::resolve,
        names::Names,
    },
    ast::{Action, Checked, Meaning, Step, SymbolId, Target},
    read::{
        cursor::Cursor,
        diagnostic::{Result, error},
        syntax::{Expression, Logic, LogicForm, Part},
        token::{RESERVED, Token},
    },
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
    /// The parts of all expressions.
    parts: &'a [Part],
    limits: Limits,
    open_ifs: Vec<OpenIf>,
    gotos: u32,
    /// The steps of the GOTOs, each with the label that it names.
    jumps: Vec<(usize, SymbolId)>,
}

/// Declares the labels in front of a statement, and as a LOGICAL the variable that it assigns. This
/// is done for all statements before any is checked.
pub(crate) fn declare(names: &mut Names, cursor: &Cursor<'_>, logic: &Logic) {
    let labels = logic.labels.iter().map(|label| (label, Meaning::Label(None)));
    let assigned = logic.assigned.iter().map(|name| (name, Meaning::Variable));
    for (token, meaning) in labels.chain(assigned) {
        let name = cursor.slice(*token);
        if !RESERVED.contains(&name) {
            let _ = names.declare(name, cursor.span_of(*token), Type::Logical, None, meaning);
        }
    }
}

impl<'a> ExecutionSection<'a> {
    pub(crate) fn new(
        names: &'a mut Names,
        checked: &'a mut Checked,
        parts: &'a [Part],
        limits: Limits,
    ) -> Self {
        let (open_ifs, jumps) = (vec![], vec![]);
        Self { names, checked, parts, limits, open_ifs, gotos: 0, jumps }
    }

    /// The index of the step that is added next.
    fn next_step(&self) -> u32 {
        self.checked.steps.len() as u32
    }

    /// Adds a step and returns its index.
    fn step(&mut self, action: Action, span: Span) -> usize {
        self.checked.steps.push(Step { action, span, line: 0 });
        self.checked.steps.len() - 1
    }

    /// Checks one statement.
    pub(crate) fn statement(
        &mut self,
        cursor: &Cursor<'_>,
        logic: &mut Logic,
        error: Option<Box<Diagnostic>>,
    ) -> Result {
        let label = logic.labels.first().map_or(Ok(()), |label| self.label(cursor, *label));
        let form = match error {
            None => Ok(()),
            Some(error) => Err(error),
        };
        let statement = match &mut logic.form {
            LogicForm::Assignment { name, index, value } => {
                self.assignment(cursor, *name, index, value, form)
            }
            LogicForm::If { word, condition } => self.begin_if(cursor, *word, condition, form),
            LogicForm::ElseIf { word, condition } => self.else_if(cursor, *word, condition, form),
            LogicForm::Else { word, is_else_if } => self.else_(cursor, *word, *is_else_if, form),
            LogicForm::EndIf { word } => self.end_if(cursor, *word, form),
            LogicForm::Goto { word, label } => self.goto(cursor, *word, *label, form),
            LogicForm::Other { ends_if } => {
                if *ends_if {
                    self.open_ifs.pop();
                }
                form
            }
        };
        label.and(statement)
    }

    /// The label in front of a statement.
    fn label(&mut self, cursor: &Cursor<'_>, label: Token) -> Result {
        let (name, span) = (cursor.slice(label), cursor.span_of(label));
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

    /// Checks an expression of the statement at `cursor`. `target` is as in
    /// [`ExpressionCheck::check`].
    fn expression(
        &mut self,
        cursor: &Cursor<'_>,
        expression: &mut Expression,
        target: Option<SymbolId>,
    ) -> Result<CheckedExpression> {
        ExpressionCheck::new(cursor, self.names, &mut self.checked.ops)
            .check(expression, self.parts, target)
    }

    fn assignment(
        &mut self,
        cursor: &Cursor<'_>,
        name: Token,
        index: &mut Option<Expression>,
        value: &mut Option<Expression>,
        form: Result,
    ) -> Result {
        let (name, span) = (cursor.slice(name), cursor.span_of(name));
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
        let symbol = resolve(self.names, name, span, index.is_some())?;
        if let Some(id) = symbol {
            self.check_writable(id, span)?;
        }
        // The index of an array that is not known is checked too: it may have errors of its own.
        let symbol = symbol.unwrap_or(SymbolId(u32::MAX));
        let target = match index {
            Some(index) => {
                let index = self.expression(cursor, index, Some(symbol))?;
                match index.index {
                    Index::At(at) => Target::At(symbol, at),
                    Index::Computed => Target::Element(symbol, index.ops),
                }
            }
            None => Target::Scalar(symbol),
        };
        let Some(value) = value else { return form };
        let value = self.expression(cursor, value, None)?.ops;
        self.step(Action::Assign { target, value }, cursor.statement_span());
        Ok(())
    }

    /// Where the label `name` is declared, if there is one.
    fn label_named(&self, name: &str) -> Option<Span> {
        let symbol = self.names.find(name).and_then(|id| self.names.get(id))?;
        matches!(symbol.meaning, Meaning::Label(_)).then_some(symbol.declared).flatten()
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

    /// Adds the step of an IF or ELSEIF.
    fn condition(
        &mut self,
        cursor: &Cursor<'_>,
        condition: &mut Option<Expression>,
        form: Result,
    ) -> Result {
        let Some(condition) = condition else { return form };
        let condition = self.expression(cursor, condition, None)?.ops;
        form?;
        let step = self.step(Action::If { condition, otherwise: 0 }, cursor.statement_span());
        if let Some(open_if) = self.open_ifs.last_mut() {
            open_if.condition = Some(step);
        }
        Ok(())
    }

    fn begin_if(
        &mut self,
        cursor: &Cursor<'_>,
        word: Token,
        condition: &mut Option<Expression>,
        form: Result,
    ) -> Result {
        let word = cursor.span_of(word);
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
        self.condition(cursor, condition, form)
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

    /// The error of an ELSEIF, ELSE or ENDIF that has no IF or is after an ELSE.
    fn misplaced(&self, span: Span, word: &str) -> Result {
        let problem = match self.open_ifs.last() {
            Some(open_if) => error(39, span, format!("{word} comes after ELSE"))
                .label(open_if.span, "of this IF")
                .help("ELSE is the last part of an IF"),
            None => error(39, span, format!("{word} has no IF"))
                .help("remove it, or put the IF in front of it"),
        };
        Err(problem.into())
    }

    fn else_if(
        &mut self,
        cursor: &Cursor<'_>,
        word: Token,
        condition: &mut Option<Expression>,
        form: Result,
    ) -> Result {
        let word = cursor.span_of(word);
        if self.open_ifs.last().is_none_or(|open_if| open_if.has_else) {
            return self.misplaced(word, "ELSEIF");
        }
        self.end_body(cursor.statement_span());
        self.condition(cursor, condition, form)
    }

    fn else_(
        &mut self,
        cursor: &Cursor<'_>,
        word: Token,
        is_else_if: bool,
        form: Result,
    ) -> Result {
        let word = cursor.span_of(word);
        if self.open_ifs.last().is_none_or(|open_if| open_if.has_else) {
            return self.misplaced(word, "ELSE");
        }
        self.end_body(cursor.statement_span());
        // ELSE IF was meant as an ELSEIF, after which ELSE may follow.
        if let Some(open_if) = self.open_ifs.last_mut() {
            open_if.has_else = !is_else_if;
        }
        form
    }

    fn end_if(&mut self, cursor: &Cursor<'_>, word: Token, form: Result) -> Result {
        let word = cursor.span_of(word);
        let here = self.next_step();
        let Some(open_if) = self.open_ifs.pop() else {
            return self.misplaced(word, "ENDIF");
        };
        self.set_otherwise(open_if.condition, here);
        for jump in open_if.body_ends {
            self.set_jump_target(jump, here);
        }
        form
    }

    /// Makes `here` the step to which a jump leads.
    fn set_jump_target(&mut self, jump: usize, here: u32) {
        if let Some(Step { action: Action::Jump { to, .. }, .. }) = self.checked.steps.get_mut(jump)
        {
            *to = here;
        }
    }

    fn goto(
        &mut self,
        cursor: &Cursor<'_>,
        word: Token,
        label: Option<Token>,
        form: Result,
    ) -> Result {
        let word = cursor.span_of(word);
        self.gotos += 1;
        if self.gotos > GOTOS && self.limits == Limits::Original {
            return Err(error(44, word, "a program has 1000 GOTOs at most")
                .help("use IFs, or compile with `--limits none`")
                .into());
        }
        let Some(label) = label else { return form };
        let (name, span) = (cursor.slice(label), cursor.span_of(label));
        let id = self.names.find(name);
        match id.and_then(|id| self.names.get(id)).map(|symbol| (&symbol.meaning, symbol.declared))
        {
            Some((Meaning::Label(None), _)) => {}
            Some((Meaning::Label(Some(_)), at)) => {
                let problem = error(47, span, format!("{name} does not come later in the program"));
                let problem = match at {
                    Some(at) => problem.label(at, "it is here"),
                    None => problem,
                };
                return Err(problem.help("a GOTO goes forward only; a scan ends by itself").into());
            }
            Some((Meaning::Unknown, _)) => return Ok(()),
            _ => {
                let problem = error(46, span, format!("no label is named {name}"));
                return Err(match self.names.suggest(name, true) {
                    Some(near) => problem.did_you_mean(near),
                    None => problem.help("put the label and a colon in front of a later statement"),
                }
                .into());
            }
        }
        form?;
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
