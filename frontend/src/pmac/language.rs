//! PMAC's implementation of the traits that every language has.

use plcc_abi::{Dialect, Engine, GivenName, Tables};
use plcc_diag::{Diagnostic, FileId, SourceMap, Span};

use super::ast::{Stmt, StmtKind};
use super::expression::{Context, expression_code, parse_expression};
use super::presentation;
use super::reference::{KEYWORDS, MANUAL, describe, memory};
use super::tasks::tasks;
use super::{Interpreter, Program};
use crate::common::keywords;
use crate::common::{
    Controller, CrossReference, Exported, Expression, ExpressionCode, FileLoader, Logic,
    LowerError, Lowered, NumberFormat, Options, StatementInterpreter, Ways, Words,
};
use crate::language::{CheckedProgram, Language, LengthCodes, RestOfCheck, Titles, Topic};
use crate::presentation::Terminal;

/// The PLC language of PMAC and Turbo PMAC.
#[derive(Clone, Copy, Debug)]
pub struct Pmac;

/// What begins a comment.
pub(super) const COMMENT_SIGNS: &[&str] = &[";", "//", "/*"];

impl Language for Pmac {
    fn dialect(&self) -> Dialect {
        Dialect::Pmac
    }

    fn title(&self) -> &'static str {
        "PMAC"
    }

    fn vendor(&self) -> &'static str {
        "Delta Tau PMAC and Turbo PMAC"
    }

    fn file_extensions(&self) -> &'static [&'static str] {
        &["pmc", "pmac", "plc"]
    }

    /// Whether a text has `OPEN PLC`, the `->` of a definition, or `#define`.
    fn has_marks(&self, plain: &str) -> bool {
        let follows = |word: &str, next: &str| {
            plain.match_indices(word).any(|(at, _)| {
                let tail = plain.get(at + word.len()..).unwrap_or("");
                tail.trim_start().starts_with(next)
            })
        };
        plain.contains("->") || follows("OPEN", "PLC") || follows("#", "DEFINE")
    }

    fn joins_files(&self) -> bool {
        true
    }

    fn has_controllers(&self) -> bool {
        true
    }

    /// The warning that nothing sets I5, without which no PLC runs: what sets the control up is
    /// often a file of its own.
    fn may_be_elsewhere(&self, code: &str) -> bool {
        code == "PMAC-W2"
    }

    fn takes_definitions(&self) -> bool {
        true
    }

    /// The PLCs with broken structures are empty.
    fn runs_despite_errors(&self) -> bool {
        true
    }

    fn comment_signs(&self) -> &'static [&'static str] {
        COMMENT_SIGNS
    }

    fn has_word(&self, word: &str) -> bool {
        keywords::has(&KEYWORDS, word)
    }

    fn length_codes(&self) -> LengthCodes {
        LengthCodes { instructions: "PMAC-X7", machine_code: "PMAC-X8" }
    }

    fn check(
        &self,
        sources: &mut SourceMap,
        files: &[FileId],
        loader: &dyn FileLoader,
        options: &Options,
    ) -> (Option<Box<dyn CheckedProgram>>, Vec<Diagnostic>) {
        let (program, diagnostics) = super::check(sources, files, loader, options);
        (program.map(|program| Box::new(program) as _), diagnostics)
    }

    fn words_and_rest(
        &self,
        sources: &mut SourceMap,
        files: &[FileId],
        loader: &dyn FileLoader,
        options: &Options,
    ) -> (Words, RestOfCheck) {
        // The reader borrows the preprocessed text, so that nothing is left for later.
        let (program, diagnostics, words) =
            super::check_with_words(sources, files, loader, options);
        let program = program.map(|program| Box::new(program) as _);
        (words, Box::new(|_| (program, diagnostics)))
    }

    fn explain(&self, name: &str, controller: Option<Controller>) -> Option<String> {
        let keyword = keywords::explain(&KEYWORDS, name, MANUAL);
        let pages =
            [keyword, memory::explain(name, controller), describe::explain(name, controller)];
        pages.into_iter().flatten().reduce(|a, b| a + &b)
    }

    fn topics(&self) -> Vec<Topic> {
        let variables = describe::topics();
        keywords::topics(&KEYWORDS).chain(memory::topics()).chain(variables).collect()
    }

    fn listing_comments(&self, tables: &Tables) -> Vec<String> {
        let Tables::Pmac(tables) = tables else { return Vec::new() };
        super::reference::listing_comments::listing_comments(tables)
    }

    fn snippets(&self) -> &'static [(&'static str, &'static str, &'static str)] {
        &[
            ("OPEN", "OPEN PLC ${1:1} CLEAR\n\t$0\nCLOSE", "a PLC program"),
            ("IF", "IF (${1:P1=1})\n\t$0\nENDIF", "the statements run if the condition is true"),
            (
                "WHILE",
                "WHILE (${1:P1=1})\n\t$0\nENDWHILE",
                "one round each scan, as long as the condition is true",
            ),
        ]
    }

    fn both_on(&self, a: &str, b: &str) -> String {
        format!("{a}=1 AND {b}=1")
    }

    fn numbers(&self) -> NumberFormat {
        NumberFormat { prefix: "$", suffix: "", widths: &[24, 48], both_beside: false }
    }

    fn scans_go_on(&self) -> bool {
        false
    }

    fn part_title(&self) -> &'static str {
        "PLC"
    }

    fn terminal(&self) -> Option<Box<dyn Terminal>> {
        Some(Box::new(presentation::PmacTerminal::new(None)))
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
        Dialect::Pmac
    }

    fn lower(&self) -> Result<Lowered, LowerError> {
        self.lower()
    }

    fn cross_reference(&self) -> CrossReference {
        self.cross_reference()
    }

    fn export(&self, name: &str, given: &[GivenName]) -> Option<Result<Exported, Vec<Diagnostic>>> {
        Some(super::export::export(&self.download, &self.loaded, &self.sources, name, given))
    }

    fn names_in_source(&self) -> Vec<GivenName> {
        self.names_in_source()
    }

    /// Q-variables are those of coordinate system 1, L-variables those that the download defines.
    fn expression(&self, text: &str) -> Result<Expression, Vec<Diagnostic>> {
        let parse = |compiled| {
            let sources = &mut SourceMap::new();
            parse_expression(text, Context { program: self, sources, system: 1, compiled })
        };
        // As in a PLC; where that is refused, as in a PLCC, which may use L-variables.
        parse(false).or_else(|found| parse(true).map_err(|_| found))
    }

    fn expression_code(&self, text: &str) -> Result<Option<ExpressionCode>, Vec<Diagnostic>> {
        let lower = |compiled| {
            let sources = &mut SourceMap::new();
            expression_code(text, Context { program: self, sources, system: 1, compiled })
        };
        lower(false).or_else(|found| lower(true).map_err(|_| found))
    }

    fn statement_interpreter(&self) -> Box<dyn StatementInterpreter> {
        Box::new(Interpreter::new(&self.download, &self.loaded, &self.sources))
    }

    fn statements(&self) -> Vec<Option<Span>> {
        let place = |stmt: &Stmt| match stmt.kind {
            StmtKind::Jump(_) => None,
            StmtKind::Assign(..)
            | StmtKind::If(..)
            | StmtKind::While(..)
            | StmtKind::EndWhile(_)
            | StmtKind::Plc(..)
            | StmtKind::Address(..)
            | StmtKind::AddressBy(..)
            | StmtKind::Text(..)
            | StmtKind::Define(_)
            | StmtKind::Word(..)
            | StmtKind::Save
            | StmtKind::Motion(..)
            | StmtKind::Loop(..) => Some(self.download.origins.place(stmt.at).0),
        };
        let tasks = tasks(&self.download, &self.loaded);
        tasks.iter().flat_map(|(_, code)| code.iter().map(place)).collect()
    }

    fn logic(&self, sources: &SourceMap) -> Vec<Option<Logic>> {
        self.contacts(sources)
    }

    /// Targets are numbers of statements in their task, which begins with the number of its first statement.
    fn ways(&self) -> Vec<Ways> {
        let mut all = vec![];
        for (_, code) in tasks(&self.download, &self.loaded) {
            let first = all.len() as u32;
            let end = code.len() as u32;
            // Behind its last statement a task ends.
            let to = |to: u32| if to < end { first + to } else { u32::MAX };
            all.extend((0..).zip(code).map(|(at, stmt)| match stmt.kind {
                StmtKind::If(_, otherwise) | StmtKind::While(_, otherwise) => {
                    Ways::to([to(at + 1), to(otherwise)])
                }
                StmtKind::Jump(target) | StmtKind::EndWhile(target) | StmtKind::Loop(target, _) => {
                    Ways::to([to(target)])
                }
                // Where GOTO and CALL go on is known only when they run.
                StmtKind::Motion(..)
                | StmtKind::Assign(..)
                | StmtKind::Plc(..)
                | StmtKind::Address(..)
                | StmtKind::AddressBy(..)
                | StmtKind::Text(..)
                | StmtKind::Define(_)
                | StmtKind::Word(..)
                | StmtKind::Save => Ways::to([to(at + 1)]),
            }));
        }
        all
    }

    fn interpreter(&self) -> Box<dyn Engine> {
        self.interpreter()
    }

    fn explain_arithmetic(&self) -> Option<Result<String, LowerError>> {
        Some(self.explain_arithmetic())
    }
}
