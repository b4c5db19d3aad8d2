//! One test of a condition (NCT 4.2, 4.3, 4.10): of a bit, of a counter or timer, of OP. What
//! parentheses combine is read in `group.rs`.

use crate::nct::{
    ast::{Cond, Op, Operand, Relation, Space, Test},
    read::{
        diagnostic::{Read, SyntaxError, error, shown},
        operand::{Prefix, begins_constant, bit, constant, counter, load, refuse, require_word},
        parser::Parser,
    },
};

impl Parser<'_> {
    /// A condition: one test, or more in parentheses.
    pub(crate) fn condition(&mut self, start: usize) -> Read<()> {
        let first = self.out.conds.len();
        let read = if self.c.at('(') { self.group() } else { self.test().map(|_| ()) };
        if let Err(fail) = read {
            self.out.conds.truncate(first);
            return Err(fail);
        }
        let count = (self.out.conds.len() - first) as u32;
        self.emit(start, Op::If { first: first as u32, count, otherwise: 0 });
        Ok(())
    }

    /// One test; `false` where none begins here.
    pub(crate) fn test(&mut self) -> Read<bool> {
        let start = self.c.pos();
        let c = &mut self.c;
        let not = c.at('N');
        if not {
            c.bump();
        }
        let Some(letter) = c.peek() else {
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
                c.bump();
                if !c.peek().is_some_and(|d| d.is_ascii_digit()) {
                    return Err(self.bad_p(start));
                }
                Test::Bit { negate: not, bit: bit(c, start, Space::P)? }
            }
            (Some(space), _) => {
                c.bump();
                Test::Bit { negate: not, bit: bit(c, start, space)? }
            }
            (None, 'Q' | 'T' | 'H' | 'M') => {
                c.bump();
                Test::Word { negate: not, word: counter(c, start, letter)? }
            }
            (None, '<' | '>' | '=') if !not => self.relation(start)?,
            _ if not => return Err(self.bad_not(start)),
            _ => return Ok(false),
        };
        self.out.conds.push(Cond::Test(test));
        Ok(true)
    }

    fn bad_p(&mut self, start: usize) -> SyntaxError {
        let found = self.c.peek();
        refuse(&mut self.c, |c| {
            let message = format!("{} can't follow P", shown(found));
            error(50, c.span_from(start), message, "write Ppqr (p 0 to 3) or PFnnn")
        })
    }

    fn bad_not(&mut self, start: usize) -> SyntaxError {
        let found = self.c.peek();
        refuse(&mut self.c, |c| {
            let message = format!("{} can't follow N", shown(found));
            let help = "N stands before a test (I Y V P F Q T H M) or before L or S";
            error(13, c.span_from(start), message, help)
        })
    }

    fn relation(&mut self, start: usize) -> Read<Test> {
        let c = &mut self.c;
        let first = c.bump();
        let (relation, text, number) = match first {
            Some('=') => (Relation::Eq, "=", 33),
            Some('<') if c.eat('=') => (Relation::Le, "<=", 37),
            Some('<') => (Relation::Lt, "<", 31),
            _ if c.eat('=') => (Relation::Ge, ">=", 39),
            _ => (Relation::Gt, ">", 35),
        };
        let not = c.at('N');
        if not {
            c.bump();
        }
        if c.at('L') {
            c.bump();
            let operand = load(c, start, if not { Prefix::LoadNot } else { Prefix::Load })?;
            if let Operand::Load { place, .. } = operand {
                require_word(c, start, place)?;
            }
            return Ok(Test::Relation { relation, operand });
        }
        if !not && begins_constant(c) {
            return Ok(Test::Relation { relation, operand: constant(c, start)? });
        }
        let found = c.peek();
        let number = number + u8::from(not);
        let n = if not { "N" } else { "" };
        Err(refuse(c, |c| {
            let message = format!("{} can't follow {text}{n}", shown(found));
            let help = if found == Some(',') {
                format!("leave the comma out: {text}5")
            } else {
                format!("write {text}5, {text}.00FF, or {text}L and a variable's name")
            };
            error(number, c.span_from(start), message, help)
        }))
    }
}
