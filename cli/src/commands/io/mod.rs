//! `plcc io`: what is wired to a program, in the order of the drawings: a template of the entries `[[io]]`, or a list of the
//! terminals.

mod gather;
mod list;
mod template;

use std::collections::HashMap;
use std::path::Path;

use plcc_host::configuration::{Point, wired_points};
use plcc_runtime::names_of;

use crate::args::{IoArgs, IoFormat};
use crate::failure::{DONE, ERRORS, Failure};
use crate::input::{Input, SourceSettings};
use crate::output;
use crate::report::{Destination, Report};

pub(crate) fn io(args: &IoArgs, report: &Report) -> Result<u8, Failure> {
    let settings = SourceSettings::for_files(&args.source, &args.files, report)?;
    let program = Input::read(&args.files, &args.source)?.check(&settings)?;
    let to = Destination { format: args.source.message_format, stdout_taken: true };
    let errors = program.diagnostics.iter().filter(|diagnostic| diagnostic.is_error()).count();
    let Some(checked) = program.checked.as_ref().filter(|_| errors == 0) else {
        let count = report.show(&program.sources, &program.diagnostics, to)?;
        report.message(&format!("{count}: nothing is listed"));
        return Ok(ERRORS);
    };
    let lowered = match checked.lower() {
        Ok(lowered) => lowered.program,
        Err(error) => return Err(Failure::usage(error.to_string())),
    };
    // The program was compiled with the settings of its machine.
    let names = names_of(&lowered);
    let gathered = gather::gather(checked.program(), &*names);
    for (name, at) in &gathered.assigned_inputs {
        report.warn(&format!(
            "{name} is an input, and {at} assigns it: it stays an input, and its wire gives its value"
        ));
    }
    let points = match &args.config {
        None => HashMap::new(),
        Some(path) => wired_points(path, &lowered, &*names)
            .map_err(|why| Failure::file(path.as_path(), why))?,
    };
    let title = args.files.first().map_or(Path::new(""), |path| path.as_path());
    let title = title.file_name().unwrap_or_default().to_string_lossy();
    let text = match args.to {
        IoFormat::Toml => template::template(&gathered),
        IoFormat::Csv => list::csv(&list::rows(&gathered, &points)),
        IoFormat::Html => list::html(&title, &list::rows(&gathered, &points)),
    };
    output::print(text.as_bytes())?;
    Ok(DONE)
}

/// The point of a line: its own, or that of its variable.
fn point<'p>(points: &'p HashMap<String, Point>, line: &str, variable: &str) -> Option<&'p Point> {
    points.get(line).or_else(|| points.get(variable))
}
