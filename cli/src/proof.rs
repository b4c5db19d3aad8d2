//! Programs about which `plcc prove` and `plcc diff --prove` find something out for all inputs.

use std::fs;
use std::path::{Path, PathBuf};

use plcc_abi::{Engine, Program, Tables};
use plcc_control::ControlArgs;
use plcc_diag::SourceMap;
use plcc_frontend::common::{Lowered, Machine};
use plcc_prove::control::{Settings, Source};
use plcc_prove::{Station, Subject};
use plcc_runtime::Executive;

use crate::compile::Checked;
use crate::failure::Failure;
use crate::output;

/// A program about which questions are asked.
pub(crate) struct Bench {
    pub(crate) checked: Checked,
    pub(crate) lowered: Lowered,
    image: Vec<u8>,
    settings: Settings,
    control: ControlArgs,
    machine: Option<Machine>,
    pub(crate) names: std::sync::Arc<dyn plcc_runtime::Names>,
}

impl Bench {
    /// A program with the settings of its control, and what its machine file says, if it has one.
    ///
    /// # Errors
    /// When the options are not for it.
    pub(crate) fn new(
        checked: Checked,
        control: &ControlArgs,
        machine: Option<&Machine>,
        as_declared: bool,
    ) -> Result<Self, Failure> {
        let lowered = checked.lower()?;
        let machine = machine.cloned();
        let made = executive(&lowered.program, control, machine.as_ref());
        let made = made.map_err(Failure::usage)?;
        let settings = settings(&lowered.program, control, machine.as_ref(), as_declared);
        let (image, names) = (made.image().to_vec(), made.names());
        let control = control.clone();
        Ok(Self { checked, lowered, image, settings, control, machine, names })
    }

    /// The program as it is made into logic.
    pub(crate) fn source(&self) -> Source<'_> {
        Source {
            program: &self.lowered.program,
            module: &self.lowered.module,
            returns: self.lowered.return_stack,
            image: &self.image,
            settings: self.settings,
        }
    }

    /// The program as questions are asked about it.
    pub(crate) fn subject(&self) -> Subject<'_> {
        let source = self.source();
        let checked = self.checked.program();
        Subject { checked, source, names: &*self.names, station: self }
    }
}

fn executive(
    program: &Program,
    control: &ControlArgs,
    machine: Option<&Machine>,
) -> Result<Box<dyn Executive + Send>, String> {
    plcc_control::executive(program, control, false, machine).map_err(|error| error.to_string())
}

impl Station for Bench {
    #[allow(clippy::expect_used, reason = "the same was made when the bench was")]
    fn executive(&self) -> Box<dyn Executive> {
        executive(&self.lowered.program, &self.control, self.machine.as_ref())
            .expect("a control was made before")
    }

    fn engine(&self) -> Box<dyn Engine> {
        self.checked.interpreter()
    }
}

/// The settings of a control that decide what it does in a tick.
fn settings(
    program: &Program,
    control: &ControlArgs,
    machine: Option<&Machine>,
    as_declared: bool,
) -> Settings {
    let period = control.pmi.period.map_or(20_000_000, |period| period.as_nanos() as u64);
    let nct = match (&program.tables, machine) {
        (_, Some(machine)) => machine.nct.clone(),
        (Tables::Nct(tables), None) => tables.settings.clone(),
        _ => Default::default(),
    };
    Settings {
        period_ns: period,
        level2_ms: control.nct.control.unwrap_or(nct.control).period_ms(),
        boards: nct.boards.unwrap_or(4).min(4),
        level0_safepoints: control.nct.level0_safepoints.unwrap_or(10_000).max(1),
        background_steps: control.pmac.background_steps.unwrap_or(1),
        as_declared,
    }
}

/// Writes a stimulus to a file of its own, `STEM-NAME.csv`, in a folder or else in the current one. The stem is that of the first
/// of the files that were read, none of which is overwritten.
///
/// # Errors
/// When it can't be written.
pub(crate) fn stimulus_file(
    read: &[PathBuf],
    folder: Option<&Path>,
    name: &str,
    stimulus: &str,
) -> Result<PathBuf, Failure> {
    let stem = read.first().and_then(|path| path.file_stem());
    let stem = stem.map_or("program".into(), |stem| stem.to_string_lossy());
    if let Some(folder) = folder {
        fs::create_dir_all(folder).map_err(|error| Failure::file(folder, error))?;
    }
    let path = folder.unwrap_or(Path::new("")).join(format!("{stem}-{name}.csv"));
    output::write(&path, stimulus.as_bytes(), &SourceMap::new(), read)?;
    Ok(path)
}
