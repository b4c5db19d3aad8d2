//! Runs a test: ticks of a control of its own, from power-up, in simulated time.

use std::collections::BTreeMap;

use plcc_abi::Engine;
use plcc_runtime::{Event, Executive, Purpose, Setting, Stop, VariableKey};

use crate::claim::Progress;
use crate::condition::Condition;
use crate::plan::{Act, Expectation, Plan, PlannedTest, Step};
use crate::script::Length;
use crate::told::{Told, text_of};

/// How many texts of events a failure shows.
const SHOWN_EVENTS: usize = 5;

/// Makes the controls of tests.
pub trait Station {
    /// A control of the program, as it is at its first power-up.
    ///
    /// # Errors
    /// Why there is none.
    fn executive(&self) -> Result<Box<dyn Executive>, String>;

    /// The same after the power was off: it has what survives that.
    ///
    /// # Errors
    /// Why there is none.
    fn executive_again(&self, retained: Option<&[u8]>) -> Result<Box<dyn Executive>, String> {
        let mut executive = self.executive()?;
        if let Some(retained) = retained {
            executive.restore(retained)?;
        }
        Ok(executive)
    }

    /// The control is not used any more, since the test is over or the power is switched off. `stop` says why its program
    /// was stopped, if it was.
    fn over(&self, _executive: &mut dyn Executive, _stop: Option<&Stop>) {}
}

/// Why a test failed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Failure {
    /// The line of the statement that failed, or of the `never`, `always` or `after`.
    pub line: u32,
    /// The statement.
    pub statement: String,
    /// What is wrong, for people.
    pub message: String,
    /// The variables of its conditions with their values.
    pub values: Vec<(String, String)>,
    /// The tick that was run last, counted from the last power-up; `None` before the first.
    pub tick: Option<u64>,
    /// How often the power had been switched on, from 1.
    pub powered: u32,
    /// The statement that was executed, where the one that failed is another one.
    pub during: Option<(u32, String)>,
    /// The texts of the last events.
    pub events: Vec<String>,
}

/// How a test went.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Outcome {
    /// How many ticks were run.
    pub ticks: u64,
    /// How much time of the control that was, in nanoseconds.
    pub time_ns: u64,
    /// Why it failed; `None` where it passed.
    pub failure: Option<Failure>,
}

/// Runs a test of a plan.
pub fn run_test(
    plan: &Plan,
    test: &PlannedTest,
    station: &dyn Station,
    engine: &mut dyn Engine,
) -> Outcome {
    let mut run = match Run::new(plan, test, station, engine) {
        Ok(run) => run,
        Err(message) => {
            let failure = Failure {
                line: test.line,
                statement: format!("test \"{}\"", test.name),
                message,
                values: vec![],
                tick: None,
                powered: 0,
                during: None,
                events: vec![],
            };
            return Outcome { ticks: 0, time_ns: 0, failure: Some(failure) };
        }
    };
    let failure = run.statements().err().map(|failure| *failure);
    station.over(run.executive.as_mut(), run.stop.as_ref());
    Outcome { ticks: run.ticks, time_ns: run.time_ns, failure }
}

/// Runs a test to its end: what fails is passed over, and nothing but a stop of the program ends it. `names` are variables whose
/// values are wanted.
///
/// # Errors
/// When there is no control, or no variable of a name.
pub fn run_through(
    plan: &Plan,
    test: &PlannedTest,
    station: &dyn Station,
    engine: &mut dyn Engine,
    names: &[String],
) -> Result<Told, String> {
    let mut run = Run::new(plan, test, station, engine)?;
    let table = run.executive.names();
    for name in names {
        let key = table.find(name, Purpose::Watch).map_err(|error| error.to_string())?;
        run.watched.push(key);
    }
    run.told = Some(Told::of(names.len()));
    for (at, statement) in test.statements.iter().enumerate() {
        run.at = at;
        // What it says of the test is not asked here.
        let _ = run.step(&statement.step);
        if run.stop.is_some() {
            break;
        }
    }
    let stop = run.stop.as_ref().map(|stop| stop.code.clone());
    station.over(run.executive.as_mut(), run.stop.as_ref());
    Ok(Told { stop, ..run.told.unwrap_or_default() })
}

