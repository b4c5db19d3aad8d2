//! `plcc hal`: writes a program as a component for LinuxCNC's HAL.

use std::fs;
use std::path::PathBuf;

use plcc_codegen::{OptLevel, Target};
use plcc_control::ControlArgs;

use crate::args::HalArgs;
use crate::compile::{self, Checked, CompileError, Optimized};
use crate::failure::{DONE, ERRORS, Failure};
use crate::hal::pins::{Pin, Wanted, pins};
use crate::hal::{component, example};
use crate::input::{self, Input, SourceSettings};
use crate::output;
use crate::report::{Destination, Report};

pub(crate) fn hal(args: &HalArgs, report: &Report) -> Result<u8, Failure> {
    let settings = SourceSettings::for_files(&args.source, &args.files, report)?;
    let source = args.files.first().filter(|file| !input::is_standard_input(file));
    let stem = source.and_then(|file| file.file_stem()).map(|stem| stem.to_string_lossy());
    let stem = stem.map(|stem| stem.to_ascii_lowercase().replace('-', "_"));
    let name = args.name.clone().or(stem).unwrap_or_else(|| "program".to_owned());
    component::check_name(&name).map_err(Failure::usage)?;
    let program = Input::read(&args.files, &args.source)?.check(&settings)?;
    let to = Destination { format: args.source.message_format, stdout_taken: false };
    let count = report.show(&program.sources, &program.diagnostics, to)?;
    let Some(checked) = program.checked.filter(|_| count.errors == 0) else {
        report.message(&format!("{count}: nothing is written"));
        return Ok(ERRORS);
    };
    let (lowered, artifact) = match build(&checked) {
        Ok(built) => built,
        Err(error) => return report.not_compiled(error, &program.sources, to),
    };
    let executive = plcc_control::executive(
        &lowered.program,
        &ControlArgs::default(),
        false,
        settings.machine_file(),
    )
    .map_err(|error| Failure::usage(error.to_string()))?;
    let checked = checked.into_program();
    let pins = pins(checked.as_ref(), &*executive.names(), &args.pin);
    let pins = pins.map_err(Failure::usage)?;
    if pins.is_empty() {
        return Err(Failure::usage("the program has no inputs and outputs; name pins by --pin"));
    }
    let folder = args.output.clone().unwrap_or_else(|| PathBuf::from(format!("{name}-hal")));
    fs::create_dir_all(&folder).map_err(|error| Failure::file(&folder, error))?;
    let shown = source.and_then(|file| file.file_name()).map(|file| file.to_string_lossy());
    let c = component::source_text(&name, &shown.unwrap_or_default(), &pins);
    let example = example::example(&name, &pins, executive.tick_ns());
    let makefile = component::makefile(&name);
    let files: [(String, &[u8]); 5] = [
        (format!("{name}.plcx"), &artifact),
        (format!("{name}.c"), c.as_bytes()),
        ("plcrt.h".to_owned(), component::HEADER.as_bytes()),
        ("Makefile".to_owned(), makefile.as_bytes()),
        (format!("{name}.hal"), example.as_bytes()),
    ];
    for (file, bytes) in &files {
        output::write(&folder.join(file), bytes, &program.sources, &args.files)?;
    }
    report.message(&format!(
        "{} has a component with {}; `make` in that folder builds {name}.so (docs/linuxcnc.md)",
        folder.display(),
        counted(&pins)
    ));
    Ok(DONE)
}

/// How many pins there are, for people.
fn counted(pins: &[Pin]) -> String {
    let plural = if pins.len() == 1 { "" } else { "s" };
    format!("{} pin{plural}", pins.len())
}

/// The optimised program and its artifact.
fn build(checked: &Checked) -> Result<(Optimized, Vec<u8>), CompileError> {
    checked.compiled(OptLevel::Speed, |lowered| {
        let code = compile::code(lowered, &Target::host_baseline()?)?;
        compile::artifact(&lowered.program, &code)
    })
}

/// Reads the value of the option `--pin`: `NAME` or `NAME=DIRECTION`.
///
/// # Errors
/// When the direction is neither in, out nor io.
pub(crate) fn wanted_pin(text: &str) -> Result<Wanted, String> {
    let (variable, direction) = match text.rsplit_once('=') {
        None => (text, None),
        Some((variable, direction)) => {
            let direction = <_ as clap::ValueEnum>::from_str(direction, true);
            let what = "in, out or io is expected after `=`";
            (variable, Some(direction.map_err(|_| what.to_owned())?))
        }
    };
    Ok(Wanted { variable: variable.to_ascii_uppercase(), direction })
}
