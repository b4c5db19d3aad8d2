//! `plcc run`

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use plcc_abi::nct::NctSettings;
use plcc_abi::{Engine, Program};
use plcc_runtime::{Artifact, NativeEngine, session};

use crate::args::{EngineArg, FormatArg, RunCommand};
use crate::compile::{self, Checked};
use crate::failure::{ERRORS, Failure};
use crate::input::{self, Input};
use crate::report::{Count, Report};

pub(crate) fn run(args: &RunCommand, report: &Report) -> Result<u8, Failure> {
    if let Some(path) = artifact_among(&args.files)? {
        return run_artifact(path, args);
    }
    let options = input::options(&args.source)?;
    let program = Input::read(&args.files, &args.source)?.check(&options);
    let errors = Count::of(&program.diagnostics).errors;
    let Some(checked) = program.checked.filter(|_| errors == 0 || args.keep_going) else {
        let count = report.show(&program.sources, &program.diagnostics, args.message_format)?;
        report.tell(&format!("{count}: the program is not run"));
        return Ok(ERRORS);
    };
    let shown: Vec<_> = match args.message_format {
        FormatArg::Json => program.diagnostics,
        FormatArg::Human => {
            let (errors, rest): (Vec<_>, Vec<_>) =
                program.diagnostics.into_iter().partition(|d| d.is_error());
            let warnings = Count::of(&rest).warnings;
            if warnings > 0 {
                let plural = if warnings == 1 { "" } else { "s" };
                report.warn(&format!("{warnings} warning{plural}; `plcc check` shows them"));
            }
            errors
        }
    };
    report.show(&program.sources, &shown, args.message_format)?;
    let (tables, mut engine) = engine(&checked, args)?;
    let machine = args.source.machine.as_ref().map(|_| &options.machine.nct);
    Ok(session::run(&tables, engine.as_mut(), &args.run, machine))
}

fn engine(checked: &Checked, args: &RunCommand) -> Result<(Program, Box<dyn Engine>), Failure> {
    let opt = args.opt.unwrap_or_default().into();
    let fail = |error| Failure::Usage(format!("the program can't be compiled: {error}"));
    Ok(match args.engine.unwrap_or_default() {
        EngineArg::Interp => (checked.lower().program, checked.interpreter()),
        EngineArg::Jit => {
            let lowered = checked.optimized(opt);
            let (engine, _) = compile::jit(&lowered, opt).map_err(fail)?;
            (lowered.program, Box::new(engine))
        }
        EngineArg::Aot => {
            let lowered = checked.optimized(opt);
            let (engine, _) = compile::aot(&lowered, opt).map_err(fail)?;
            (lowered.program, Box::new(engine))
        }
    })
}

/// The artifact, if that is what was given; it stands alone.
fn artifact_among(files: &[PathBuf]) -> Result<Option<&Path>, Failure> {
    for path in files {
        let named = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("plcx"));
        if !named && !begins_as_artifact(path) {
            continue;
        }
        if files.len() > 1 {
            return Err(Failure::file(path, "an artifact is run alone"));
        }
        return Ok(Some(path));
    }
    Ok(None)
}

fn begins_as_artifact(path: &Path) -> bool {
    let mut start = Vec::new();
    let read = File::open(path).and_then(|file| file.take(64).read_to_end(&mut start));
    read.is_ok() && Artifact::is_artifact(&start)
}

fn run_artifact(path: &Path, args: &RunCommand) -> Result<u8, Failure> {
    let source = &args.source;
    let machine = source.machine.as_deref().map(input::machine).transpose()?;
    let fixed = [
        ("--dialect", source.dialect.is_some()),
        ("--limits", source.limits.is_some()),
        ("--define", !source.define.is_empty()),
        ("--controller", source.controller.is_some()),
        ("-I", !source.include.is_empty()),
        ("--keep-going", args.keep_going),
        ("--opt", args.opt.is_some()),
        (
            "the variables of --machine",
            machine.as_ref().is_some_and(|machine| !machine.variables.is_empty()),
        ),
    ];
    if let Some((option, _)) = fixed.iter().find(|(_, given)| *given) {
        let what = format!("{option} was settled when this artifact was built; build it anew");
        return Err(Failure::file(path, what));
    }
    if let Some(engine @ (EngineArg::Interp | EngineArg::Jit)) = args.engine {
        let name = if engine == EngineArg::Jit { "jit" } else { "interp" };
        let what = format!("an artifact is machine code; --engine {name} needs the source");
        return Err(Failure::file(path, what));
    }
    let artifact = Artifact::open(path).map_err(|error| Failure::file(path, error))?;
    let engine = NativeEngine::new(&artifact.code, &artifact.program);
    let mut engine = engine.map_err(|error| Failure::file(path, error))?;
    let settings: Option<&NctSettings> = machine.as_ref().map(|machine| &machine.nct);
    Ok(session::run(&artifact.program, &mut engine, &args.run, settings))
}
