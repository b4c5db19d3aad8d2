//! How often a declared name is read and written, above its declaration, and why it has its value in the run that is shown.

use std::collections::BTreeMap;

use gen_lsp_types::{CodeLens, Command, Range};
use plcc_frontend::common::words::DeclarationKind;
use serde_json::Value;

use super::hover::times;
use crate::program::At;

/// The lenses of a document. `is_shown` says that the values of a run of its program are shown.
pub(crate) fn code_lens(at: At<'_>, is_shown: bool) -> Vec<CodeLens> {
    let uri = at.documents.uri(at.program.path(at.file));
    let Some(Ok(uri)) = uri.map(serde_json::to_value) else { return vec![] };
    let own = at.program.words.declarations.iter().filter(|it| it.at.file == at.file);
    let mut lines: BTreeMap<u32, u32> = BTreeMap::new();
    for declaration in own.clone() {
        let is_shown =
            !matches!(declaration.kind, DeclarationKind::Definition | DeclarationKind::Key);
        let line = at.program.range(declaration.at).start.line;
        *lines.entry(line).or_default() += u32::from(is_shown);
    }
    own.flat_map(|declaration| {
        let (read, written) = at.program.words.uses_of(&declaration.name);
        let title = match declaration.kind {
            DeclarationKind::Constant => format!("read {}", times(read)),
            // What the control itself calls, or a range of PLCs that is enabled, would be said to be called never.
            DeclarationKind::Label | DeclarationKind::Program if read == 0 => return vec![],
            DeclarationKind::Label | DeclarationKind::Program => format!("called {}", times(read)),
            DeclarationKind::Definition | DeclarationKind::Key => return vec![],
            DeclarationKind::Input
            | DeclarationKind::Output
            | DeclarationKind::Variable
            | DeclarationKind::Contact
            | DeclarationKind::Announcement => {
                format!("read {}, written {}", times(read), times(written))
            }
        };
        let range = at.program.range(declaration.at);
        // Of several names in a line each lens says of which it tells.
        let is_alone = lines.get(&range.start.line).is_none_or(|&count| count < 2);
        let of = |text: String| match is_alone {
            true => text,
            false => format!("{}: {text}", declaration.name),
        };
        // The extension asks for the references and shows them; in other editors the text alone is there.
        let position = serde_json::to_value(range.start).unwrap_or_default();
        let mut lenses =
            vec![lens(range, of(title), "plcc.showReferences", vec![uri.clone(), position])];
        if is_shown && written > 0 {
            let name = vec![declaration.name.clone().into()];
            lenses.push(lens(range, of("why?".to_owned()), "plcc.why", name));
        }
        lenses
    })
    .collect()
}

fn lens(range: Range, title: String, command: &str, arguments: Vec<Value>) -> CodeLens {
    let command =
        Command { title, tooltip: None, command: command.to_owned(), arguments: Some(arguments) };
    CodeLens { range, command: Some(command), data: None }
}

#[cfg(test)]
mod tests {
    use plcc_abi::Dialect;

    use super::*;
    use crate::program::tests::{at, with_cursor};

    #[test]
    fn lenses_of_several_names_in_a_line_say_the_names() {
        let of = with_cursor(
            Dialect::Pmi,
            "$INPUT\nDOOR = 1/0\n$INTEGER\nN, M\n$END\nN = M\nA = DOOR\n",
        );
        let lenses = code_lens(at(&of), true);
        let titles: Vec<String> =
            lenses.into_iter().filter_map(|it| Some(it.command?.title)).collect();
        assert_eq!(
            titles,
            [
                "read once, written never",
                "N: read never, written once",
                "N: why?",
                "M: read once, written never",
                "read never, written once",
                "why?",
            ]
        );
    }
}