/// What fails a statement, before it is known where it stands.
struct Wrong {
    message: String,
    values: Vec<(String, String)>,
    /// The `never`, `always` or `after` that is broken.
    invariant: Option<usize>,
}

impl Wrong {
    fn new(message: impl Into<String>) -> Self {
        Self { message: message.into(), values: vec![], invariant: None }
    }

    fn with(condition: &Condition, executive: &dyn Executive, message: impl Into<String>) -> Self {
        Self { message: message.into(), values: condition.values(executive), invariant: None }
    }
}

/// A test that runs.
struct Run<'r> {
    plan: &'r Plan,
    test: &'r PlannedTest,
    station: &'r dyn Station,
    engine: &'r mut dyn Engine,
    executive: Box<dyn Executive>,
    /// What acts before the next tick, in order.
    pending: Vec<Act>,
    /// What ends pulses, by the tick before which it acts.
    ends: BTreeMap<u64, Vec<(VariableKey, Setting)>>,
    /// The tick that comes next, since power-up.
    next: u64,
    powered: u32,
    stop: Option<Stop>,
    /// Whether a statement has said that the program was to stop.
    stop_expected: bool,
    /// Whether each expected text was seen.
    seen: Vec<bool>,
    /// The texts of the last events.
    texts: Vec<String>,
    events: Vec<Event>,
    ticks: u64,
    time_ns: u64,
    /// The statement that is executed.
    at: usize,
    /// What the program tells, where the test is run to its end whatever fails, and the variables whose values are wanted.
    told: Option<Told>,
    watched: Vec<VariableKey>,
    /// What is remembered of the script's invariants that stand above the test.
    progress: Vec<Progress>,
}

impl<'r> Run<'r> {
    fn new(
        plan: &'r Plan,
        test: &'r PlannedTest,
        station: &'r dyn Station,
        engine: &'r mut dyn Engine,
    ) -> Result<Self, String> {
        Ok(Self {
            plan,
            test,
            station,
            engine,
            executive: station.executive()?,
            pending: vec![],
            ends: BTreeMap::new(),
            next: 0,
            powered: 1,
            stop: None,
            stop_expected: false,
            seen: vec![false; test.messages.len()],
            texts: vec![],
            events: vec![],
            ticks: 0,
            time_ns: 0,
            at: 0,
            told: None,
            watched: vec![],
            progress: vec![Progress::default(); test.invariants],
        })
    }

    fn statements(&mut self) -> Result<(), Box<Failure>> {
        for (at, statement) in self.test.statements.iter().enumerate() {
            self.at = at;
            self.step(&statement.step).map_err(|wrong| Box::new(self.failure(wrong)))?;
        }
        Ok(())
    }

    fn failure(&self, wrong: Wrong) -> Failure {
        let statement = self.test.statements.get(self.at);
        let own = statement.map_or((self.test.line, String::new()), |s| (s.line, s.text.clone()));
        let broken = wrong.invariant.and_then(|index| self.plan.invariants.get(index));
        let ((line, text), during) = match broken {
            Some(invariant) => ((invariant.line, invariant.text.clone()), Some(own)),
            None => (own, None),
        };
        Failure {
            line,
            statement: text,
            message: wrong.message,
            values: wrong.values,
            tick: self.next.checked_sub(1),
            powered: self.powered,
            during,
            events: self.texts.clone(),
        }
    }

    fn step(&mut self, step: &Step) -> Result<(), Wrong> {
        match step {
            Step::Act(acts) => {
                self.pending.extend(acts);
                Ok(())
            }
            Step::Run(length) => self.run(*length),
            Step::Wait(conditions, length) => self.wait(conditions, *length),
            Step::Hold(conditions, length) => self.hold(conditions, *length),
            Step::Expect(expectations) => self.expect(expectations),
            Step::PowerCycle => self.power_cycle(),
        }
    }

