//! What a name stands for where it is used.

use plcc_diag::{Diagnostic, Span};

use crate::pmi::{
    analyse::names::Names,
    ast::{Meaning, SymbolId},
    read::diagnostic::error,
};

/// What a name stands for in an expression or as a target; nothing where an earlier error hides
/// it.
///
/// # Errors
/// A name that does not exist, is a label, or is an array without index or the reverse.
pub(crate) fn resolve(
    names: &mut Names,
    name: &str,
    span: Span,
    indexed: bool,
) -> Result<Option<SymbolId>, Box<Diagnostic>> {
    let found = names.find(name).and_then(|id| Some((id, names.get(id)?)));
    let (id, symbol) = match found {
        Some((id, symbol)) if !matches!(symbol.meaning, Meaning::Label(_)) => (id, symbol),
        label => {
            let label = label.and_then(|(_, symbol)| symbol.declared);
            return Err(Box::new(undefined(names, name, span, indexed, label)));
        }
    };
    if symbol.meaning == Meaning::Unknown {
        return Ok(None);
    }
    let problem = match (indexed, symbol.elements) {
        (true, None) => error(35, span, format!("{name} is no array"))
            .help("remove the brackets, or declare it with a number of elements"),
        (false, Some(count)) => error(36, span, format!("{name} is an array"))
            .help(format!("name one of its elements, {name}[0] to {name}[{}]", count.max(1) - 1)),
        _ => {
            names.mark_named(id);
            return Ok(Some(id));
        }
    };
    let problem = match symbol.declared {
        Some(at) => problem.label(at, "it is declared here"),
        None => problem,
    };
    Err(Box::new(problem))
}

fn undefined(
    names: &mut Names,
    name: &str,
    span: Span,
    indexed: bool,
    label: Option<Span>,
) -> Diagnostic {
    let problem = if indexed {
        error(29, span, format!("no array is named {name}"))
    } else {
        error(31, span, format!("nothing is named {name}"))
    };
    if let Some(label) = label {
        return problem.label(label, "this is a label, not a variable");
    }
    let code = name.strip_prefix('@').filter(|rest| {
        rest.len() > 2
            && rest.starts_with(['M', 'G'])
            && rest.bytes().skip(1).all(|b| b.is_ascii_digit())
    });
    if let Some(code) = code {
        let directive = if code.starts_with('M') { "$MCODE" } else { "$GCODE" };
        return problem.help(format!("declare the code behind {directive}: {name}/P or {name}/D"));
    }
    if let Some(near) = names.suggest(name, false) {
        return problem.help(format!("did you mean {near}?"));
    }
    problem.help(match (indexed, name.starts_with('@')) {
        (_, true) => "the manual's 3.4 lists the executive's variables; a machine file adds others",
        (true, _) => "declare it behind $LOGICAL, $INTEGER or $LONG with its number of elements",
        (false, _) => "declare it, or assign it somewhere, which makes it a LOGICAL",
    })
}
