//! `plcc xref`: lists where a program reads, writes and tests each variable.

use serde_json::json;

use crate::args::{FormatArg, XrefArgs};
use crate::failure::{DONE, ERRORS, Failure};
use crate::input::{Input, SourceSettings};
use crate::output;
use crate::report::{Destination, Report};

pub(crate) fn xref(args: &XrefArgs, report: &Report) -> Result<u8, Failure> {
    let settings = SourceSettings::for_files(&args.source, &args.files, report)?;
    let program = Input::read(&args.files, &args.source)?.check(&settings.options);
    // The table has standard output; as JSON everything is a line of it.
    let to = Destination::from(args.source.message_format);
    let count = report.show(&program.sources, &program.diagnostics, to)?;
    let Some(checked) = program.checked.filter(|_| count.errors == 0) else {
        report.message(&format!("{count}: nothing is listed"));
        return Ok(ERRORS);
    };
    let xref = checked.cross_reference();
    match args.source.message_format {
        FormatArg::Human => output::print(xref.to_string().as_bytes())?,
        FormatArg::Json => {
            for row in &xref.rows {
                let line = json!({
                    "name": row.name, "file": row.file, "meaning": row.meaning,
                    "read": row.read, "written": row.written, "tested": row.tested,
                });
                output::print(format!("{line}\n").as_bytes())?;
            }
        }
    }
    report.show(&program.sources, &xref.warnings, to)?;
    Ok(DONE)
}
