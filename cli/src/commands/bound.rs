//! `plcc check --bound`: prints for each task how many operations one scan can execute at most, and the
//! lines on the way, an object of JSON a line. [`crate::bound`] finds both.

use plcc_ir::passes::{OptLevel, optimize};
use plcc_ir::{Module, StatementId};
use serde_json::{Value, json};

use crate::args::CheckArgs;
use crate::bound::bounds;
use crate::failure::{DONE, ERRORS, Failure};
use crate::input::{Input, SourceSettings};
use crate::output;
use crate::report::{Destination, Report};

pub(crate) fn bound(args: &CheckArgs, report: &Report) -> Result<u8, Failure> {
    let settings = SourceSettings::for_files(&args.source, &args.paths, report)?;
    let program = Input::read(&args.paths, &args.source)?.check(&settings)?;
    // The bounds take standard output, so that diagnostics go to standard error.
    let to = Destination { format: args.source.message_format, stdout_taken: true };
    let count = report.show(&program.sources, &program.diagnostics, to)?;
    let Some(checked) = program.checked.filter(|_| count.errors == 0) else {
        return Ok(ERRORS);
    };
    let mut lowered = match checked.lower() {
        Ok(lowered) => lowered,
        Err(error) => return report.not_compiled(error, &program.sources, to),
    };
    optimize(&mut lowered.module, OptLevel::Speed);
    let module = &lowered.module;
    let mut text = String::new();
    for (task, bound) in module.tasks.iter().zip(bounds(module, lowered.return_stack)) {
        let path = lines(module, &bound.path);
        let line = json!({"entry": task.name, "operations": bound.operations, "path": path});
        text.push_str(&format!("{line}\n"));
    }
    output::print(text.as_bytes())?;
    Ok(DONE)
}

/// The lines at which statements begin; each only once where several of the same line follow one
/// another.
fn lines(module: &Module, path: &[StatementId]) -> Vec<Value> {
    let statements = path.iter().filter_map(|loc| module.statements.get(loc.index()));
    let mut lines: Vec<(u32, u32)> = statements.map(|s| (s.file, s.line)).collect();
    lines.dedup();
    let named = lines.into_iter().filter_map(|(file, line)| {
        let name = &module.files.get(file as usize)?.name;
        Some(json!({"file": name, "line": line}))
    });
    named.collect()
}
