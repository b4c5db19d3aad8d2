//! The other side of a control for the desk (`--simulate`): reads the part program, and puts the simulator beside an
//! executive.
//!
//! A run has a [`Simulation`], which is all that its simulator is made from, as texts. A record holds it, so that a replay needs
//! no file.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use plcc_abi::machine::Machine;
use plcc_abi::machine::simulator::SimulatorTable;
use plcc_abi::{Program, Tables};
use plcc_diag::{Diagnostic, SourceMap};
use plcc_files::{read_regular, why_not_read};
use plcc_runtime::{Executive, SimulatedExecutive};
use plcc_simulator::{MAX_PART_PROGRAM, Rules, Setup, Strictness, read_part_program};
use serde::{Deserialize, Serialize};

use plcc_control::ControlArgs;

/// The most mistakes of a part program that are printed; the others are counted.
const MAX_ERRORS: usize = 20;

/// What the simulator of a run is made from.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Simulation {
    /// The name and the text of the machine file, where there is one.
    machine: Option<(String, String)>,
    /// The name of the part program and what its file holds, where there is one.
    part_program: Option<(String, Vec<u8>)>,
}

/// A program's executive with the simulator beside it, and what is to be told about it.
pub struct Simulated {
    /// The executive.
    pub executive: SimulatedExecutive,
    /// Warnings about the part program.
    pub warnings: Vec<String>,
    /// Notes about what is switched off.
    pub notes: Vec<String>,
}

impl Simulation {
    /// Reads the part program: the one that is named, or else the one of the machine file, which lies beside that.
    /// `machine` is the machine file of the run, with its path.
    ///
    /// # Errors
    /// When the part program can't be read.
    pub fn read(
        machine: Option<(&Path, &Machine)>,
        part_program: Option<&Path>,
    ) -> Result<Self, String> {
        let table = machine.and_then(|(path, machine)| Some((path, machine.simulator.as_ref()?)));
        let path = match (part_program, table) {
            (Some(path), _) => Some(path.to_owned()),
            (None, Some((machine, table))) => part_program_beside(machine, table),
            (None, None) => None,
        };
        let part_program = path.map(|path| {
            let bytes = read_regular(&path, MAX_PART_PROGRAM);
            let bytes = bytes.map_err(|error| {
                format!(
                    "{}: the part program can't be read: {}",
                    path.display(),
                    why_not_read(&error)
                )
            })?;
            Ok::<_, String>((path.display().to_string(), bytes))
        });
        let machine = table.map(|(path, table)| (path.display().to_string(), table.text.clone()));
        Ok(Self { machine, part_program: part_program.transpose()? })
    }

    /// The table of a machine file without a part program, to be checked alone.
    pub fn table_alone(path: Option<&Path>, machine: &Machine) -> Self {
        let name =
            path.map_or_else(|| "the machine file".into(), |path| path.display().to_string());
        let text = machine.simulator.as_ref().map(|table| (name, table.text.clone()));
        Self { machine: text, part_program: None }
    }

    /// The machine file as it was named, where there is one with a table.
    pub fn machine_file(&self) -> Option<&Path> {
        self.machine.as_ref().map(|(name, _)| Path::new(name))
    }

    /// The part program as it was named, where it is another one than that of the table.
    pub fn own_part_program(&self) -> Option<&Path> {
        let (name, _) = self.part_program.as_ref()?;
        let of_table = self.table().ok().zip(self.machine_file());
        let of_table = of_table.and_then(|(table, path)| part_program_beside(path, &table));
        Some(Path::new(name)).filter(|path| of_table.as_deref() != Some(*path))
    }

    /// The table: what the machine file says, or nothing.
    fn table(&self) -> Result<SimulatorTable, Vec<String>> {
        let Some((name, text)) = &self.machine else { return Ok(SimulatorTable::default()) };
        let machine = Machine::parse(text).map_err(|error| vec![format!("{name}: {error}")])?;
        Ok(machine.simulator.unwrap_or_default())
    }

    /// A sentence about the table, with the name of its file.
    fn named(&self, why: &str) -> String {
        let file = self.machine.as_ref().map_or("[simulator]", |(name, _)| name.as_str());
        format!("{file}: {why}")
    }

