//! Finds the symbol that a name in an expression or assignment stands for, and explains why there
//! is none.

use plcc_diag::{Diagnostic, Span};

use crate::pmi::{
    analyse::names::Names,
    ast::{Meaning, SymbolId},
    read::diagnostic::error,
    reference::executive::{Family, families},
};

/// The symbol of a variable in an expression or on the left of an assignment; `indexed` says
/// whether a `[` follows it. `None` if the name comes from a declaration that has an error.
///
/// # Errors
/// A name that does not exist or is a label, an array without an index, and an index after a name
/// that is not an array.
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
        (true, None) => error(35, span, format!("{name} is not an array"))
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

/// The error of a name that does not exist, or is a label that is declared at `label`.
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
        return problem.help(format!("declare the code after {directive}: {name}/P or {name}/D"));
    }
    if let Some(family) = family_of(name) {
        return problem.help(format!("there are {} to {}", family.first, family.last));
    }
    if let Some(near) = names.suggest(name, false) {
        return problem.did_you_mean(near);
    }
    problem.help(match (indexed, name.starts_with('@')) {
        (_, true) => "the manual's 3.4 lists the executive's variables; a machine file adds others",
        (true, _) => "declare it after $LOGICAL, $INTEGER or $LONG with its number of elements",
        (false, _) => "declare it, or assign it somewhere, which makes it a LOGICAL",
    })
}

/// The family of executive variables to which a name would belong if its number were in range:
/// `@CP100` to `@CP115` for `@CP116`.
fn family_of(name: &str) -> Option<&'static Family> {
    let letters = |name: &'static str| name.trim_end_matches(|c: char| c.is_ascii_digit());
    families().iter().filter(|family| family.first != family.last).find(|family| {
        let number = name.strip_prefix(letters(family.first)).unwrap_or("");
        !number.is_empty() && number.bytes().all(|b| b.is_ascii_digit())
    })
}
