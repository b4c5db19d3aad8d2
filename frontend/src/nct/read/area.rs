//! Statements with a register area in F (NCT 4.14 to 4.16): `HF PF MR MW ADD SUB MUL DIV CMP` and
//! the address of the area.

use crate::nct::{
    ast::{AreaOp, Op},
    read::{
        diagnostic::{Read, error, shown},
        number::{Digits, address},
        operand::refuse,
        parser::Parser,
    },
};

impl Parser<'_> {
    /// A statement whose whole name comes next.
    pub(crate) fn named_area(&mut self, start: usize, name: &str, op: AreaOp) -> Read<Op> {
        for _ in name.chars() {
            self.cursor.bump();
        }
        self.area_address(start, op)
    }

    /// A statement with a name of three letters, of which two are taken. If the next letter is not
    /// `last`, that is the error `number`.
    pub(crate) fn area_by_last_letter(
        &mut self,
        start: usize,
        name: &str,
        op: AreaOp,
        last: char,
        number: u8,
    ) -> Read<Op> {
        if !self.cursor.eat(last) {
            let found = self.cursor.peek();
            let message =
                format!("{} is not allowed here: only {name} begins like this", shown(found));
            return Err(refuse(&mut self.cursor, |cursor| {
                error(number, cursor.span_from(start), message, format!("write {name}nnn"))
            }));
        }
        self.area_address(start, op)
    }

    /// The address after the name: three digits, so that the whole area lies in F.
    fn area_address(&mut self, start: usize, op: AreaOp) -> Read<Op> {
        let area = address(&mut self.cursor, start, 3, 3, Digits::Decimal)?.value;
        let (name, bytes) = (op.name(), op.area());
        if area + bytes > 1000 {
            return Err(error(
                46,
                self.cursor.span_from(start),
                format!("the {bytes} bytes of {name}'s registers reach beyond F999"),
                format!("let them begin at F{:03} or before", 1000 - bytes),
            ));
        }
        Ok(Op::Area { op, area })
    }
}
