//! From a name to its declaration and to its other places.

use gen_lsp_types::{
    Declaration, DeclarationResponse, Definition, DefinitionResponse, DocumentHighlight,
    DocumentHighlightKind, Location,
};
use plcc_diag::Span;
use plcc_frontend::common::words::{Appearance, Word};

use crate::program::At;

/// Where the name at a place is declared.
pub(crate) fn definition(at: At<'_>) -> Option<DefinitionResponse> {
    found(at).map(|it| DefinitionResponse::Definition(Definition::LocationList(it)))
}

/// The same for the request that asks for declarations.
pub(crate) fn declaration(at: At<'_>) -> Option<DeclarationResponse> {
    found(at).map(|it| DeclarationResponse::Declaration(Declaration::LocationList(it)))
}

/// The declarations of the name at a place, else the places where it gets a value, or the file that is included.
fn found(at: At<'_>) -> Option<Vec<Location>> {
    let program = at.program;
    let included = program.words.includes.iter().find(|(span, _)| holds(*span, at));
    let mut places: Vec<Span> = match (included, at.word()) {
        (Some(&(_, file)), _) => vec![Span { file, start: 0, end: 0 }],
        (None, Some(word)) => {
            let declared = program.words.declarations_of(word).into_iter().map(|it| it.at);
            let declared: Vec<Span> = declared.collect();
            if declared.is_empty() { written(at, word) } else { declared }
        }
        (None, None) => vec![],
    };
    places.dedup();
    let places: Vec<Location> =
        places.into_iter().filter_map(|span| program.location(span, at.documents)).collect();
    (!places.is_empty()).then_some(places)
}

fn holds(span: Span, at: At<'_>) -> bool {
    span.file == at.file && span.start <= at.offset && at.offset <= span.end
}

/// Where what a word names gets a value: of a name that no declaration has.
fn written(at: At<'_>, word: &Word) -> Vec<Span> {
    let same = at.program.words.same_as(word).into_iter();
    same.filter(|it| it.appearance == Some(Appearance::Written)).map(|it| it.span).collect()
}

/// All places of the name at a place.
pub(crate) fn references(at: At<'_>, with_declaration: bool) -> Vec<Location> {
    let Some(word) = at.word() else { return vec![] };
    let same = at.program.words.same_as(word).into_iter();
    same.filter(|it| with_declaration || it.appearance != Some(Appearance::Declared))
        .filter_map(|it| at.program.location(it.span, at.documents))
        .collect()
}

/// The places of the name in the same file, those where it gets a value apart.
pub(crate) fn highlights(at: At<'_>) -> Vec<DocumentHighlight> {
    let Some(word) = at.word() else { return vec![] };
    let same = at.program.words.same_as(word).into_iter().filter(|it| it.span.file == at.file);
    let highlight = |it: &Word| DocumentHighlight {
        range: at.program.range(it.span),
        kind: Some(match it.appearance {
            Some(Appearance::Written) => DocumentHighlightKind::Write,
            Some(
                Appearance::Read | Appearance::Tested | Appearance::GoneTo | Appearance::Called,
            ) => DocumentHighlightKind::Read,
            Some(Appearance::Declared) | None => DocumentHighlightKind::Text,
        }),
    };
    same.map(highlight).collect()
}

#[cfg(test)]
mod tests {
    use plcc_abi::Dialect;

    use super::*;
    use crate::program::tests::{at, with_cursor};

    /// Line and column of each place.
    fn lines(places: Vec<Location>) -> Vec<(u32, u32)> {
        places.iter().map(|it| (it.range.start.line, it.range.start.character)).collect()
    }

    #[test]
    fn a_name_leads_to_its_declaration_and_to_its_uses() {
        let of = with_cursor(Dialect::Pmi, "$LOGICAL\nA, B\n$END\nA = B\nIF |A\nB = T\nENDIF\n");
        assert_eq!(lines(found(at(&of)).unwrap()), [(1, 0)]);
        assert_eq!(lines(references(at(&of), true)), [(1, 0), (3, 0), (4, 3)]);
        assert_eq!(lines(references(at(&of), false)), [(3, 0), (4, 3)]);
        let kinds: Vec<_> = highlights(at(&of)).into_iter().filter_map(|it| it.kind).collect();
        use DocumentHighlightKind::{Read, Text, Write};
        assert_eq!(kinds, [Text, Write, Read]);
    }

    #[test]
    fn without_a_declaration_it_leads_to_where_it_gets_a_value() {
        let of = with_cursor(Dialect::Nct, ":001 U012 J1\n:000 LY012| J0");
        assert_eq!(lines(found(at(&of)).unwrap()), [(0, 6)]);
        let of = with_cursor(Dialect::Nct, ":001 C00|5 J1\n:005 R");
        assert_eq!(lines(found(at(&of)).unwrap()), [(1, 0)]);
    }
}
