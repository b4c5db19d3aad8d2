//! Runs a PMI program in every engine side by side, each with an executive of its own.
#![allow(clippy::expect_used)]

use plcc_abi::{Engine, Program, Region};
use plcc_codegen::{CodegenOptions, OptLevel, Optimization, Target, compile};
use plcc_diag::SourceMap;
use plcc_frontend::{
    common::{MemoryLoader, Options},
    pmi,
};
use plcc_ir::Module;
use plcc_load::Artifact;
use plcc_runtime::native::NativeEngine;
use plcc_runtime::pmi::{PmiExecutive, PmiOptions};
use plcc_runtime::{Event, Executive, Purpose, Setting, Stop, VariableKey};

/// The result of a tick and its events.
pub(crate) type Ticked = (Result<(), Stop>, Vec<Event>);

/// An engine with its own executive.
pub(crate) struct Machine {
    pub(crate) name: &'static str,
    engine: Box<dyn Engine>,
    pub(crate) executive: PmiExecutive,
}

impl Machine {
    pub(crate) fn tick(&mut self) -> Ticked {
        let mut events = vec![];
        let result = self.executive.tick(self.engine.as_mut(), &mut events);
        (result, events)
    }
}

/// All engines of a program.
pub(crate) struct Machines {
    pub(crate) all: Vec<Machine>,
    /// The regions in which each engine may keep what it likes; they are not compared.
    scratch: Option<Region>,
}

/// A row of a stimulus whose name was looked up.
#[derive(Clone, Copy)]
pub(crate) struct Change {
    pub(crate) tick: u32,
    variable: VariableKey,
    value: Setting,
}

/// Checks a source that has no errors.
pub(crate) fn checked(source: &str, options: &Options) -> Result<pmi::Program, String> {
    let mut sources = SourceMap::new();
    let file = sources.add("main.pmi", source.as_bytes());
    let (program, all) = pmi::check(&mut sources, file, &MemoryLoader::new(), options);
    let first = all.iter().find(|d| d.is_error());
    program.ok_or_else(|| {
        first.map_or_else(String::new, |d| plcc_diag::render::draw(&sources, d, false))
    })
}

fn native(module: &Module, options: CodegenOptions, program: &Program) -> Box<dyn Engine> {
    let target = Target::host().expect("this machine is a target");
    let code = compile(module, &target, options).expect("native code");
    Box::new(NativeEngine::new(&code, program).expect("an engine"))
}

/// Native code that was written as an artifact and read back, for every processor of this
/// architecture.
fn ahead(module: &Module, options: CodegenOptions, program: &Program) -> Box<dyn Engine> {
    let target = Target::host_baseline().expect("this architecture is a target");
    let code = compile(module, &target, options).expect("native code");
    let bytes = plcc_load::encode(program, &code).expect("an artifact");
    let read = Artifact::parse(&bytes, None).expect("it is read back");
    assert_eq!(read.program, *program, "the tables come back");
    Box::new(NativeEngine::new(&read.code, &read.program).expect("an engine"))
}

impl Machines {
    /// Makes the engines, the statement interpreter first.
    pub(crate) fn new(program: &pmi::Program, interpreter: Box<dyn Engine>) -> Self {
        let lowered = program.lower().expect("it is lowered");
        let (module, program) = (lowered.module, lowered.program);
        assert_eq!(plcc_ir::verify::verify(&module), []);
        let mut best = module.clone();
        let speed = Optimization::from(OptLevel::Speed).run(&mut best).0;
        let none = CodegenOptions::NONE;
        let engines: Vec<(&'static str, Box<dyn Engine>)> = vec![
            ("interp", interpreter),
            ("jit none", native(&module, none, &program)),
            ("jit speed", native(&best, speed, &program)),
            ("aot none", ahead(&module, none, &program)),
            ("aot speed", ahead(&best, speed, &program)),
            ("ir", Box::new(plcc_ir::Interpreter::new(module))),
        ];
        let machine = |(name, engine)| {
            let executive = PmiExecutive::new(&program, PmiOptions::default());
            Machine { name, engine, executive: executive.expect("tables that fit") }
        };
        let scratch = program.region("scratch").cloned();
        Self { all: engines.into_iter().map(machine).collect(), scratch }
    }

