//! Constants that an I-variable does not take as they are.

use plcc_abi::pmac::{Kind, Range};
use plcc_diag::Diagnostic;

use crate::pmac::ast::{Action, Expr, Op, Target};
use crate::pmac::origin::At;
use crate::pmac::read::download::Checker;
use crate::pmac::reference::tables::i_range;

impl Checker<'_> {
    /// Warns of an on-line assignment.
    pub(crate) fn warn_of_action(&mut self, action: &Action, at: At) {
        if let Action::Assign(target, expr) = *action {
            self.warn_of_range(target, expr, at);
        }
    }

    /// Warns of a constant that rolls over. Rows (`I0..99=0`) sweep over many variables and are
    /// not meant for each.
    pub(crate) fn warn_of_range(&mut self, target: Target, expr: Expr, at: At) {
        let Target::Var(Kind::I, number) = target else { return };
        let number = u32::from(number);
        let Some(value) = self.constant_value(expr) else { return };
        let Some(range) = i_range(self.out.controller, number) else { return };
        if holds(range, value) {
            return;
        }
        let (low, high) = match range {
            Range::Integer(low, high) => (low as f64, high as f64),
            Range::Real(low, high) => (low, high),
        };
        let stored = range.convert(value);
        let diagnostic = self.flat.origins.diagnose(at, |span| {
            let message = format!("I{number} takes {low} to {high}: {value} becomes {stored}");
            Diagnostic::warning("PMAC-W5", span, message)
                .help(format!("`plcc explain I{number}` says what it means"))
        });
        self.diagnostics.push(diagnostic);
    }

    /// A number, perhaps with minus signs before it.
    fn constant_value(&self, expr: Expr) -> Option<f64> {
        let start = expr.start as usize;
        let ops = self.reader.ops.get(start..start + expr.len as usize)?;
        let (Op::Const(value), signs) = ops.split_first()? else { return None };
        let minus = |op: &Op| matches!(op, Op::Neg);
        let negative = signs.len() % 2 == 1;
        signs.iter().all(minus).then_some(if negative { -value } else { *value })
    }
}

/// Whether a value stays what it is, roundings of integers aside.
fn holds(range: Range, value: f64) -> bool {
    match range {
        Range::Integer(low, high) => (low as f64..=high as f64).contains(&value.round()),
        Range::Real(low, high) => (low..=high).contains(&value),
    }
}

#[cfg(test)]
mod tests {
    use crate::common::{Controller, MemoryLoader, Options};
    use crate::pmac::check;

    fn warnings(source: &str, controller: Controller) -> Vec<String> {
        let mut map = plcc_diag::SourceMap::new();
        let file = map.add("m.pmc", source.as_bytes());
        let options = Options { controller, ..Options::default() };
        let (program, diagnostics) = check(&mut map, &[file], &MemoryLoader::new(), &options);
        assert!(program.is_some());
        let line = |d: &plcc_diag::Diagnostic| map.line_col(d.span.file, d.span.start).0;
        let told = |d: &plcc_diag::Diagnostic| format!("{} {}: {}", d.code, line(d), d.message);
        diagnostics.iter().map(told).collect()
    }

    #[test]
    fn constants_that_roll_over_are_told() {
        let text = "I5=2 I8=256\nI4=4.5\nI100=-1\nOPEN PLC 1 CLEAR\n\
                    I12=0\nI136=--2.5\nCMD\"I9=4\"\nCLOSE\n";
        assert_eq!(
            warnings(text, Controller::Pmac),
            [
                "PMAC-W5 1: I8 takes 0 to 255: 256 becomes 0",
                "PMAC-W5 2: I4 takes 0 to 3: 4.5 becomes 1",
                "PMAC-W5 3: I100 takes 0 to 1: -1 becomes 1",
                "PMAC-W5 5: I12 takes 1 to 8388607: 0 becomes 8388607",
                "PMAC-W5 6: I136 takes -2 to 2: 2.5 becomes -1.5",
                "PMAC-W5 7: I9 takes 0 to 3: 4 becomes 0",
            ]
        );
        let text = "I5=2 I8=8388608\nI12=0\nOPEN PLC 1 CLEAR I5111=8388608 CLOSE\n";
        assert_eq!(
            warnings(text, Controller::Turbo),
            [
                "PMAC-W5 1: I8 takes 0 to 255: 8388608 becomes 0",
                "PMAC-W5 3: I5111 takes -8388608 to 8388607: 8388608 becomes -8388608",
            ]
        );
    }

    #[test]
    fn what_fits_or_is_not_known_is_not_told() {
        let text = "I5=2 I8=255.4 I8=-0.4 I136=2 I122=-1 I46=99999 I125=$FFFFFF I5=*\nI0..4=9\n\
                    OPEN PLC 1 CLEAR\nI8=P1 I8=255+1 I(8)=256 P8=256 M8=256\nCLOSE\n";
        assert_eq!(warnings(text, Controller::Pmac), Vec::<String>::new());
    }
}