    /// Reads the part program, if there is one, for the control of a program: gives its text and all that is to be said of
    /// it.
    ///
    /// # Errors
    /// What is wrong with the table.
    pub fn diagnostics(
        &self,
        program: &Program,
    ) -> Result<Option<(SourceMap, Vec<Diagnostic>)>, Vec<String>> {
        let rules = Rules::new(&self.table()?, program);
        Ok(self.part_program.as_ref().map(|(name, bytes)| {
            let mut sources = SourceMap::new();
            let file = sources.add(name, bytes);
            let (_, diagnostics) = read_part_program(&rules, &sources, file);
            (sources, diagnostics)
        }))
    }

    /// Checks the table against a program: whether all names are there, and nothing has two writers.
    ///
    /// # Errors
    /// All that is wrong, with the lines.
    pub fn check_table(
        &self,
        program: &Program,
        control: &ControlArgs,
        machine: Option<&Machine>,
    ) -> Result<(), Vec<String>> {
        let made = plcc_control::executive(program, control, false, machine);
        let executive = made.map_err(|error| vec![error.to_string()])?;
        let table = Self { part_program: None, ..self.clone() };
        table.beside(executive, program, control, machine, Strictness::Refuse).map(drop)
    }

    /// Puts the simulator beside an executive of a program at power-up. `control` and `machine` are the options and the
    /// machine file with which that was made.
    ///
    /// # Errors
    /// All that is wrong with the table, or the first mistakes of the part program and the number of the others.
    pub fn beside(
        &self,
        executive: Box<dyn Executive + Send>,
        program: &Program,
        control: &ControlArgs,
        machine: Option<&Machine>,
        strictness: Strictness,
    ) -> Result<Simulated, Vec<String>> {
        let table = self.table()?;
        let parameters = parameters(program, control, machine);
        let named = |why: String| self.named(&why);
        let setup = Setup::new(&table, program, &parameters, executive.tick_ns());
        let mut setup = setup.map_err(|why| vec![named(why)])?;
        let mut warnings = vec![];
        if let Some((name, bytes)) = &self.part_program {
            let mut sources = SourceMap::new();
            let file = sources.add(name, bytes);
            let diagnostics = setup.read_part_program(&sources, file);
            let lines = |wanted: fn(&&Diagnostic) -> bool| {
                let chosen = diagnostics.iter().filter(wanted);
                chosen.map(|found| shown(&sources, found)).collect::<Vec<_>>()
            };
            let mut errors = lines(|found| found.is_error());
            if !errors.is_empty() {
                let more = errors.len().saturating_sub(MAX_ERRORS);
                errors.truncate(MAX_ERRORS);
                if more > 0 {
                    errors.push(format!("{name}: and {more} more"));
                }
                return Err(errors);
            }
            warnings = lines(|found| !found.is_error());
        }
        let made = SimulatedExecutive::new(executive, &Arc::new(setup), strictness);
        let (executive, notes) =
            made.map_err(|errors| errors.into_iter().map(named).collect::<Vec<_>>())?;
        Ok(Simulated { executive, warnings, notes })
    }
}

/// The part program of a table, which lies beside the machine file.
pub fn part_program_beside(machine: &Path, table: &SimulatorTable) -> Option<PathBuf> {
    let name = Setup::named_part_program(table)?;
    Some(machine.parent().unwrap_or(Path::new("")).join(name))
}

/// A mistake in a line, with its place.
fn shown(sources: &SourceMap, found: &Diagnostic) -> String {
    let (line, column) = sources.line_col(found.span.file, found.span.start);
    let help = found.help.as_ref().map_or_else(String::new, |help| format!("; {help}"));
    let path = sources.path(found.span.file);
    format!("{path}:{line}:{column}: {}: {}{help}", found.code, found.message)
}

/// The NC parameters of an NCT control: those with which its program was compiled, or of a machine file of the run, and
/// those of the command line.
fn parameters(
    program: &Program,
    control: &ControlArgs,
    machine: Option<&Machine>,
) -> Vec<(u16, i64)> {
    let Tables::Nct(tables) = &program.tables else { return vec![] };
    let settings = machine.map_or(&tables.settings, |machine| &machine.nct);
    settings.parameters.iter().chain(&control.nct.param).copied().collect()
}
