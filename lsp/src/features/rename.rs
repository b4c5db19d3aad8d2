//! Gives a name another spelling everywhere: names and labels of PMI, names that a PMAC's `#define` defines.
//!
//! A change of names must not change the program. So it is made on a copy of the texts first, and refused if the copy has an
//! error that was not there, or if its machine code is another one.

use std::collections::{BTreeMap, HashMap};

use gen_lsp_types::{PrepareRenamePlaceholder, PrepareRenameResult, TextEdit, WorkspaceEdit};
use plcc_diag::{FileId, Span};
use plcc_frontend::common::words::Word;

use crate::Compiler;
use crate::program::{At, Program};

/// Whether the name at a place can get another spelling, and what it is.
///
/// # Errors
/// Why it can't.
pub(crate) fn prepare(at: At<'_>) -> Result<PrepareRenameResult, String> {
    let word = at.word().ok_or("there is no name here")?;
    own_name(at, word)?;
    Ok(PrepareRenameResult::PrepareRenamePlaceholder(PrepareRenamePlaceholder {
        range: at.program.range(word.span),
        placeholder: at.text(word).to_owned(),
    }))
}

/// The name of the program that a word is.
fn own_name<'p>(at: At<'p>, word: &'p Word) -> Result<&'p str, String> {
    let name =
        word.defined_as.as_deref().or(word.name.as_deref()).ok_or("there is no name here")?;
    let declared = at.program.words.declared(name).next().is_some();
    // Names of the control, such as I012 or P1, are spelled as they are declared nowhere, or in words of the language.
    if !declared || at.text(word) != name || is_of_control(at, word) {
        return Err(format!("{name} is a name of the control, which can't be spelled otherwise"));
    }
    Ok(name)
}

/// Whether a word is a name that the control has, rather than one that the program gives.
fn is_of_control(at: At<'_>, word: &Word) -> bool {
    let text = at.text(word);
    text.starts_with([':', '@'])
        || word.defined_as.is_none()
            && at.program.checked().is_some_and(|it| it.accessed(text).is_some())
            && at
                .program
                .words
                .declarations
                .iter()
                .all(|it| it.name != text || it.detail.contains("->"))
}

/// The edits that give the name at a place the spelling `new`.
///
/// # Errors
/// Why it can't be done.
pub(crate) fn rename(
    at: At<'_>,
    new: &str,
    compiler: &dyn Compiler,
) -> Result<WorkspaceEdit, String> {
    let word = at.word().ok_or("there is no name here")?;
    let name = own_name(at, word)?;
    let is_name = new.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
        && new.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
    if !is_name {
        return Err(format!("`{new}` is not a name: letters and digits, a letter first"));
    }
    if at.program.words.words.iter().any(|it| at.text(it) == new) {
        return Err(format!("`{new}` is in the program already"));
    }
    let Some(before) = at.program.checked() else {
        return Err("the program has errors; mend them first, so that it can be compared".into());
    };
    let spans: Vec<Span> = at.program.words.same_as(word).into_iter().map(|it| it.span).collect();
    let spans: Vec<Span> =
        spans.into_iter().filter(|span| at.program.sources.slice(*span) == name).collect();
    let after = changed(at, &spans, new);
    let Some(checked) = after.checked() else {
        let error = after.diagnostics().iter().find(|it| it.is_error());
        let error = error.map_or_else(String::new, |it| format!(": {}", it.message));
        return Err(format!("with the name {new} the program has an error{error}"));
    };
    let renamed = Some((new, name));
    if compiler.code(before, None) != compiler.code(checked, renamed) {
        return Err(format!("with the name {new} it would be another program"));
    }
    let mut changes: HashMap<_, Vec<TextEdit>> = HashMap::new();
    for span in spans {
        let uri = at.documents.uri(at.program.path(span.file)).ok_or("a file has no address")?;
        let edit = TextEdit { range: at.program.range(span), new_text: new.to_owned() };
        changes.entry(uri).or_default().push(edit);
    }
    Ok(WorkspaceEdit { changes: Some(changes), ..WorkspaceEdit::default() })
}

/// The program with another text at some places.
fn changed(at: At<'_>, spans: &[Span], new: &str) -> Program {
    let program = at.program;
    let mut texts: BTreeMap<FileId, String> = BTreeMap::new();
    // From the last one on, so that the places in front stay what they are.
    for span in spans.iter().rev() {
        let text =
            texts.entry(span.file).or_insert_with(|| program.sources.text(span.file).to_owned());
        if text.get(span.range()).is_some() {
            text.replace_range(span.range(), new);
        }
    }
    program.with_texts(texts, at.documents)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use plcc_abi::Dialect;
    use plcc_diag::Diagnostic;
    use plcc_frontend::CheckedProgram;

    use super::*;
    use crate::program::tests::{at, with_cursor};

    /// Compares what lowering makes, which is enough here.
    struct Lowering;

    impl Compiler for Lowering {
        fn code(&self, program: &dyn CheckedProgram, _: Option<(&str, &str)>) -> Option<Vec<u8>> {
            let lowered = program.lower().ok()?;
            let functions = lowered.module.funcs.iter().map(|it| format!("{it:?}").len());
            Some(functions.flat_map(usize::to_le_bytes).collect())
        }

        fn mistakes_of_script(&self, _: &Path, _: &str) -> Vec<Diagnostic> {
            vec![]
        }

        fn open_run(&self, _: &Path, _: &Path) -> Result<Box<dyn crate::Run>, String> {
            Err("nothing runs".into())
        }
    }

    fn renamed(dialect: Dialect, text: &str, new: &str) -> Result<usize, String> {
        let edit = rename(at(&with_cursor(dialect, text)), new, &Lowering)?;
        Ok(edit.changes.into_iter().flatten().map(|(_, edits)| edits.len()).sum())
    }

    #[test]
    fn names_of_the_program_are_spelled_anew_everywhere() {
        let text = "$INPUT\nDOOR = 1/0\n$FAULT\nFLT = \"x\", DOOR\n$END\nA = DO|OR\n";
        assert_eq!(renamed(Dialect::Pmi, text, "GATE"), Ok(3));
        let text = "#define DOOR M11\nM11->X:0,0\nOPEN PLC1 CLEAR\nP1=D|OOR\nCLOSE\n";
        assert_eq!(renamed(Dialect::Pmac, text, "Gate"), Ok(2));
    }

    #[test]
    fn what_would_change_the_program_is_refused() {
        let text = "$INPUT\nDOOR = 1/0\n$END\nA = DO|OR\n";
        for (new, why) in [
            ("A", "is in the program already"),
            ("2A", "is not a name"),
            ("TOOLONGNAME", "has an error"),
            ("IF", "has an error"),
        ] {
            let error = renamed(Dialect::Pmi, text, new).unwrap_err();
            assert!(error.contains(why), "{new}: {error}");
        }
        let error = renamed(Dialect::Nct, ":001 U0|12 J1\n:000 J0\n", "X").unwrap_err();
        assert!(error.contains("name of the control"), "{error}");
        let error = renamed(Dialect::Pmac, "M11->X:0,0\nOPEN PLC1 CLEAR\nP1=M1|1\nCLOSE\n", "X")
            .unwrap_err();
        assert!(error.contains("name of the control"), "{error}");
    }
}
