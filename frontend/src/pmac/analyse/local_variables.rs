//! The L-variables of PLCCs: that each one has a definition, and which statements are computed in
//! integers because of them.

use plcc_abi::pmac::Kind;

use crate::pmac::ast::{Buffer, Download, Expr, Func, Op, StmtKind, Target};
use crate::pmac::read::cursor::ParseError;
use crate::pmac::read::download::DownloadReader;

/// Reports the L-variables that no definition in the text defines, one for each statement.
pub(crate) fn report_undefined(read: &mut DownloadReader<'_>) {
    let mut last = 0;
    for (statement, used) in std::mem::take(&mut read.l_uses) {
        let undefined = || used.numbers().find(|number| !read.download.l_defs.contains_key(number));
        if statement != last
            && let Some(number) = undefined()
        {
            last = statement;
            read.report(ParseError {
                code: "PMAC-3",
                at: used.at,
                message: format!("L{number} is not defined").into(),
                help: Some(format!("define it: L{number}->Y:$FFC2,8,1").into()),
            });
        }
    }
}

/// Notes for each statement of PLCCs whether it is computed in integers. `with_point` are the
/// indices of the operations that are constants with a decimal point, in rising order.
pub(crate) fn mark_integers(download: &mut Download, with_point: &[usize]) {
    let Download { plccs, ops, .. } = download;
    for Buffer { code, .. } in plccs {
        for stmt in code {
            stmt.integer = is_integer(&stmt.kind, ops, with_point);
        }
    }
}

/// Whether a statement of a PLCC is computed in integers. Such a statement has at least one
/// L-variable, and nothing but L-variables, integer constants, operators, ABS and INT. A constant
/// that is written with a decimal point is not an integer constant, whatever its value.
fn is_integer(kind: &StmtKind, ops: &[Op], with_point: &[usize]) -> bool {
    let (expr, target): (Expr, bool) = match kind {
        StmtKind::Assign(Target::Var(Kind::L, _) | Target::Range { kind: Kind::L, .. }, expr) => {
            (*expr, true)
        }
        StmtKind::If(expr, _) | StmtKind::While(expr, _) => (*expr, false),
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
        | StmtKind::Loop(..) => return false,
    };
    let start = expr.start as usize;
    let ops = ops.get(start..start + expr.len as usize).unwrap_or(&[]);
    let mut any = target;
    let all = ops.iter().all(|op| match op {
        Op::Const(value) => value.fract() == 0.0 && *value <= 8_388_607.0,
        Op::Var(kind, _) => {
            any |= *kind == Kind::L;
            *kind == Kind::L
        }
        Op::Indirect(_) => false,
        Op::Call(func) => matches!(func, Func::Abs | Func::Int),
        Op::Neg | Op::Bin(_) | Op::Cmp(_) | Op::Both | Op::Either => true,
    });
    let next = with_point.get(with_point.partition_point(|&at| at < start));
    all && any && next.is_none_or(|&at| at >= start + ops.len())
}
