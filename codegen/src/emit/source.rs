//! The source's statements as comments.

use std::fmt::Write as _;

use plcc_ir::{FuncData, Module};

/// Longer statements are cut in comments, in characters.
const WIDTH: usize = 100;

/// `; lathe.pmi:12  A = B & C` for a statement's number.
pub(super) fn comment(module: &Module, loc: u32) -> Option<String> {
    let statement = module.statements.get(loc as usize)?;
    let name = module.files.get(statement.file as usize).map_or("?", |file| file.name.as_str());
    let text = module.statement_text(statement);
    let mut out = format!("; {name}:{}", statement.line);
    if !text.is_empty() {
        out.push_str("  ");
        out.extend(text.chars().take(WIDTH).map(|c| if c.is_control() { ' ' } else { c }));
        out.push_str(if text.chars().nth(WIDTH).is_some() { "…" } else { "" });
    }
    Some(out)
}

/// ` ; labels L0 L4` for a function that can be entered there, with the tasks that start there.
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
