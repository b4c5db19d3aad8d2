//! The lints of PMAC: what the language allows and a programmer seldom means. They look at the
//! download and at its state after load, so they are asked only where there is no error.

mod flow;
mod plcs;
mod variables;

use plcc_diag::{Diagnostic, Span};

use super::load::Loaded;
use crate::pmac::ast::{Buffer, Download, Expr, Op, Stmt};
use crate::pmac::origin::TextRange;

/// What the lints look at.
pub(super) struct Checked<'a> {
    /// The download.
    pub(super) download: &'a Download,
    /// Its state after load.
    pub(super) loaded: &'a Loaded,
    /// Whether the download has motion programs, which are skipped and may write variables.
    pub(super) has_motion: bool,
    found: Vec<Diagnostic>,
}

/// All findings of the lints, in no particular order.
pub(crate) fn find(download: &Download, loaded: &Loaded, has_motion: bool) -> Vec<Diagnostic> {
    let mut checked = Checked { download, loaded, has_motion, found: Vec::new() };
    variables::value_out_of_range(&mut checked);
    variables::undefined_m_variables(&mut checked);
    variables::shared_timers(&mut checked);
    plcs::never_runs(&mut checked);
    plcs::repeats_every_scan(&mut checked);
    plcs::texts(&mut checked);
    flow::conditions(&mut checked);
    checked.found
}

impl<'a> Checked<'a> {
    /// Adds a finding at a place of the preprocessed text.
    fn add(&mut self, at: TextRange, make: impl FnOnce(Span) -> Diagnostic) {
        let diagnostic = self.download.origins.diagnose(at, make);
        self.found.push(diagnostic);
    }

    /// The PLCs, then the PLCCs, each with its number and whether it is a PLCC.
    fn programs(&self) -> impl Iterator<Item = (bool, u32, &'a Buffer)> + use<'a> {
        let plcs = (0..).zip(&self.download.plcs).map(|(number, buffer)| (false, number, buffer));
        let plccs = (0..).zip(&self.download.plccs).map(|(number, buffer)| (true, number, buffer));
        plcs.chain(plccs)
    }

    /// All statements: of PLCs, of PLCCs, and those that COMMANDs execute.
    fn statements(&self) -> impl Iterator<Item = &'a Stmt> + use<'a> {
        let programs = self.programs().map(|(_, _, buffer)| &buffer.code);
        programs.chain(&self.download.commands).flatten()
    }

    fn ops(&self, expr: Expr) -> &'a [Op] {
        self.download.ops(expr)
    }
}

/// The name of a program, as a statement writes it: `PLC 3`.
fn program_name(compiled: bool, number: u32) -> String {
    format!("{} {number}", if compiled { "PLCC" } else { "PLC" })
}

/// The value of an expression that is a number, perhaps with minus signs in front of it.
pub(super) fn constant_value(ops: &[Op]) -> Option<f64> {
    let (Op::Const(value), signs) = ops.split_first()? else { return None };
    let negative = signs.len() % 2 == 1;
    let minus = signs.iter().all(|op| matches!(op, Op::Neg));
    minus.then_some(if negative { -value } else { *value })
}
