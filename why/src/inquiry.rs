//! What an inquiry knows: the program and its run, the traces of the ticks that it has looked at, the variables that it has met.

use std::collections::{BTreeMap, HashMap};
use std::rc::Rc;
use std::sync::Arc;

use plcc_frontend::CheckedProgram;
use plcc_frontend::common::{Accessed, StatementInterpreter, Value};
use plcc_frontend::presentation::StatementPlace;
use plcc_replay::trace::TickTrace;
use plcc_replay::{DebugError, DebuggedProgram, History};
use plcc_runtime::{Names, Purpose, Setting, VariableKey};

use crate::Question;
use crate::explanation::Explanation;
use crate::graph::Graph;
use crate::round::Round;
use crate::texts::AskedText;
use crate::trial::{Trial, execute};
use crate::variable::Variable;

/// A longer process image is not copied for each statement whose effects are found, in bytes.
const SMALL_IMAGE: usize = 1 << 16;

/// A place in a run: before the step of a tick with this number; all of the tick is before the number of its steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct Moment {
    pub(crate) tick: u64,
    pub(crate) step: usize,
}

/// An answer that is being looked for.
pub(crate) struct Inquiry<'a> {
    pub(crate) program: &'a DebuggedProgram,
    pub(crate) history: &'a mut dyn History,
    pub(crate) names: Arc<dyn Names>,
    pub(crate) graph: Graph,
    /// The length of a tick in nanoseconds.
    pub(crate) tick_ns: u64,
    /// The forces in effect at the moment that is explained.
    pub(crate) forces: Vec<(VariableKey, Setting)>,
    interpreter: Box<dyn StatementInterpreter>,
    placed: Vec<bool>,
    traces: BTreeMap<u64, Rc<TickTrace>>,
    rounds: HashMap<Moment, Rc<Round>>,
    variables: HashMap<Accessed, Option<Rc<Variable>>>,
    effects: HashMap<(usize, u32), Rc<Trial>>,
    /// The task of each statement, of a subroutine any of those that may call it; made when it is first needed.
    tasks: Vec<usize>,
    /// The image on which the effects of statements are found.
    image: Vec<u8>,
    scratch: Vec<u8>,
    /// How many statements are being followed back that make a variable's value of its own.
    pub(crate) followed: usize,
}

impl<'a> Inquiry<'a> {
    pub(crate) fn new(
        program: &'a DebuggedProgram,
        history: &'a mut dyn History,
        question: &Question,
    ) -> Result<Self, DebugError> {
        let names = history.executive().names();
        let interpreter = program.checked().statement_interpreter();
        let mut this = Self {
            program,
            history,
            names,
            graph: Graph::new(program.checked().ways()),
            tick_ns: 0,
            forces: vec![],
            interpreter,
            placed: program.places().placed(),
            traces: BTreeMap::new(),
            rounds: HashMap::new(),
            variables: HashMap::new(),
            effects: HashMap::new(),
            tasks: vec![],
            image: vec![],
            scratch: vec![],
            followed: 0,
        };
        this.trace(question.tick)?;
        this.tick_ns = this.history.executive().tick_ns();
        this.forces = this.history.executive().forces();
        this.image = this.history.executive().image().to_vec();
        Ok(this)
    }

