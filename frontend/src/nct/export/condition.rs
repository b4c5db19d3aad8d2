//! Conditions (NCT 4.2 to 4.11). One with an indirect access is computed test by test in front of its IF, since such an access writes
//! status flags, which the tests after it may ask.

use plcc_iec::{Expression, Level};

use super::Writer;
use crate::nct::ast::{Arith, ConditionPart, Operand, Program, Relation, Test, Variable, Word};

fn is_indirect(part: &ConditionPart) -> bool {
    matches!(
        part,
        ConditionPart::Test(Test::Relation {
            operand: Operand::Load { place: Variable::Word(Word::Indirect(_)), .. },
            ..
        })
    )
}

/// Whether a condition of the program has an indirect access.
pub(super) fn any_indirect(program: &Program) -> bool {
    program.condition_parts.iter().any(is_indirect)
}

impl Writer<'_> {
    /// Lines in front of a condition, and the condition.
    pub(super) fn condition(&self, first: u32, count: u32) -> (Vec<String>, Expression) {
        let range = first as usize..(first as usize).saturating_add(count as usize);
        let parts = self.program.condition_parts.get(range).unwrap_or_default();
        let apart = parts.iter().any(is_indirect);
        let (mut lines, mut stack): (Vec<String>, Vec<Expression>) = (vec![], vec![]);
        let mut tests = self.own.tests.iter();
        for part in parts {
            match part {
                ConditionPart::Test(test) => {
                    let name = tests.next().map_or("", String::as_str);
                    let value = if is_indirect(part) {
                        lines.extend(self.indirect_test(test, name));
                        Expression::name(name)
                    } else if apart {
                        lines.push(format!("{name} := {};", self.test(test).into_text()));
                        Expression::name(name)
                    } else {
                        self.test(test)
                    };
                    stack.push(value);
                }
                ConditionPart::Gate(gate) => {
                    let (right, left) = (stack.pop(), stack.pop());
                    let (operator, level) = match gate {
                        Arith::And => ("AND", Level::And),
                        Arith::Or => ("OR", Level::Or),
                        _ => ("XOR", Level::Xor),
                    };
                    let no = || Expression::name("FALSE");
                    stack.push(left.unwrap_or_else(no).infix(
                        operator,
                        level,
                        right.unwrap_or_else(no),
                    ));
                }
            }
        }
        let condition = stack.pop().unwrap_or_else(|| Expression::name("FALSE"));
        (lines, condition)
    }

    fn test(&self, test: &Test) -> Expression {
        match *test {
            Test::Bit { negate, bit } => {
                let value = self.bit(bit);
                if negate { value.inverted() } else { value }
            }
            Test::Word { negate, word } => {
                let operator = if negate { "=" } else { "<>" };
                let zero = Expression::name("0");
                self.word(word).infix(operator, Level::Relation, zero).of_unsigned()
            }
            Test::Relation { relation, operand } => {
                let right = self.operand(operand);
                let op = Expression::name(&self.own.op);
                op.infix(sign(relation), Level::Relation, right).of_unsigned()
            }
        }
    }

    /// A relation with what an address leads to; it does not hold where there is no such address.
    fn indirect_test(&self, test: &Test, name: &str) -> Vec<String> {
        let Test::Relation {
            relation,
            operand: Operand::Load { negate, place: Variable::Word(Word::Indirect(at)) },
        } = *test
        else {
            return vec![];
        };
        let mut lines = self.find_address(at);
        let value = self.at_address(negate);
        lines.push(format!("{name} := FALSE;"));
        lines.push(format!("IF {} THEN", self.own.valid));
        lines.push(format!("  {name} := {} {} {value};", self.own.op, sign(relation)));
        lines.push("END_IF;".into());
        lines
    }
}

fn sign(relation: Relation) -> &'static str {
    match relation {
        Relation::Lt => "<",
        Relation::Gt => ">",
        Relation::Eq => "=",
        Relation::Le => "<=",
        Relation::Ge => ">=",
    }
}
