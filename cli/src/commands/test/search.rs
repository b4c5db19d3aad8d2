//! `plcc test --search SECONDS`: looks for stimuli that cover what the tests of a script do not cover yet.
//!
//! Random changes are made to the stimuli that were found so far. Each candidate runs in native code first. Only one in which
//! variables change together as they never did before is run in the statement interpreter, which counts what it covers.

use std::collections::HashSet;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::Path;
use std::time::{Duration, Instant};

use fastrand::Rng;
use plcc_abi::Engine;
use plcc_abi::place::Direction;
use plcc_diag::SourceMap;
use plcc_plctest::coverage::{Counts, Coverage, Map, ObservedEngine};
use plcc_plctest::{Act, Step, run_test};
use plcc_record::Action;
use plcc_runtime::{Class, Event, Names, Properties, Setting, Value, VariableKey};

use super::Job;
use super::from_record::{Writer, head};
use super::program::TestProgram;
use crate::args::TestArgs;
use crate::failure::{DONE, Failure};
use crate::output;
use crate::report::Report;

/// So many candidates are tried, however little time there is.
const FEWEST: usize = 300;
/// How many ticks a candidate has.
const TICKS: std::ops::Range<u64> = 20..300;

/// A stimulus: what is set before which tick, by rising ticks.
#[derive(Clone, Debug, Default)]
struct Candidate {
    ticks: u64,
    rows: Vec<(u64, usize, Setting)>,
}

/// What can be set.
struct Input {
    key: VariableKey,
    /// Values that are worth trying.
    values: Vec<Setting>,
}

