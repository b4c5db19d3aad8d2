//! Comments for listings: the source's statements, and the labels of functions.

use std::fmt::Write as _;

use plcc_abi::printable;
use plcc_ir::{FuncData, Module};

/// The longest text of a statement in a comment, in characters; a longer one is cut.
const WIDTH: usize = 100;

/// The comment for the statement with a number, such as `; lathe.pmi:12  A = B & C`; `None` if
/// there is no such statement.
pub(super) fn comment(module: &Module, loc: u32) -> Option<String> {
    let statement = module.statements.get(loc as usize)?;
    let name = module.files.get(statement.file as usize).map_or("?", |file| file.name.as_str());
    let text = module.statement_text(statement);
    let mut out = format!("; {name}:{}", statement.line);
    if !text.is_empty() {
        out.push_str("  ");
        out.extend(printable(text).chars().take(WIDTH).map(|c| if c == '\t' { ' ' } else { c }));
        out.push_str(if text.chars().nth(WIDTH).is_some() { "…" } else { "" });
    }
    Some(out)
}

/// The comment that says at which labels a function can be entered, and which tasks start there:
/// ` ; entered at L0=block0 (task scan) L4=block7`.
pub(super) fn entries(module: &Module, func: &FuncData) -> String {
    let mut out = String::from(" ; entered at");
    for (label, block) in func.entries() {
        let _ = write!(out, " {label}={block}");
        for task in module.tasks.iter().filter(|task| task.entry == label.0) {
            let _ = write!(out, " (task {})", task.name);
        }
    }
    out
}
