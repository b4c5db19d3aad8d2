//! What can't be written in IEC 61131-3.

use plcc_abi::pmac::Kind;
use plcc_diag::Diagnostic;

use super::words::field_of;
use crate::pmac::analyse::load::Loaded;
use crate::pmac::ast::{Download, Func, Op, Stmt, StmtKind, Target};
use crate::pmac::tasks::{TaskKind, tasks};

/// An error for each statement that can't be written.
pub(super) fn all(download: &Download, loaded: &Loaded) -> Vec<Diagnostic> {
    let tasks = tasks(download, loaded);
    let plcs = tasks.iter().filter(|(kind, _)| matches!(kind, TaskKind::Plc { .. }));
    let refused = |stmt: &Stmt| {
        let what = why(download, loaded, stmt)?;
        let (span, _) = download.origins.place(stmt.at);
        let text = format!("{what}, which is not written in IEC 61131-3");
        let help = "leave it out of the text that is exported, and write the new program for this place by hand";
        Some(Diagnostic::error("PMAC-X10", span, text).help(help))
    };
    plcs.flat_map(|(_, code)| code.iter()).filter_map(refused).collect()
}

/// Motion programs, which are not written.
pub(super) fn notes(download: &Download) -> Vec<Diagnostic> {
    let note = |buffer: &crate::pmac::ast::Buffer| {
        let (span, _) = download.origins.place(buffer.opened?);
        let text = "a motion program is not written in IEC 61131-3";
        Some(Diagnostic::standalone_note("PMAC-X10", span, text))
    };
    download.progs.values().filter_map(note).collect()
}

/// Why a statement can't be written; `None` if it can.
fn why(download: &Download, loaded: &Loaded, stmt: &Stmt) -> Option<String> {
    if stmt.integer {
        return Some("this statement is computed in the 24 bits of L-variables".into());
    }
    let unknown = |kind: Kind, number: u16| {
        let is_field = matches!(kind, Kind::M | Kind::L);
        let is_known = !is_field || field_of(download, loaded, kind, number).is_some();
        let letter = if kind == Kind::L { 'L' } else { 'M' };
        (!is_known)
            .then(|| format!("{letter}{number} is not a binary field of a plain word of memory"))
    };
    match stmt.kind {
        StmtKind::Text(..) => {
            return Some("this is for the host, a display or the command line".into());
        }
        StmtKind::Define(_) | StmtKind::Word(..) | StmtKind::Save => {
            return Some("this is a command to the control".into());
        }
        StmtKind::Motion(..) | StmtKind::Loop(..) => return Some("this moves motors".into()),
        StmtKind::Address(_, Some(system)) if system != 1 => {
            return Some(format!("this chooses coordinate system {system}"));
        }
        StmtKind::AddressBy(..) => return Some("this computes a coordinate system".into()),
        StmtKind::Assign(Target::Indirect(..), _) => {
            return Some("this computes a variable's number".into());
        }
        StmtKind::Assign(target, _) => {
            if let Some(what) = target.named().find_map(|(kind, number)| unknown(kind, number)) {
                return Some(what);
            }
            if target.named().any(|it| matches!(it, (Kind::I, 5 | 8 | 10))) {
                return Some("this changes when PLCs run".into());
            }
        }
        _ => {}
    }
    stmt.kind.expressions().flat_map(|expr| download.ops(expr)).find_map(|op| match *op {
        Op::Indirect(_) => Some("this computes a variable's number".into()),
        Op::Call(Func::Abs | Func::Int | Func::Sqrt) => None,
        Op::Call(_) => {
            Some("a function of angles, logarithms or powers differs in its last digit".into())
        }
        Op::Var(kind, number) => unknown(kind, number),
        _ => None,
    })
}
