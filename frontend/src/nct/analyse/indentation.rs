//! Where the indentation of a text says that a condition has ended, and its `Z` has not come.
//!
//! Indentation means nothing to the control. It shows, though, where the programmer took a condition for closed: after
//! statements that stand further in than the condition's line, one that does not.

use plcc_diag::Span;

use crate::nct::ast::{Op, Stmt};

/// The distance of tab stops.
const TAB: usize = 8;

/// A condition whose `Z` is perhaps lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Left {
    /// The index of the condition's statement.
    pub(super) condition: usize,
    /// The index of the statement that stands no further in than the condition.
    pub(super) statement: usize,
}

/// A condition whose `Z` has not come yet.
struct Open {
    stmt: usize,
    /// How far its line is indented; `None` if something stands before it in its line.
    indent: Option<usize>,
    /// Whether a statement after it stood further in.
    has_inner: bool,
    is_told: bool,
}

/// The conditions that their texts leave before their `Z` comes, in the order of the statements that do.
pub(super) fn left_conditions(text: &str, stmts: &[Stmt]) -> Vec<Left> {
    let mut open: Vec<Open> = vec![];
    let mut found = vec![];
    for (at, stmt) in stmts.iter().enumerate() {
        let indent = indentation(text, stmt.span);
        let is_mark = matches!(stmt.op, Op::EndIf | Op::Else { .. } | Op::Label(_) | Op::Text);
        if let Some(indent) = indent.filter(|_| !is_mark) {
            if let Some(top) = open.last_mut() {
                top.has_inner |= top.indent.is_some_and(|own| indent > own);
            }
            let leaves = |open: &&mut Open| {
                open.has_inner && !open.is_told && open.indent.is_some_and(|own| indent <= own)
            };
            if let Some(left) = open.iter_mut().rev().find(leaves) {
                left.is_told = true;
                found.push(Left { condition: left.stmt, statement: at });
            }
        }
        match stmt.op {
            Op::If { .. } => open.push(Open { stmt: at, indent, has_inner: false, is_told: false }),
            Op::EndIf => drop(open.pop()),
            _ => {}
        }
    }
    found
}

/// How far the line of a statement is indented; `None` if the statement is not the first of its line.
fn indentation(text: &str, span: Span) -> Option<usize> {
    let before = text.get(..span.start as usize)?;
    let before = before.get(before.rfind(['\r', '\n']).map_or(0, |at| at + 1)..)?;
    let mut column = 0;
    for c in before.chars() {
        column = match c {
            ' ' => column + 1,
            '\t' => (column / TAB + 1) * TAB,
            _ => return None,
        };
    }
    Some(column)
}
