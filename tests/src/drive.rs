//! Runs a program with its stimulus tick by tick and says what can be seen of it after each: events,
//! variables, retained data. Tests compare this between engines, and between a run that was
//! continued from a checkpoint and one that was not.

use std::path::{Path, PathBuf};

use plcc_abi::machine::Machine as MachineFile;
use plcc_abi::{Dialect, Engine, Program};
use plcc_control::ControlArgs;
use plcc_diag::SourceMap;
use plcc_frontend::common::Options;
use plcc_host::args::RunArgs;
use plcc_host::session;
use plcc_record::ReplaceableExecutive;
use plcc_record::{RecordFile, Recorder};
use plcc_runtime::{Event, Executive, Purpose, VariableKey};

use crate::compile::{Compiled, compile, compile_sources};
use crate::gen_pmi::Case;

/// A compiled program, its stimulus and the options of its control.
pub struct Bench {
    /// The program in all engines.
    pub compiled: Compiled,
    /// The number of ticks that the stimulus is made for.
    pub ticks: u64,
    rows: Vec<(u64, String, String)>,
    args: ControlArgs,
    /// Where the other side is simulated: the machine file and the part program.
    desk: Option<(PathBuf, Option<PathBuf>)>,
}

impl Bench {
    /// Compiles a generated program with its stimulus.
    ///
    /// # Errors
    /// The source has errors, or the stimulus is not a table of three columns.
    pub fn new(case: &Case, dialect: Dialect, options: &Options) -> Result<Self, String> {
        let mut sources = SourceMap::new();
        let file = sources.add("case", case.source.as_bytes());
        let compiled = compile_sources(&mut sources, &[file], dialect, options)?;
        Self::with(compiled, &case.stimulus, case.ticks.into(), dialect)
    }

    /// Compiles a file. `stimulus` is the path of a table, if there is one.
    ///
    /// # Errors
    /// A file can't be read, the source has errors, or the stimulus is not a table.
    pub fn open(
        source: &Path,
        stimulus: Option<&Path>,
        ticks: u64,
        dialect: Dialect,
    ) -> Result<Self, String> {
        let compiled = compile(source, dialect, &Options::default())?;
        let read = |path: &Path| std::fs::read_to_string(path).map_err(|error| error.to_string());
        let stimulus = stimulus.map(read).transpose()?.unwrap_or_default();
        Self::with(compiled, &stimulus, ticks, dialect)
    }

    fn with(
        compiled: Compiled,
        stimulus: &str,
        ticks: u64,
        dialect: Dialect,
    ) -> Result<Self, String> {
        let mut rows = vec![];
        for row in stimulus.lines().skip(1).filter(|row| !row.trim().is_empty()) {
            let mut parts = row.splitn(3, ',');
            let (Some(tick), Some(name), Some(value)) = (parts.next(), parts.next(), parts.next())
            else {
                return Err(format!("no row of a stimulus: {row}"));
            };
            let tick = tick.parse().map_err(|_| format!("no tick: {row}"))?;
            rows.push((tick, name.to_owned(), value.to_owned()));
        }
        // With few safepoints in a slice, :000 is suspended again and again.
        let level0_safepoints = (dialect == Dialect::Nct).then_some(3);
        let mut args = ControlArgs::default();
        args.nct.level0_safepoints = level0_safepoints;
        Ok(Self { compiled, ticks, rows, args, desk: None })
    }

    /// The same with the other side simulated, by the table of a machine file. A part program stands in place of the table's.
    #[must_use]
    pub fn on_the_desk(self, machine: &Path, part_program: Option<&Path>) -> Self {
        Self { desk: Some((machine.to_owned(), part_program.map(Path::to_owned))), ..self }
    }

    /// The executive of a program of [`Compiled::engine`], at power-up.
    ///
    /// # Errors
    /// The program's tables do not fit together.
    pub fn executive(&self, program: &Program) -> Result<Box<dyn Executive + Send>, String> {
        let Some((path, part_program)) = self.desk.clone() else {
            let made = plcc_control::executive(program, &self.args, false, None);
            return made.map_err(|error| error.to_string());
        };
        let text = std::fs::read_to_string(&path).map_err(|error| error.to_string())?;
        let machine = MachineFile::parse(&text).map_err(|error| error.to_string())?;
        let args = RunArgs {
            control: self.args.clone(),
            simulate: true,
            machine_path: Some(path),
            part_program,
            ..RunArgs::default()
        };
        let made = session::simulated_executive(program, &args, Some(&machine));
        made.map_err(|error| error.to_string())
    }

