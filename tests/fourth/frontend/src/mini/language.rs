//! MINI as one of the languages.

use std::sync::Arc;

use plcc_abi::mini::Kind;
use plcc_abi::{Dialect, Engine, Tables};
use plcc_diag::{Diagnostic, FileId, SourceMap, Span};

use super::ast::{Action, Operand, Term};
use super::oracle::Interpreter;
use super::{Program, expression, lower, read};
use crate::common::{
    Controller, CrossReference, CrossReferenceBuilder, Expression, FileLoader, LowerError, Lowered,
    NumberFormat, Options, StatementInterpreter, Use, Ways, Words,
};
use crate::language::{CheckedProgram, Language, LengthCodes, RestOfCheck, Titles, Topic};

/// The language.
#[derive(Clone, Copy, Debug)]
pub struct Mini;

/// The words of the language, and what they mean.
pub(super) const WORDS: &[(&str, &str)] = &[
    ("INPUT", "declares a bit that the machine gives"),
    ("OUTPUT", "declares a bit that the machine takes"),
    ("NUMBER", "declares a number"),
    ("COUNT", "adds 1 to a number"),
    ("IF", "the statements up to END are executed if the expression is not 0"),
    ("END", "ends an IF"),
];

impl Language for Mini {
    fn dialect(&self) -> Dialect {
        Dialect::Mini
    }

    fn title(&self) -> &'static str {
        "MINI"
    }

    fn vendor(&self) -> &'static str {
        "the tests of plcc"
    }

    fn file_extensions(&self) -> &'static [&'static str] {
        &["mini"]
    }

    fn has_marks(&self, _: &str) -> bool {
        false
    }

    fn comment_signs(&self) -> &'static [&'static str] {
        &[";"]
    }

    fn length_codes(&self) -> LengthCodes {
        LengthCodes { instructions: "MINI-X1", machine_code: "MINI-X2" }
    }

    fn check(
        &self,
        sources: &mut SourceMap,
        files: &[FileId],
        _: &dyn FileLoader,
        _: &Options,
    ) -> (Option<Box<dyn CheckedProgram>>, Vec<Diagnostic>) {
        let file = files.first().copied().unwrap_or(FileId(0));
        let (code, found) = read::read(sources, file);
        let program = Program { code: Arc::new(code), sources: sources.clone() };
        (found.is_empty().then(|| Box::new(program) as _), found)
    }

    fn words_and_rest(
        &self,
        sources: &mut SourceMap,
        files: &[FileId],
        loader: &dyn FileLoader,
        options: &Options,
    ) -> (Words, RestOfCheck) {
        let words = super::words::words(sources, files.first().copied().unwrap_or(FileId(0)));
        let (program, found) = self.check(sources, files, loader, options);
        (words, Box::new(|_| (program, found)))
    }

    fn snippets(&self) -> &'static [(&'static str, &'static str, &'static str)] {
        &[("IF", "IF ${1:CONDITION}\n\t$0\nEND", "the statements up to END run if the condition is not 0")]
    }

    fn both_on(&self, a: &str, b: &str) -> String {
        format!("{a} * {b}")
    }

    fn explain(&self, name: &str, _: Option<Controller>) -> Option<String> {
        let (word, meaning) = WORDS.iter().find(|(word, _)| word.eq_ignore_ascii_case(name))?;
        Some(format!("{word}: {meaning}\n"))
    }

    fn topics(&self) -> Vec<Topic> {
        let topic = |(word, meaning): &(&str, &str)| Topic {
            name: (*word).into(),
            meaning: (*meaning).into(),
        };
        WORDS.iter().map(topic).collect()
    }

    fn numbers(&self) -> NumberFormat {
        NumberFormat { prefix: "0x", suffix: "", widths: &[32], both_beside: false }
    }

    fn scans_go_on(&self) -> bool {
        false
    }

    fn classes(&self) -> &'static [&'static str] {
        &["Inputs", "Outputs", "Numbers"]
    }

    fn titles<'t>(&self, tables: &'t Tables) -> Titles<'t> {
        Box::new(move |name| {
            let Tables::Mini(tables) = tables else { return "Numbers" };
            match tables.symbols.iter().find(|symbol| symbol.name == name).map(|one| one.kind) {
                Some(Kind::Input) => "Inputs",
                Some(Kind::Output) => "Outputs",
                Some(Kind::Number) | None => "Numbers",
            }
        })
    }
}

impl CheckedProgram for Program {
    fn dialect(&self) -> Dialect {
        Dialect::Mini
    }

    fn lower(&self) -> Result<Lowered, LowerError> {
        lower::lower(self)
    }

    fn interpreter(&self) -> Box<dyn Engine> {
        Box::new(Interpreter { code: Arc::clone(&self.code) })
    }

    fn statement_interpreter(&self) -> Box<dyn StatementInterpreter> {
        Box::new(Interpreter { code: Arc::clone(&self.code) })
    }

    fn statements(&self) -> Vec<Option<Span>> {
        let place = |step: &super::ast::Step| match step.action {
            Action::End => None,
            Action::Assign { .. } | Action::If { .. } => Some(step.span),
        };
        self.code.steps.iter().map(place).collect()
    }

    fn ways(&self) -> Vec<Ways> {
        let ways = |(at, step): (u32, &super::ast::Step)| match step.action {
            Action::If { otherwise, .. } => Ways::to([at + 1, otherwise as u32]),
            Action::Assign { .. } | Action::End => Ways::to([at + 1]),
        };
        (0..).zip(&self.code.steps).map(ways).collect()
    }

    fn expression(&self, text: &str) -> Result<Expression, Vec<Diagnostic>> {
        expression::expression(self, text)
    }

    fn cross_reference(&self) -> CrossReference {
        let mut builder = CrossReferenceBuilder::default();
        let mut add = |index: usize, step: &super::ast::Step, used: Use| {
            if let Some(symbol) = self.code.symbol(index) {
                builder.add(&symbol.name, &self.sources, step.span.file, step.line, used);
            }
        };
        for step in &self.code.steps {
            let (terms, used): (&[Term], _) = match &step.action {
                Action::Assign { to, value } => {
                    add(*to, step, Use::Written);
                    (value, Use::Read)
                }
                Action::If { condition, .. } => (condition, Use::Tested),
                Action::End => continue,
            };
            for term in terms {
                if let Operand::Variable(index) = term.operand {
                    add(index, step, used);
                }
            }
        }
        builder.finish(|_| None)
    }
}
