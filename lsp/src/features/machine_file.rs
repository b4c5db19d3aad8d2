//! Problems of a machine file (`STEM.machine.toml`), as every command tells them.

use std::path::Path;

use gen_lsp_types::{Diagnostic, DiagnosticSeverity, Message, Position, Range};
use plcc_frontend::common::{LintLevels, Machine};

/// Whether a file is a machine file by its name.
pub(crate) fn is_machine_file(path: &Path) -> bool {
    path.file_name().is_some_and(|name| name.to_string_lossy().ends_with(".machine.toml"))
}

/// What is wrong with the text of a machine file.
pub(crate) fn problems(text: &str) -> Vec<Diagnostic> {
    let machine = Machine::parse(text).map_err(|error| error.to_string());
    let Err(message) = machine.and_then(|machine| LintLevels::of_machine(&machine)) else {
        return vec![];
    };
    // The message names the line, if it knows it.
    let named = message.split("line ").nth(1).unwrap_or_default();
    let digits: String = named.chars().take_while(char::is_ascii_digit).collect();
    let line = digits.parse::<u32>().unwrap_or(1).saturating_sub(1);
    let range = Range {
        start: Position { line, character: 0 },
        end: Position { line: line + 1, character: 0 },
    };
    vec![Diagnostic {
        range,
        severity: Some(DiagnosticSeverity::Error),
        source: Some("plcc".into()),
        message: Message::String(message.trim_end().to_owned()),
        ..Diagnostic::default()
    }]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mistake_is_told_in_its_line() {
        let found =
            problems("[lints]\nnear-name = \"allow\"\n[names]\nI012 = { alias = \"2D\" }\n");
        assert_eq!(found.iter().map(|it| it.range.start.line).collect::<Vec<_>>(), [3]);
        assert!(problems("[lints]\nnear-name = \"allow\"\n").is_empty());
        assert_eq!(problems("[nonsense]\n").len(), 1);
    }
}