    /// A control at power-up that is recorded.
    ///
    /// # Errors
    /// As [`machine`](Self::machine).
    pub fn recorded_machine(
        &self,
        program: &Program,
        file: RecordFile,
    ) -> Result<Machine<'_>, String> {
        let mut executive = ReplaceableExecutive::new(self.executive(program)?);
        let declared = executive.names().declared();
        executive.record(Recorder::to_file(file, &executive));
        let executive = Box::new(executive);
        Ok(Machine { bench: self, executive, declared, tick: 0, stopped: false })
    }

    /// A control at power-up, for a program of [`Compiled::engine`].
    ///
    /// # Errors
    /// The program's tables do not fit together.
    pub fn machine(&self, program: &Program) -> Result<Machine<'_>, String> {
        let executive = self.executive(program)?;
        let declared = executive.names().declared();
        Ok(Machine { bench: self, executive, declared, tick: 0, stopped: false })
    }
}

/// A control with its program and stimulus, run by [`Machine::step`].
pub struct Machine<'a> {
    bench: &'a Bench,
    /// The control itself.
    pub executive: Box<dyn Executive>,
    declared: Vec<(String, VariableKey)>,
    /// The next tick's number.
    pub tick: u64,
    stopped: bool,
}

impl Machine<'_> {
    /// Runs one tick with its stimulus. Gives a line for each event, for a stop, for each variable that
    /// the program names and for the retained data; no lines once the program was stopped.
    ///
    /// # Errors
    /// The stimulus names something that the program does not have.
    pub fn step(&mut self, engine: &mut dyn Engine) -> Result<Vec<String>, String> {
        let tick = self.tick;
        self.tick += 1;
        if self.stopped {
            return Ok(vec![]);
        }
        for (_, name, value) in self.bench.rows.iter().filter(|row| row.0 == tick) {
            let found = self.executive.names().find(name, Purpose::Stimulus);
            let variable = found.map_err(|error| error.to_string())?;
            let value =
                self.executive.names().parse(variable, value).map_err(|error| error.to_string())?;
            self.executive.write(variable, value);
        }
        let mut events: Vec<Event> = vec![];
        let result = self.executive.tick(engine, &mut events);
        let mut seen: Vec<String> = events.iter().map(|event| format!("{event:?}")).collect();
        if let Err(stop) = result {
            self.stopped = true;
            seen.push(format!("{stop:?}"));
        }
        for (name, variable) in &self.declared {
            seen.push(format!("{tick} {name} {}", self.executive.read(*variable)));
        }
        seen.push(format!("{tick} retained {:?}", self.executive.retained().map(|r| hash(&r))));
        Ok(seen)
    }

    /// Says at which tick the control is, and whether its program was stopped, after a checkpoint was
    /// restored.
    pub fn go_on(&mut self, tick: u64, stopped: bool) {
        (self.tick, self.stopped) = (tick, stopped);
    }

    /// Ends the record of a recorded control.
    ///
    /// # Errors
    /// The record could not be written.
    pub fn end_record(&mut self) -> Result<(), String> {
        let executive = self.executive.as_any_mut().downcast_mut::<ReplaceableExecutive>();
        let executive = executive.ok_or("the control is not recorded")?;
        executive.end_record(None).map_err(|error| error.to_string())
    }

    /// Whether the program was stopped.
    pub fn has_stopped(&self) -> bool {
        self.stopped
    }

    /// The image, in which two regions of PMI and NCT are zeroed: engines keep values there while a
    /// statement runs, each in its own way. All other bytes must be the same in every engine.
    pub fn state(&self, program: &Program) -> Vec<u8> {
        let mut image = self.executive.image().to_vec();
        for name in ["scratch", "waiting"] {
            let Some(region) = program.region(name) else { continue };
            let (start, end) = (region.offset as usize, (region.offset + region.size) as usize);
            if let Some(bytes) = image.get_mut(start..end) {
                bytes.fill(0);
            }
        }
        image
    }
}

/// A hash (FNV-1a) that stands for long data in a message.
fn hash(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xCBF2_9CE4_8422_2325, |hash, byte| {
        (hash ^ u64::from(*byte)).wrapping_mul(0x100_0000_01B3)
    })
}
