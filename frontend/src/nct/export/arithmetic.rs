//! Arithmetic on OP and on variables, with the status flags that it writes (NCT 4.8, 4.9).

use plcc_iec::{Expression, Level};

use super::Writer;
use super::statement::{FLAGS_FOLLOW, complement};
use crate::nct::ast::{Arith, Operand, Variable, Word};
use crate::nct::status_flags::{
    BCD_SIGN, CARRY, HIGH_WORD, MUL_OVERFLOW, NOT_BCD, OVERFLOW, SIGN, SYNTAX, ZERO,
};

impl Writer<'_> {
    /// A variable becomes itself combined with OP.
    pub(super) fn update(&self, op: Arith, negate: bool, word: Word) -> Vec<String> {
        let own = &self.own;
        let old = self.word(word);
        let old = if negate { complement(old) } else { old };
        let with = Expression::name(&own.op);
        if !matches!(op, Arith::Add | Arith::Sub) {
            let value = old.call_with(function_of(op), with);
            let mut lines = vec![format!("{} := {};", own.result, value.into_text())];
            lines.extend(self.write_word(word, &own.result));
            lines.push(FLAGS_FOLLOW.into());
            return self.without_mark(word, lines);
        }
        let carry = match op {
            Arith::Add => old.clone().call_with("WORD_CARRY(", with.clone()).into_text(),
            _ => old.clone().infix("<", Level::Relation, with.clone()).into_text(),
        };
        let mut lines = vec![
            format!("{} := {carry};", own.carry),
            format!("{} := {};", own.result, old.call_with(function_of(op), with).into_text()),
        ];
        lines.extend(self.write_word(word, &own.result));
        lines.push(FLAGS_FOLLOW.into());
        self.flag(&mut lines, CARRY, &own.carry);
        self.flag(&mut lines, ZERO, &format!("{} = 0", own.result));
        self.flag(&mut lines, SIGN, &format!("{} >= 32768", own.result));
        self.without_mark(word, lines)
    }

    /// Only an indirect access has flags of its own between a result and its flags.
    fn without_mark(&self, word: Word, mut lines: Vec<String>) -> Vec<String> {
        if !matches!(word, Word::Indirect(_)) {
            lines.retain(|line| line != FLAGS_FOLLOW);
        }
        lines
    }

    /// AND, OR and XOR with a bit change bit 0 of OP alone.
    pub(super) fn with_bit(&self, op: Arith, operand: Operand) -> Vec<String> {
        let Operand::Load { negate, place: Variable::Bit(bit) } = operand else { return vec![] };
        let register = &self.own.op;
        let value = self.bit(bit);
        let value = if negate { value.inverted() } else { value };
        match op {
            Arith::And => vec![
                format!("IF {} THEN", value.inverted().into_text()),
                format!("  {register} := {register} - {register} MOD 2;"),
                "END_IF;".into(),
            ],
            Arith::Or => vec![
                format!("IF {} THEN", value.into_text()),
                format!("  {register} := {register} / 2 * 2 + 1;"),
                "END_IF;".into(),
            ],
            _ => vec![
                format!("IF {} THEN", value.into_text()),
                format!("  {register} := WORD_XOR({register}, 1);"),
                "END_IF;".into(),
            ],
        }
    }

    /// OP becomes a value combined with another one. Neither is computed from what the lines write.
    pub(super) fn arithmetic(&self, op: Arith, a: Expression, b: Expression) -> Vec<String> {
        let own = &self.own;
        let register = &own.op;
        let (left, right) = (a.clone().into_text(), b.clone().into_text());
        let mut lines = vec![];
        match op {
            Arith::And | Arith::Or | Arith::Xor => {
                lines.push(format!(
                    "{register} := {};",
                    a.call_with(function_of(op), b).into_text()
                ));
            }
            Arith::Add | Arith::Sub => {
                let carry = match op {
                    Arith::Add => format!("WORD_CARRY({left}, {right})"),
                    _ => a.clone().infix("<", Level::Relation, b.clone()).into_text(),
                };
                self.flag(&mut lines, CARRY, &carry);
                lines.push(format!(
                    "{register} := {};",
                    a.call_with(function_of(op), b).into_text()
                ));
                self.flag(&mut lines, ZERO, &format!("{register} = 0"));
                self.flag(&mut lines, SIGN, &format!("{register} >= 32768"));
            }
            Arith::Mul => {
                lines.push(format!("{} := WORD_MUL_HIGH({left}, {right});", own.result));
                lines.push(format!("{register} := WORD_MUL({left}, {right});"));
                lines.extend(self.write_word(HIGH_WORD, &own.result));
                self.flag(&mut lines, MUL_OVERFLOW, &format!("{} <> 0", own.result));
            }
            Arith::Div => {
                let high = self.word(HIGH_WORD).into_text();
                let mut zero = vec![];
                self.flag(&mut zero, SYNTAX, "TRUE");
                let mut done = vec![
                    format!("{} := WORD_REM({high}, {left}, {right});", own.result),
                    format!("{register} := WORD_DIV({high}, {left}, {right});"),
                ];
                self.flag(&mut done, SYNTAX, "FALSE");
                done.extend(self.write_word(HIGH_WORD, &own.result));
                lines.push(format!("IF {right} = 0 THEN"));
                zero.push(format!("{register} := {left};"));
                lines.extend(zero.into_iter().map(|line| format!("  {line}")));
                lines.push("ELSE".into());
                lines.extend(done.into_iter().map(|line| format!("  {line}")));
                lines.push("END_IF;".into());
            }
        }
        lines
    }

    pub(super) fn bin(&self) -> Vec<String> {
        let register = &self.own.op;
        let sign = self.flags.read_bit(BCD_SIGN).into_text();
        let mut lines = vec![
            format!("{} := WORD_IS_BCD({register});", self.own.carry),
            format!("IF {} THEN", self.own.carry),
            format!("  {register} := WORD_FROM_BCD({register});"),
            format!("  IF {sign} THEN"),
            format!("    {register} := WORD_SUB(0, {register});"),
            "  END_IF;".into(),
        ];
        let mut flags = vec![];
        self.flag(&mut flags, ZERO, &format!("{register} = 0"));
        self.flag(&mut flags, SIGN, &format!("{register} >= 32768"));
        lines.extend(flags.into_iter().map(|line| format!("  {line}")));
        lines.push("END_IF;".into());
        self.flag(&mut lines, NOT_BCD, &format!("NOT {}", self.own.carry));
        lines
    }

    pub(super) fn bcd(&self) -> Vec<String> {
        let own = &self.own;
        let register = &own.op;
        let mut lines = vec![
            format!("{} := {register} >= 32768;", own.carry),
            format!("{} := {register};", own.result),
            format!("IF {} THEN", own.carry),
            format!("  {} := WORD_SUB(0, {register});", own.result),
            "END_IF;".into(),
        ];
        self.flag(&mut lines, OVERFLOW, &format!("{} > 9999", own.result));
        lines.push(format!("IF {} <= 9999 THEN", own.result));
        lines.push(format!("  {register} := WORD_TO_BCD({});", own.result));
        let mut flags = vec![];
        self.flag(&mut flags, ZERO, &format!("{} = 0", own.result));
        self.flag(&mut flags, SIGN, &own.carry);
        lines.extend(flags.into_iter().map(|line| format!("  {line}")));
        lines.push("END_IF;".into());
        lines
    }
}

/// The function of two words.
fn function_of(op: Arith) -> &'static str {
    match op {
        Arith::Add => "WORD_ADD(",
        Arith::Sub => "WORD_SUB(",
        Arith::And => "WORD_AND(",
        Arith::Or => "WORD_OR(",
        Arith::Xor => "WORD_XOR(",
        Arith::Mul => "WORD_MUL(",
        Arith::Div => "WORD_DIV(",
    }
}
