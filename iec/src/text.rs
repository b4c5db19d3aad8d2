//! Structured Text (IEC 61131-3, part 3.3), as one file that a compiler takes as it is.

use std::fmt::Write;

use crate::project::{Function, Kind, Project, Type, Variable};

/// How many columns a step of indentation has.
const INDENT: &str = "  ";

/// A comment. What would end or nest it is taken apart.
pub fn comment(text: &str) -> String {
    format!("(* {} *)", one_line(text))
}

/// The text of a comment, in one line.
pub(crate) fn one_line(text: &str) -> String {
    let mut text = text.replace(['\n', '\r', '\t'], " ");
    for (pair, apart) in [("*)", "* )"), ("(*", "( *")] {
        while text.contains(pair) {
            text = text.replace(pair, apart);
        }
    }
    let printable: String = text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    printable.trim().to_owned()
}

/// The type of a variable as it is declared.
fn declared_type(variable: &Variable) -> String {
    match variable.elements {
        None => variable.ty.name().to_owned(),
        Some(count) => {
            format!("ARRAY [0..{}] OF {}", count.saturating_sub(1), variable.ty.name())
        }
    }
}

/// The first value, with `:=` in front.
fn initial(variable: &Variable) -> String {
    match (&variable.initial[..], variable.elements) {
        ([], _) => String::new(),
        ([value, ..], None) => format!(" := {value}"),
        (values, Some(_)) => format!(" := [{}]", values.join(", ")),
    }
}

fn declaration(out: &mut String, variable: &Variable) {
    let Variable { name, address, comment: about, .. } = variable;
    let address = address.as_ref().map(|place| format!(" AT {place}")).unwrap_or_default();
    let ty = declared_type(variable);
    let _ = write!(out, "{INDENT}{INDENT}{name}{address} : {ty}{};", initial(variable));
    if !about.is_empty() {
        let _ = write!(out, " {}", comment(about));
    }
    out.push('\n');
}

/// The word that begins a list of declarations.
fn list_of(kind: Kind) -> &'static str {
    match kind {
        Kind::Input => "VAR_INPUT",
        Kind::Local => "VAR",
        Kind::Retained => "VAR RETAIN",
        Kind::Constant => "VAR CONSTANT",
    }
}

fn declarations(out: &mut String, variables: &[Variable]) {
    // Compilers want variables with an address in lists of their own.
    for kind in [Kind::Input, Kind::Local, Kind::Retained, Kind::Constant] {
        for located in [true, false] {
            let mut list = variables
                .iter()
                .filter(|it| it.kind == kind && it.address.is_some() == located)
                .peekable();
            if list.peek().is_some() {
                let _ = writeln!(out, "{INDENT}{}", list_of(kind));
                list.for_each(|variable| declaration(out, variable));
                let _ = writeln!(out, "{INDENT}END_VAR");
            }
        }
    }
}

fn function(out: &mut String, function: &Function) {
    let Function { name, returns, inputs, locals, comment: about, body, needs: _ } = function;
    let _ = writeln!(out, "{}\nFUNCTION {name} : {}", comment(about), returns.name());
    for (list, variables) in [("VAR_INPUT", inputs), ("VAR", locals)] {
        if variables.is_empty() {
            continue;
        }
        let _ = writeln!(out, "{INDENT}{list}");
        for (name, ty) in *variables {
            let _ = writeln!(out, "{INDENT}{INDENT}{name} : {};", Type::name(*ty));
        }
        let _ = writeln!(out, "{INDENT}END_VAR");
    }
    body.iter().for_each(|line| {
        let _ = writeln!(out, "{INDENT}{line}");
    });
    out.push_str("END_FUNCTION\n\n");
}

/// The interval of a task as a literal of TIME.
pub(crate) fn interval(project: &Project) -> String {
    match project.interval_us {
        us if us.is_multiple_of(1000) => format!("T#{}ms", us / 1000),
        us => format!("T#{}.{:03}ms", us / 1000, us % 1000),
    }
}

/// A project as one text: its functions, the program, and a configuration that calls it in its time.
pub fn structured_text(project: &Project) -> String {
    let mut out = String::new();
    for line in &project.comments {
        let _ = writeln!(out, "{}", comment(line));
    }
    out.push('\n');
    project.functions().into_iter().for_each(|it| function(&mut out, it));
    let name = &project.name;
    let _ = writeln!(out, "PROGRAM {name}");
    declarations(&mut out, &project.variables);
    for line in &project.body {
        let _ = writeln!(out, "{INDENT}{line}");
    }
    let time = interval(project);
    let _ = write!(
        out,
        "END_PROGRAM\n\nCONFIGURATION PLANT\n  RESOURCE CONTROL ON PLC\n    TASK SCAN(INTERVAL := {time}, PRIORITY := 1);\n    \
         PROGRAM MAIN WITH SCAN : {name};\n  END_RESOURCE\nEND_CONFIGURATION\n"
    );
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_comment_ends_where_it_should() {
        for (text, expected) in [
            ("door closed", "(* door closed *)"),
            ("a *) b (* c", "(* a * ) b ( * c *)"),
            ("**)\n(**", "(* ** ) ( ** *)"),
            ("(*)", "(* ( * ) *)"),
        ] {
            assert_eq!(comment(text), expected);
        }
    }
}
