//! The declarations of a document, and of all programs that are open.

use std::rc::Rc;

use gen_lsp_types::{
    BaseSymbolInformation, DocumentSymbol, DocumentSymbolResponse, SymbolKind, WorkspaceSymbol,
    WorkspaceSymbolLocation, WorkspaceSymbolResponse,
};
use plcc_frontend::common::words::{Declaration, DeclarationKind};

use crate::documents::Documents;
use crate::program::{At, Program};

/// The most symbols that a search gives.
const MAX_FOUND: usize = 500;

/// The declarations of a document, those of a program under it.
pub(crate) fn of_document(at: At<'_>) -> DocumentSymbolResponse {
    let mut roots: Vec<DocumentSymbol> = vec![];
    let own = at.program.words.declarations.iter().filter(|it| it.at.file == at.file);
    for declaration in own {
        let symbol = one(at.program, declaration);
        // A declaration inside a program or label, such as a label of a motion program, is its child.
        let parent = roots.last_mut().filter(|parent| {
            let end = |it: &DocumentSymbol| (it.range.end.line, it.range.end.character);
            end(&symbol) <= end(parent) && parent.kind == SymbolKind::Module
        });
        match parent {
            Some(parent) => parent.children.get_or_insert_default().push(symbol),
            None => roots.push(symbol),
        }
    }
    DocumentSymbolResponse::DocumentSymbolList(roots)
}

#[allow(
    deprecated,
    reason = "the protocol's structure still has the old field for deprecated symbols"
)]
fn one(program: &Program, of: &Declaration) -> DocumentSymbol {
    let comment = program.comment(of.at);
    let detail = comment.unwrap_or_else(|| of.detail.clone());
    DocumentSymbol {
        name: of.name.clone(),
        detail: Some(detail),
        kind: kind(of.kind),
        tags: None,
        deprecated: None,
        range: program.range(of.extent),
        selection_range: program.range(of.at),
        children: None,
    }
}

/// The protocol's kind that comes nearest.
fn kind(of: DeclarationKind) -> SymbolKind {
    match of {
        DeclarationKind::Input | DeclarationKind::Output => SymbolKind::Field,
        DeclarationKind::Variable => SymbolKind::Variable,
        DeclarationKind::Constant | DeclarationKind::Definition => SymbolKind::Constant,
        DeclarationKind::Contact => SymbolKind::Boolean,
        DeclarationKind::Announcement => SymbolKind::Event,
        DeclarationKind::Key => SymbolKind::Key,
        DeclarationKind::Label => SymbolKind::Function,
        DeclarationKind::Program => SymbolKind::Module,
    }
}

/// The declarations whose names hold the letters of a query, in their order.
pub(crate) fn of_workspace<'p>(
    query: &str,
    programs: impl Iterator<Item = &'p Rc<Program>>,
    documents: &Documents,
) -> WorkspaceSymbolResponse {
    let query = query.to_uppercase();
    let mut found = vec![];
    for program in programs {
        for declaration in &program.words.declarations {
            if found.len() >= MAX_FOUND || !holds_letters(&declaration.name.to_uppercase(), &query)
            {
                continue;
            }
            let Some(location) = program.location(declaration.at, documents) else { continue };
            found.push(WorkspaceSymbol {
                location: WorkspaceSymbolLocation::Location(location),
                data: None,
                base_symbol_information: BaseSymbolInformation {
                    name: declaration.name.clone(),
                    kind: kind(declaration.kind),
                    tags: None,
                    container_name: Some(declaration.detail.clone()),
                },
            });
        }
    }
    found.sort_by(|a, b| a.base_symbol_information.name.cmp(&b.base_symbol_information.name));
    WorkspaceSymbolResponse::WorkspaceSymbolList(found)
}

/// Whether a name has the letters of a query in their order.
fn holds_letters(name: &str, query: &str) -> bool {
    let mut rest = name.chars();
    query.chars().all(|letter| rest.any(|c| c == letter))
}

#[cfg(test)]
mod tests {
    use plcc_abi::Dialect;

    use super::*;
    use crate::program::tests::{at, with_cursor};

    #[test]
    fn a_document_lists_its_declarations() {
        let of =
            with_cursor(Dialect::Pmac, "#define A P1\nM1->X:0,0\nOPEN PLC 2 CLEAR\nP1=1\nCLOSE\n");
        let DocumentSymbolResponse::DocumentSymbolList(found) = of_document(at(&of)) else {
            panic!()
        };
        let names: Vec<&str> = found.iter().map(|it| it.name.as_str()).collect();
        assert_eq!(names, ["A", "M1", "PLC2"]);
    }

    #[test]
    fn a_search_takes_letters_with_others_between() {
        assert!(holds_letters("TURRET", "TRT"));
        assert!(!holds_letters("TURRET", "TTU"));
        assert!(holds_letters("X", ""));
    }
}