    /// Whether the rest of the test says that the program is to stop, before it runs further ticks.
    fn stop_is_expected_later(&self) -> bool {
        let rest = self.test.statements.get(self.at..).unwrap_or_default();
        for (distance, statement) in rest.iter().enumerate() {
            match &statement.step {
                Step::Expect(all) => {
                    if all.iter().any(|one| matches!(one, Expectation::Stop(_))) {
                        return true;
                    }
                }
                Step::Act(_) => {}
                // The first one is the statement that runs.
                Step::Run(_) | Step::Wait(..) | Step::Hold(..) if distance == 0 => {}
                Step::Run(_) | Step::Wait(..) | Step::Hold(..) | Step::PowerCycle => return false,
            }
        }
        false
    }

    /// Runs a tick.
    fn tick(&mut self) -> Result<(), Wrong> {
        if let Some(stop) = &self.stop {
            return Err(stopped(stop));
        }
        let tick = self.next;
        for (key, value) in self.ends.remove(&tick).unwrap_or_default() {
            self.executive.write(key, value);
        }
        for act in std::mem::take(&mut self.pending) {
            match act {
                Act::Set(key, value) => self.executive.write(key, value),
                Act::Pulse(key, on, off, length) => {
                    self.executive.write(key, on);
                    let tick_ns = self.executive.tick_ns();
                    let length = length.map_or(1, |length| length.ticks(tick_ns).max(1));
                    self.ends.entry(tick.saturating_add(length)).or_default().push((key, off));
                }
                Act::Force(key, value) => {
                    if let Err(reason) = self.executive.force(key, value) {
                        let name = self.executive.names().canonical(key);
                        return Err(Wrong::new(format!("`{name}` {reason}")));
                    }
                }
            }
        }
        let tick_ns = self.executive.tick_ns();
        let result = self.executive.tick(self.engine, &mut self.events);
        self.next += 1;
        self.ticks += 1;
        self.time_ns = self.time_ns.saturating_add(tick_ns);
        self.see_events();
        self.see_values();
        self.stop = result.err();
        match &self.stop {
            Some(stop) if !self.stop_is_expected_later() => Err(stopped(stop)),
            _ => self.invariants(),
        }
        .or_else(|wrong| self.pass_over(wrong))
    }

    /// Passes over what is wrong in a tick, where the test is run to its end.
    fn pass_over(&mut self, wrong: Wrong) -> Result<(), Wrong> {
        match &mut self.told {
            Some(told) if self.stop.is_none() => {
                told.broken = told.broken.or(wrong.invariant);
                Ok(())
            }
            _ => Err(wrong),
        }
    }

    /// Looks for expected texts in the events of a tick.
    fn see_events(&mut self) {
        for event in std::mem::take(&mut self.events) {
            let Some(text) = text_of(&event.body) else { continue };
            if let Some(told) = &mut self.told {
                told.hear(&event.body, &text);
            }
            for (seen, message) in self.seen.iter_mut().zip(&self.test.messages) {
                *seen |= text.contains(message.as_str());
            }
            if self.texts.last() != Some(&text) {
                if self.texts.len() == SHOWN_EVENTS {
                    self.texts.remove(0);
                }
                self.texts.push(text);
            }
        }
    }

    /// Notes the values of the variables that are wanted.
    fn see_values(&mut self) {
        let Some(told) = &mut self.told else { return };
        for (number, key) in self.watched.iter().enumerate() {
            told.see(number, self.executive.read(*key));
        }
    }

    /// Looks at what the script says of all ticks; each is looked at in each tick, whatever another one says.
    fn invariants(&mut self) -> Result<(), Wrong> {
        let invariants = self.plan.invariants.iter().zip(&mut self.progress);
        let executive = self.executive.as_ref();
        let mut first = Ok(());
        for (index, (invariant, progress)) in invariants.enumerate() {
            if let Some(breach) = invariant.claim.breach(progress, executive)
                && first.is_ok()
            {
                let wrong = Wrong::with(breach.condition, executive, breach.message);
                first = Err(Wrong { invariant: Some(index), ..wrong });
            }
        }
        first
    }