    pub(crate) fn checked(&self) -> &'a dyn CheckedProgram {
        self.program.checked()
    }

    /// The trace of a tick.
    pub(crate) fn trace(&mut self, tick: u64) -> Result<Rc<TickTrace>, DebugError> {
        if let Some(trace) = self.traces.get(&tick) {
            return Ok(Rc::clone(trace));
        }
        let (interpreter, history) = (self.interpreter.as_mut(), &mut *self.history);
        let (trace, _) = TickTrace::record(self.program, &self.placed, interpreter, history, tick)?;
        let trace = Rc::new(trace);
        self.traces.insert(tick, Rc::clone(&trace));
        Ok(trace)
    }

    /// The last scans of all tasks before a moment.
    pub(crate) fn round(&mut self, before: Moment) -> Result<Rc<Round>, DebugError> {
        if let Some(round) = self.rounds.get(&before) {
            return Ok(Rc::clone(round));
        }
        let round = Rc::new(Round::before(self, before)?);
        self.rounds.insert(before, Rc::clone(&round));
        Ok(round)
    }

    /// The process image before a step.
    pub(crate) fn image(&mut self, at: Moment) -> Result<Vec<u8>, DebugError> {
        Ok(self.trace(at.tick)?.image(at.step))
    }

    /// The variable that a statement has accessed; `None` for internal state without a name.
    pub(crate) fn variable(&mut self, accessed: Accessed) -> Option<Rc<Variable>> {
        if let Some(known) = self.variables.get(&accessed) {
            return known.clone();
        }
        let name = self.program.name(accessed);
        let variable = name.map(|name| Rc::new(self.new_variable(name, Some(accessed))));
        self.variables.insert(accessed, variable.clone());
        variable
    }

    /// A variable that was not met before.
    pub(crate) fn new_variable(&self, name: String, accessed: Option<Accessed>) -> Variable {
        Variable::new(&*self.names, self.checked(), name, accessed)
    }

    /// The variable with a name.
    pub(crate) fn named(&mut self, name: &str) -> Rc<Variable> {
        let key = self.names.find(name, Purpose::Watch);
        let name = key.map_or_else(|_| name.to_owned(), |key| self.names.canonical(key));
        match self.program.accessed(&name) {
            Some(accessed) if accessed_name(self.program, accessed).as_ref() == Some(&name) => {
                match self.variable(accessed) {
                    Some(variable) => variable,
                    None => Rc::new(self.new_variable(name, Some(accessed))),
                }
            }
            accessed => Rc::new(self.new_variable(name, accessed)),
        }
    }

    /// Executes a statement on a copy of an image: see [`execute`]. Gives the image afterwards, too.
    pub(crate) fn try_statement(
        &mut self,
        task: usize,
        statement: u32,
        image: &[u8],
        given: &[(Accessed, Value)],
    ) -> (Trial, Vec<u8>) {
        let mut image = image.to_vec();
        let trial = execute(self.interpreter.as_mut(), task, statement, &mut image, given);
        (trial, image)
    }

    /// What a statement reads and writes.
    pub(crate) fn effects(&mut self, task: usize, statement: u32) -> Rc<Trial> {
        if let Some(effects) = self.effects.get(&(task, statement)) {
            return Rc::clone(effects);
        }
        // A copy for each statement would take long where the image is long.
        let copies = self.image.len() / SMALL_IMAGE;
        if self.effects.len().is_multiple_of(copies + 1) {
            self.scratch.clone_from(&self.image);
        }
        let mut image = std::mem::take(&mut self.scratch);
        let effects = execute(self.interpreter.as_mut(), task, statement, &mut image, &[]);
        self.scratch = image;
        let effects = Rc::new(effects);
        self.effects.insert((task, statement), Rc::clone(&effects));
        effects
    }

    /// The task of a statement; of a statement in a subroutine one that could call it.
    pub(crate) fn task_of(&mut self, statement: u32) -> usize {
        if self.tasks.is_empty() {
            let count = self.program.tables().tasks.len();
            let mut known = 0;
            for statement in 0..self.graph.len() as u32 {
                let mut tasks = (known..count).chain(0..known);
                known = tasks.find(|&task| self.effects(task, statement).ran).unwrap_or(known);
                self.tasks.push(known);
            }
        }
        self.tasks.get(statement as usize).copied().unwrap_or(0)
    }

    /// The statements that can write a variable.
    pub(crate) fn writers(&mut self, of: &Variable) -> Vec<u32> {
        let mut found = vec![];
        for statement in 0..self.graph.len() as u32 {
            let task = self.task_of(statement);
            let effects = self.effects(task, statement);
            if effects.writes.iter().any(|(written, _)| self.is_met(of, *written)) {
                found.push(statement);
            }
        }
        found
    }

    /// Whether an access concerns a variable.
    pub(crate) fn is_met(&mut self, variable: &Variable, accessed: Accessed) -> bool {
        match self.variable(accessed) {
            Some(other) => variable.meets(&other),
            None => variable.accessed.is_some_and(|own| own.meets(accessed)),
        }
    }

    /// Where a statement stands.
    pub(crate) fn place(&self, statement: u32) -> Option<StatementPlace> {
        self.program.places().place(statement)
    }

    /// The answer.
    pub(crate) fn explain(mut self, question: &Question) -> Result<Explanation, DebugError> {
        let steps = self.trace(question.tick)?.steps.len();
        let at = Moment { tick: question.tick, step: question.step.unwrap_or(steps).min(steps) };
        let key = match self.names.find(&question.name, Purpose::Watch) {
            Ok(key) if quoted(&question.name).is_none() => key,
            found => match self.of_text(&question.name)? {
                Some(OfText::Variable(name)) => self.names.find(&name, Purpose::Watch),
                Some(OfText::Statements(asked)) => return self.text(&asked, at, question),
                None => found,
            }
            .map_err(|error| DebugError(error.to_string()))?,
        };
        if self.names.properties(key).elements.is_some() {
            return Err(DebugError(format!(
                "`{}` is a whole array; name one element, as {}[0]",
                question.name,
                self.names.canonical(key)
            )));
        }
        let name = self.of_line(self.names.canonical(key));
        let variable = self.named(&name);
        self.tree(&variable, at, question.would)
    }

    /// The variable whose only line has a name, as drawings call it; else that name.
    fn of_line(&self, name: String) -> String {
        let points = self.checked().io_points(&[], &self.image);
        let is_its_line = |lines: &[String]| matches!(lines, [line] if *line == name);
        let of = points.into_iter().find(|point| point.bit && is_its_line(&point.lines));
        of.map_or(name, |point| point.name)
    }

    /// What has a text: a fault or message, or statements that put it out; small and capital letters are the same. `None` if
    /// nothing has it.
    ///
    /// # Errors
    /// When several have it.
    fn of_text(&self, asked: &str) -> Result<Option<OfText>, DebugError> {
        let text = quoted(asked).unwrap_or(asked).trim().to_lowercase();
        let announced = self.checked().announcements().into_iter();
        let announced = announced.map(|one| (one.text, OfText::Variable(one.name)));
        let mut all: Vec<(String, OfText)> = announced.collect();
        let mut by_text: BTreeMap<String, Vec<u32>> = BTreeMap::new();
        for one in self.checked().text_statements() {
            if self.shown_place(one.statement) == asked.trim() {
                let statements = vec![one.statement];
                return Ok(Some(OfText::Statements(AskedText { text: one.text, statements })));
            }
            by_text.entry(one.text).or_default().push(one.statement);
        }
        all.extend(by_text.into_iter().map(|(text, statements)| {
            (text.clone(), OfText::Statements(AskedText { text, statements }))
        }));
        let has = |exactly: bool| {
            let matches = |other: &str| match exactly {
                true => other.to_lowercase() == text,
                false => other.to_lowercase().contains(&text),
            };
            all.iter().filter(|(other, _)| matches(other)).collect::<Vec<_>>()
        };
        let found = if text.is_empty() { vec![] } else { has(true) };
        let may_be_part = found.is_empty() && text.len() > 1 && quoted(asked).is_none();
        let found = if may_be_part { has(false) } else { found };
        match found.as_slice() {
            [] => Ok(None),
            [(_, one)] => Ok(Some(one.clone())),
            several => {
                let name = |of: &OfText| match of {
                    OfText::Variable(name) => name.clone(),
                    OfText::Statements(asked) => asked
                        .statements
                        .first()
                        .map_or_else(String::new, |&at| self.shown_place(at)),
                };
                let named = several.iter().map(|(text, of)| format!("{} ({text})", name(of)));
                let named = named.collect::<Vec<_>>().join(", ");
                Err(DebugError(format!("several have this text; name one of them: {named}")))
            }
        }
    }

    /// Where a statement begins, as `FILE:LINE`.
    fn shown_place(&self, statement: u32) -> String {
        let place = self.place(statement);
        place.map_or_else(String::new, |place| {
            format!("{}:{}", self.program.sources().path(place.file), place.line)
        })
    }
}

/// What has a text.
#[derive(Clone, Debug)]
enum OfText {
    /// The variable of a fault or message.
    Variable(String),
    /// Statements that put it out.
    Statements(AskedText),
}

/// The text of a name that is a text in quotes, which may have the statement's word in front: `"DOOR OPEN"`, `SEND"DOOR OPEN"`.
fn quoted(name: &str) -> Option<&str> {
    let (word, text) = name.trim().strip_suffix('"')?.split_once('"')?;
    let is_word = word.chars().all(|c| c.is_ascii_alphanumeric() || c == ' ' || c == ',');
    is_word.then_some(text)
}

fn accessed_name(program: &DebuggedProgram, accessed: Accessed) -> Option<String> {
    program.name(accessed)
}
