//! Reads the variables after `L`, `NL`, `S` and `NS`, and the operands of operations and relations
//! (NCT 4.6, 4.7).
//!
//! In all functions `start` is the offset at which the statement begins, for the place of an error.

use crate::nct::{
    ast::{Bit, Operand, Space, Variable, Word},
    read::{
        cursor::Cursor,
        diagnostic::{Read, SyntaxError, error, shown},
        number::{Digits, address, decimal, hexadecimal},
    },
};

/// What is before a variable's name.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Prefix {
    Load,
    LoadNot,
    Store,
    StoreNot,
}

impl Prefix {
    fn stores(self) -> bool {
        matches!(self, Self::Store | Self::StoreNot)
    }

    pub(crate) fn negates(self) -> bool {
        matches!(self, Self::LoadNot | Self::StoreNot)
    }

    fn text(self) -> &'static str {
        match self {
            Self::Load => "L",
            Self::LoadNot => "NL",
            Self::Store => "S",
            Self::StoreNot => "NS",
        }
    }

    /// The error of a letter that can't follow this prefix.
    fn number(self) -> u8 {
        match self {
            Self::Load => 51,
            Self::LoadNot => 14,
            Self::Store => 30,
            Self::StoreNot => 15,
        }
    }
}

/// Reads the address of a word or bit after its letter: two digits name a word, three a bit;
/// after `F` there is one digit more.
fn bit_or_word(cursor: &mut Cursor<'_>, start: usize, space: Space) -> Read<Variable> {
    let least = if space == Space::F { 3 } else { 2 };
    let found = address(cursor, start, least, least + 1, Digits::Octal)?;
    let variable = if found.len == least {
        Variable::Word(Word::Bytes { space, byte: found.value })
    } else {
        Variable::Bit(bit_of_digits(space, found.value))
    };
    check_port(cursor, start, variable)?;
    Ok(variable)
}

/// The bit of an address whose digits were read as one decimal number: the last digit is the bit,
/// the others are the byte.
fn bit_of_digits(space: Space, digits: u16) -> Bit {
    Bit { space, byte: digits / 10, bit: (digits % 10) as u8 }
}

/// Reads the address of a bit after its letter.
pub(crate) fn bit(cursor: &mut Cursor<'_>, start: usize, space: Space) -> Read<Bit> {
    let len = if space == Space::F { 4 } else { 3 };
    let found = address(cursor, start, len, len, Digits::Octal)?;
    let bit = bit_of_digits(space, found.value);
    check_port(cursor, start, Variable::Bit(bit))?;
    Ok(bit)
}

/// Refuses a physical line of an interface board that does not exist.
fn check_port(cursor: &Cursor<'_>, start: usize, variable: Variable) -> Read<()> {
    let (space, byte) = match variable {
        Variable::Bit(bit) => (bit.space, bit.byte),
        Variable::Word(Word::Bytes { space, byte }) => (space, byte),
        Variable::Word(_) => return Ok(()),
    };
    if matches!(space, Space::P | Space::O) && byte >= space.bytes() {
        return Err(error(
            60,
            cursor.span_from(start),
            format!("there is no interface board {} to reach directly", byte / 10),
            "direct inputs and outputs are on boards 0 to 3; use I, U, D or S for flags",
        ));
    }
    Ok(())
}

/// Reads the number of a counter or timer after its letter.
pub(crate) fn counter(cursor: &mut Cursor<'_>, start: usize, letter: char) -> Read<Word> {
    let len = if letter == 'M' { 1 } else { 2 };
    let n = address(cursor, start, len, len, Digits::Decimal)?.value as u8;
    let (number, most, what) = match letter {
        'Q' => (42, 31, "counters are Q00 to Q31"),
        'T' => (43, 49, "20 ms timers are T00 to T49"),
        'H' => (43, 99, "second timers are H00 to H99"),
        _ => (43, 9, "minute timers are M0 to M9"),
    };
    if n > most {
        let message = format!("there is no {letter}{n:02}");
        return Err(error(number, cursor.span_from(start), message, what));
    }
    Ok(match letter {
        'Q' => Word::Q(n),
        'T' => Word::T(n),
        'H' => Word::H(n),
        _ => Word::M(n),
    })
}

/// Reads a register or constant after `R`.
fn register(cursor: &mut Cursor<'_>, start: usize, prefix: Prefix) -> Read<Word> {
    if cursor.eat('H') {
        let n = address(cursor, start, 3, 3, Digits::Decimal)?.value;
        let span = cursor.span_from(start);
        let Some(register) = u8::try_from(n).ok().filter(|n| *n <= 199) else {
            let help = "registers are RH000 to RH199; 050 to 099 and 150 to 199 can be stored to";
            return Err(error(64, span, format!("there is no RH{n:03}"), help));
        };
        if prefix.stores() && n % 100 < 50 {
            let message = format!("RH{n:03} is written by the NC, not by the PLC program");
            let help = "store to RH050 to RH099 or RH150 to RH199";
            return Err(error(66, span, message, help));
        }
        return Ok(Word::Rh(register));
    }
    if cursor.at('P') && prefix.stores() {
        cursor.bump();
        let _ = address(cursor, start, 3, 3, Digits::Decimal);
        return Err(error(
            22,
            cursor.span_from(start),
            "constants of the control can't be stored to",
            "RP constants are set on the control or in the machine file; keep the value in F",
        ));
    }
    if cursor.eat('P') {
        let n = address(cursor, start, 3, 3, Digits::Decimal)?.value;
        return match u8::try_from(n) {
            Ok(n @ 1..=40) => Ok(Word::Rp(n)),
            _ => Err(error(
                49,
                cursor.span_from(start),
                format!("there is no RP{n:03}"),
                "constants are RP001 to RP040",
            )),
        };
    }
    let found = cursor.peek();
    Err(refuse(cursor, |cursor| {
        error(
            23,
            cursor.span_from(start),
            format!("H or P must follow R here, not {}", shown(found)),
            "RHnnn is a register, RP0nn a constant",
        )
    }))
}

