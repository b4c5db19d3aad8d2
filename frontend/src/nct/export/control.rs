//! What the control does around the modules (rulings, Time), as blocks of the same CASE as the statements.

use plcc_abi::nct::LINE_BYTES;
use plcc_iec::{Expression, Flow, Item, Step, comment};

use super::storage::{Unit, has_weight};
use super::{FIRST_SLICE, LEVEL0_BEGINS, LEVEL2_ENABLE, NO_SYNCHRONISATION, Writer, bit, bits_of};
use crate::nct::ast::{Bit, Space, Word};

/// How many blocks are the control's.
pub(super) const STEPS: usize = 5;

/// Safepoints that :001 and :002 may pass, and those of :000 in a slice (rulings, Time).
const MOST: u32 = 1_000_000;
const MOST_OF_0: u32 = 10_000;

/// The item of a statement.
pub(super) fn item(statement: usize) -> usize {
    statement + STEPS
}

/// The number of the block that begins with a statement.
pub(super) fn block(statement: usize) -> usize {
    item(statement) + 1
}

/// The control's blocks.
const BEGIN: usize = 1;
const LATCH: usize = 2;
const AFTER_1: usize = 3;
const AFTER_0: usize = 4;
const LEVEL2: usize = 5;

/// Copies between images of a unit: the names of what is copied from and to.
type Copy = (usize, usize);

