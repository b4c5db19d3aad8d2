//! How often a declared name is read and written, above its declaration, and why it has its value in the run that is shown.

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
    own.flat_map(|declaration| {
        let (read, written) = at.program.words.uses_of(&declaration.name);
        let title = match declaration.kind {
            DeclarationKind::Constant => format!("read {}", times(read)),
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
        // The extension asks for the references and shows them; in other editors the text alone is there.
        let position = serde_json::to_value(range.start).unwrap_or_default();
        let mut lenses =
            vec![lens(range, title, "plcc.showReferences", vec![uri.clone(), position])];
        if is_shown && written > 0 {
            let name = vec![declaration.name.clone().into()];
            lenses.push(lens(range, "why?".to_owned(), "plcc.why", name));
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
