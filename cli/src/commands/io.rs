//! `plcc io`: writes a template of the entries `[[io]]` for all inputs and outputs of a program.

use std::collections::HashSet;
use std::fmt::Write as _;

use plcc_abi::{Dialect, printable};
use plcc_diag::{FileId, SourceMap};
use plcc_frontend::language;
use plcc_host::image_file::SymbolTable;
use plcc_runtime::names_of;

use crate::args::IoArgs;
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
        report.message(&format!("{count}: no template is written"));
        return Ok(ERRORS);
    };
    let lowered = match checked.lower() {
        Ok(lowered) => lowered.program,
        Err(error) => return Err(Failure::usage(error.to_string())),
    };
    // The program was compiled with the settings of its machine.
    let names = names_of(&lowered);
    let used: HashSet<String> = names.declared().into_iter().map(|(name, _)| name).collect();
    let table = SymbolTable::new(&*names);
    let mut text = String::from(
        "# The inputs and outputs of the program, for the configuration of its control (controller.toml).\n\
         # Set driver and address of each (see docs/wiring.md), and safe and timeout of inputs; remove\n\
         # what is not wired. Neighbours may become ranges, as in name = \"LS1..LS16\".\n",
    );
    for symbol in table.symbols.iter().filter(|symbol| used.contains(&symbol.name)) {
        let safe = match symbol.direction.name() {
            "an input" => "safe = \"off\"\ntimeout = \"500ms\"\n",
            "an output" => "",
            _ => continue,
        };
        let what = symbol.direction.name();
        let comment = comment(&program.sources, &symbol.name, program.dialect);
        let comment = comment.map_or_else(String::new, |comment| description(&comment));
        let name = &symbol.name;
        // Writing to memory does not fail.
        let _ = write!(
            text,
            "\n[[io]]\nname = \"{name}\"  # {what}\n{comment}driver = \"other\"\naddress = \"\"\n{safe}",
        );
    }
    output::print(text.as_bytes())?;
    Ok(DONE)
}

/// The line with the key `description`.
fn description(comment: &str) -> String {
    let text = printable(comment).replace('\\', "\\\\").replace('"', "\\\"");
    format!("description = \"{text}\"\n")
}

/// The comment of the first line that names a variable and has a comment behind it.
fn comment(sources: &SourceMap, name: &str, dialect: Dialect) -> Option<String> {
    let signs = language(dialect).comment_signs();
    let files = (0..sources.len()).map(|file| sources.text(FileId(file as u32)));
    files.flat_map(str::lines).find_map(|line| {
        let upper = line.to_ascii_uppercase();
        let is_word = |at: usize| {
            let part = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '@';
            let before = upper.get(..at).and_then(|text| text.chars().next_back());
            let behind = upper.get(at + name.len()..).and_then(|text| text.chars().next());
            !before.is_some_and(part) && !behind.is_some_and(part)
        };
        let at = upper.match_indices(name).map(|(at, _)| at).find(|&at| is_word(at))?;
        let rest = line.get(at + name.len()..)?;
        let (sign, behind) =
            signs.iter().filter_map(|sign| Some((rest.find(sign)?, *sign))).min()?;
        let text = rest.get(sign + behind.len()..)?.trim_end_matches("*/").trim();
        (!text.is_empty()).then(|| text.to_owned())
    })
}