/// Makes the error of a character that can't be here, and skips what belongs to the mistake. The
/// character itself is taken before `make` is called, unless it may be a part of the program's
/// structure, such as `Z` or a parenthesis. The letters and digits of a variable right after it
/// are skipped afterwards.
pub(crate) fn refuse(
    cursor: &mut Cursor<'_>,
    make: impl FnOnce(&Cursor<'_>) -> SyntaxError,
) -> SyntaxError {
    if !matches!(cursor.peek(), None | Some('Z' | 'E' | 'J' | ':' | '$' | '(' | ')' | '[' | ']')) {
        cursor.bump();
    }
    let fail = make(cursor);
    while !cursor.gap()
        && cursor.peek().is_some_and(|d| d.is_ascii_digit() || "IYVPFRQTHMLSN".contains(d))
    {
        cursor.bump();
    }
    fail
}

/// Reads a variable after `L`, `NL`, `S` or `NS`.
pub(crate) fn variable(cursor: &mut Cursor<'_>, start: usize, prefix: Prefix) -> Read<Variable> {
    let letter = cursor.peek();
    let space = match letter {
        Some('I') if !prefix.stores() => Some(Space::I),
        Some('V') if !prefix.stores() => Some(Space::V),
        Some('P') if !prefix.stores() => Some(Space::P),
        Some('O') if prefix.stores() => Some(Space::O),
        Some('Y') => Some(Space::Y),
        Some('F') => Some(Space::F),
        _ => None,
    };
    if let Some(space) = space {
        cursor.bump();
        if space == Space::F && cursor.eat('I') {
            let at = address(cursor, start, 3, 3, Digits::Decimal)?.value;
            return Ok(Variable::Word(Word::Indirect(at)));
        }
        let variable = bit_or_word(cursor, start, space)?;
        if prefix.stores() {
            check_even(cursor, start, variable)?;
        }
        return Ok(variable);
    }
    match letter {
        Some('R') => {
            cursor.bump();
            register(cursor, start, prefix).map(Variable::Word)
        }
        Some(letter @ ('Q' | 'T' | 'H' | 'M')) => {
            cursor.bump();
            counter(cursor, start, letter).map(Variable::Word)
        }
        _ => {
            let names = if prefix.stores() { "Y O F R Q T H M" } else { "I Y V P F R Q T H M" };
            Err(refuse(cursor, |cursor| {
                error(
                    prefix.number(),
                    cursor.span_from(start),
                    format!("{} can't follow {}", shown(letter), prefix.text()),
                    format!("one of {names} must follow, the beginning of a variable's name"),
                )
            }))
        }
    }
}

/// Refuses a word at an odd byte of an interface board, to which none can be stored.
fn check_even(cursor: &Cursor<'_>, start: usize, variable: Variable) -> Read<()> {
    match variable {
        Variable::Word(Word::Bytes { space: space @ (Space::Y | Space::O), byte })
            if byte < 40 && byte % 2 == 1 =>
        {
            Err(error(
                58,
                cursor.span_from(start),
                format!("{}{byte:02} is at an odd byte of its board", space.letter()),
                "store words to even bytes, or store the bits one by one",
            ))
        }
        _ => Ok(()),
    }
}

/// Whether a constant that needs no comma begins here: a digit, or a point.
pub(crate) fn begins_constant(cursor: &Cursor<'_>) -> bool {
    cursor.peek().is_some_and(|d| d.is_ascii_digit() || d == '.')
}

/// Reads such a constant: decimal, or hexadecimal after a point.
pub(crate) fn constant(cursor: &mut Cursor<'_>, start: usize) -> Read<Operand> {
    let value = if cursor.eat('.') { hexadecimal(cursor, start)? } else { decimal(cursor, start)? };
    Ok(Operand::Const(value))
}

/// Reads a variable after `L` or `NL` as an operand.
pub(crate) fn load(cursor: &mut Cursor<'_>, start: usize, prefix: Prefix) -> Read<Operand> {
    let variable = variable(cursor, start, prefix)?;
    Ok(Operand::Load { negate: prefix.negates(), place: variable })
}

/// Refuses a bit where a number of 16 bits is needed.
pub(crate) fn require_word(cursor: &Cursor<'_>, start: usize, variable: Variable) -> Read<()> {
    let Variable::Bit(bit) = variable else { return Ok(()) };
    let digits = if bit.space == Space::F { "three digits" } else { "two digits" };
    Err(error(
        7,
        cursor.span_from(start),
        format!("{bit} is a bit, and this statement works on words"),
        format!("name a word with {digits}; bits go with L, S, A, O and X"),
    ))
}
