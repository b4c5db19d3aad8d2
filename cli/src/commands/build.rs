//! `plcc build`: compiles a program ahead of time and writes an artifact, an object or a listing.

use std::ffi::OsStr;
use std::io::IsTerminal;
use std::path::PathBuf;

use plcc_abi::Program;
use plcc_codegen::emit::ObjectOptions;
use plcc_codegen::{Target, emit};
use plcc_frontend::language;
use plcc_load::Attached;

use crate::args::{BuildArgs, Emit, PassArgs};
use crate::commands::validation;
use crate::compile::{self, CompileError, Optimized};
use crate::failure::{DONE, ERRORS, Failure};
use crate::input::{Input, SourceSettings, is_standard_input, machine_text};
use crate::object_args::ObjectArgs;
use crate::output;
use crate::recorded::recorded_sources;
use crate::report::{Destination, Report};
use crate::signing;

/// Compiles a program and writes what was asked for. `passes` are those of `plcc dev build`.
pub(crate) fn build(args: &BuildArgs, passes: &PassArgs, report: &Report) -> Result<u8, Failure> {
    let settings = SourceSettings::for_files(&args.source, &args.files, report)?;
    let how = passes.at(args.opt);
    let target = match &args.target {
        Some(triple) => Target::baseline(triple),
        None => Target::host_baseline(),
    };
    let target = target.map_err(|error| Failure::usage(format!("--target: {error}")))?;
    let source = args.files.first().filter(|file| !is_standard_input(file));
    let stem = source.and_then(|file| file.file_stem()).unwrap_or(OsStr::new("program"));
    let mut stem = stem.to_owned();
    if args.target.is_some() {
        stem.push("-");
        stem.push(target.architecture());
    }
    let object = object_options(args)?;
    let path = match (&args.output, args.emit) {
        (Some(path), _) => path.clone(),
        (None, Emit::Artifact) => named(&stem, "plcx"),
        (None, Emit::Obj) => named(&stem, "o"),
        (None, Emit::Ir | Emit::Clif | Emit::Asm) => PathBuf::from("-"),
    };
    let stdout_taken = output::is_stdout(&path);
    let is_text = matches!(args.emit, Emit::Ir | Emit::Clif | Emit::Asm);
    if stdout_taken && !is_text && std::io::stdout().is_terminal() {
        let what = "machine code is not written to a terminal; name a file with -o";
        return Err(Failure::usage(what));
    }
    if args.sign.is_some() && !matches!(args.emit, Emit::Artifact) {
        return Err(Failure::usage("--sign is for artifacts"));
    }
    let program = Input::read(&args.files, &args.source)?.check(&settings)?;
    let to = Destination { format: args.source.message_format, stdout_taken };
    let count = report.show(&program.sources, &program.diagnostics, to)?;
    let other_language = program.other_language();
    let Some(checked) = program.checked.filter(|_| count.errors == 0) else {
        other_language.iter().for_each(|note| report.note(note));
        report.message(&format!("{count}: nothing is built"));
        return Ok(ERRORS);
    };
    let sources = match args.emit {
        Emit::Artifact if !args.object.no_source => {
            let machine = settings.machine.as_deref().map(machine_text).transpose()?;
            let (files, options) = (program.named_files, &settings.options);
            recorded_sources(program.dialect, &program.sources, files, options, machine).to_bytes()
        }
        _ => vec![],
    };
    let debug = !args.object.no_debug;
    let panel = checked.operator_panel();
    let attached = Attached { sources: &sources, operator: Some(&panel), ..Attached::default() };
    let made = checked
        .compiled(how, |optimized| make(optimized, &target, args.emit, &object, debug, attached));
    let (optimized, mut bytes) = match made {
        Ok(made) => made,
        Err(error) => return report.not_compiled(error, &program.sources, to),
    };
    if args.validate {
        let before = match checked.lower() {
            Ok(lowered) => lowered.module,
            Err(error) => return report.not_compiled(error, &program.sources, to),
        };
        validation::validate(&before, &optimized, args.timeout, to)?;
    }
    if let Some(key) = &args.sign {
        bytes = signing::sign(bytes, key)?;
    }
    if is_text {
        let mut listing = listing_comments(&optimized.program);
        listing.append(&mut bytes);
        bytes = listing;
    }
    let mut read = args.files.clone();
    read.extend(settings.machine);
    read.extend(args.sign.clone());
    output::write(&path, &bytes, &program.sources, &read)?;
    Ok(DONE)
}

