//! `plcc plot`: draws a trace, and the picture of `plcc run --plot`.

use std::io;
use std::path::Path;

use plcc_diag::SourceMap;
use plcc_files::{MAX_STIMULUS, read_at_most, read_regular, why_not_read};
use plcc_host::session::write_whole;

use crate::args::PlotArgs;
use crate::failure::{DONE, Failure};
use crate::input::is_standard_input;
use crate::output;
use crate::plot::{MAX_BARS, Picture, read_table};
use crate::report::Report;

pub(crate) fn plot(args: &PlotArgs, report: &Report) -> Result<u8, Failure> {
    let path = args.trace.as_path();
    let bytes = match is_standard_input(path) {
        true => read_at_most(io::stdin().lock(), MAX_STIMULUS),
        false => read_regular(path, MAX_STIMULUS),
    };
    let bytes = bytes.map_err(|error| Failure::file(path, why_not_read(&error)))?;
    let picture = read_table(&String::from_utf8_lossy(&bytes)).map_err(|wrong| {
        let lines = wrong.iter().map(|(line, what)| format!("{}:{line}: {what}", path.display()));
        Failure::usage(lines.collect::<Vec<_>>().join("\nerror: "))
    })?;
    tell_what_is_missing(&picture, report);
    let read = [path.to_owned()];
    output::write(&args.output, picture.draw().as_bytes(), &SourceMap::new(), &read)?;
    Ok(DONE)
}

/// Writes the picture of a run.
///
/// # Errors
/// When the file can't be written.
pub(crate) fn write_plot(path: &Path, picture: &Picture, report: &Report) -> Result<(), Failure> {
    tell_what_is_missing(picture, report);
    if output::is_stdout(path) {
        return output::print(picture.draw().as_bytes());
    }
    write_whole(path, picture.draw().as_bytes()).map_err(|error| Failure::usage(error.to_string()))
}

/// Warns of an empty picture, and of bits that it leaves out.
fn tell_what_is_missing(picture: &Picture, report: &Report) {
    if picture.is_empty() {
        report.warn("the picture is empty, since no variable has a value in the trace");
    }
    if let more @ 1.. = picture.left_out() {
        report.warn(&format!("only the first {MAX_BARS} bits are drawn, and {more} are left out"));
    }
}
