//! `plcc export`: writes a program in IEC 61131-3.

use std::fs;
use std::path::PathBuf;

use plcc_frontend::language;
use plcc_iec::{plcopen, structured_text};

use crate::args::{ExportArgs, ExportFormat};
use crate::failure::{DONE, ERRORS, Failure};
use crate::input::{Input, SourceSettings, is_standard_input};
use crate::output;
use crate::report::{Destination, Report};

pub(crate) fn export(args: &ExportArgs, report: &Report) -> Result<u8, Failure> {
    let settings = SourceSettings::for_files(&args.source, &args.files, report)?;
    let program = Input::read(&args.files, &args.source)?.check(&settings)?;
    let to = Destination::from(args.source.message_format);
    let dialect = program.dialect;
    let Some((checked, sources)) = program.without_errors(to, report)? else { return Ok(ERRORS) };
    let source = args.files.first().filter(|file| !is_standard_input(file));
    let stem = source.and_then(|file| file.file_stem()).map(|stem| stem.to_string_lossy());
    let stem = stem.unwrap_or("program".into());
    let Some(exported) = checked.program().export(&stem, checked.names()) else {
        let title = language(dialect).title();
        return Err(Failure::usage(format!("programs of {title} can't be exported")));
    };
    let exported = match exported {
        Ok(exported) => exported,
        Err(mut found) => {
            // A name of a #define may stand for several statements at one place.
            found.dedup_by(|one, before| (one.code, one.span) == (before.code, before.span));
            let count = report.show(&sources, &found, to)?;
            report.message(&format!("{count}: nothing is written"));
            return Ok(ERRORS);
        }
    };
    report.show(&sources, &exported.notes, to)?;
    let folder = args.out.clone().unwrap_or_else(|| PathBuf::from("."));
    fs::create_dir_all(&folder).map_err(|error| Failure::file(&folder, error))?;
    let (extension, bytes) = match args.to {
        ExportFormat::St => ("st", structured_text(&exported.project).into_bytes()),
        ExportFormat::Plcopen => {
            let bytes = plcopen(&exported.project, env!("CARGO_PKG_VERSION"));
            ("xml", bytes.map_err(Failure::internal)?)
        }
    };
    let path = folder.join(format!("{stem}.{extension}"));
    output::write(&path, &bytes, &sources, &args.files)?;
    Ok(DONE)
}
