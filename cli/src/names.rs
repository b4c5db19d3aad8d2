//! What people call a program's variables and say of them: the table `[names]` of the machine file, and what the source says.

use plcc_abi::GivenName;
use plcc_abi::machine::MachineName;
use plcc_frontend::common::Machine;
use plcc_frontend::{CheckedProgram, language};

/// All of it for a checked program. What the machine file says stands before what the source says, since the first one counts.
pub(crate) fn given(program: &dyn CheckedProgram, machine: &Machine) -> Vec<GivenName> {
    let own = machine.names.iter().filter_map(|MachineName { given, .. }| {
        let name = program.canonical(&given.name)?;
        Some(GivenName { name, ..given.clone() })
    });
    own.chain(program.names_in_source()).collect()
}

/// Whether the entries of `[names]` are for variables of the program, and their aliases are not names that mean something
/// already.
///
/// # Errors
/// What is wrong with the first entry that is not, with its line in the machine file.
pub(crate) fn check(program: &dyn CheckedProgram, machine: &Machine) -> Result<(), String> {
    let mut seen: Vec<(String, usize)> = vec![];
    for MachineName { line, given: GivenName { name, alias, .. } } in &machine.names {
        let Some(canonical) = program.canonical(name) else {
            let known = program.cross_reference().rows.into_iter().map(|row| row.name);
            let known: Vec<String> = known.collect();
            let near = plcc_abi::closest(name, known.iter().map(String::as_str));
            let near = near.map(|near| format!("; did you mean `{near}`?")).unwrap_or_default();
            return Err(format!(
                "line {line}: [names]: the program has no variable named `{name}`{near}"
            ));
        };
        if let Some((_, first)) = seen.iter().find(|(known, _)| *known == canonical) {
            return Err(format!(
                "line {line}: [names]: {canonical} is there twice, first in line {first}"
            ));
        }
        seen.push((canonical, *line));
        let language = language(program.dialect());
        let what = if program.has_name(alias) {
            "already the name of a variable"
        } else if language.has_word(alias) {
            "a word of the language"
        } else {
            continue;
        };
        return Err(format!(
            "line {line}: [names]: `{alias}` can't be an alias of {name}: it is {what}; choose another one"
        ));
    }
    Ok(())
}