    /// Looks up the rows of a stimulus, `tick,name,value` after a heading.
    pub(crate) fn stimulus(&mut self, text: &str) -> Result<Vec<Change>, String> {
        let rows = text.lines().skip(1);
        rows.map(|row| {
            let fields: Vec<&str> = row.split(',').collect();
            let [tick, name, value] = fields.as_slice() else { return Err(row.to_owned()) };
            let tick = tick.parse().map_err(|_| row.to_owned())?;
            let mut found = None;
            for machine in &mut self.all {
                let variable = machine.executive.names().find(name, Purpose::Stimulus);
                let variable = variable.map_err(|e| e.to_string())?;
                let value =
                    machine.executive.names().parse(variable, value).map_err(|e| e.to_string())?;
                found = Some(Change { tick, variable, value });
            }
            found.ok_or_else(|| row.to_owned())
        })
        .collect()
    }

    /// Applies changes and runs a tick in every engine. The error says how the engines differ.
    pub(crate) fn tick(&mut self, changes: &[Change]) -> Result<Ticked, String> {
        let mut results = vec![];
        for machine in &mut self.all {
            for change in changes {
                machine.executive.write(change.variable, change.value);
            }
            results.push(machine.tick());
        }
        let Some((first, others)) = self.all.split_first() else { return Err(String::new()) };
        for (machine, result) in others.iter().zip(results.iter().skip(1)) {
            let (name, first_result) = (machine.name, &results[0]);
            if result != first_result {
                return Err(format!("{name} gives {result:?}, interp {first_result:?}"));
            }
            let ours = first.executive.image();
            let theirs = machine.executive.image();
            let scratch = self.scratch.as_ref().map_or(0..0, |s| s.offset..s.offset + s.size);
            let differs = |at: &usize| ours[*at] != theirs[*at] && !scratch.contains(&(*at as u32));
            if ours.len() != theirs.len()
                || ours != theirs && (0..ours.len()).any(|at| differs(&at))
            {
                return Err(format!("{name}: {}", self.difference(machine.name)));
            }
        }
        Ok(results.swap_remove(0))
    }

    /// The variables whose values in this engine are not those of the first one.
    fn difference(&self, name: &str) -> String {
        let other = self.all.iter().find(|machine| machine.name == name);
        let Some((first, other)) = self.all.first().zip(other) else { return String::new() };
        let (ours, theirs) = (&first.executive, &other.executive);
        let declared = ours.names().declared().into_iter().zip(theirs.names().declared());
        let pairs = declared.map(|((name, a), (_, b))| (name, ours.read(a), theirs.read(b)));
        let text: Vec<String> = pairs
            .filter(|(_, a, b)| a != b)
            .map(|(name, a, b)| format!("{name} is {b}, in interp {a}"))
            .collect();
        match text.is_empty() {
            true => "a byte outside the variables differs".to_owned(),
            false => text.join(", "),
        }
    }
}

/// How a run ended: ticks, events, and the stop's code.
#[derive(Debug, PartialEq)]
pub(crate) struct Ended {
    pub(crate) ticks: u32,
    pub(crate) events: Vec<Event>,
    pub(crate) stop: Option<Stop>,
}

/// Runs a program under a stimulus in all engines.
///
/// # Errors
/// How they differ; a program or stimulus that is not valid, too.
pub(crate) fn run(
    source: &str,
    stimulus: &str,
    ticks: u32,
    options: &Options,
) -> Result<Ended, String> {
    let program = checked(source, options)?;
    let mut machines = Machines::new(&program, program.interpreter());
    let changes = machines.stimulus(stimulus)?;
    let mut ended = Ended { ticks: 0, events: vec![], stop: None };
    for tick in 0..ticks {
        let now: Vec<Change> = changes.iter().filter(|c| c.tick == tick).copied().collect();
        let (result, mut events) = machines.tick(&now).map_err(|e| format!("tick {tick}: {e}"))?;
        ended.ticks += 1;
        ended.events.append(&mut events);
        if let Err(stop) = result {
            ended.stop = Some(stop);
            break;
        }
    }
    Ok(ended)
}
