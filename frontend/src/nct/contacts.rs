//! The contacts of NCT's conditions: the tests in them. A condition is read again from its text, since the checked program
//! has no places of tests.

use plcc_diag::{SourceMap, Span};

use crate::common::{Gate, Logic, LogicBuilder};
use crate::nct::{
    Program,
    ast::{Arith, ConditionPart, Op, Stmt, Test},
    read::parser::parse,
};

impl Program {
    /// As [`logic`](crate::CheckedProgram::logic).
    pub(super) fn contacts(&self, sources: &SourceMap) -> Vec<Option<Logic>> {
        self.checked.stmts.iter().map(|stmt| self.contacts_of(stmt, sources)).collect()
    }

    fn contacts_of(&self, stmt: &Stmt, sources: &SourceMap) -> Option<Logic> {
        let Op::If { .. } = stmt.op else { return None };
        let Span { file, start, .. } = stmt.span;
        let text = sources.slice(stmt.span);
        let (parsed, _) = parse(file, text, self.limits);
        let mut tests = parsed.tests.iter();
        let mut builder = LogicBuilder::default();
        for part in &parsed.condition_parts {
            let test = match part {
                ConditionPart::Test(test) => test,
                ConditionPart::Gate(gate) => {
                    builder.gate(match gate {
                        Arith::Or => Gate::Or,
                        Arith::Xor => Gate::Xor,
                        _ => Gate::And,
                    });
                    continue;
                }
            };
            let (from, to) = *tests.next()?;
            let whole = text.get(from..to)?;
            let negated = match test {
                Test::Bit { negate, .. } | Test::Word { negate, .. } => *negate,
                Test::Relation { .. } => false,
            };
            // A contact that is closed at rest is one of the same bit.
            let own =
                if negated { whole.trim_start().strip_prefix(['N', 'n'])? } else { whole }.trim();
            let offset = start + (to - own.len()) as u32;
            let span = Span { file, start: offset, end: start + to as u32 };
            let name: String = own.split_whitespace().collect();
            // A counter or timer alone is a number, and its test a condition.
            let value = match test {
                Test::Word { .. } => self.expression(&format!("({own})")).ok()?,
                _ => self.expression(own).ok()?,
            };
            builder.varying_contact(&name, span, value);
            if negated {
                builder.not();
            }
        }
        builder.finish()
    }
}
