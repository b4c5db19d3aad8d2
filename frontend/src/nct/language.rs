//! NCT as one of the languages.

use plcc_abi::{Dialect, Engine, GivenName, Tables};
use plcc_diag::{Diagnostic, FileId, SourceMap, Span};

use super::Program;
use super::ast::{Op, Stmt};
use super::presentation;
use super::reference::{KEYWORDS, MANUAL};
use crate::common::keywords;
use crate::common::{
    Controller, CrossReference, Exported, Expression, ExpressionCode, FileLoader, Logic,
    LowerError, Lowered, NumberFormat, Options, StatementInterpreter, Ways, Words,
};
use crate::language::{CheckedProgram, Language, LengthCodes, RestOfCheck, Titles, Topic};
use crate::presentation::Presentation;

/// The PLC language of NCT's controls.
#[derive(Clone, Copy, Debug)]
pub struct Nct;

/// What begins a comment.
pub(super) const COMMENT_SIGNS: &[&str] = &["/*", ";"];

impl Language for Nct {
    fn dialect(&self) -> Dialect {
        Dialect::Nct
    }

    fn title(&self) -> &'static str {
        "NCT"
    }

    fn vendor(&self) -> &'static str {
        "NCT"
    }

    fn file_extensions(&self) -> &'static [&'static str] {
        &["nct", "plc"]
    }

    /// Whether the label of a module is there, `:000` or `:001`. The address in PMAC's `Y:0001`
    /// is not a label.
    fn has_marks(&self, plain: &str) -> bool {
        plain.match_indices(':').any(|(at, _)| {
            let (before, after) = plain.split_at(at);
            let mut digits = after.chars().skip(1).filter(|c| !c.is_whitespace());
            let module = digits.next() == Some('0')
                && digits.next() == Some('0')
                && matches!(digits.next(), Some('0' | '1'));
            let before = before.trim_end();
            let address = before.ends_with(['X', 'Y', 'L', 'D', 'P', 'F'])
                || ["TWB", "TWS", "TWR"].iter().any(|word| before.ends_with(word));
            module && !address
        })
    }

    fn comment_signs(&self) -> &'static [&'static str] {
        COMMENT_SIGNS
    }

    fn has_word(&self, word: &str) -> bool {
        keywords::has(&KEYWORDS, word)
    }

    fn length_codes(&self) -> LengthCodes {
        LengthCodes { instructions: "NCT-X2", machine_code: "NCT-X3" }
    }

    fn check(
        &self,
        sources: &mut SourceMap,
        files: &[FileId],
        loader: &dyn FileLoader,
        options: &Options,
    ) -> (Option<Box<dyn CheckedProgram>>, Vec<Diagnostic>) {
        let file = files.first().copied().unwrap_or(FileId(0));
        let (program, diagnostics) = super::check(sources, file, loader, options);
        (program.map(|program| Box::new(program) as _), diagnostics)
    }

    fn words_and_rest(
        &self,
        sources: &mut SourceMap,
        files: &[FileId],
        _: &dyn FileLoader,
        options: &Options,
    ) -> (Words, RestOfCheck) {
        let file = files.first().copied().unwrap_or(FileId(0));
        let (words, rest) = super::words_and_rest(sources, file, options);
        let boxed = |program| Box::new(program) as Box<dyn CheckedProgram>;
        let rest = move |sources: &SourceMap| {
            let (program, diagnostics) = rest(sources);
            (program.map(boxed), diagnostics)
        };
        (words, Box::new(rest))
    }

    fn explain(&self, name: &str, _controller: Option<Controller>) -> Option<String> {
        let keyword = keywords::explain(&KEYWORDS, name, MANUAL);
        [keyword, super::names::explain(name)].into_iter().flatten().reduce(|a, b| a + &b)
    }

    fn topics(&self) -> Vec<Topic> {
        let topic =
            |row: &super::names::Name| Topic { name: row.name.into(), meaning: row.meaning.into() };
        keywords::topics(&KEYWORDS).chain(super::names::all().iter().map(topic)).collect()
    }

    fn snippets(&self) -> &'static [(&'static str, &'static str, &'static str)] {
        &[(":001", ":001\n\t$0\nJ1", "the module that runs each 20 ms")]
    }

    fn both_on(&self, a: &str, b: &str) -> String {
        format!("({a}A{b})")
    }

    fn numbers(&self) -> NumberFormat {
        NumberFormat { prefix: ".", suffix: "", widths: &[16, 32], both_beside: true }
    }

    /// A scan that was interrupted goes on in the next slices.
    fn scans_go_on(&self) -> bool {
        true
    }

    fn classes(&self) -> &'static [&'static str] {
        presentation::CLASSES
    }

    fn titles<'t>(&self, _: &'t Tables) -> Titles<'t> {
        Box::new(presentation::title)
    }
}

impl CheckedProgram for Program {
    fn dialect(&self) -> Dialect {
        Dialect::Nct
    }

    fn lower(&self) -> Result<Lowered, LowerError> {
        self.lower()
    }

    fn expression(&self, text: &str) -> Result<Expression, Vec<Diagnostic>> {
        self.expression(text)
    }

    fn expression_code(&self, text: &str) -> Result<Option<ExpressionCode>, Vec<Diagnostic>> {
        self.expression_code(text)
    }

    fn statement_interpreter(&self) -> Box<dyn StatementInterpreter> {
        Box::new(self.counting_interpreter())
    }

    fn statements(&self) -> Vec<Option<Span>> {
        let place = |stmt: &Stmt| match stmt.op {
            Op::EndIf | Op::Else { .. } | Op::Label(_) | Op::Text => None,
            _ => Some(stmt.span),
        };
        self.checked.stmts.iter().map(place).collect()
    }

    fn ways(&self) -> Vec<Ways> {
        self.checked.ways()
    }

    fn calls(&self, image: &[u8]) -> Vec<u32> {
        self.checked.open_calls(&self.layout, image)
    }

    fn logic(&self, sources: &SourceMap) -> Vec<Option<Logic>> {
        self.contacts(sources)
    }

    fn interpreter(&self) -> Box<dyn Engine> {
        self.interpreter()
    }

    fn cross_reference(&self) -> CrossReference {
        self.cross_reference()
    }

    /// `V012` looks at I012.
    fn has_name(&self, word: &str) -> bool {
        let looks = word.strip_prefix(['V', 'v']).map(|digits| format!("I{digits}"));
        self.canonical(word).or_else(|| self.canonical(&looks?)).is_some()
    }

    fn export(&self, name: &str, given: &[GivenName]) -> Option<Result<Exported, Vec<Diagnostic>>> {
        Some(super::export::export(&self.checked, &self.settings, name, given))
    }

    fn names_in_source(&self) -> Vec<GivenName> {
        self.names_in_source()
    }
}