impl Writer<'_> {
    fn entry(&self, number: usize) -> Option<usize> {
        Some(block(self.program.modules().nth(number)?.1))
    }

    fn has_level2(&self) -> bool {
        self.entry(2).is_some()
    }

    fn output(&self, digits: u16) -> String {
        self.outputs.read_bit(bit(Space::Y, digits)).into_text()
    }

    /// Lines that have a module begin, and the control go on with a block after it.
    fn enter(&self, number: usize, after: usize) -> Vec<String> {
        let own = &self.own;
        let fuel = if number == 0 { MOST_OF_0 } else { MOST };
        let mut lines = vec![
            format!("{} := {number};", own.module),
            format!("{} := {after};", own.after),
            format!("{} := {};", own.op, own.op_of.get(number).map_or("0", String::as_str)),
            format!("{} := {fuel};", own.fuel),
            format!("{} := 0;", own.depth),
            format!("{} := {};", own.next, self.entry(number).unwrap_or(after)),
        ];
        if number == 0 {
            lines.push(format!("IF {} <> 0 THEN", own.resume));
            lines.push(format!("  {} := {};", own.next, own.resume));
            lines.push(format!("  {} := {};", own.depth, own.depth_of_0));
            lines.push(format!("  {} := 0;", own.resume));
            lines.push("END_IF;".into());
        }
        lines
    }

    /// Copies images of each unit of inputs: 0 is the one that is shown, 1 the one before it, then those of :001 and :000.
    fn copies(&self, copies: &[Copy]) -> Vec<String> {
        let mut lines = vec![];
        for (unit, images) in &self.images {
            let shown = self.inputs.units.get(unit).map_or("", String::as_str);
            let name = |number: usize| match number {
                0 => shown,
                number => images.get(number - 1).map_or("", String::as_str),
            };
            lines.extend(
                copies.iter().map(|&(from, to)| format!("{} := {};", name(to), name(from))),
            );
        }
        lines
    }

    pub(super) fn steps_of_control(&self) -> Vec<Item> {
        let own = &self.own;
        let comments = [
            "a slice begins",
            "time, and inputs",
            "behind :001",
            "behind :000: outputs",
            ":002 runs until the next slice",
        ];
        let mut begin = vec![format!("{} := {LATCH};", own.next), format!("{} := 0;", own.module)];
        if self.has_level2() {
            begin.push(format!("IF {} THEN", self.output(LEVEL2_ENABLE)));
            begin.extend(self.enter(2, LATCH).into_iter().map(|line| format!("  {line}")));
            begin.push("END_IF;".into());
        }
        // OP of :002, if it has run.
        let keep = [
            format!("IF {} = 2 THEN", own.module),
            format!("  {} := {};", own.op_of[2], own.op),
            "END_IF;".into(),
        ];
        let mut latch = if self.has_level2() { keep.to_vec() } else { vec![] };
        latch.extend(self.time());
        latch.extend(self.copies(&[(0, 1)]));
        latch.extend(self.latch());
        latch.extend(self.enter(1, AFTER_1));

        let mut after_1 = vec![
            format!("{} := {};", own.op_of[1], own.op),
            format!("IF {} = 0 THEN", own.slice),
            format!("  {} := NOT ({});", own.synchronised, self.output(NO_SYNCHRONISATION)),
            "END_IF;".into(),
        ];
        if !self.images.is_empty() {
            after_1.push(format!("IF {} OR NOT {} THEN", own.level0_starts, own.synchronised));
            after_1.extend(self.copies(&[(4, 5), (0, 4)]).into_iter().map(|it| format!("  {it}")));
            after_1.push("END_IF;".into());
        }
        after_1.extend(self.copies(&[(0, 2), (1, 3), (4, 0), (5, 1)]));
        after_1.extend(self.enter(0, AFTER_0));

        let mut after_0 = vec![
            format!("{} := {};", own.op_of[0], own.op),
            format!("{} := {} = 0;", own.level0_starts, own.resume),
        ];
        after_0.extend(self.copies(&[(2, 0), (3, 1)]));
        after_0.extend(self.drive());
        after_0.push(format!("{} := 1;", own.runs));
        after_0.push(format!("{} := {};", own.next, if self.has_level2() { LEVEL2 } else { 0 }));

        let mut level2 = vec![];
        if self.has_level2() {
            let most = 20 / self.settings.control.period_ms().max(1);
            level2.extend(keep);
            level2.push(format!("{} := {LEVEL2};", own.next));
            level2.push(format!("IF {} >= {most} THEN", own.runs));
            level2.push(format!("  {} := 0;", own.next));
            level2.push(format!("ELSIF {} THEN", self.output(LEVEL2_ENABLE)));
            level2.extend(self.enter(2, LEVEL2).into_iter().map(|line| format!("  {line}")));
            level2.push("END_IF;".into());
            level2.push(format!("{0} := {0} + 1;", own.runs));
        } else {
            level2.push(format!("{} := 0;", own.next));
        }
        let steps = [begin, latch, after_1, after_0, level2].into_iter().zip(comments);
        let item = |(lines, text): (Vec<String>, &str)| Item {
            comments: vec![text.to_owned()],
            behind: String::new(),
            step: Step::Leave(lines),
        };
        steps.map(item).collect()
    }

    /// The timers go down, but not before the first slice (NCT 2.4).
    fn time(&self) -> Vec<String> {
        let own = &self.own;
        let mut lines = vec![];
        for (every, is_one) in [
            (1, (|word: &Word| matches!(word, Word::T(_))) as fn(&Word) -> bool),
            (50, |word| matches!(word, Word::H(_))),
            (3000, |word| matches!(word, Word::M(_))),
        ] {
            let timers: Vec<_> = self.registers.iter().filter(|(word, _)| is_one(word)).collect();
            if timers.is_empty() {
                continue;
            }
            lines.push(match every {
                1 => format!("IF {} > 0 THEN", own.slice),
                every => format!("IF ({0} > 0) AND ({0} MOD {every} = 0) THEN", own.slice),
            });
            for (_, name) in timers {
                lines.push(format!("  IF {name} > 0 THEN"));
                lines.push(format!("    {name} := {name} - 1;"));
                lines.push("  END_IF;".into());
            }
            lines.push("END_IF;".into());
        }
        lines
    }

    /// The inputs of :001: lines, and what the NC gives.
    fn latch(&self) -> Vec<String> {
        let mut lines = vec![];
        for (unit, name) in &self.inputs.units {
            let from_nc = self.from_nc.get(unit);
            let bits = bits_of(*unit);
            let first = bits.first().map_or(0, |(byte, _)| *byte);
            let all_lines = bits.iter().all(|(byte, _)| usize::from(*byte) < LINE_BYTES);
            match (unit, from_nc) {
                (Unit::Bit(byte, bit), None) => {
                    lines.push(format!("{name} := {};", self.line(Space::P, *byte, *bit)));
                }
                (_, None) if all_lines => lines.push(format!("{name} := {};", self.sum(*unit))),
                (_, Some(nc)) if !all_lines && usize::from(first) >= LINE_BYTES => {
                    lines.push(format!("{name} := {nc};"));
                }
                // The word of the last line and the first flag of the NC.
                (_, nc) => {
                    let nc = nc.map_or("0", String::as_str);
                    lines.push(format!(
                        "{name} := {} + {nc} / 256 * 256;",
                        self.sum_of(Unit::Byte(first), "UINT")
                    ));
                }
            }
        }
        for (digits, value) in [
            (FIRST_SLICE, format!("{} = 0", self.own.slice)),
            (LEVEL0_BEGINS, self.own.level0_starts.clone()),
        ] {
            let bit = bit(Space::I, digits);
            if self.inputs.has_bit(bit) {
                lines.push(self.inputs.write_bit(bit, &value));
            }
        }
        lines
    }

    /// The value of lines of inputs, as a sum with their weights.
    fn sum(&self, unit: Unit) -> String {
        self.sum_of(unit, if matches!(unit, Unit::Byte(_)) { "USINT" } else { "UINT" })
    }

    fn sum_of(&self, unit: Unit, to: &str) -> String {
        let bits = bits_of(unit).into_iter().enumerate();
        let terms = bits.map(|(place, (byte, bit))| {
            let line = format!("BOOL_TO_{to}({})", self.line(Space::P, byte, bit));
            if place == 0 { line } else { format!("{} * {line}", 1_u32 << place) }
        });
        terms.collect::<Vec<_>>().join(" + ")
    }

    /// The lines of outputs take the output image, where the machine has boards (rulings, Time).
    fn drive(&self) -> Vec<String> {
        let boards = self.settings.boards.unwrap_or(4).min(4);
        let driven = self.lines_out.iter().filter(|((byte, _), _)| *byte < u16::from(boards) * 10);
        let line = |(&(byte, number), name): (&(u16, u8), &String)| {
            let of = Bit { space: Space::Y, byte, bit: number };
            let value = match self.outputs.has_bit(of) {
                true => self.outputs.read_bit(of),
                false => Expression::name("FALSE"),
            };
            format!("{name} := {};", value.into_text())
        };
        driven.map(line).collect()
    }

    /// The whole body.
    pub(super) fn body(&self, flow: &Flow<'_>) -> Vec<String> {
        let own = &self.own;
        let mut lines =
            vec![format!("IF {} <> 0 THEN", own.stop), "  RETURN;".into(), "END_IF;".into()];
        if let Some(array) = &self.flags.array {
            // An array is kept as a whole, and F000 to F499 are 0 at power-up.
            lines.push(format!("IF {} = 0 THEN", own.slice));
            lines.push(format!("  {} := 0;", own.address));
            lines.push(format!("  WHILE {} < 500 DO", own.address));
            lines.push(format!("    {array}[{}] := 0;", own.address));
            lines.push(format!("    {0} := {0} + 1;", own.address));
            lines.push("  END_WHILE;".into());
            lines.push("END_IF;".into());
        }
        lines.push(format!("{} := {BEGIN};", own.next));
        lines.push(format!("{} := {MOST};", own.fuel));
        let used_up = [
            format!("IF {} = 0 THEN", own.fuel),
            format!("  IF {} = 0 THEN", own.module),
            format!("    {} := {};", own.resume, own.next),
            format!("    {} := {};", own.depth_of_0, own.depth),
            format!("    {} := {AFTER_0};", own.next),
            "  ELSE".into(),
            format!("    {} := {};", own.stop, own.module),
            format!("    {} := 0;", own.next),
            "  END_IF;".into(),
            format!("  {} := {MOST};", own.fuel),
            "END_IF;".into(),
        ];
        lines.extend(flow.text(&format!("{} <> 0", own.next), &used_up));
        lines.push(format!("IF {} <> 0 THEN", own.stop));
        lines.push(format!("  {}", comment("The control has stopped: all outputs are off")));
        for (number, name) in own.op_of.iter().enumerate() {
            let word = if number == 0 { "IF" } else { "ELSIF" };
            lines.push(format!("  {word} {} = {number} THEN", own.module));
            lines.push(format!("    {name} := {};", own.op));
            if number == 0 {
                lines.extend(
                    self.copies(&[(2, 0), (3, 1)]).into_iter().map(|it| format!("    {it}")),
                );
            }
        }
        lines.push("  END_IF;".into());
        lines.extend(self.lines_out.values().map(|line| format!("  {line} := FALSE;")));
        lines.push("END_IF;".into());
        lines.push(format!("{0} := {0} + 1;", own.slice));
        lines.push(format!("IF {} > 3000 THEN", own.slice));
        lines.push(format!("  {} := 1;", own.slice));
        lines.push("END_IF;".into());
        lines
    }

    /// The name of a line that hardware statements write.
    pub(super) fn line_name(&self, bit: Bit) -> &str {
        self.line(bit.space, bit.byte, bit.bit)
    }

    /// The value of lines as a word.
    pub(super) fn lines_word(&self, space: Space, byte: u16) -> Expression {
        let bits = bits_of(Unit::Word(byte)).into_iter().enumerate();
        let bits = bits.filter(|(_, (byte, _))| usize::from(*byte) < LINE_BYTES);
        let terms = bits.map(|(place, (byte, bit))| {
            let line = format!("BOOL_TO_UINT({})", self.line(space, byte, bit));
            if place == 0 { line } else { format!("{} * {line}", 1_u32 << place) }
        });
        Expression::name(format!("({})", terms.collect::<Vec<_>>().join(" + ")))
    }

    /// Statements that put a word on lines.
    pub(super) fn drive_word(&self, byte: u16, value: &str) -> Vec<String> {
        let bits = bits_of(Unit::Word(byte)).into_iter().enumerate();
        let bits = bits.filter(|(_, (byte, _))| usize::from(*byte) < LINE_BYTES);
        bits.map(|(place, (byte, bit))| {
            let on = has_weight(value, 1 << place).into_text();
            format!("{} := {on};", self.line(Space::O, byte, bit))
        })
        .collect()
    }
}
