//! Definitions of M- and L-variables, and addresses.

use plcc_abi::pmac::{Definition, Field, Format, Space};

use super::cursor::{Parsed, syntax, syntax_help};
use super::expr::Reader;

impl Reader<'_> {
    /// An address: a colon or none, then a number within the controller's memory.
    pub(crate) fn address(&mut self) -> Parsed<u32> {
        let _ = self.cur.eat(b':');
        self.cur.blanks();
        let start = self.cur.pos;
        let Some(value) = self.cur.integer() else {
            return self.cur.expected("an address");
        };
        let last = if self.is_turbo() { 0xFF_FFFF } else { 0xFFFF };
        match u32::try_from(value) {
            Ok(address) if address <= last => Ok(address),
            _ => {
                let message = format!("addresses end at ${last:X}, this is ${value:X}");
                Err(self.beyond_controller(self.cur.since(start), message))
            }
        }
    }

    /// A number from `least` to `most`, which is 255 at most. Errors call it `what`.
    fn small(&mut self, what: &str, least: u64, most: u64) -> Parsed<u8> {
        self.cur.blanks();
        let start = self.cur.pos;
        let Some(value) = self.cur.integer() else {
            return self.cur.expected(what);
        };
        if (least..=most).contains(&value) {
            return Ok(value as u8);
        }
        syntax(self.cur.since(start), format!("{what} is {least} to {most}, not {value}"))
    }

    /// The letter of a format.
    fn format(&mut self) -> Parsed<Format> {
        let format = match self.cur.peek().to_ascii_uppercase() {
            b'U' => Format::U,
            b'S' => Format::S,
            b'D' => Format::D,
            b'C' => Format::C,
            _ => return self.cur.expected("a format: U, S, D or C"),
        };
        self.cur.pos += 1;
        Ok(format)
    }

    /// Takes a field such as `,0,48` after the address of a D, DP, L or F definition. It has no
    /// meaning, since these are never parts of words.
    fn no_field(&mut self) -> Parsed<()> {
        let mut parts = 0;
        while parts < 3 && self.cur.eat(b',') {
            if self.cur.peek().is_ascii_alphabetic() {
                self.format()?;
                break;
            }
            self.small("a number", 0, 48)?;
            parts += 1;
        }
        Ok(())
    }

    /// A definition, as it stands after `->`.
    pub(crate) fn definition(&mut self) -> Parsed<Definition> {
        self.cur.blanks();
        let start = self.cur.pos;
        if self.cur.eat(b'*') {
            return Ok(Definition::Star);
        }
        if ["TWD", "TWB", "TWS", "TWR"].iter().any(|word| self.cur.eat_word(word)) {
            return self.thumbwheel();
        }
        if self.cur.eat_word("DP") {
            let address = self.address()?;
            self.no_field()?;
            return Ok(Definition::Dp { address });
        }
        let letter = self.cur.peek().to_ascii_uppercase();
        let space = match letter {
            b'D' | b'L' | b'F' => {
                self.cur.pos += 1;
                let address = self.address()?;
                self.no_field()?;
                return Ok(match letter {
                    b'D' => Definition::D { address },
                    b'L' => Definition::L { address },
                    _ => Definition::F { address },
                });
            }
            b'X' => Space::X,
            b'Y' => Space::Y,
            _ => return self.cur.expected("X, Y, D, L, DP, F, TWD, TWB, TWS, TWR or *"),
        };
        self.cur.pos += 1;
        let addr = self.address()?;
        let (mut offset, mut width, mut format) = (0, 1, Format::U);
        if !self.cur.eat(b',') {
            let at = self.cur.since(start);
            let help = "a bit's number: Y:$FFC2,8, or 24 for the whole word";
            return syntax_help(at, "it is not said which bits of the word are meant", help);
        }
        offset += self.small("a bit's number", 0, 24)?;
        let whole = offset == 24;
        if whole {
            (offset, width) = (0, 24);
        }
        if self.cur.eat(b',') {
            if whole && self.cur.peek().is_ascii_alphabetic() {
                format = self.format()?;
            } else {
                let given = self.small("the number of bits", 0, 24)?;
                // A width of 0 means 1. After the offset 24, which means the whole word, there are
                // no bits left.
                if !whole {
                    width = given.max(1);
                } else if given > 0 {
                    let at = self.cur.since(start);
                    let message = format!("a word has 24 bits: {given} from bit 24 on do not fit");
                    return syntax_help(at, message, "24 without a width is the whole word");
                }
                if self.cur.eat(b',') {
                    format = self.format()?;
                }
            }
        }
        if offset + width > 24 {
            let at = self.cur.since(start);
            let message = format!("a word has 24 bits: {width} from bit {offset} on do not fit");
            return syntax_help(at, message, "offset and width together are 24 at most");
        }
        // A single bit is 0 or 1 whatever its format (guide, Memory Map).
        if width == 1 {
            format = Format::U;
        }
        Ok(Definition::word(space, addr, Field { offset, width, format }))
    }

    /// The rest of a thumbwheel definition. Only its address is kept.
    fn thumbwheel(&mut self) -> Parsed<Definition> {
        let _ = self.cur.eat(b':');
        let Some(address) = self.cur.integer() else {
            return self.cur.expected("an address on the multiplexer");
        };
        let address = u32::try_from(address).unwrap_or(u32::MAX) & 0xFFFF;
        // Both TWD:4,0.8.3,U and TWD:4,0,8.3,U are found in sources.
        let mut parts = 0;
        while parts < 4 && (self.cur.eat(b',') || self.cur.eat(b'.')) {
            if self.cur.peek().is_ascii_alphabetic() {
                self.format()?;
                break;
            }
            self.small("a number", 0, 255)?;
            parts += 1;
        }
        Ok(Definition::Tw { address })
    }
}
