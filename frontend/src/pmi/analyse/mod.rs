//! Makes a checked program of the statements: first the specification section, then all names that
//! the execution section declares, then the texts of faults and messages, then the execution
//! section.

pub(crate) mod cross_reference;
mod declaration;
pub(crate) mod execution_section;
pub(crate) mod expression;
pub(crate) mod lints;
pub(crate) mod lookup;
pub(crate) mod names;
mod numbers_of_other_languages;
mod other_languages;
pub(crate) mod ports;
pub(crate) mod small_letters;
mod specification_section;
mod words_of_other_languages;

use plcc_diag::{Diagnostic, FileId, MessageText, SourceMap};

use crate::common::{EXPLAINED_ERRORS, FileLoader, Options};
use crate::pmi::{
    analyse::{
        execution_section::ExecutionSection,
        lookup::resolve,
        names::Names,
        specification_section::{
            PendingAnnouncement, PendingItem, Section, SpecificationSection, array_in_text,
        },
    },
    ast::{Announcement, Checked, Item},
    read::{
        cursor::Cursor,
        diagnostic::{self, error},
        lexer::lex,
        statements::{self, Statement},
        token::Token,
    },
    reference::executive::Executive,
};

/// Reads and checks the program in `file`. The result is consistent only if no diagnostic is an
/// error.
pub(crate) fn check(
    sources: &mut SourceMap,
    file: FileId,
    loader: &dyn FileLoader,
    options: &Options,
) -> (Checked, Vec<Diagnostic>) {
    let mut diagnostics = vec![];
    let text = statements::read(sources, file, loader, options, &mut diagnostics);
    let mut checked = Checked::default();
    let mut names = Names::new(&Executive::new(&options.machine));
    let mut lexer = Lexer { sources, options, tokens: vec![] };

    let mut specification = SpecificationSection::new(&mut names, &mut checked, options.limits);
    let mut rest = text.statements.as_slice();
    while let [statement, tail @ ..] = rest {
        rest = tail;
        let mut cursor = lexer.cursor(*statement);
        // An error may be that of a directive, which begins another part of the section.
        let section = specification.section;
        if let Err(problem) = specification.statement(&mut cursor) {
            let section = section.or(Some(Section::End));
            let few = diagnostics.len() < EXPLAINED_ERRORS;
            let explained =
                if few { other_languages::explain(&cursor, section, problem) } else { problem };
            diagnostics.push(*explained);
        }
        if specification.section == Some(Section::End) {
            break;
        }
    }
    let ended = specification.section == Some(Section::End);
    let pending = std::mem::take(&mut specification.pending);
    diagnostics.append(&mut specification.warnings);
    // A file that ends in the middle of a statement has an error already.
    if !ended && diagnostics.iter().all(|diagnostic| diagnostic.code != "PMI-2") {
        let missing = error(2, text.last, "the file ends without $END");
        let mut ends = text.statements.iter().filter_map(|statement| {
            let cursor = lexer.cursor(*statement);
            let [word] = cursor.tokens else { return None };
            (cursor.slice(*word) == "END").then(|| cursor.span_of(*word))
        });
        diagnostics.push(match ends.next() {
            Some(end) => missing.label(end, "this END has no `$`").help("write $END there"),
            None => missing.help("put $END between the declarations and the logic"),
        });
    }

    for statement in rest {
        execution_section::declare(&mut names, &mut lexer.cursor(*statement));
    }
    announcements(pending, &mut names, &mut checked, &mut diagnostics);
    let mut execution = ExecutionSection::new(&mut names, &mut checked, options.limits);
    for statement in rest {
        let mut cursor = lexer.cursor(*statement);
        if let Err(problem) = execution.statement(&mut cursor) {
            let few = diagnostics.len() < EXPLAINED_ERRORS;
            let explained =
                if few { other_languages::explain(&cursor, None, problem) } else { problem };
            diagnostics.push(*explained);
        }
    }
    execution.finish(&mut diagnostics);
    checked.symbols = names.into_symbols();
    for step in &mut checked.steps {
        step.line = sources.line(step.span.file, step.span.start);
    }
    for diagnostic in diagnostics.iter_mut().filter(|d| d.is_error() && d.help.is_none()) {
        diagnostic.help = diagnostic::default_help(diagnostic.code).map(MessageText::from);
    }
    diagnostics.sort_by_key(|diagnostic| (diagnostic.span.file, diagnostic.span.start));
    small_letters::tell_small_letters_once(file, sources.text(file), &mut diagnostics);
    (checked, diagnostics)
}

/// Cuts one statement after the other into tokens.
struct Lexer<'a> {
    sources: &'a SourceMap,
    options: &'a Options,
    tokens: Vec<Token>,
}

impl Lexer<'_> {
    fn cursor(&mut self, statement: Statement) -> Cursor<'_> {
        let text = self.sources.text(statement.file);
        self.tokens.clear();
        let Statement { start, end, .. } = statement;
        lex(text, start, end, self.options.limits, &mut self.tokens);
        Cursor::new(text, &self.tokens, statement)
    }
}

/// Looks up the variables in the texts of faults and messages. All are declared by now.
fn announcements(
    pending: Vec<PendingAnnouncement>,
    names: &mut Names,
    checked: &mut Checked,
    diagnostics: &mut Vec<Diagnostic>,
) {
    for PendingAnnouncement { symbol, fault, items } in pending {
        let mut found = Ok(vec![]);
        for item in items {
            let Ok(list) = &mut found else { break };
            match item {
                PendingItem::Text(text) => list.push(Item::Text(text)),
                PendingItem::Name(name, span) => match variable_in_text(names, &name, span) {
                    Ok(Some(id)) => list.push(Item::Value(id)),
                    Ok(None) => {}
                    Err(problem) => found = Err(problem),
                },
            }
        }
        match found {
            Ok(items) => {
                let list = if fault { &mut checked.faults } else { &mut checked.messages };
                list.push(Announcement { symbol, items });
            }
            Err(problem) => diagnostics.push(*problem),
        }
    }
}

/// The variable that a text names; `None` for a name from a declaration that has an error.
fn variable_in_text(
    names: &mut Names,
    name: &str,
    span: plcc_diag::Span,
) -> Result<Option<crate::pmi::ast::SymbolId>, Box<Diagnostic>> {
    let array = names.find(name).and_then(|id| names.get(id)).is_some_and(|s| s.elements.is_some());
    if array { Err(Box::new(array_in_text(span))) } else { resolve(names, name, span, false) }
}
