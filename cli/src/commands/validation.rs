//! `plcc build --validate`: whether the optimised code does what the code before did.

use std::io::Write;
use std::time::Duration;

use plcc_abi::printable;
use plcc_ir::Module;
use plcc_prove::validate::{Answer, Difference, Validation, Verdict};
use serde_json::{Value, json};

use crate::args::FormatArg;
use crate::commands::prove::place_of;
use crate::compile::Optimized;
use crate::failure::Failure;
use crate::output;
use crate::report::{Destination, count_of};

/// Compares each function with what the front end made, and tells the answers.
///
/// # Errors
/// When a function does something else than before: a mistake of the compiler.
pub(crate) fn validate(
    before: &Module,
    optimized: &Optimized,
    time: Duration,
    to: Destination,
) -> Result<(), Failure> {
    let validation = Validation::new(before, &optimized.module);
    let (mut proved, mut undecided, mut refuted) = (0, 0, None);
    for number in 0..validation.len() {
        let answer = validation.function(number, time);
        tell(&as_line(before, to.format, &answer), to)?;
        match answer.verdict {
            Verdict::Proved => proved += 1,
            Verdict::Undecided(_) => undecided += 1,
            Verdict::Refuted(_) => refuted = refuted.or(Some(answer)),
        }
    }
    if let Some(Answer { verdict: Verdict::Refuted(difference), .. }) = &refuted {
        let what = described(before, difference);
        return Err(Failure::internal(format!(
            "the optimised code does not do what the code before did: {what}"
        )));
    }
    if to.format == FormatArg::Human {
        let functions = count_of(proved + undecided, "function");
        let line = match undecided {
            0 => format!("{functions}: the optimised code does what the code before did\n"),
            _ => format!("{functions}: {proved} proved, {undecided} undecided\n"),
        };
        tell(&line, to)?;
    }
    Ok(())
}

/// Writes a line of the answers: to standard output, or to standard error where that has the listing.
fn tell(line: &str, to: Destination) -> Result<(), Failure> {
    if to.stdout_taken {
        let _ = write!(std::io::stderr(), "{line}");
        return Ok(());
    }
    output::print(line.as_bytes())
}

/// What differs, where, and with which bytes of the image.
fn described(module: &Module, difference: &Difference) -> String {
    let place = difference.place.as_ref();
    let place = place.map_or(String::new(), |(file, line)| format!("{file}:{line} "));
    let image: Vec<String> = image(module, difference)
        .into_iter()
        .map(|(place, value)| format!("{place} = {value}"))
        .collect();
    let with = match image.is_empty() {
        true => "with an image of zeros".into(),
        false => format!("with {}", image.join(", ")),
    };
    format!("{place}{} {with}", difference.what)
}

fn image(module: &Module, difference: &Difference) -> Vec<(String, u8)> {
    let bytes = difference.image.iter();
    bytes.map(|&(offset, value)| (module.place_name(offset), value)).collect()
}

/// An answer as a line, or lines, of the output.
fn as_line(module: &Module, format: FormatArg, answer: &Answer) -> String {
    let (word, reason) = match &answer.verdict {
        Verdict::Proved => ("proved", None),
        Verdict::Refuted(difference) => ("refuted", Some(described(module, difference))),
        Verdict::Undecided(reason) => ("undecided", Some(place_of(reason))),
    };
    match format {
        FormatArg::Json => {
            let lines = answer.lines.as_ref();
            let mut object = json!({
                "function": answer.function,
                "file": lines.map(|(file, ..)| file),
                "first_line": lines.map(|(_, first, _)| first),
                "last_line": lines.map(|(.., last)| last),
                "result": word,
            });
            if let Value::Object(fields) = &mut object {
                if let Some(reason) = reason {
                    fields.insert("reason".into(), reason.into());
                }
                if let Verdict::Refuted(difference) = &answer.verdict {
                    let bytes: serde_json::Map<String, Value> = image(module, difference)
                        .into_iter()
                        .map(|(place, value)| (place, value.into()))
                        .collect();
                    fields.insert("image".into(), bytes.into());
                }
            }
            format!("{object}\n")
        }
        FormatArg::Human => {
            let what = match &answer.lines {
                Some((file, first, last)) if first == last => format!("line {first} of {file}"),
                Some((file, first, last)) => format!("lines {first} to {last} of {file}"),
                None => format!("function {}", answer.function),
            };
            let mut text = format!("{word:<10} {}\n", printable(&what));
            if let Some(reason) = reason {
                text.push_str(&format!("           {}\n", printable(&reason)));
            }
            text
        }
    }
}
