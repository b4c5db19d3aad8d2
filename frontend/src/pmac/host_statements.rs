//! The statements that general code can have executed by the host: assignments to one variable and
//! conditions, in PLCs, that name an M-variable. They are numbered in the order of the tasks, then of
//! the statements.

use plcc_abi::pmac::{Kind, Statement};

use super::analyse::assumptions::for_each_named_m;
use super::ast::{Download, Expr, Stmt, StmtKind, Target};
use super::tasks::TaskKind;

/// What the host executes of a statement: the variable that is assigned to, `None` for a condition, and
/// the value. `None` if the host does not execute the statement.
fn parts(download: &Download, stmt: &Stmt) -> Option<(Option<(Kind, u16)>, Expr)> {
    let parts = match stmt.kind {
        _ if stmt.integer => return None,
        StmtKind::Assign(Target::Var(kind, number), value) => (Some((kind, number)), value),
        StmtKind::If(condition, _) | StmtKind::While(condition, _) => (None, condition),
        StmtKind::Assign(..)
        | StmtKind::Jump(_)
        | StmtKind::EndWhile(_)
        | StmtKind::Plc(..)
        | StmtKind::Address(..)
        | StmtKind::AddressBy(..)
        | StmtKind::Text(..)
        | StmtKind::Define(_)
        | StmtKind::Word(..)
        | StmtKind::Save
        | StmtKind::Motion(..)
        | StmtKind::Loop(..) => return None,
    };
    let mut names_m = false;
    for_each_named_m(download, std::slice::from_ref(stmt), &mut |_| names_m = true);
    names_m.then_some(parts)
}

/// The statements of all tasks that the host executes, by their numbers.
pub(crate) fn table(download: &Download, tasks: &[(TaskKind, &[Stmt])]) -> Vec<Statement> {
    let plcs = tasks.iter().filter(|(kind, _)| matches!(kind, TaskKind::Plc { .. }));
    let all = plcs.flat_map(|(_, code)| code.iter());
    let statement = |(target, value)| Statement { target, value: download.ops(value).to_vec() };
    all.filter_map(|stmt| parts(download, stmt)).map(statement).collect()
}

/// For each statement of a task its number, `None` if the host does not execute it. `next` is the number
/// of the first one; after the call it is that of the next task's first one.
pub(crate) fn numbers(
    download: &Download,
    kind: TaskKind,
    code: &[Stmt],
    next: &mut u32,
) -> Vec<Option<u32>> {
    let mut number = |stmt| {
        parts(download, stmt)?;
        *next += 1;
        Some(*next - 1)
    };
    match kind {
        TaskKind::Plc { .. } => code.iter().map(&mut number).collect(),
        TaskKind::Command(_) | TaskKind::Motion(_) => vec![],
    }
}
