//! `plcc diff --prove`: for each output and retained variable whether it can differ.

use std::path::Path;

use plcc_prove::product::{Comparison, Version, compare};
use serde_json::json;

use super::WITH_ERRORS;
use super::stored::Stored;

use crate::args::{DiffArgs, FormatArg};
use crate::commands::prove::{not_followed, place_of, status};
use crate::failure::{ERRORS, Failure};
use crate::input::{Input, SourceSettings};
use crate::output;
use crate::proof::{Bench, stimulus_file};
use crate::recorded::{check_recorded, machine_of_recorded};
use crate::report::{Destination, Report};

pub(super) fn prove(args: &DiffArgs, report: &Report) -> Result<u8, Failure> {
    let (Some(old), Some(new)) = (bench(&args.old, args, report)?, bench(&args.new, args, report)?)
    else {
        report.message("nothing is compared: a program has errors");
        return Ok(ERRORS);
    };
    let (a, b) = (old.lowered.program.dialect(), new.lowered.program.dialect());
    if a != b {
        return Err(Failure::usage(format!(
            "the old version is a program in {}, the new one in {}",
            a.name(),
            b.name()
        )));
    }
    let version = |bench| Version { source: Bench::source(bench), station: bench };
    let answers = compare(version(&old), version(&new), args.timeout).unwrap_or_else(|text| {
        let undecided =
            || Comparison::Undecided { reason: not_followed(text.clone(), Some(&args.new)) };
        new.names.outputs().into_iter().map(|(name, _)| (name, undecided())).collect()
    });
    let (mut different, mut undecided) = (0, 0);
    for (name, answer) in answers {
        let (text, json) = match answer {
            Comparison::Same => {
                (format!("same       {name}\n"), json!({"name": name, "result": "same"}))
            }
            Comparison::Different { scans, stimulus } => {
                different += 1;
                let file = format!("differs-{different}");
                let path = stimulus_file(
                    &[args.new.clone(), args.old.clone()],
                    args.out.as_deref(),
                    &file,
                    &stimulus,
                )?;
                let path = path.to_string_lossy();
                let text =
                    format!("different  {name}\n           in scan {} with {path}\n", scans - 1);
                (
                    text,
                    json!({"name": name, "result": "different", "scans": scans, "stimulus": path}),
                )
            }
            Comparison::Undecided { reason } => {
                undecided += 1;
                let reason = place_of(&reason);
                let text = format!("undecided  {name}\n           {reason}\n");
                (text, json!({"name": name, "result": "undecided", "reason": reason}))
            }
        };
        let text = match args.source.message_format {
            FormatArg::Human => text,
            FormatArg::Json => format!("{json}\n"),
        };
        output::print(text.as_bytes())?;
    }
    Ok(status(different, undecided))
}

/// A version; `None` if it has errors, which have been told.
fn bench(path: &Path, args: &DiffArgs, report: &Report) -> Result<Option<Bench>, Failure> {
    if let Some(stored) = Stored::read(path)? {
        let failure = |error| Failure::file(path, error);
        let (checked, ..) = check_recorded(&stored.sources).map_err(failure)?;
        let checked = checked.ok_or_else(|| failure(WITH_ERRORS.into()))?;
        let machine = machine_of_recorded(&stored.sources).map_err(failure)?;
        return Bench::new(checked, &args.control, machine.as_ref(), false).map(Some);
    }
    let files = [path.to_owned()];
    let settings = SourceSettings::for_files(&args.source, &files, report)?;
    let program = Input::read(&files, &args.source)?.check(&settings)?;
    let to = Destination::from(args.source.message_format);
    let Some((checked, _)) = program.without_errors(to, report)? else { return Ok(None) };
    Bench::new(checked, &args.control, settings.machine_file(), false).map(Some)
}
