//! How often a declared name is read and written, above its declaration.

use gen_lsp_types::{CodeLens, Command};
use plcc_frontend::common::words::DeclarationKind;

use super::hover::times;
use crate::program::At;

/// The lenses of a document.
pub(crate) fn code_lens(at: At<'_>) -> Vec<CodeLens> {
    let uri = at.documents.uri(at.program.path(at.file));
    let Some(Ok(uri)) = uri.map(serde_json::to_value) else { return vec![] };
    let own = at.program.words.declarations.iter().filter(|it| it.at.file == at.file);
    own.filter_map(|declaration| {
        let (read, written) = at.program.words.uses_of(&declaration.name);
        let title = match declaration.kind {
            DeclarationKind::Constant => format!("read {}", times(read)),
            DeclarationKind::Label | DeclarationKind::Program => format!("called {}", times(read)),
            DeclarationKind::Definition | DeclarationKind::Key => return None,
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
        let arguments = vec![uri.clone(), serde_json::to_value(range.start).ok()?];
        let command = "plcc.showReferences".to_owned();
        let command = Command { title, tooltip: None, command, arguments: Some(arguments) };
        Some(CodeLens { range, command: Some(command), data: None })
    })
    .collect()
}
