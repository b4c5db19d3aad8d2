//! `plcc xref`: lists where a program reads, writes and tests each variable.

use serde_json::json;

use plcc_runtime::GivenNames;

use crate::args::{FormatArg, XrefArgs};
use crate::failure::{DONE, ERRORS, Failure};
use crate::input::{Input, SourceSettings};
use crate::output;
use crate::report::{Destination, Report};

pub(crate) fn xref(args: &XrefArgs, report: &Report) -> Result<u8, Failure> {
    let settings = SourceSettings::for_files(&args.source, &args.files, report)?;
    let program = Input::read(&args.files, &args.source)?.check(&settings)?;
    // The table has standard output; as JSON everything is a line of it.
    let to = Destination::from(args.source.message_format);
    let count = report.show(&program.sources, &program.diagnostics, to)?;
    let Some(checked) = program.checked.filter(|_| count.errors == 0) else {
        report.message(&format!("{count}: nothing is listed"));
        return Ok(ERRORS);
    };
    let given = GivenNames::of_canonical(checked.names());
    let mut xref = checked.cross_reference();
    match args.source.message_format {
        FormatArg::Human => {
            for row in &mut xref.rows {
                let said = given.said_of(&row.name).map(|said| said.line());
                let parts = [said.filter(|line| !line.is_empty()), row.meaning.take()];
                let parts: Vec<String> = parts.into_iter().flatten().collect();
                row.meaning = Some(parts.join("; ")).filter(|text| !text.is_empty());
            }
            output::print(xref.to_string().as_bytes())?;
        }
        FormatArg::Json => {
            for row in &xref.rows {
                let mut line = json!({
                    "name": row.name, "file": row.file, "meaning": row.meaning,
                    "read": row.read, "written": row.written, "tested": row.tested,
                });
                if let (Some(said), Some(line)) = (given.said_of(&row.name), line.as_object_mut()) {
                    line.extend(said.parts().map(|(key, value)| (key.to_owned(), value.into())));
                }
                output::print(format!("{line}\n").as_bytes())?;
            }
        }
    }
    report.show(&program.sources, &xref.warnings, to)?;
    Ok(DONE)
}
