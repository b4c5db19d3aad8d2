//! Who calls whom: subroutines of NCT, programs of a PMAC that start and stop each other.

use gen_lsp_types::{
    CallHierarchyIncomingCall, CallHierarchyItem, CallHierarchyOutgoingCall, SymbolKind,
};
use plcc_diag::{FileId, Span};
use plcc_frontend::common::words::{Appearance, Declaration, DeclarationKind, Word};

use crate::program::At;

/// The subroutine or program that is named at a place.
pub(crate) fn prepare(at: At<'_>) -> Option<Vec<CallHierarchyItem>> {
    let name = at.word().and_then(|word| word.name.as_deref());
    // The word OPEN of a program has no name; its declaration begins there.
    let named = at.program.words.declarations.iter().find(|it| {
        let begins = it.at.file == at.file && it.at.start <= at.offset && at.offset <= it.at.end;
        is_called(it) && (Some(it.name.as_str()) == name || begins)
    })?;
    item(at, named).map(|item| vec![item])
}

fn is_called(of: &Declaration) -> bool {
    matches!(of.kind, DeclarationKind::Label | DeclarationKind::Program)
}

fn item(at: At<'_>, of: &Declaration) -> Option<CallHierarchyItem> {
    Some(CallHierarchyItem {
        name: of.name.clone(),
        kind: if of.kind == DeclarationKind::Program {
            SymbolKind::Module
        } else {
            SymbolKind::Function
        },
        tags: None,
        detail: Some(of.detail.clone()),
        uri: at.documents.uri(at.program.path(of.at.file))?,
        range: at.program.range(of.extent),
        selection_range: at.program.range(of.at),
        data: None,
    })
}

/// A file as a caller: its on-line commands start PLCs when it is downloaded.
fn item_of_file(at: At<'_>, file: FileId) -> Option<CallHierarchyItem> {
    let name = at.program.path(file).file_name()?.to_string_lossy().into_owned();
    let end = at.program.sources.text(file).len();
    Some(CallHierarchyItem {
        name,
        kind: SymbolKind::File,
        tags: None,
        detail: Some("the download itself".into()),
        uri: at.documents.uri(at.program.path(file))?,
        range: at.program.range(Span::new(file, 0, end)),
        selection_range: at.program.range(Span::new(file, 0, 0)),
        data: None,
    })
}

/// The declaration at a place.
fn declaration<'p>(at: At<'p>) -> Option<&'p Declaration> {
    at.program.words.declarations.iter().find(|it| {
        is_called(it) && it.at.file == at.file && it.at.start <= at.offset && at.offset <= it.at.end
    })
}

/// The declaration whose text a word is in.
fn around<'p>(at: At<'p>, word: &Word) -> Option<&'p Declaration> {
    let declarations = at.program.words.declarations.iter().filter(|it| is_called(it));
    let holds = |it: &&Declaration| {
        it.extent.file == word.span.file
            && it.extent.start <= word.span.start
            && word.span.end <= it.extent.end
    };
    declarations.filter(holds).min_by_key(|it| it.extent.end - it.extent.start)
}

/// The words that call something, each with the declaration that it is in; without one where the download itself starts a PLC.
fn calls<'p>(at: At<'p>) -> impl Iterator<Item = (&'p Word, Option<&'p Declaration>)> {
    let words = at.program.words.words.iter();
    let calling = words
        .filter(|word| matches!(word.appearance, Some(Appearance::Called | Appearance::GoneTo)));
    calling.map(move |word| (word, around(at, word)))
}

