//! A hash of a PLC's statements, by which an online change knows a PLC that has stayed the same.
//!
//! It is made of everything that a statement does, also of what the statement names by a number: the
//! operations of its expressions, its texts, the statements of its COMMANDs. The numbers themselves, which
//! count over the whole download, are left out, and so are the definitions of M- and L-variables, which are
//! no part of the PLC. So it does not change with other PLCs.

use std::fmt::{self, Write};
use std::hash::Hasher;

use plcc_abi::Fnv;
use plcc_abi::pmac::{CommandStep, Text};

use super::ast::{Download, Expr, Stmt, StmtKind, Target};

/// The hash of these statements of a download.
pub(crate) fn fingerprint(download: &Download, code: &[Stmt]) -> u64 {
    let mut hash = Fnv::default();
    // Writing to a hash does not fail.
    let _ = write_statements(download, code, &mut hash);
    hash.finish()
}

fn write_statements(download: &Download, code: &[Stmt], hash: &mut Fnv) -> fmt::Result {
    let mut tasks = Vec::new();
    for stmt in code {
        write_statement(download, stmt, hash, &mut tasks)?;
        for task in tasks.drain(..) {
            // A COMMAND holds no COMMAND.
            let code = download.commands.get(task as usize).map_or(&[][..], Vec::as_slice);
            for stmt in code {
                write_statement(download, stmt, hash, &mut Vec::new())?;
            }
        }
    }
    Ok(())
}

/// Writes what a statement does. Appends to `tasks` the indices of the statements that it has executed.
fn write_statement(
    download: &Download,
    stmt: &Stmt,
    hash: &mut Fnv,
    tasks: &mut Vec<u32>,
) -> fmt::Result {
    let ops = |expr: Expr| download.ops(expr);
    write!(hash, "{} ", stmt.integer)?;
    match stmt.kind {
        StmtKind::Assign(Target::Indirect(kind, number), value) => {
            write!(hash, "assign {kind:?} {:?} {:?};", ops(number), ops(value))
        }
        StmtKind::Assign(target, value) => write!(hash, "assign {target:?} {:?};", ops(value)),
        StmtKind::If(condition, to) => write!(hash, "if {:?} {to};", ops(condition)),
        StmtKind::While(condition, to) => write!(hash, "while {:?} {to};", ops(condition)),
        StmtKind::AddressBy(motor, system) => {
            write!(hash, "address {:?} {:?};", ops(motor), ops(system))
        }
        StmtKind::Text(index, value) => {
            write!(hash, "text {:?} ", value.map(ops))?;
            match download.texts.get(index as usize) {
                Some(Text::Command { text, error, steps }) => {
                    tasks.extend(steps.iter().filter_map(|step| match step {
                        CommandStep::Task(task) => Some(*task),
                        CommandStep::Motion(_) => None,
                    }));
                    write!(hash, "{text:?} {error:?};")
                }
                text => write!(hash, "{text:?};"),
            }
        }
        StmtKind::Define(index) => {
            write!(hash, "define {:?};", download.defines.get(index as usize))
        }
        StmtKind::Word(space, address, value) => {
            write!(hash, "word {space:?} {address} {:?};", ops(value))
        }
        StmtKind::Motion(index, _) => {
            let Some(motion) = download.motion.get(index as usize) else { return Ok(()) };
            let values: Vec<_> = motion.values.iter().map(|value| ops(*value)).collect();
            write!(hash, "motion {:?} {values:?};", motion.kind)
        }
        StmtKind::Loop(head, _) => write!(hash, "loop {head};"),
        kind @ (StmtKind::Jump(_)
        | StmtKind::EndWhile(_)
        | StmtKind::Plc(..)
        | StmtKind::Address(..)
        | StmtKind::Save) => write!(hash, "{kind:?};"),
    }
}
