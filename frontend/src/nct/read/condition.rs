//! One test of a condition (NCT 4.2, 4.3, 4.10): of a bit, of a counter or timer, of OP. What
//! parentheses combine is read in `group.rs`.

use crate::nct::{
    ast::{ConditionPart, Op, Operand, Relation, Space, Test},
    read::{
        diagnostic::{Read, SyntaxError, error, shown},
        operand::{Prefix, begins_constant, bit, constant, counter, load, refuse, require_word},
        parser::Parser,
    },
};

impl Parser<'_> {
    /// A condition: one test, or more in parentheses.
    pub(crate) fn condition(&mut self, start: usize) -> Read<()> {
        let first = self.out.condition_parts.len();
        let read = if self.cursor.at('(') { self.group() } else { self.test().map(|_| ()) };
        if let Err(fail) = read {
            self.out.condition_parts.truncate(first);
            return Err(fail);
        }
        let count = (self.out.condition_parts.len() - first) as u32;
        self.emit(start, Op::If { first: first as u32, count, otherwise: 0 });
        Ok(())
    }

    /// One test; `false` where none begins here.
    pub(crate) fn test(&mut self) -> Read<bool> {
        let start = self.cursor.pos();
        let cursor = &mut self.cursor;
        let not = cursor.at('N');
        if not {
            cursor.bump();
        }
        let Some(letter) = cursor.peek() else {
            return if not { Err(self.bad_not(start)) } else { Ok(false) };
        };
        let space = match letter {
            'I' => Some(Space::I),
            'Y' => Some(Space::Y),
            'V' => Some(Space::V),
            'P' => Some(Space::P),
            'F' => Some(Space::F),
            _ => None,
        };
        let test = match (space, letter) {
            (Some(Space::P), _) => {
                cursor.bump();
                if !cursor.peek().is_some_and(|d| d.is_ascii_digit()) {
                    return Err(self.bad_p(start));
                }
                Test::Bit { negate: not, bit: bit(cursor, start, Space::P)? }
            }
            (Some(space), _) => {
                cursor.bump();
                Test::Bit { negate: not, bit: bit(cursor, start, space)? }
            }
            (None, 'Q' | 'T' | 'H' | 'M') => {
                cursor.bump();
                Test::Word { negate: not, word: counter(cursor, start, letter)? }
            }
            (None, '<' | '>' | '=') if !not => self.relation(start)?,
            _ if not => return Err(self.bad_not(start)),
            _ => return Ok(false),
        };
        self.out.condition_parts.push(ConditionPart::Test(test));
        self.out.tests.push((start, self.cursor.end()));
        Ok(true)
    }

    /// The error of a `P` that begins neither a test nor PF.
    fn bad_p(&mut self, start: usize) -> SyntaxError {
        let found = self.cursor.peek();
        refuse(&mut self.cursor, |cursor| {
            let message = format!("{} can't follow P", shown(found));
            error(50, cursor.span_from(start), message, "write Ppqr (p 0 to 3) or PFnnn")
        })
    }

    /// The error of an `N` that begins neither a test nor NL or NS.
    fn bad_not(&mut self, start: usize) -> SyntaxError {
        let found = self.cursor.peek();
        refuse(&mut self.cursor, |cursor| {
            let message = format!("{} can't follow N", shown(found));
            let help = "N is written before a test (I Y V P F Q T H M) or before L or S";
            error(13, cursor.span_from(start), message, help)
        })
    }

    /// A comparison of OP, at its `<`, `>` or `=`.
    fn relation(&mut self, start: usize) -> Read<Test> {
        let cursor = &mut self.cursor;
        let first = cursor.bump();
        let (relation, text, number) = match first {
            Some('=') => (Relation::Eq, "=", 33),
            Some('<') if cursor.eat('=') => (Relation::Le, "<=", 37),
            Some('<') => (Relation::Lt, "<", 31),
            _ if cursor.eat('=') => (Relation::Ge, ">=", 39),
            _ => (Relation::Gt, ">", 35),
        };
        let not = cursor.at('N');
        if not {
            cursor.bump();
        }
        if cursor.at('L') {
            cursor.bump();
            let operand = load(cursor, start, if not { Prefix::LoadNot } else { Prefix::Load })?;
            if let Operand::Load { place: variable, .. } = operand {
                require_word(cursor, start, variable)?;
            }
            return Ok(Test::Relation { relation, operand });
        }
        if !not && begins_constant(cursor) {
            return Ok(Test::Relation { relation, operand: constant(cursor, start)? });
        }
        let found = cursor.peek();
        let number = number + u8::from(not);
        let n = if not { "N" } else { "" };
        Err(refuse(cursor, |cursor| {
            let message = format!("{} can't follow {text}{n}", shown(found));
            let help = if found == Some(',') {
                format!("leave the comma out: {text}5")
            } else {
                format!("write {text}5, {text}.00FF, or {text}L and a variable's name")
            };
            error(number, cursor.span_from(start), message, help)
        }))
    }
}
