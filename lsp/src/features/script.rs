//! Test scripts (`*.plctest`): their mistakes, the words of scripts, and the names of the programs that they test.

use std::path::{Path, PathBuf};

use gen_lsp_types::{
    CodeLens, Command, CompletionItem, CompletionItemKind, CompletionResponse, Contents,
    Diagnostic, Hover, MarkupContent, MarkupKind, Position, Uri,
};
use plcc_diag::{FileId, SourceMap, Span};
use plcc_plctest::{KEYWORDS, form, parse};

use super::{completion, diagnostics, hover};
use crate::Compiler;
use crate::position::Encoding;
use crate::program::Program;

/// Whether a file is a test script by its name.
pub(crate) fn is_script(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("plctest"))
}

/// A script, and the place in it that a request is about.
pub(crate) struct Script {
    sources: SourceMap,
    file: FileId,
    encoding: Encoding,
}

impl Script {
    /// A script with this text.
    pub(crate) fn new(path: &Path, text: &str, encoding: Encoding) -> Self {
        let mut sources = SourceMap::new();
        let file = sources.add(path.to_string_lossy(), text.as_bytes());
        Self { sources, file, encoding }
    }

    /// The first file of the program that it tests.
    pub(crate) fn program(&self) -> Option<PathBuf> {
        let (script, _) = parse(&self.sources, self.file);
        let named = script.programs.into_iter().next()?;
        Some(Path::new(self.sources.path(self.file)).parent()?.join(named.text))
    }

    /// Its mistakes, as `plcc test` tells them.
    pub(crate) fn problems(&self, compiler: &dyn Compiler, explains: bool) -> Vec<Diagnostic> {
        let (path, text) = (self.sources.path(self.file), self.sources.text(self.file));
        let found = compiler.mistakes_of_script(Path::new(path), text);
        let range = |span| self.encoding.range(&self.sources, span);
        found.iter().map(|it| diagnostics::plain(it, range(it.span), explains)).collect()
    }

    /// Above each test what runs it.
    pub(crate) fn code_lens(&self, uri: &Uri) -> Vec<CodeLens> {
        let Ok(uri) = serde_json::to_value(uri) else { return vec![] };
        let (script, _) = parse(&self.sources, self.file);
        let lens = |test: &plcc_plctest::script::Test| {
            let range = self.encoding.range(&self.sources, test.name.span);
            // The extension runs it in the test explorer.
            let arguments = vec![uri.clone(), test.name.text.as_str().into()];
            let (title, command) = ("run this test".to_owned(), "plcc.runTest".to_owned());
            let command = Command { title, tooltip: None, command, arguments: Some(arguments) };
            CodeLens { range, command: Some(command), data: None }
        };
        script.tests.iter().map(lens).collect()
    }

    /// The name or keyword at a place.
    fn word(&self, at: Position) -> Span {
        let text = self.sources.text(self.file);
        let offset = self.encoding.offset(&self.sources, self.file, at) as usize;
        let (before, after) = text.split_at_checked(offset).unwrap_or((text, ""));
        let start = before.trim_end_matches(completion::is_part_of_word).len();
        let end = text.len() - after.trim_start_matches(completion::is_part_of_word).len();
        Span::new(self.file, start, end)
    }

    /// Whether nothing but blanks is before a place in its line.
    fn begins_line(&self, offset: u32) -> bool {
        let before = self.sources.text(self.file).get(..offset as usize).unwrap_or_default();
        before.rsplit(['\n', '\r']).next().is_some_and(|line| line.trim().is_empty())
    }

    /// What the word at a place is: the form of a statement, or a name of the program.
    pub(crate) fn hover(&self, at: Position, program: Option<&Program>) -> Option<Hover> {
        let span = self.word(at);
        let word = self.sources.slice(span);
        let value = match form(word).filter(|_| self.begins_line(span.start)) {
            Some(form) => format!("```text\n{form}\n```"),
            None => hover::of_name(program?, word)?,
        };
        let contents = Contents::MarkupContent(MarkupContent { kind: MarkupKind::Markdown, value });
        Some(Hover { contents, range: Some(self.encoding.range(&self.sources, span)) })
    }

    /// What can be written at a place: statements at the beginning of a line, names of the program behind that.
    pub(crate) fn completion(&self, at: Position, program: Option<&Program>) -> CompletionResponse {
        let end = self.encoding.offset(&self.sources, self.file, at);
        let span = Span { end, ..self.word(at) };
        let range = self.encoding.range(&self.sources, span);
        let prefix = self.sources.slice(span);
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
    use plcc_abi::Dialect;

    use super::*;
    use crate::program::tests::with_cursor;

    /// A script and the place of `|` in it.
    fn script(text: &str) -> (Script, Position) {
        let at = text.find('|').unwrap();
        let script =
            Script::new(Path::new("/tmp/a.plctest"), &text.replace('|', ""), Encoding::Utf16);
        let at = script.encoding.position(&script.sources, script.file, at as u32);
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
