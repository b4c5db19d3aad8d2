//! Who calls whom: subroutines of NCT, programs of a PMAC that start and stop each other.

use gen_lsp_types::{
    CallHierarchyIncomingCall, CallHierarchyItem, CallHierarchyOutgoingCall, SymbolKind,
};
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

/// The words that call something, each with the declaration that it is in.
fn calls<'p>(at: At<'p>) -> impl Iterator<Item = (&'p Word, &'p Declaration)> {
    let words = at.program.words.words.iter();
    let calling = words
        .filter(|word| matches!(word.appearance, Some(Appearance::Called | Appearance::GoneTo)));
    calling.filter_map(move |word| Some((word, around(at, word)?)))
}

/// Who calls the item at a place.
pub(crate) fn incoming(at: At<'_>) -> Option<Vec<CallHierarchyIncomingCall>> {
    let of = declaration(at)?;
    let mut found: Vec<(&Declaration, CallHierarchyIncomingCall)> = vec![];
    for (word, caller) in calls(at).filter(|(word, _)| word.name.as_ref() == Some(&of.name)) {
        let range = at.program.range(word.span);
        match found.iter_mut().find(|(known, _)| *known == caller) {
            Some((_, call)) => call.from_ranges.push(range),
            None => {
                let from = item(at, caller)?;
                found.push((caller, CallHierarchyIncomingCall { from, from_ranges: vec![range] }));
            }
        }
    }
    Some(found.into_iter().map(|(_, call)| call).collect())
}

/// Whom the item at a place calls.
pub(crate) fn outgoing(at: At<'_>) -> Option<Vec<CallHierarchyOutgoingCall>> {
    let of = declaration(at)?;
    let mut found: Vec<CallHierarchyOutgoingCall> = vec![];
    for (word, _) in calls(at).filter(|(_, caller)| *caller == of) {
        let named = word.name.as_deref().unwrap_or_default();
        let Some(called) = at.program.words.declared(named).filter(|it| is_called(it)).last()
        else {
            continue;
        };
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
}
