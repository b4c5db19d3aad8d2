//! Which statements a module can reach, for online changes: [`ReachableCode`].
//!
//! A module is more than the statements from its label to its `J`: it calls subroutines and jumps to
//! labels that are elsewhere, and shares them with other modules. So the statements are collected along
//! all branches. Numbers that count over the whole program are left out of the hash or replaced, so that
//! another module's change does not alter it.

use std::fmt::Write;
use std::hash::Hasher;

use plcc_abi::Fnv;
use plcc_abi::nct::ReachableCode;

use super::ast::{Op, Program};

/// The code that each module can reach, in the order of the tasks.
pub(super) fn reachable(program: &Program) -> Vec<ReachableCode> {
    let points = program.resume_points();
    program.modules().map(|(_, entry)| code(program, &points, entry)).collect()
}

/// The code that is reached from a statement on. `points` are the program's resume points.
fn code(program: &Program, points: &[usize], entry: usize) -> ReachableCode {
    let statements = statements_from(program, entry);
    // The number of a statement that is reached, or would have stood there.
    let number = |at: usize| statements.partition_point(|&other| other < at) as u32;
    let mut hash = Fnv::default();
    for &at in &statements {
        let Some(stmt) = program.stmts.get(at) else { continue };
        // What is hashed is the text that `Debug` writes, so the names of the fields and variants of
        // `Op` must stay: artifacts of earlier versions have been made with them. Writing to a hash
        // does not fail.
        let _ = match stmt.op {
            Op::If { first, count, otherwise } => {
                let range = first as usize..(first as usize).saturating_add(count as usize);
                let parts = program.condition_parts.get(range).unwrap_or_default();
                write!(hash, "If {parts:?} {};", number(otherwise as usize))
            }
            Op::Else { end } => write!(hash, "Else {};", number(end as usize)),
            op => write!(hash, "{op:?};"),
        };
    }
    let calls = (0u32..).zip(program.calls());
    let calls = calls.filter(|(_, at)| statements.binary_search(at).is_ok());
    ReachableCode {
        fingerprint: hash.finish(),
        resume_points: points
            .iter()
            .map(|point| Some(statements.binary_search(point).ok()? as u32))
            .collect(),
        calls: calls.map(|(call, _)| call).collect(),
    }
}

/// The indices of the statements that can be reached from one of them, in the source's order.
fn statements_from(program: &Program, entry: usize) -> Vec<usize> {
    let mut is_reached = vec![false; program.stmts.len()];
    let mut open = vec![entry];
    while let Some(at) = open.pop() {
        let (Some(stmt), Some(reached)) = (program.stmts.get(at), is_reached.get_mut(at)) else {
            continue;
        };
        if std::mem::replace(reached, true) {
            continue;
        }
        let next = at + 1;
        match stmt.op {
            Op::If { otherwise, .. } => {
                open.extend([next, otherwise as usize, otherwise as usize + 1])
            }
            Op::Else { end } => open.extend([end as usize, end as usize + 1]),
            Op::Goto(label) => open.extend(program.target(label)),
            Op::GotoIndirect(_) => open.extend(program.indirect_targets()),
            Op::Call(label) => open.extend(program.target(label).into_iter().chain([next])),
            Op::CallIndirect(_) => open.extend(program.indirect_targets().chain([next])),
            Op::Return | Op::End(_) => {}
            Op::Set(_)
            | Op::Clear(_)
            | Op::Count { .. }
            | Op::Load(_)
            | Op::Store { .. }
            | Op::Arith { .. }
            | Op::Update { .. }
            | Op::Shift { .. }
            | Op::Bin
            | Op::Bcd
            | Op::Push(_)
            | Op::Apply { .. }
            | Op::EndIf
            | Op::Label(_)
            | Op::Area { .. }
            | Op::Text
            | Op::Bad { .. } => open.push(next),
        }
    }
    is_reached.iter().enumerate().filter(|(_, reached)| **reached).map(|(at, _)| at).collect()
}

#[cfg(test)]
mod tests {
    use plcc_abi::Tables;
    use plcc_diag::SourceMap;

    use crate::common::{MemoryLoader, Options};

    /// An artifact of an earlier version has the same fingerprints, so that a module goes on in an
    /// online change where its code is the same.
    #[test]
    fn a_fingerprint_stays_the_same_from_version_to_version() {
        let text = b":000\n(I001 A NI002) U012 E LF020 + LQ05 SY40 Z\nJ0\n:001\nJ1\n:002\nJ2\n";
        let mut sources = SourceMap::new();
        let file = sources.add("a.nct", text);
        let (program, found) =
            crate::nct::check(&mut sources, file, &MemoryLoader::new(), &Options::default());
        let program = program.unwrap_or_else(|| panic!("{found:?}")).lower().unwrap().program;
        let Tables::Nct(tables) = program.tables else { panic!("tables of another language") };
        let all: Vec<u64> = tables.reachable.iter().map(|code| code.fingerprint).collect();
        assert_eq!(all, [2331751197843469025, 8336693819634462048, 15106185916368813050]);
    }
}