/// Prints how long each pass of the optimiser takes.
pub(crate) fn time_passes(
    args: &BuildArgs,
    passes: &PassArgs,
    report: &Report,
) -> Result<(), Failure> {
    let settings = SourceSettings::for_files(&args.source, &args.files, report)?;
    let program = Input::read(&args.files, &args.source)?.check(&settings)?;
    let times =
        program.checked.and_then(|checked| checked.optimized_timed(passes.at(args.opt)).ok());
    for (pass, time) in times.map_or(vec![], |(_, times)| times) {
        let ms = time.as_secs_f64() * 1e3;
        report.message(&format!("{:<16} {ms:>9.3} ms", pass.name()));
    }
    Ok(())
}

/// How an object or the debug part of an artifact is made: `--prefix` and `--debug-prefix-map`.
fn object_options(args: &BuildArgs) -> Result<ObjectOptions, Failure> {
    let refused = match args.emit {
        Emit::Obj if args.object.no_debug => Some("--no-debug is for artifacts"),
        Emit::Obj | Emit::Ir | Emit::Clif | Emit::Asm if args.object.no_source => {
            Some("--no-source is for artifacts")
        }
        Emit::Artifact if args.object.prefix.is_some() => {
            Some("--prefix is for objects: --emit obj")
        }
        Emit::Artifact | Emit::Obj => None,
        Emit::Ir | Emit::Clif | Emit::Asm => {
            let ObjectArgs { prefix, debug_prefix_map, no_debug, no_source: _ } = &args.object;
            (prefix.is_some() || !debug_prefix_map.is_empty() || *no_debug).then_some(
                "--prefix, --debug-prefix-map and --no-debug are for --emit obj or artifact",
            )
        }
    };
    if let Some(what) = refused {
        return Err(Failure::usage(what));
    }
    let default = ObjectOptions::default();
    let prefix = args.object.prefix.clone().unwrap_or(default.prefix);
    let mut chars = prefix.chars();
    let begins = chars.next().is_some_and(|c| c.is_ascii_alphabetic() || c == '_');
    if !begins || !chars.all(|c| c.is_ascii_alphanumeric() || c == '_') {
        return Err(Failure::usage(format!("--prefix: `{prefix}` is not a name of C")));
    }
    let folder = std::env::current_dir().map(|folder| folder.to_string_lossy().into_owned());
    let folder = folder.unwrap_or(default.folder);
    let mut prefix_map = vec![];
    for map in &args.object.debug_prefix_map {
        let Some((old, new)) = map.split_once('=') else {
            let what = format!("--debug-prefix-map: `{map}` is not OLD=NEW");
            return Err(Failure::usage(what));
        };
        prefix_map.push((old.to_owned(), new.to_owned()));
    }
    Ok(ObjectOptions { prefix, folder, prefix_map })
}

/// The name of an output file in the current folder.
fn named(stem: &OsStr, ending: &str) -> PathBuf {
    let mut name = stem.to_owned();
    name.push(".");
    name.push(ending);
    name.into()
}

/// The comments above a listing: what the variables that the program names mean.
fn listing_comments(program: &Program) -> Vec<u8> {
    let comments = language(program.dialect()).listing_comments(&program.tables);
    let end = if comments.is_empty() { "" } else { "\n" };
    let mut text: String = comments.iter().map(|comment| format!("; {comment}\n")).collect();
    text.push_str(end);
    text.into_bytes()
}

/// The bytes of the form that was asked for.
fn make(
    optimized: &Optimized,
    target: &Target,
    form: Emit,
    object: &ObjectOptions,
    debug: bool,
    attached: Attached<'_>,
) -> Result<Vec<u8>, CompileError> {
    Ok(match form {
        Emit::Artifact => {
            let code = compile::code(optimized, target)?;
            let debug = debug.then_some((target, object));
            compile::artifact_with(&optimized.program, &code, debug, attached)?
        }
        Emit::Obj => {
            let code = compile::code(optimized, target)?;
            emit::object(&optimized.program, &code, target, object)?
        }
        Emit::Ir => plcc_ir::text::print(&optimized.module).into_bytes(),
        Emit::Clif => emit::clif(&optimized.module, target, optimized.codegen)?.into_bytes(),
        Emit::Asm => emit::asm(&optimized.module, target, optimized.codegen)?.into_bytes(),
    })
}