/// Who calls the item at a place.
pub(crate) fn incoming(at: At<'_>) -> Option<Vec<CallHierarchyIncomingCall>> {
    let of = declaration(at)?;
    let mut found: Vec<((Option<&Declaration>, FileId), CallHierarchyIncomingCall)> = vec![];
    let names = |word: &Word| at.program.words.names_of(word).any(|name| name == of.name);
    for (word, caller) in calls(at).filter(|(word, _)| names(word)) {
        let range = at.program.range(word.span);
        let file = word.span.file;
        match found.iter_mut().find(|(known, _)| *known == (caller, file)) {
            Some((_, call)) => call.from_ranges.push(range),
            None => {
                let from = match caller {
                    Some(caller) => item(at, caller)?,
                    None => item_of_file(at, file)?,
                };
                let call = CallHierarchyIncomingCall { from, from_ranges: vec![range] };
                found.push(((caller, file), call));
            }
        }
    }
    Some(found.into_iter().map(|(_, call)| call).collect())
}

/// Whom the item at a place calls.
pub(crate) fn outgoing(at: At<'_>) -> Option<Vec<CallHierarchyOutgoingCall>> {
    let of = declaration(at)?;
    let mut found: Vec<CallHierarchyOutgoingCall> = vec![];
    let words = &at.program.words;
    let own = calls(at).filter(|(_, caller)| *caller == Some(of)).map(|(word, _)| word);
    for (word, name) in own.flat_map(|word| words.names_of(word).map(move |name| (word, name))) {
        let Some(called) = words.declared(name).filter(|it| is_called(it)).last() else { continue };
        let range = at.program.range(word.span);
        match found.iter_mut().find(|call| call.to.name == called.name) {
            Some(call) => call.from_ranges.push(range),
            None => found.push(CallHierarchyOutgoingCall {
                to: item(at, called)?,
                from_ranges: vec![range],
            }),
        }
    }
    Some(found)
}

#[cfg(test)]
mod tests {
    use plcc_abi::Dialect;

    use super::*;
    use crate::program::tests::{at, with_cursor};

    #[test]
    fn callers_and_called_are_found() {
        let of = with_cursor(Dialect::Nct, ":001 C005 C005 J1\n|:005 C006 R\n:006 R\n:000 C005 J0");
        let callers: Vec<(String, usize)> = incoming(at(&of))
            .unwrap()
            .into_iter()
            .map(|call| (call.from.name, call.from_ranges.len()))
            .collect();
        assert_eq!(callers, [(":001".to_owned(), 2), (":000".to_owned(), 1)]);
        let called: Vec<String> =
            outgoing(at(&of)).unwrap().into_iter().map(|call| call.to.name).collect();
        assert_eq!(called, [":006"]);
    }

    #[test]
    fn programs_that_start_each_other_are_found() {
        let of = with_cursor(
            Dialect::Pmac,
            "OPEN PLC 1 CLEAR\nENABLE PLC 2\nCLOSE\n|OPEN PLC 2 CLEAR\nP1=1\nCLOSE\n",
        );
        let callers: Vec<String> =
            incoming(at(&of)).unwrap().into_iter().map(|it| it.from.name).collect();
        assert_eq!(callers, ["PLC1"]);
        assert_eq!(
            prepare(at(&of)).unwrap().first().map(|it| it.name.clone()).as_deref(),
            Some("PLC2")
        );
    }

    #[test]
    fn programs_are_started_by_ranges_commands_and_the_download() {
        let of = with_cursor(
            Dialect::Pmac,
            "OPEN PLC 1 CLEAR\nENABLE PLC 2..4\nDISABLE PLC 3\nCLOSE\n|OPEN PLC 3 CLEAR\n\
             CMD\"ENA PLC1,4\"\nCLOSE\nOPEN PLC 4 CLEAR\nP1=1\nCLOSE\nENABLE PLC 1..3\n",
        );
        let callers: Vec<(String, usize)> = incoming(at(&of))
            .unwrap()
            .into_iter()
            .map(|call| (call.from.name, call.from_ranges.len()))
            .collect();
        assert_eq!(callers, [("PLC1".to_owned(), 2), ("a.pmac".to_owned(), 1)]);
        let called: Vec<String> =
            outgoing(at(&of)).unwrap().into_iter().map(|call| call.to.name).collect();
        assert_eq!(called, ["PLC1", "PLC4"]);
    }
}