    /// Runs tick 0 where none was run yet.
    fn begin(&mut self) -> Result<(), Wrong> {
        if self.next == 0 { self.tick() } else { Ok(()) }
    }

    /// The first condition that does not hold now, with why.
    fn first_wrong(&self, conditions: &[Condition]) -> Option<Wrong> {
        conditions.iter().find_map(|condition| self.wrong(condition))
    }

    fn wrong(&self, condition: &Condition) -> Option<Wrong> {
        let message = match condition.holds(self.executive.as_ref()) {
            Ok(true) => return None,
            Ok(false) => format!("`{}` does not hold", condition.text),
            Err(why) => format!("`{}` has no value: {why}", condition.text),
        };
        Some(Wrong::with(condition, self.executive.as_ref(), message))
    }

    fn run(&mut self, length: Length) -> Result<(), Wrong> {
        for _ in 0..length.ticks(self.executive.tick_ns()) {
            self.tick()?;
            if self.stop.is_some() {
                break;
            }
        }
        Ok(())
    }

    fn wait(&mut self, conditions: &[Condition], length: Length) -> Result<(), Wrong> {
        self.begin()?;
        let mut left = length.ticks(self.executive.tick_ns());
        let ticks = left;
        while let Some(mut wrong) = self.first_wrong(conditions) {
            if left == 0 {
                wrong.message = format!("{} after {ticks} ticks", wrong.message);
                return Err(wrong);
            }
            left -= 1;
            self.tick()?;
        }
        Ok(())
    }

    fn hold(&mut self, conditions: &[Condition], length: Length) -> Result<(), Wrong> {
        let ticks = length.ticks(self.executive.tick_ns());
        for passed in 0..ticks {
            self.tick()?;
            if self.told.is_some() {
                continue;
            }
            if let Some(mut wrong) = self.first_wrong(conditions) {
                wrong.message = format!("{} in tick {} of {ticks}", wrong.message, passed + 1);
                return Err(wrong);
            }
        }
        Ok(())
    }

    fn expect(&mut self, expectations: &[Expectation]) -> Result<(), Wrong> {
        self.begin()?;
        for expectation in expectations {
            match expectation {
                Expectation::Condition(condition) => {
                    if let Some(wrong) = self.wrong(condition) {
                        return Err(wrong);
                    }
                }
                Expectation::Message(index) => {
                    if !self.seen.get(*index).copied().unwrap_or(false) {
                        let text = self.test.messages.get(*index).map_or("", String::as_str);
                        return Err(Wrong::new(format!("no event contains \"{text}\"")));
                    }
                }
                Expectation::Stop(code) => match &self.stop {
                    None => return Err(Wrong::new("the program was not stopped")),
                    Some(stop) if stop.code == *code => self.stop_expected = true,
                    Some(stop) => return Err(stopped(stop)),
                },
            }
        }
        match &self.stop {
            Some(stop) if !self.stop_expected && !self.stop_is_expected_later() => {
                Err(stopped(stop))
            }
            _ => Ok(()),
        }
    }

    /// Switches the control off and on. Forces stay, what was to act does not.
    fn power_cycle(&mut self) -> Result<(), Wrong> {
        let retained = self.executive.retained();
        let forces = self.executive.forces();
        self.station.over(self.executive.as_mut(), self.stop.as_ref());
        let again = self.station.executive_again(retained.as_deref());
        self.executive = again.map_err(Wrong::new)?;
        for (key, value) in forces {
            if let Err(reason) = self.executive.force(key, Some(value)) {
                let name = self.executive.names().canonical(key);
                return Err(Wrong::new(format!("`{name}` {reason}")));
            }
        }
        self.ends.clear();
        self.pending.clear();
        self.progress.fill(Progress::default());
        self.next = 0;
        self.powered += 1;
        self.stop = None;
        self.stop_expected = false;
        Ok(())
    }
}

/// That the program was stopped.
fn stopped(stop: &Stop) -> Wrong {
    let place = stop
        .place
        .as_ref()
        .map_or_else(String::new, |place| format!(" ({}:{})", place.file, place.line));
    Wrong::new(format!("the program was stopped with {}: {}{place}", stop.code, stop.message))
}
