//! PMI as one of the languages.

use plcc_abi::{Dialect, Engine, GivenName, Tables};
use plcc_diag::{Diagnostic, FileId, SourceMap, Span};

use super::ast::{Action, Step};
use super::presentation;
use super::reference::{KEYWORDS, MANUAL};
use super::{Interpreter, Program};
use crate::common::keywords;
use crate::common::{
    Controller, CrossReference, Exported, Expression, ExpressionCode, FileLoader, Logic,
    LowerError, Lowered, NumberFormat, Options, StatementInterpreter, Ways, Words,
};
use crate::language::{CheckedProgram, Language, LengthCodes, RestOfCheck, Titles, Topic};

/// The PMI language.
#[derive(Clone, Copy, Debug)]
pub struct Pmi;

/// The directives of PMI (PMI 2.1), by which its programs are recognised.
const DIRECTIVES: [&str; 15] = [
    "INPUT", "OUTPUT", "LOGICAL", "INTEGER", "LONG", "FAULT", "MESSAGE", "KEY", "MCODE", "GCODE",
    "TIMER", "FLIPFLOP", "AUXAXIS", "INCLUDE", "END",
];

/// What begins a comment.
pub(super) const COMMENT_SIGNS: &[&str] = &["?"];

impl Language for Pmi {
    fn dialect(&self) -> Dialect {
        Dialect::Pmi
    }

    fn title(&self) -> &'static str {
        "PMI"
    }

    fn vendor(&self) -> &'static str {
        "Sieb & Meyer SERIES 8"
    }

    fn file_extensions(&self) -> &'static [&'static str] {
        &["pmi"]
    }

    /// Whether a line begins with a directive.
    fn has_marks(&self, plain: &str) -> bool {
        plain.split(['\r', '\n']).any(|line| {
            let word = line.trim_start_matches(|c: char| c.is_whitespace() || c == '\u{feff}');
            let Some(word) = word.strip_prefix('$') else { return false };
            let end = word.find(|c: char| !c.is_ascii_alphanumeric()).unwrap_or(word.len());
            word.get(..end).is_some_and(|word| DIRECTIVES.contains(&word))
        })
    }

    fn comment_signs(&self) -> &'static [&'static str] {
        COMMENT_SIGNS
    }

    fn has_word(&self, word: &str) -> bool {
        keywords::has(&KEYWORDS, word)
    }

    fn length_codes(&self) -> LengthCodes {
        LengthCodes { instructions: "PMI-X4", machine_code: "PMI-X5" }
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
        loader: &dyn FileLoader,
        options: &Options,
    ) -> (Words, RestOfCheck) {
        let file = files.first().copied().unwrap_or(FileId(0));
        let (words, rest) = super::words_and_rest(sources, file, loader, options);
        let boxed = |program| Box::new(program) as Box<dyn CheckedProgram>;
        let rest = move |sources: &SourceMap| {
            let (program, diagnostics) = rest(sources);
            (program.map(boxed), diagnostics)
        };
        (words, Box::new(rest))
    }

    fn explain(&self, name: &str, _controller: Option<Controller>) -> Option<String> {
        let keyword = keywords::explain(&KEYWORDS, name, MANUAL);
        [keyword, super::explain(name)].into_iter().flatten().reduce(|a, b| a + &b)
    }

    fn topics(&self) -> Vec<Topic> {
        let variables = super::reference::executive::topics();
        keywords::topics(&KEYWORDS).chain(variables).collect()
    }

    fn snippets(&self) -> &'static [(&'static str, &'static str, &'static str)] {
        &[
            (
                "IF",
                "IF (${1:CONDITION})\n\t$0\nENDIF",
                "the statements run if the condition is true",
            ),
            ("ELSEIF", "ELSEIF (${1:CONDITION})\n\t$0", "another condition of an IF"),
            ("GOTO", "GOTO ${1:LABEL}", "goes on at a label further down"),
        ]
    }

    fn both_on(&self, a: &str, b: &str) -> String {
        format!("{a} & {b}")
    }

    fn numbers(&self) -> NumberFormat {
        NumberFormat { prefix: "", suffix: "h", widths: &[16, 32], both_beside: false }
    }

    fn scans_go_on(&self) -> bool {
        false
    }

    /// True logicals are underlined, and numbers stand above their variables (PMI 5.1).
    fn chooses_statements(&self) -> bool {
        true
    }

    fn classes(&self) -> &'static [&'static str] {
        presentation::CLASSES
    }

    fn titles<'t>(&self, tables: &'t Tables) -> Titles<'t> {
        presentation::titles(tables)
    }
}

impl CheckedProgram for Program {
    fn dialect(&self) -> Dialect {
        Dialect::Pmi
    }

    fn lower(&self) -> Result<Lowered, LowerError> {
        self.lower()
    }

    fn lower_in_place_of(&self, name: &str, old: &str) -> Result<Lowered, LowerError> {
        self.lower_in_place_of(name, old)
    }

    fn cross_reference(&self) -> CrossReference {
        self.cross_reference()
    }

    fn names_in_source(&self) -> Vec<GivenName> {
        self.names_in_source()
    }

    fn expression(&self, text: &str) -> Result<Expression, Vec<Diagnostic>> {
        self.expression(text)
    }

    fn expression_code(&self, text: &str) -> Result<Option<ExpressionCode>, Vec<Diagnostic>> {
        self.expression_code(text)
    }

    fn statement_interpreter(&self) -> Box<dyn StatementInterpreter> {
        Box::new(Interpreter::new(&self.checked, &self.layout))
    }

    fn statements(&self) -> Vec<Option<Span>> {
        self.checked
            .steps
            .iter()
            .map(|step| step.action.is_statement().then_some(step.span))
            .collect()
    }

    fn logic(&self, sources: &SourceMap) -> Vec<Option<Logic>> {
        self.contacts(sources)
    }

    fn ways(&self) -> Vec<Ways> {
        let ways = |(at, step): (u32, &Step)| match step.action {
            Action::Assign { .. } => Ways::to([at + 1]),
            Action::If { otherwise, .. } => Ways::to([at + 1, otherwise]),
            Action::Jump { to, .. } => Ways::to([to]),
        };
        (0..).zip(&self.checked.steps).map(ways).collect()
    }

    fn interpreter(&self) -> Box<dyn Engine> {
        self.interpreter()
    }

    fn place_of_value(&self, name: &str) -> Option<Span> {
        self.checked.place_of_value(name)
    }

    fn export(&self, name: &str, given: &[GivenName]) -> Option<Result<Exported, Vec<Diagnostic>>> {
        Some(Ok(super::export::export(&self.checked, &self.sources, name, given)))
    }

    fn key_texts(&self) -> Vec<String> {
        self.checked.keys.iter().map(|(_, text)| text.clone()).collect()
    }
}
