//! `plcrt check-config`: the mistakes of a configuration, also those that only the program's control or
//! `plcio` knows.

use std::io::{self, Write};
use std::path::Path;

use plcc_abi::{Program, printable};
use plcc_configuration::{Checked, Configuration, Entry, Mistake, Mistakes, Warning};
use plcc_control::ControlArgs;
use plcc_host::args::RunArgs;
use plcc_host::configuration;
use plcc_host::session::{self, PathConflict};
use plcc_load::Artifact;
use plcc_load::signature::PublicKey;

/// That a configuration has mistakes, if it has some.
pub(crate) fn refuse(path: &Path, mut mistakes: Vec<Mistake>) -> Result<(), String> {
    mistakes.sort();
    if mistakes.is_empty() { Ok(()) } else { Err(Mistakes(path, &mistakes).to_string()) }
}

/// Finds the mistakes of a configuration, also those that only the program's control or `plcio` knows.
///
/// # Errors
/// All of them.
pub(crate) fn check_config(path: &Path) -> Result<u8, String> {
    let (configuration, findings) = Configuration::open(path)?;
    let mut mistakes = match configuration.is_wired() {
        true => findings.all(),
        false => findings.for_control(),
    };
    let reads = configuration.artifact.iter().cloned().chain([path.to_owned()]).collect();
    let mut run = RunArgs { realtime: true, reads, ..RunArgs::default() };
    mistakes.extend(configuration::apply(&configuration, &mut run));
    let mut warnings: Vec<Warning> = vec![];
    for (option, folder) in session::missing_folders(&run) {
        let key = option.trim_start_matches('-');
        let what = "does not exist: the control could not write there";
        let message = format!("`{key}`: the folder {} {what}", folder.display());
        warnings.push(Warning { line: Some(configuration.line_of(key)), message });
    }
    if let Some(artifact) = &configuration.artifact {
        match run.public_key().and_then(|key| open(artifact, key.as_ref())) {
            Err(message) => {
                mistakes.push(Mistake { line: configuration.line_of("artifact"), message });
            }
            Ok(Artifact { program, .. }) => {
                check_program(&configuration, &program, &run, &mut mistakes, &mut warnings)?;
            }
        }
    }
    // An output that is not wired may be that of an entry with a mistake.
    refuse(path, mistakes)?;
    warnings.extend(configuration.warnings());
    for warning in &warnings {
        let _ = writeln!(io::stderr(), "warning: {}", printable(&warning.of(path)));
    }
    Ok(session::DONE)
}

/// Finds what does not fit the program of a configuration, which says `run` of a run.
///
/// # Errors
/// When the program's control can't be made.
fn check_program(
    configuration: &Configuration,
    program: &Program,
    run: &RunArgs,
    mistakes: &mut Vec<Mistake>,
    warnings: &mut Vec<Warning>,
) -> Result<(), String> {
    for PathConflict { option, message } in session::path_conflicts(program, run) {
        let line = configuration.line_of(option.trim_start_matches('-'));
        mistakes.push(Mistake { line, message });
    }
    let executive = |control: &ControlArgs| plcc_control::executive(program, control, true, None);
    // The only key that is an option of a control.
    let mut control = run.control.clone();
    if let Err(error) = executive(&control) {
        let line = configuration.line_of("period");
        mistakes.push(Mistake { line, message: error.to_string() });
        control = ControlArgs::default();
    }
    let own = executive(&control).map_err(|error| error.to_string())?;
    let names = own.names();
    for entry in &configuration.safe {
        let refused = names.safe_lines(&[configuration::safe_output(entry)]);
        let messages = refused.err().into_iter().flatten().map(|error| error.to_string());
        mistakes.extend(messages.map(|message| Mistake { line: entry.line, message }));
    }
    let checked = check_wiring(&configuration.entries, program, &control)?;
    warnings.extend(checked.warnings);
    mistakes.extend(checked.mistakes);
    Ok(())
}

/// Compares entries `[[io]]` with a program.
///
/// # Errors
/// When the program's control can't be made.
pub(crate) fn check_wiring(
    entries: &[Entry],
    program: &Program,
    control: &ControlArgs,
) -> Result<Checked, String> {
    if entries.is_empty() {
        return Ok(Checked::default());
    }
    let executive = plcc_control::executive(program, control, true, None);
    let executive = executive.map_err(|error| error.to_string())?;
    Ok(configuration::check_wiring(entries, program, &*executive.names()))
}

/// Reads an artifact; with a key it must be signed.
fn open(path: &Path, key: Option<&PublicKey>) -> Result<Artifact, String> {
    Artifact::open(path, key).map_err(|error| error.with_path(path))
}
