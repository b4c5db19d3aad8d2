//! Checks the statements that `read` makes of the text, and makes a checked program of them: first the specification section, then all names that
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

use plcc_diag::{Diagnostic, FileId, MessageText, SourceMap, Span};

use crate::common::{EXPLAINED_ERRORS, FileLoader, Options};
use crate::pmi::{
    analyse::{
        execution_section::ExecutionSection,
        lookup::resolve,
        names::Names,
        specification_section::{PendingAnnouncement, PendingItem, SpecificationSection},
    },
    ast::{Announcement, Checked, Item},
    read::{
        self,
        cursor::Cursor,
        declaration::array_in_text,
        diagnostic::{self, error},
        section::Section,
        syntax::{Form, Text},
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
) -> (Checked, Text, Vec<Diagnostic>) {
    let mut diagnostics = vec![];
    let mut text = read::read(sources, file, loader, options, &mut diagnostics);
    let Text { statements, tokens, parts, has_end, last } = &mut text;
    let (has_end, last) = (*has_end, *last);
    let mut checked = Checked::default();
    let mut names = Names::new(&Executive::of(&options.machine));

    let mut first_of_logic = None;
    let mut specification = SpecificationSection::new(&mut names, &mut checked, options.limits);
    for statement in &mut *statements {
        let cursor = statement.cursor(sources, tokens);
        let Form::Declaration(declaration) = &mut statement.form else { break };
        let error = statement.error.take();
        let looks_like_logic = !has_end && specification.looks_like_logic(&cursor);
        let result = specification.statement(&cursor, declaration, error);
        let is_end = matches!(cursor.tokens, [word] if cursor.slice(*word) == "END");
        if !has_end && (is_end || looks_like_logic && result.is_err()) {
            let first = cursor.tokens.first().map(|&token| cursor.span_of(token));
            first_of_logic = first_of_logic.or(first.map(|first| (first, is_end)));
        }
        if let Err(problem) = result {
            let section = declaration.section.or(Some(Section::End));
            diagnostics.push(*explain(&diagnostics, &cursor, section, problem));
        }
    }
    let pending = std::mem::take(&mut specification.pending);
    diagnostics.append(&mut specification.warnings);
    // A file that ends in the middle of a statement has an error already.
    if !has_end && diagnostics.iter().all(|diagnostic| diagnostic.code != "PMI-2") {
        without_end(&mut diagnostics, last, first_of_logic);
    }

    for statement in &*statements {
        if let Form::Logic(logic) = &statement.form {
            execution_section::declare(&mut names, &statement.cursor(sources, tokens), logic);
        }
    }
    announcements(pending, &mut names, &mut checked, &mut diagnostics);
    let mut execution = ExecutionSection::new(&mut names, &mut checked, parts, options.limits);
    for statement in &mut *statements {
        let cursor = statement.cursor(sources, tokens);
        let Form::Logic(logic) = &mut statement.form else { continue };
        if let Err(problem) = execution.statement(&cursor, logic, statement.error.take()) {
            diagnostics.push(*explain(&diagnostics, &cursor, None, problem));
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
    (checked, text, diagnostics)
}

/// Tells that there is no $END. What was found wrong from the first statement of the logic on, if there is one, only
/// comes of that. It may be an END without its `$`.
fn without_end(
    diagnostics: &mut Vec<Diagnostic>,
    last: Span,
    first_of_logic: Option<(Span, bool)>,
) {
    let missing = error(2, last, "the file ends without $END");
    let Some((first, is_end)) = first_of_logic else {
        diagnostics.push(missing.help("put $END between the declarations and the logic"));
        return;
    };
    diagnostics.retain(|earlier| {
        !earlier.is_error() || earlier.span.file != first.file || earlier.span.start < first.start
    });
    let (label, help) = if is_end {
        ("this END has no `$`", "write $END there")
    } else {
        let help = "write $END on a line of its own in front of the first statement";
        ("the logic seems to begin here", help)
    };
    diagnostics.push(missing.label(first, label).help(help));
}

/// An error with what was probably meant, if it is one of the first.
fn explain(
    earlier: &[Diagnostic],
    cursor: &Cursor<'_>,
    section: Option<Section>,
    problem: Box<Diagnostic>,
) -> Box<Diagnostic> {
    if earlier.len() < EXPLAINED_ERRORS {
        other_languages::explain(cursor, section, problem)
    } else {
        problem
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
