//! Operations on OP outside brackets (NCT 4.4 to 4.8), with the errors of those that have no valid operand.

use crate::nct::{
    ast::{AreaOp, Arith, Op, Operand},
    read::{
        diagnostic::{Read, SyntaxError, error, shown},
        operand::{Prefix, begins_constant, constant, load, refuse, require_word, variable},
        parser::Parser,
    },
};

/// How conditions are combined, and OP with a variable.
macro_rules! combine {
    ($sign:literal) => {
        concat!(
            "to combine conditions, put parentheses around them: (I001 ",
            $sign,
            " I002); to combine OP with a variable, write ",
            $sign,
            "L before its name"
        )
    };
}

/// A constant has no comma here.
macro_rules! no_comma {
    ($sign:literal) => {
        concat!("leave the comma out: ", $sign, "5")
    };
}

/// Which operands there are.
macro_rules! with_operand {
    ($sign:literal) => {
        concat!("write ", $sign, "5, ", $sign, ".00FF, or ", $sign, "L and a variable's name")
    };
}

/// One of these helps for an operation, by the sign with which it begins.
macro_rules! of_operation {
    ($first:expr, $help:ident) => {
        match $first {
            '+' => $help!("+"),
            '-' => $help!("-"),
            '*' => $help!("*"),
            '/' => $help!("/"),
            'A' => $help!("A"),
            'O' => $help!("O"),
            _ => $help!("X"),
        }
    };
}

impl Parser<'_> {
    /// An operation on OP outside brackets.
    pub(super) fn operation(&mut self, start: usize, first: char) -> Read<()> {
        self.cursor.bump();
        let cursor = &mut self.cursor;
        let op = match first {
            '+' => Arith::Add,
            '-' => Arith::Sub,
            '*' => Arith::Mul,
            '/' => Arith::Div,
            'A' if cursor.at('D') => {
                cursor.bump();
                let op = self.area_by_last_letter(start, "ADD", AreaOp::Add, 'D', 47)?;
                self.emit(start, op);
                return Ok(());
            }
            'A' => Arith::And,
            'O' => Arith::Or,
            _ => Arith::Xor,
        };
        let stores = !matches!(op, Arith::Mul | Arith::Div);
        let not = cursor.at('N');
        if not {
            cursor.bump();
        }
        let found = cursor.peek();
        let op = match found {
            Some('L') => {
                cursor.bump();
                let operand =
                    load(cursor, start, if not { Prefix::LoadNot } else { Prefix::Load })?;
                self.arith(start, op, operand)?
            }
            Some('S') if stores => {
                cursor.bump();
                let prefix = if not { Prefix::StoreNot } else { Prefix::Store };
                let variable = variable(cursor, start, prefix)?;
                if matches!(op, Arith::Add | Arith::Sub) {
                    require_word(cursor, start, variable)?;
                }
                Op::Update { op, negate: not, place: variable }
            }
            Some('[') if !not => {
                return self.bracket(start, Some(op));
            }
            _ if !not && begins_constant(cursor) => {
                let operand = constant(cursor, start)?;
                self.arith(start, op, operand)?
            }
            _ => return Err(self.bad_operand(start, first, not)),
        };
        self.emit(start, op);
        Ok(())
    }

    /// An operation with its operand; arithmetic takes no bits.
    pub(crate) fn arith(&mut self, start: usize, op: Arith, operand: Operand) -> Read<Op> {
        if let Operand::Load { place: variable, .. } = operand
            && matches!(op, Arith::Add | Arith::Sub | Arith::Mul | Arith::Div)
        {
            require_word(&self.cursor, start, variable)?;
        }
        Ok(Op::Arith { op, operand })
    }

    /// The error of an operation `first`, with an `N` after it or `not`, that has no valid
    /// operand.
    fn bad_operand(&mut self, start: usize, first: char, not: bool) -> SyntaxError {
        let found = self.cursor.peek();
        let tests = matches!(found, Some('I' | 'Y' | 'V' | 'P' | 'F' | 'Q' | 'T' | 'H' | 'M'));
        let gate = matches!(first, 'A' | 'O' | 'X');
        let number = match first {
            '*' | '/' => 45,
            _ if gate && (tests || matches!(found, Some('(' | '<' | '>' | '='))) => 63,
            _ if not && !tests => 13,
            _ => 7,
        };
        let help = match (number, found) {
            (63, _) => of_operation!(first, combine),
            (_, Some(',')) => of_operation!(first, no_comma),
            _ => of_operation!(first, with_operand),
        };
        let n = if not { "N" } else { "" };
        let message = format!("{} can't follow {first}{n}", shown(found));
        refuse(&mut self.cursor, |cursor| error(number, cursor.span_from(start), message, help))
    }
}
