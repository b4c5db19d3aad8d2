//! A script that was checked against its program: names are keys, values have the variables' types, conditions are expressions.

use plcc_diag::{Diagnostic, Span};
use plcc_runtime::{NameError, Names, Purpose, Setting, ValueError, VariableKey};

use crate::claim::Claim;
use crate::condition::{Condition, Surroundings};
use crate::script::{Body, Expected, Length, Piece, Script, Statement};

/// The code of a name that the program does not have, or that can't be used so.
pub(crate) const NAME: &str = "TEST-3";
/// The code of a value that does not fit its variable.
pub(crate) const VALUE: &str = "TEST-4";

/// What acts on a variable before the next tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Act {
    /// A row of a stimulus.
    Set(VariableKey, Setting),
    /// A row with 1, and one with 0 after so long; one tick without a length.
    Pulse(VariableKey, Setting, Setting, Option<Length>),
    /// A force, `None` ends it.
    Force(VariableKey, Option<Setting>),
}

/// What a statement does.
#[derive(Clone, Debug)]
pub enum Step {
    /// Variables are set before the next tick.
    Act(Vec<Act>),
    /// Ticks are run until the conditions hold, for so long at most.
    Wait(Vec<Condition>, Length),
    /// Conditions hold now, events have come, the program was stopped.
    Expect(Vec<Expectation>),
    /// The conditions hold at the end of each of these ticks.
    Hold(Vec<Condition>, Length),
    /// Ticks are run.
    Run(Length),
    /// Off and on.
    PowerCycle,
}

/// What is expected.
#[derive(Clone, Debug)]
pub enum Expectation {
    /// A condition.
    Condition(Condition),
    /// An event whose text contains this: its index in [`PlannedTest::messages`].
    Message(usize),
    /// The program was stopped with this code.
    Stop(String),
}

/// A statement of a test.
#[derive(Clone, Debug)]
pub struct PlannedStatement {
    /// What it does.
    pub step: Step,
    /// Its line.
    pub line: u32,
    /// The statement as it was written.
    pub text: String,
}

/// `never`, `always` or `after`.
#[derive(Clone, Debug)]
pub struct Invariant {
    /// What it says.
    pub claim: Claim,
    /// Its line.
    pub line: u32,
    /// As it was written.
    pub text: String,
}

/// A test, ready to be run.
#[derive(Clone, Debug)]
pub struct PlannedTest {
    /// Its name.
    pub name: String,
    /// Its line.
    pub line: u32,
    /// Its statements.
    pub statements: Vec<PlannedStatement>,
    /// The texts that it expects in events.
    pub messages: Vec<String>,
    /// How many of the script's invariants hold for it.
    pub invariants: usize,
}

/// A script, ready to be run.
#[derive(Clone, Debug, Default)]
pub struct Plan {
    /// `never`, `always` and `after`, in their order.
    pub invariants: Vec<Invariant>,
    /// The tests, in their order.
    pub tests: Vec<PlannedTest>,
}

impl Plan {
    /// Checks a script against its program. `text` gives the text of a place in the script.
    ///
    /// # Errors
    /// Every mistake, at its place in the script.
    pub fn new<'t>(
        script: &Script,
        text: &dyn Fn(Span) -> &'t str,
        checked: &dyn plcc_frontend::CheckedProgram,
        program: &plcc_abi::Program,
        names: &dyn Names,
    ) -> Result<Self, Vec<Diagnostic>> {
        let around = Surroundings { checked, names, program };
        let mut planner = Planner { around, found: vec![], messages: vec![] };
        let mut plan = Self::default();
        for statement in &script.invariants {
            let claim = match &statement.body {
                Body::Invariant { holds, conditions } => {
                    Claim::Each { holds: *holds, conditions: planner.conditions(conditions) }
                }
                Body::Response { after, then, within } => {
                    let after = planner.conditions(std::slice::from_ref(after)).pop();
                    let then = planner.conditions(then);
                    let Some(after) = after.map(Box::new) else { continue };
                    Claim::Response { after, then, within: *within }
                }
                _ => continue,
            };
            let (line, text) = (statement.line, text(statement.span).to_owned());
            plan.invariants.push(Invariant { claim, line, text });
        }
        for test in &script.tests {
            let statements = test.statements.iter().filter_map(|statement| {
                let step = planner.step(statement)?;
                let text = text(statement.span).to_owned();
                Some(PlannedStatement { step, line: statement.line, text })
            });
            let statements = statements.collect();
            plan.tests.push(PlannedTest {
                name: test.name.text.clone(),
                line: test.line,
                statements,
                messages: std::mem::take(&mut planner.messages),
                invariants: test.invariants,
            });
        }
        if planner.found.is_empty() { Ok(plan) } else { Err(planner.found) }
    }
}

/// Checks statements.
struct Planner<'p> {
    around: Surroundings<'p>,
    found: Vec<Diagnostic>,
    /// The texts that the test expects in events.
    messages: Vec<String>,
}

