//! Lints about conditions: `constant-condition`, `unreachable`, `endless-wait`.

use std::collections::BTreeSet;

use plcc_abi::pmac::Kind;
use plcc_diag::Diagnostic;

use super::Checked;
use crate::pmac::ast::{Action, Buffer, Expr, Op, StmtKind, Target};
use plcc_abi::pmac::expression;

/// What is known of a condition without running the program.
enum Known {
    /// It is always true, or always false.
    Always(bool),
    /// It reads only variables that nothing in the download writes.
    Unchanging,
    /// It may change.
    Nothing,
}

/// The P- and Q-variables that something in the download may write.
struct Written {
    numbers: BTreeSet<(Kind, u16)>,
    /// Whether any P-variable may be written, since a statement computes the number or a motion program
    /// may write it; and whether any Q-variable may.
    any: [bool; 2],
}

impl Written {
    fn of(checked: &Checked<'_>) -> Self {
        let mut this = Self { numbers: BTreeSet::new(), any: [checked.has_motion; 2] };
        for stmt in checked.download.statements() {
            match stmt.kind {
                StmtKind::Assign(target, _) => this.add(target),
                // Memory that is written by its address may be that of any variable.
                StmtKind::Word(..) | StmtKind::Define(_) => this.any = [true; 2],
                StmtKind::If(..)
                | StmtKind::Jump(_)
                | StmtKind::While(..)
                | StmtKind::EndWhile(_)
                | StmtKind::Plc(..)
                | StmtKind::Address(..)
                | StmtKind::AddressBy(..)
                | StmtKind::Text(..)
                | StmtKind::Save
                | StmtKind::Motion(..)
                | StmtKind::Loop(..) => {}
            }
        }
        for online in &checked.download.online {
            // Definitions may lead to the memory of P and Q.
            if let Action::Write(..) = online.action {
                this.any = [true; 2];
            }
        }
        this
    }

    fn add(&mut self, target: Target) {
        self.numbers.extend(target.named());
        if let Target::Indirect(kind, _) = target {
            self.any[0] |= kind == Kind::P;
            self.any[1] |= kind == Kind::Q;
        }
    }

    fn has(&self, kind: Kind, number: u16) -> bool {
        let any = match kind {
            Kind::P => self.any[0],
            Kind::Q => self.any[1],
            // M- and L-variables may be inputs, and on-line commands set I-variables.
            _ => true,
        };
        any || self.numbers.contains(&(kind, number))
    }
}

fn known(checked: &Checked<'_>, condition: Expr, written: &Written) -> Known {
    let ops = checked.download.ops(condition);
    let mut constant = true;
    for op in ops {
        match *op {
            Op::Var(kind, number) if written.has(kind, number) => return Known::Nothing,
            Op::Indirect(_) => return Known::Nothing,
            Op::Var(..) => constant = false,
            _ => {}
        }
    }
    if !constant {
        return Known::Unchanging;
    }
    if ops.iter().any(|op| matches!(op, Op::Call(_))) {
        return Known::Nothing;
    }
    let value = expression::evaluate(ops, &mut Vec::new(), false, &mut |_, _| 0.0);
    Known::Always(value != 0.0)
}

/// Looks at every condition of the PLCs and PLCCs.
pub(super) fn conditions(checked: &mut Checked<'_>) {
    let written = Written::of(checked);
    for (_, _, buffer) in checked.download.programs() {
        program(checked, buffer, &written);
    }
}

fn program(checked: &mut Checked<'_>, buffer: &Buffer, written: &Written) {
    for (index, stmt) in buffer.code.iter().enumerate() {
        match stmt.kind {
            StmtKind::If(condition, _) => {
                if let Known::Always(truth) = known(checked, condition, written) {
                    checked.add(stmt.at, |span| {
                        let message = format!("this condition is always {truth}");
                        Diagnostic::warning("PMAC-W10", span, message)
                            .help("compare a variable, or take the IF out")
                    });
                }
            }
            StmtKind::While(condition, after) => match known(checked, condition, written) {
                Known::Always(false) => checked.add(stmt.at, |span| {
                    Diagnostic::warning("PMAC-W10", span, "this condition is always false")
                        .help("compare a variable, or take the WHILE out")
                }),
                Known::Always(true) => {
                    // A loop that runs for ever is a usual way to write a PLC; what is after it
                    // never runs.
                    if let Some(next) = buffer.code.get(after as usize)
                        && !matches!(next.kind, StmtKind::EndWhile(_) | StmtKind::Jump(_))
                    {
                        checked.add(next.at, |span| {
                            Diagnostic::warning("PMAC-W11", span, "no scan reaches this statement")
                                .note("it is after a WHILE that never ends")
                                .help("give the WHILE a condition that ends it, or take it out")
                        });
                    }
                    if is_empty(buffer, index) {
                        endless(checked, stmt.at);
                    }
                }
                Known::Unchanging => endless(checked, stmt.at),
                Known::Nothing => {}
            },
            _ => {}
        }
    }
}

/// Whether the WHILE with this index has nothing in it.
fn is_empty(buffer: &Buffer, index: usize) -> bool {
    matches!(buffer.code.get(index + 1).map(|stmt| &stmt.kind), Some(StmtKind::EndWhile(_)))
}

fn endless(checked: &mut Checked<'_>, at: crate::pmac::origin::TextRange) {
    checked.add(at, |span| {
        Diagnostic::warning("PMAC-W18", span, "nothing in this download changes this condition")
            .note("once the WHILE is entered, only an on-line command ends it")
            .help("wait for a variable that a PLC, a motion program or an input changes")
    });
}
