//! Test scripts (`*.plctest`): their mistakes, the words of scripts, and the names of the programs that they test.

use std::path::{Path, PathBuf};

use gen_lsp_types::{
    CodeLens, Command, CompletionItem, CompletionItemKind, CompletionResponse, Diagnostic, Hover,
    Position, Uri,
};
use plcc_plctest::{KEYWORDS, form, parse};

use super::open_text::OpenText;
use super::{completion, diagnostics, hover};
use crate::Compiler;
use crate::position::Encoding;
use crate::program::Program;

/// Whether a file is a test script by its name.
pub(crate) fn is_script(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("plctest"))
}

/// A script, and what can be asked of a place in it.
pub(crate) struct Script(OpenText);

impl Script {
    /// A script with this text.
    pub(crate) fn new(path: &Path, text: &str, encoding: Encoding) -> Self {
        Self(OpenText::new(path, text, encoding))
    }

    /// The first file of the program that it tests.
    pub(crate) fn program(&self) -> Option<PathBuf> {
        let (script, _) = parse(&self.0.sources, self.0.file);
        let named = script.programs.into_iter().next()?;
        Some(self.0.path().parent()?.join(named.text))
    }

    /// Its mistakes, as `plcc test` tells them.
    pub(crate) fn problems(&self, compiler: &dyn Compiler, explains: bool) -> Vec<Diagnostic> {
        let found = compiler.mistakes_of_script(self.0.path(), self.0.text());
        found.iter().map(|it| diagnostics::plain(it, self.0.range(it.span), explains)).collect()
    }

    /// Above each test what runs it.
    pub(crate) fn code_lens(&self, uri: &Uri) -> Vec<CodeLens> {
        let Ok(uri) = serde_json::to_value(uri) else { return vec![] };
        let (script, _) = parse(&self.0.sources, self.0.file);
        let lens = |test: &plcc_plctest::script::Test| {
            let range = self.0.range(test.name.span);
            // The extension runs it in the test explorer.
            let arguments = vec![uri.clone(), test.name.text.as_str().into()];
            let (title, command) = ("run this test".to_owned(), "plcc.runTest".to_owned());
            let command = Command { title, tooltip: None, command, arguments: Some(arguments) };
            CodeLens { range, command: Some(command), data: None }
        };
        script.tests.iter().map(lens).collect()
    }

    /// Whether nothing but blanks is before a place in its line.
    fn begins_line(&self, offset: u32) -> bool {
        self.0.line_before(offset).trim().is_empty()
    }

    /// What the word at a place is: the form of a statement, or a name of the program.
    pub(crate) fn hover(&self, at: Position, program: Option<&Program>) -> Option<Hover> {
        let span = self.0.word(at, completion::is_part_of_word);
        let word = self.0.slice(span);
        let value = match form(word).filter(|_| self.begins_line(span.start)) {
            Some(form) => format!("```text\n{form}\n```"),
            None => hover::of_name(program?, word)?,
        };
        Some(hover::shown(value, self.0.range(span)))
    }

    /// What can be written at a place: statements at the beginning of a line, then names of the program.
    pub(crate) fn completion(&self, at: Position, program: Option<&Program>) -> CompletionResponse {
        let span = self.0.beginning(at, completion::is_part_of_word);
        let (range, prefix) = (self.0.range(span), self.0.slice(span));
        let keywords = KEYWORDS.iter().filter(|word| word.starts_with(prefix));
        let keywords = keywords.filter(|_| self.begins_line(span.start)).map(|word| {
            let detail = form(word).unwrap_or_default();
            completion::item(word, CompletionItemKind::Keyword, detail, None, range)
        });
        let mut items: Vec<CompletionItem> = keywords.collect();
        if let Some(program) = program.filter(|_| !self.begins_line(span.start)) {
            items.extend(completion::names(program, prefix, range, |_| false));
        }
        CompletionResponse::CompletionItemList(items)
    }
}

#[cfg(test)]
mod tests {
    use gen_lsp_types::Contents;
    use plcc_abi::Dialect;

    use super::*;
    use crate::program::tests::with_cursor;

    /// A script and the place of `|` in it.
    fn script(text: &str) -> (Script, Position) {
        let at = text.find('|').unwrap();
        let script =
            Script::new(Path::new("/tmp/a.plctest"), &text.replace('|', ""), Encoding::Utf16);
        let at = script.0.encoding.position(&script.0.sources, script.0.file, at as u32);
        (script, at)
    }

    fn proposed(text: &str) -> Vec<String> {
        let program =
            with_cursor(Dialect::Pmi, "$INPUT\nDOOR = 1/0 ? the door\n$END\nLAMP = DOOR\n");
        let (script, at) = script(text);
        let CompletionResponse::CompletionItemList(list) = script.completion(at, Some(&program.0))
        else {
            unreachable!("a script has a plain list")
        };
        list.into_iter().map(|it| it.label).collect()
    }

    #[test]
    fn statements_begin_lines_and_names_follow() {
        assert_eq!(proposed("program \"a.pmi\"\ntest \"x\"\n  re|"), ["release"]);
        assert_eq!(proposed("program \"a.pmi\"\ntest \"x\"\n  set DO|"), ["DOOR"]);
        assert_eq!(proposed("|").len(), KEYWORDS.len());
    }

    #[test]
    fn each_test_can_be_run() {
        let (script, _) = script("program \"a.pmi\"|\ntest \"one\"\nend\n\n test \"two\"\nend\n");
        let uri = Uri::parse("file:///tmp/a.plctest").unwrap();
        let lenses = script.code_lens(&uri).into_iter().map(|lens| {
            let named = lens.command.and_then(|it| it.arguments)?.into_iter().nth(1)?;
            Some((lens.range.start.line, named.as_str()?.to_owned()))
        });
        let lenses: Vec<_> = lenses.map(Option::unwrap).collect();
        assert_eq!(lenses, [(1, "one".to_owned()), (4, "two".to_owned())]);
    }

    #[test]
    fn words_are_explained() {
        let program =
            with_cursor(Dialect::Pmi, "$INPUT\nDOOR = 1/0 ? the door\n$END\nLAMP = DOOR\n");
        let shown = |text: &str| {
            let (script, at) = script(text);
            match script.hover(at, Some(&program.0)).map(|it| it.contents) {
                Some(Contents::MarkupContent(it)) => it.value,
                _ => String::new(),
            }
        };
        assert!(shown("  pu|lse DOOR").contains("pulse NAME for 200 ms"));
        assert!(shown("  pulse DO|OR").contains("the door"));
        assert_eq!(shown("  pulse NON|E"), "");
    }

    #[test]
    fn the_program_is_found_from_the_scripts_folder() {
        let (script, _) = script("program \"../a.pmi\"|\n");
        assert_eq!(script.program(), Some(PathBuf::from("/tmp/../a.pmi")));
        assert!(is_script(Path::new("x.PLCTEST")) && !is_script(Path::new("plctest")));
    }
}