impl Planner<'_> {
    fn conditions(&mut self, pieces: &[Piece]) -> Vec<Condition> {
        let mut conditions = vec![];
        for piece in pieces {
            match Condition::new(piece, self.around) {
                Ok(condition) => conditions.push(condition),
                Err(diagnostic) => self.found.push(diagnostic),
            }
        }
        conditions
    }

    /// The variable of a name that can be set.
    fn variable(&mut self, name: &Piece) -> Option<VariableKey> {
        match self.around.names.find(&name.text, Purpose::Stimulus) {
            Ok(key) => Some(key),
            Err(error) => {
                let diagnostic = match error {
                    NameError::Unknown { name: unknown, suggestion } => {
                        let text = format!("the program has no variable named `{unknown}`");
                        let is_key =
                            unknown.get(..4).is_some_and(|head| head.eq_ignore_ascii_case("KEY."));
                        let help = match suggestion {
                            _ if is_key => {
                                "write `simulate` above the tests: only a simulated machine has keys".into()
                            }
                            Some(near) => format!("did you mean `{near}`?"),
                            None => "`plcc xref` lists the variables of a program".into(),
                        };
                        Diagnostic::error(NAME, name.span, text).help(help)
                    }
                    NameError::Unfit { .. } => {
                        Diagnostic::error(NAME, name.span, error.to_string())
                            .help("name a single variable that the machine or the operator can set")
                    }
                };
                self.found.push(diagnostic);
                None
            }
        }
    }

    /// The value of a variable.
    fn value(&mut self, key: VariableKey, value: &Piece) -> Option<Setting> {
        match self.around.names.parse(key, &value.text) {
            Ok(setting) => Some(setting),
            Err(ValueError { value: text, reason }) => {
                let text = format!("`{text}` {reason}");
                let diagnostic = Diagnostic::error(VALUE, value.span, text);
                self.found.push(diagnostic.help("write the value as in a stimulus"));
                None
            }
        }
    }

    /// A variable that can be forced.
    fn forced(&mut self, name: &Piece) -> Option<VariableKey> {
        let key = self.variable(name)?;
        if !self.around.names.properties(key).can_be_forced {
            let text =
                format!("`{}` can't be forced: only inputs and physical outputs can", name.text);
            let diagnostic = Diagnostic::error(NAME, name.span, text);
            self.found.push(diagnostic.help(format!("`set {} = VALUE` sets it once", name.text)));
            return None;
        }
        Some(key)
    }

    /// What a statement does; `None` where it has a mistake.
    fn step(&mut self, statement: &Statement) -> Option<Step> {
        let before = self.found.len();
        let step = match &statement.body {
            Body::Set(settings) => {
                let mut acts = vec![];
                for (name, value) in settings {
                    let Some(key) = self.variable(name) else { continue };
                    acts.extend(self.value(key, value).map(|value| Act::Set(key, value)));
                }
                Step::Act(acts)
            }
            Body::Pulse(names, length) => {
                let mut acts = vec![];
                for name in names {
                    let Some(key) = self.variable(name) else { continue };
                    let digit = |text: &str| Piece { text: text.into(), span: name.span };
                    let (on, off) = (self.value(key, &digit("1")), self.value(key, &digit("0")));
                    if let (Some(on), Some(off)) = (on, off) {
                        acts.push(Act::Pulse(key, on, off, *length));
                    }
                }
                Step::Act(acts)
            }
            Body::Force(settings) => {
                let mut acts = vec![];
                for (name, value) in settings {
                    let Some(key) = self.forced(name) else { continue };
                    acts.extend(self.value(key, value).map(|value| Act::Force(key, Some(value))));
                }
                Step::Act(acts)
            }
            Body::Release(names) => {
                let keys: Vec<_> = names.iter().filter_map(|name| self.forced(name)).collect();
                Step::Act(keys.into_iter().map(|key| Act::Force(key, None)).collect())
            }
            Body::Wait(conditions, length) => Step::Wait(self.conditions(conditions), *length),
            Body::Hold(conditions, length) => Step::Hold(self.conditions(conditions), *length),
            Body::Expect(expected) => {
                let mut all = vec![];
                for expected in expected {
                    match expected {
                        Expected::Condition(piece) => {
                            let conditions = self.conditions(std::slice::from_ref(piece));
                            all.extend(conditions.into_iter().map(Expectation::Condition));
                        }
                        Expected::Message(text) => {
                            self.messages.push(text.text.clone());
                            all.push(Expectation::Message(self.messages.len() - 1));
                        }
                        Expected::Stop(code) => all.push(Expectation::Stop(code.text.clone())),
                    }
                }
                Step::Expect(all)
            }
            Body::Run(length) => Step::Run(*length),
            Body::PowerCycle => Step::PowerCycle,
            // These stand outside of tests.
            Body::Program(_)
            | Body::Machine(_)
            | Body::Simulate
            | Body::Invariant { .. }
            | Body::Response { .. }
            | Body::Test(_)
            | Body::End => return None,
        };
        (self.found.len() == before).then_some(step)
    }
}