/// Looks for stimuli, and writes what was found as a script.
///
/// # Errors
/// When the scripts are for several programs, the program has nothing that can be set, or the script can't be written.
pub(super) fn search(
    seconds: u64,
    jobs: &[Job<'_>],
    programs: &[TestProgram],
    args: &TestArgs,
    report: &Report,
) -> Result<u8, Failure> {
    let [program] = programs else {
        return Err(Failure::usage("--search looks at one program: name scripts of one"));
    };
    let seed = args.seed.unwrap_or_else(|| Rng::new().u64(0..1 << 32));
    report.message(&format!("the seed of this search is {seed}"));
    let map = Map::new(program.checked.as_ref(), &program.sources);
    let mut counting = ObservedEngine::new(program.checked.as_ref(), &map);
    let mut known = Counts::new(&map);
    for job in jobs {
        run_test(&job.script.plan, job.test, program, &mut counting);
        known.add(&counting.take());
    }
    let before = summary(&map, program, &known);
    let names = program.made().map_err(Failure::usage)?.names();
    let inputs = inputs(&*names, jobs);
    if inputs.is_empty() {
        let what =
            "the program has no input, and no test sets a variable, so that nothing can be tried";
        return Err(Failure::usage(what));
    }
    let search = Search { program, names: &*names, inputs: &inputs };
    let mut native = program.engine().map_err(Failure::usage)?;
    let mut random = Rng::with_seed(seed);
    let (mut seen, mut found) =
        (HashSet::new(), vec![Candidate { ticks: TICKS.start, rows: vec![] }]);
    let mut texts = vec![];
    let (until, mut tried) = (Instant::now() + Duration::from_secs(seconds), 0);
    while tried < FEWEST || Instant::now() < until {
        tried += 1;
        let candidate = search.changed(&found, &mut random);
        if !search.is_new(&candidate, native.as_mut(), &mut seen)? {
            continue;
        }
        search.run(&candidate, &mut counting, &mut |_| {})?;
        let counts = counting.take();
        if counts.is_new_beside(&known) {
            known.add(&counts);
            texts.push(search.text(&candidate, native.as_mut())?);
            found.push(candidate);
        }
    }
    let after = summary(&map, program, &known);
    let out = args.output.as_deref().unwrap_or(Path::new("-"));
    let mut text = format!(
        "# Found by a search with the seed {seed}. What is expected here is what came out: judge whether it is right.\n"
    );
    let files = (0..program.named_files as u32).map(plcc_diag::FileId);
    let files: Vec<&str> = files.map(|file| program.sources.path(file)).collect();
    let machine = program.settings.machine.as_deref();
    text.push_str(&head(out, &files, machine, program.run.simulate));
    for (number, body) in (1..).zip(&texts) {
        text.push_str(&format!("\ntest \"found {number} by seed {seed}\"\n{body}end\n"));
    }
    output::write(out, text.as_bytes(), &SourceMap::new(), &[])?;
    report.message(&format!("{tried} stimuli were tried, {} cover something new", texts.len()));
    report.message(&format!("before: {before}"));
    report.message(&format!("after:  {after}"));
    Ok(DONE)
}

/// How much is covered.
fn summary(map: &Map, program: &TestProgram, counts: &Counts) -> String {
    Coverage::new(map, &program.sources, &[(String::new(), counts.clone())]).summary().line()
}

/// What can be set: the inputs of the program, and what its tests set, with the values that they give.
fn inputs(names: &dyn Names, jobs: &[Job<'_>]) -> Vec<Input> {
    let mut inputs: Vec<Input> = vec![];
    let mut add = |key: VariableKey, value: Option<Setting>| {
        let known = inputs.iter().position(|input| input.key == key).unwrap_or_else(|| {
            let digits: &[&str] = match names.properties(key).class {
                Class::Logical => &["0", "1"],
                Class::Integer | Class::Fraction => &["0", "1", "2", "5", "10", "100"],
            };
            let values = digits.iter().filter_map(|digits| names.parse(key, digits).ok()).collect();
            inputs.push(Input { key, values });
            inputs.len() - 1
        });
        if let (Some(input), Some(value)) = (inputs.get_mut(known), value) {
            input.values.extend((!input.values.contains(&value)).then_some(value));
        }
    };
    for (_, key) in names.declared() {
        let Properties { direction, elements, .. } = names.properties(key);
        if matches!(direction, Direction::Input) && elements.is_none() {
            add(key, None);
        }
    }
    let steps = jobs.iter().flat_map(|job| &job.test.statements).map(|statement| &statement.step);
    for act in steps
        .filter_map(|step| if let Step::Act(acts) = step { Some(acts) } else { None })
        .flatten()
    {
        match *act {
            Act::Set(key, value) | Act::Force(key, Some(value)) => add(key, Some(value)),
            Act::Pulse(key, on, _, _) => add(key, Some(on)),
            Act::Force(_, None) => {}
        }
    }
    inputs.retain(|input| !input.values.is_empty());
    inputs
}

/// What a search works with.
struct Search<'s> {
    program: &'s TestProgram,
    names: &'s dyn Names,
    inputs: &'s [Input],
}

impl Search<'_> {
    /// A stimulus that was found, with random changes.
    fn changed(&self, found: &[Candidate], random: &mut Rng) -> Candidate {
        let mut candidate = random.choice(found).cloned().unwrap_or_default();
        if random.u8(0..4) == 0 {
            candidate.ticks = random.u64(TICKS);
            candidate.rows.retain(|(tick, ..)| *tick < candidate.ticks);
        }
        for _ in 0..random.usize(1..8) {
            if random.u8(0..4) == 0 && !candidate.rows.is_empty() {
                candidate.rows.swap_remove(random.usize(..candidate.rows.len()));
                continue;
            }
            let number = random.usize(..self.inputs.len());
            let Some(value) =
                self.inputs.get(number).and_then(|input| random.choice(&input.values))
            else {
                continue;
            };
            candidate.rows.push((random.u64(..candidate.ticks.max(1)), number, *value));
        }
        candidate.rows.sort_by_key(|(tick, ..)| *tick);
        candidate
    }

    /// Runs a stimulus from power-up, up to its end or a stop of the program. `see` is shown each tick.
    fn run(
        &self,
        candidate: &Candidate,
        engine: &mut dyn Engine,
        see: &mut dyn FnMut(SeenTick<'_>),
    ) -> Result<(), Failure> {
        let mut executive = self.program.made().map_err(Failure::usage)?;
        let mut events: Vec<Event> = vec![];
        let mut rows = candidate.rows.iter().peekable();
        for tick in 0..candidate.ticks {
            let mut actions = vec![];
            while let Some((_, number, value)) = rows.next_if(|(at, ..)| *at <= tick) {
                let Some(input) = self.inputs.get(*number) else { continue };
                executive.write(input.key, *value);
                actions.push(Action::Write(input.key, *value));
            }
            events.clear();
            let stop = executive.tick(engine, &mut events).err();
            let code = stop.as_ref().map(|stop| stop.code.clone());
            see(SeenTick {
                executive: executive.as_ref(),
                actions: &actions,
                events: &events,
                stop: code,
            });
            if stop.is_some() {
                break;
            }
        }
        Ok(())
    }

    /// Whether variables change together in a stimulus as they never did before.
    fn is_new(
        &self,
        candidate: &Candidate,
        engine: &mut dyn Engine,
        seen: &mut HashSet<u64>,
    ) -> Result<bool, Failure> {
        let bits: Vec<VariableKey> =
            self.names.declared().into_iter().map(|(_, key)| key).collect();
        let is_bit = |key: &VariableKey| {
            let Properties { class, elements, .. } = self.names.properties(*key);
            class == Class::Logical && elements.is_none()
        };
        let bits: Vec<VariableKey> = bits.into_iter().filter(is_bit).collect();
        let mut last: Vec<Value> = vec![];
        let mut is_new = false;
        self.run(candidate, engine, &mut |tick| {
            let now: Vec<Value> = bits.iter().map(|key| tick.executive.read(*key)).collect();
            let mut hasher = DefaultHasher::new();
            for (number, value) in now.iter().enumerate() {
                if last.get(number) != Some(value) {
                    (number, *value == Value::Int(0)).hash(&mut hasher);
                }
            }
            tick.stop.hash(&mut hasher);
            is_new |= seen.insert(hasher.finish());
            last = now;
        })?;
        Ok(is_new)
    }

    /// The statements of a test that gives a stimulus and expects what comes out.
    fn text(&self, candidate: &Candidate, engine: &mut dyn Engine) -> Result<String, Failure> {
        let fresh = self.program.made().map_err(Failure::usage)?;
        let mut writer = Writer::new(self.names, fresh.as_ref(), fresh.as_ref());
        self.run(candidate, engine, &mut |tick| {
            writer.tick(tick.actions, tick.executive, tick.events, tick.stop);
        })?;
        Ok(writer.finish())
    }
}

/// A tick that was run.
struct SeenTick<'t> {
    executive: &'t dyn plcc_runtime::Executive,
    actions: &'t [Action],
    events: &'t [Event],
    stop: Option<String>,
}
