//! What an observer is told of the statements with a register area (NCT 4.14 to 4.16): HF, PF, MR, MW, ADD, SUB,
//! MUL, DIV and CMP.
//!
//! The host performs these statements. So that an observer sees them like all others, the interpreter
//! tells it what the host is about to read, and afterwards what it has written:
//!
//! | statement | read | written |
//! | --- | --- | --- |
//! | `ADD220` | the registers F220 to F227, the numbers A and B at the addresses in them | the number C, F0046, F0047, F0053, F0080, F0082 |
//! | `HF120` | the registers F120 to F127, the item that was found | the address in F128, F0080, F0081 |
//!
//! Numbers are told as the words in which they lie. Of a table that is searched only the item that was found is
//! told: hundreds of others would hide it.

use plcc_abi::nct::FLAG_BYTES;
use plcc_abi::nct::arithmetic::{Operation, from_bcd};

use super::run::Run;
use crate::common::{Observer, Value};
use crate::nct::ast::{AreaOp, Bit, Space, Variable, Word};
use crate::nct::status_flags::{NOT_BCD, NOT_FOUND, OVERFLOW, SIGN, SYNTAX, ZERO};

/// A number among the local variables: its first byte, and how many bytes it has.
type Number = (u16, u16);

/// The last byte at which a word of F begins.
const LAST_WORD: u16 = FLAG_BYTES as u16 - 2;

/// The arithmetic of a statement; `None` for those that search or copy.
fn operation(op: AreaOp) -> Option<Operation> {
    Some(match op {
        AreaOp::Add => Operation::Add,
        AreaOp::Sub => Operation::Sub,
        AreaOp::Mul => Operation::Mul,
        AreaOp::Div => Operation::Div,
        AreaOp::Cmp => Operation::Cmp,
        AreaOp::Hf | AreaOp::Pf | AreaOp::Mr | AreaOp::Mw => return None,
    })
}

/// The register, counted in bytes from the beginning of the area, that receives the address that a search has found.
fn answer_register(op: AreaOp) -> Option<u16> {
    match op {
        AreaOp::Hf => Some(8),
        AreaOp::Pf => Some(4),
        _ => None,
    }
}

impl<O: Observer> Run<'_, O> {
    /// Tells the observer what a statement reads, before the host performs it. Returns the number that the
    /// statement will write if its registers are in order.
    pub(super) fn observe_area_reads(&mut self, op: AreaOp, area: u16) -> Option<Number> {
        let end = area + answer_register(op).unwrap_or(op.area());
        for register in (area..end).step_by(2).filter(|&register| register <= LAST_WORD) {
            self.word(word_at(register));
        }
        let size = self.byte(Space::F, area).into();
        match (op, operation(op)) {
            (_, Some(operation)) => {
                let a = self.number_at(area + 2, operation.first_operand_size(size));
                let b = self.number_at(area + 4, size);
                for number in [a, b].into_iter().flatten() {
                    self.observe_number(Observer::read, number);
                }
                self.number_at(area + 6, operation.result_size(size)?)
            }
            (AreaOp::Mr, _) => self.number_at(area + 6, size),
            (AreaOp::Mw, _) => {
                let number = self.number_at(area + 6, size)?;
                self.observe_number(Observer::read, number);
                None
            }
            _ => None,
        }
    }

    /// Tells the observer what the host has written. `result` is what
    /// [`observe_area_reads`](Self::observe_area_reads) gave.
    pub(super) fn observe_area_writes(&mut self, op: AreaOp, area: u16, result: Option<Number>) {
        let answer = answer_register(op);
        let is_done = !self.is_set(SYNTAX) && (answer.is_some() || !self.is_set(NOT_BCD));
        if is_done && let Some(number) = result {
            self.observe_number(Observer::write, number);
        }
        if is_done && let Some(register) = answer {
            if !self.is_set(NOT_FOUND) {
                let register = area + register;
                if let Some(item) = self.number_at(register, 2) {
                    self.observe_number(Observer::read, item);
                }
                self.observe_number(Observer::write, (register, 2));
            }
            self.observe_flag(NOT_FOUND);
        }
        if is_done && let Some(operation) = operation(op) {
            self.observe_flag(ZERO);
            self.observe_flag(SIGN);
            // DIV leaves it as it is.
            if operation != Operation::Div {
                self.observe_flag(OVERFLOW);
            }
        }
        self.observe_flag(SYNTAX);
        if answer.is_none() {
            self.observe_flag(NOT_BCD);
        }
    }

    /// The number of `size` bytes whose address is, in BCD, in a register; `None` if no number can lie there.
    fn number_at(&self, register: u16, size: u16) -> Option<Number> {
        let address = from_bcd(u16::from_le_bytes([
            self.byte(Space::F, register),
            self.byte(Space::F, register + 1),
        ]))?;
        let fits = usize::from(address) + usize::from(size) <= FLAG_BYTES;
        (fits && (1..=8).contains(&size)).then_some((address, size))
    }

    /// Tells of a number: of each word in which it lies.
    fn observe_number(
        &mut self,
        tell: fn(&mut O, crate::common::Accessed, Value),
        (first, size): Number,
    ) {
        for byte in (first..first + size).step_by(2) {
            // A single byte at the end of F is the high one of the last word.
            let byte = byte.min(LAST_WORD);
            let word = [self.byte(Space::F, byte), self.byte(Space::F, byte + 1)];
            let value = Value::Integer(u16::from_le_bytes(word).into());
            self.observe(tell, Variable::Word(word_at(byte)), value);
        }
    }

    fn observe_flag(&mut self, flag: Bit) {
        let value = Value::Logical(self.is_set(flag));
        self.observe(Observer::write, Variable::Bit(flag), value);
    }

    fn is_set(&self, flag: Bit) -> bool {
        self.byte(flag.space, flag.byte) >> flag.bit & 1 != 0
    }
}

fn word_at(byte: u16) -> Word {
    Word::Bytes { space: Space::F, byte }
}
