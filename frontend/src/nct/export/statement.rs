//! Statements, with the status flags that they write (NCT 4). Flags that nothing in the program reads are left out.

use plcc_iec::{Expression, Level, Step};

use super::Writer;
use super::control::{block, item};
use crate::nct::ast::{Arith, Bit, Op, Operand, Space, Variable, Word};
use crate::nct::control_flow::INDIRECT_LABELS;
use crate::nct::status_flags::{NOT_BCD, SYNTAX};

impl Writer<'_> {
    /// The value of a bit.
    pub(super) fn bit(&self, bit: Bit) -> Expression {
        match bit.space {
            Space::P | Space::O => Expression::name(self.line_name(bit)),
            Space::I | Space::Y | Space::F => {
                self.storage(bit.space).map_or(Expression::name("FALSE"), |it| it.read_bit(bit))
            }
            // A change is what makes the two images differ.
            Space::V => {
                let now = self.inputs.read_bit(bit);
                now.infix(
                    "<>",
                    Level::Relation,
                    self.inputs.read_bit_of(bit, |unit| self.before(unit)),
                )
            }
        }
    }

    /// The image before of a unit of inputs.
    fn before(&self, unit: super::Unit) -> &str {
        self.images.get(&unit).map_or("", |images| images[0].as_str())
    }

    /// The value of a word.
    pub(super) fn word(&self, word: Word) -> Expression {
        match word {
            Word::Bytes { space: space @ (Space::P | Space::O), byte } => {
                self.lines_word(space, byte)
            }
            Word::Bytes { space: Space::V, byte } => {
                let now = self.inputs.read_word(byte);
                let before = self.inputs.read_word_of(byte, |unit| self.before(unit));
                now.call_with("WORD_XOR(", before)
            }
            Word::Bytes { space, byte } => {
                self.storage(space).map_or(Expression::name("0"), |it| it.read_word(byte))
            }
            // Found by the lines in front.
            Word::Indirect(_) => Expression::name(&self.own.value),
            other => Expression::name(self.registers.get(&other).map_or("0", String::as_str)),
        }
    }

    /// The value of an operand that is not an indirect access.
    pub(super) fn operand(&self, operand: Operand) -> Expression {
        match operand {
            Operand::Const(value) => Expression::name(value.to_string()),
            Operand::Load { negate, place: Variable::Bit(bit) } => {
                let value = self.bit(bit);
                (if negate { value.inverted() } else { value }).call("BOOL_TO_UINT(")
            }
            Operand::Load { negate, place: Variable::Word(word) } => {
                let value = self.word(word);
                if negate { complement(value) } else { value }
            }
        }
    }

    pub(super) fn write_bit(&self, bit: Bit, value: &str) -> Vec<String> {
        match self.storage(bit.space) {
            Some(storage) => vec![storage.write_bit(bit, value)],
            None => vec![format!("{} := {value};", self.line_name(bit))],
        }
    }

    pub(super) fn write_word(&self, word: Word, value: &str) -> Vec<String> {
        match word {
            Word::Bytes { space: Space::P | Space::O, byte } => self.drive_word(byte, value),
            Word::Bytes { space, byte } => {
                self.storage(space).map(|it| it.write_word(byte, value)).unwrap_or_default()
            }
            Word::Indirect(_) => self.write_at_address(value),
            other => {
                let name = self.registers.get(&other).map_or("", String::as_str);
                vec![format!("{name} := {value};")]
            }
        }
    }

    /// Writes a status flag, if anything can see it.
    pub(super) fn flag(&self, lines: &mut Vec<String>, flag: Bit, value: &str) {
        if self.flags.array.is_some() || self.flags.has_bit(flag) {
            lines.push(self.flags.write_bit(flag, value));
        }
    }

    /// Finds the address in a word of F, and writes F0080 and F0082 where it is none.
    pub(super) fn find_address(&self, at: u16) -> Vec<String> {
        let own = &self.own;
        let (address, valid) = (&own.address, &own.valid);
        let mut lines = vec![
            format!("{address} := {};", self.flags.read_word(at).into_text()),
            format!("{} := WORD_IS_BCD({address});", own.carry),
            format!("{valid} := FALSE;"),
            format!("IF {} THEN", own.carry),
            format!("  {address} := WORD_FROM_BCD({address});"),
            format!("  {valid} := {address} < 1000;"),
            "END_IF;".into(),
            format!("IF {valid} THEN"),
            format!("  {} := {};", own.value, self.array_word()),
            "END_IF;".into(),
        ];
        self.flag(&mut lines, SYNTAX, &format!("{} AND NOT {valid}", own.carry));
        self.flag(&mut lines, NOT_BCD, &format!("NOT {}", own.carry));
        lines
    }

    fn array_word(&self) -> String {
        let (array, address) = (self.flags.array.as_deref().unwrap_or(""), &self.own.address);
        format!("WORD_OF_BYTES({array}[{address}], {array}[{address} + 1])")
    }

    /// What the address leads to.
    pub(super) fn at_address(&self, negate: bool) -> String {
        let value = Expression::name(&self.own.value);
        (if negate { complement(value) } else { value }).into_text()
    }

    fn write_at_address(&self, value: &str) -> Vec<String> {
        let (array, address) = (self.flags.array.as_deref().unwrap_or(""), &self.own.address);
        vec![
            format!("{array}[{address}] := LOW_BYTE({value});"),
            format!("IF {address} < 999 THEN"),
            format!("  {array}[{address} + 1] := HIGH_BYTE({value});"),
            "END_IF;".into(),
        ]
    }

    /// Lines that are done only if the address of an indirect access is one; for other operands they are done as they are.
    pub(super) fn with_operand(
        &self,
        operand: Operand,
        lines_of: impl FnOnce(Expression) -> Vec<String>,
    ) -> Vec<String> {
        if let Operand::Load { negate, place: Variable::Word(Word::Indirect(at)) } = operand {
            let mut lines = self.find_address(at);
            lines.push(format!("IF {} THEN", self.own.valid));
            let value = Expression::name(self.at_address(negate));
            let value =
                if negate { Expression::name(format!("({})", value.into_text())) } else { value };
            lines.extend(lines_of(value).into_iter().map(|line| format!("  {line}")));
            lines.push("END_IF;".into());
            return lines;
        }
        lines_of(self.operand(operand))
    }

    /// What a statement is in the flow.
    pub(super) fn step(&self, at: usize, op: &Op) -> Step {
        let own = &self.own;
        match *op {
            Op::If { first, count, otherwise } => {
                let (before, condition) = self.condition(first, count);
                Step::Branch { before, condition, otherwise: item(otherwise as usize + 1) }
            }
            Op::Else { end } => Step::Jump { to: item(end as usize + 1), ends_body: true },
            Op::Goto(label) => match self.program.target(label) {
                Some(to) if to > at => Step::Jump { to: item(to), ends_body: false },
                Some(to) => Step::Leave(self.jump(at, to)),
                None => Step::Leave(vec![format!("{} := {};", own.next, own.after)]),
            },
            Op::Call(label) => match self.program.target(label) {
                Some(to) => Step::Leave(self.call(at, to)),
                None => Step::Leave(vec![format!("{} := {};", own.next, own.after)]),
            },
            Op::GotoIndirect(word) => {
                Step::Leave(self.to_named_label(word, at, |to| self.jump(at, to)))
            }
            Op::CallIndirect(word) => {
                Step::Leave(self.to_named_label(word, at, |to| self.call(at, to)))
            }
            Op::Return => Step::Leave(vec![
                format!("IF {} = 0 THEN", own.depth),
                format!("  {} := {};", own.next, own.after),
                "ELSE".into(),
                format!("  {0} := {0} - 1;", own.depth),
                format!("  {} := {}[{} * 32 + {}];", own.next, own.returns, own.module, own.depth),
                "END_IF;".into(),
            ]),
            Op::End(_) => Step::Leave(vec![format!("{} := {};", own.next, own.after)]),
            op => Step::Do(self.lines(op)),
        }
    }

    /// A jump; one back passes a safepoint.
    fn jump(&self, from: usize, to: usize) -> Vec<String> {
        let mut lines = vec![];
        if to <= from {
            lines.push(format!("{0} := {0} - 1;", self.own.fuel));
        }
        lines.push(format!("{} := {};", self.own.next, block(to)));
        lines
    }

    /// A call, which passes a safepoint; one that is too deep stops the program.
    fn call(&self, from: usize, to: usize) -> Vec<String> {
        let own = &self.own;
        vec![
            format!("IF {} >= 32 THEN", own.depth),
            format!("  {} := 3;", own.stop),
            format!("  {} := 0;", own.next),
            "ELSE".into(),
            format!(
                "  {}[{} * 32 + {}] := {};",
                own.returns,
                own.module,
                own.depth,
                block(from + 1)
            ),
            format!("  {0} := {0} + 1;", own.depth),
            format!("  {0} := {0} - 1;", own.fuel),
            format!("  {} := {};", own.next, block(to)),
            "END_IF;".into(),
        ]
    }

    /// Goes to the label whose number a word of F has in BCD; where there is none, F0080 or F0082 says so, and the next
    /// statement follows.
    fn to_named_label(
        &self,
        word: u16,
        at: usize,
        lines_to: impl Fn(usize) -> Vec<String>,
    ) -> Vec<String> {
        let own = &self.own;
        let mut lines = vec![
            format!("{} := {};", own.address, self.flags.read_word(word).into_text()),
            format!("{} := WORD_IS_BCD({});", own.carry, own.address),
            format!("{} := {};", own.next, block(at + 1)),
            format!("{} := FALSE;", own.valid),
            format!("IF {} THEN", own.carry),
            format!("  {0} := WORD_FROM_BCD({0});", own.address),
        ];
        let labels: Vec<_> = INDIRECT_LABELS
            .filter_map(|label| Some((label, self.program.target(label)?)))
            .collect();
        if !labels.is_empty() {
            lines.push(format!("  CASE {} OF", own.address));
            for (label, to) in labels {
                lines.push(format!("    {label}:"));
                lines.push(format!("      {} := TRUE;", own.valid));
                lines.extend(lines_to(to).into_iter().map(|line| format!("      {line}")));
            }
            lines.push("  END_CASE;".into());
        }
        lines.push("END_IF;".into());
        self.flag(&mut lines, SYNTAX, &format!("{} AND NOT {}", own.carry, own.valid));
        self.flag(&mut lines, NOT_BCD, &format!("NOT {}", own.carry));
        lines
    }

    /// The lines of a statement that control runs through.
    fn lines(&self, op: Op) -> Vec<String> {
        let own = &self.own;
        let register = &own.op;
        match op {
            Op::Set(bit) => self.write_bit(bit, "TRUE"),
            Op::Clear(bit) => self.write_bit(bit, "FALSE"),
            Op::Count { counter, up } => {
                let counter = Word::Q(counter);
                let function = if up { "WORD_ADD(" } else { "WORD_SUB(" };
                let value = self.word(counter).call_with(function, Expression::name("1"));
                self.write_word(counter, &value.into_text())
            }
            Op::Load(operand) => self.with_operand(operand, |value| {
                vec![format!("{register} := {};", value.into_text())]
            }),
            Op::Store { negate, place: Variable::Bit(bit) } => {
                let even = if negate { "0" } else { "1" };
                self.write_bit(bit, &format!("{register} MOD 2 = {even}"))
            }
            Op::Store { negate, place: Variable::Word(word) } => {
                let value = Expression::name(register);
                let value = if negate { complement(value) } else { value }.into_text();
                self.with_address(word, || self.write_word(word, &value))
            }
            Op::Arith { op, operand: operand @ Operand::Load { place: Variable::Bit(_), .. } } => {
                self.with_bit(op, operand)
            }
            Op::Arith { op, operand } => self.with_operand(operand, |value| {
                let mut lines = vec![];
                // The flags may lie in the operand.
                let value = match operand {
                    Operand::Load {
                        place: Variable::Word(Word::Bytes { space: Space::F, .. }),
                        ..
                    } => {
                        lines.push(format!("{} := {};", own.value, value.into_text()));
                        Expression::name(&own.value)
                    }
                    _ => value,
                };
                lines.extend(self.arithmetic(op, Expression::name(register), value));
                lines
            }),
            Op::Update { op, negate, place: Variable::Bit(bit) } => {
                let old = self.bit(bit);
                let old = if negate { old.inverted() } else { old };
                let with = Expression::name(format!("({register} MOD 2 = 1)"));
                let (operator, level) = match op {
                    Arith::And => ("AND", Level::And),
                    Arith::Or => ("OR", Level::Or),
                    _ => ("XOR", Level::Xor),
                };
                self.write_bit(bit, &old.infix(operator, level, with).into_text())
            }
            Op::Update { op, negate, place: Variable::Word(word) } => {
                self.with_address(word, || self.update(op, negate, word))
            }
            Op::Shift { left: true, by } => {
                vec![format!("{register} := WORD_SHL({register}, {});", 1_u32 << by)]
            }
            Op::Shift { left: false, by } => {
                vec![format!("{register} := {register} / {};", 1_u32 << by)]
            }
            Op::Bin => self.bin(),
            Op::Bcd => self.bcd(),
            Op::Push(slot) => vec![format!("{} := {register};", self.slot(slot))],
            Op::Apply { op, slot } => {
                let right = format!("{} := {register};", own.value);
                let mut lines = vec![right];
                let kept = Expression::name(self.slot(slot));
                lines.extend(self.arithmetic(op, kept, Expression::name(&own.value)));
                lines
            }
            _ => vec![],
        }
    }

    pub(super) fn slot(&self, slot: u16) -> &str {
        self.own.slots.get(usize::from(slot)).map_or("", String::as_str)
    }

    /// Lines that write a word; those of an indirect access are done where its address is one, and write the flags after them.
    fn with_address(&self, word: Word, lines_of: impl FnOnce() -> Vec<String>) -> Vec<String> {
        let Word::Indirect(at) = word else { return lines_of() };
        let mut lines = self.find_address(at);
        lines.push(format!("IF {} THEN", self.own.valid));
        let mut done = lines_of();
        // What was written may have been the flags' own byte.
        let mut flags = vec![];
        self.flag(&mut flags, SYNTAX, "FALSE");
        self.flag(&mut flags, NOT_BCD, "FALSE");
        let behind = done.iter().position(|line| line == FLAGS_FOLLOW).unwrap_or(done.len());
        done.splice(behind..(behind + 1).min(done.len()), flags);
        lines.extend(done.into_iter().map(|line| format!("  {line}")));
        lines.push("END_IF;".into());
        lines
    }
}

/// Stands in a list of lines where the flags of an indirect access belong: after the result and in front of its flags.
pub(super) const FLAGS_FOLLOW: &str = "FLAGS";

/// All bits of a word turned.
pub(super) fn complement(value: Expression) -> Expression {
    Expression::name("65535").infix("-", Level::Sum, value)
}
