//! The names of an NCT program's variables, as users write them ([`NctName`]).

use std::sync::Arc;

use plcc_abi::DialectVariable;
use plcc_abi::Program;
use plcc_abi::nct::layout::region;
use plcc_abi::nct::{FlagLocation, IMAGE_BYTES, LINE_BYTES, NctName, NctTables};
use plcc_abi::place::{Direction, Place, Type};

use crate::names::{Class, Names, Properties};
use crate::safe_outputs::{SafeLines, SafeOutputs};
use crate::{NameError, Purpose, Setting, ValueError, VariableKey};

use super::forces;

/// Bytes of lines of an interface board, of inputs and of outputs each.
pub(super) const BOARD_BYTES: u8 = 10;

/// Where the parts of the image begin that names need; `None` for one that the program lacks.
#[derive(Debug)]
struct Offsets {
    lines_in: Option<u32>,
    lines_out: Option<u32>,
    rh: Option<u32>,
    q: Option<u32>,
    t: Option<u32>,
    h: Option<u32>,
    m: Option<u32>,
    rp: Option<u32>,
}

/// All names of a program on a machine.
#[derive(Debug)]
pub(super) struct NctNames {
    tables: Arc<NctTables>,
    /// How many interface boards the machine has.
    boards: u8,
    offsets: Offsets,
}

/// The key of a variable.
pub(super) fn key(name: NctName) -> VariableKey {
    VariableKey(DialectVariable::Nct(name))
}

/// The variable of a key; `None` for the key of another control.
pub(super) fn name(key: VariableKey) -> Option<NctName> {
    let DialectVariable::Nct(name) = key.0 else { return None };
    Some(name)
}

/// A value: a signed decimal integer.
pub(super) fn parse(text: &str) -> Result<Setting, ValueError> {
    let unfit = |reason: &str| ValueError { value: text.into(), reason: reason.into() };
    let text = text.trim();
    let digits = text.strip_prefix(['-', '+']).unwrap_or(text);
    if digits.is_empty() || !digits.bytes().all(|b| b.is_ascii_digit()) {
        return Err(unfit("is not an integer"));
    }
    text.parse().map(Setting::Int).map_err(|_| unfit("is beyond any variable's range"))
}

impl NctNames {
    /// The names of a program with these tables, on a machine with so many interface boards.
    pub(super) fn new(program: &Program, tables: Arc<NctTables>, boards: u8) -> Self {
        let region = |name: &str| program.region(name).map(|region| region.offset);
        let offsets = Offsets {
            lines_in: region(region::LINES_IN),
            lines_out: region(region::LINES_OUT),
            rh: region(region::RH),
            q: region(region::Q),
            t: region(region::T),
            h: region(region::H),
            m: region(region::M),
            rp: region(region::RP),
        };
        Self { tables, boards, offsets }
    }

    /// How many bytes of lines of inputs, and as many of outputs, the machine's boards have.
    pub(super) fn line_bytes(&self) -> u8 {
        self.boards.saturating_mul(BOARD_BYTES)
    }

    /// The offset of the first byte of output lines.
    pub(super) fn lines_out(&self) -> u32 {
        self.offsets.lines_out.unwrap_or(0)
    }

    /// Finds what a name means.
    pub(super) fn variable(&self, text: &str, purpose: Purpose) -> Result<NctName, NameError> {
        let unfit = |reason: String| NameError::Unfit { name: text.into(), reason };
        let name: NctName = text.trim().parse().map_err(|e| unfit(format!("{e}")))?;
        let line = match name {
            NctName::I { byte, .. } | NctName::P { byte, .. } | NctName::O { byte, .. } => byte,
            _ => 0,
        };
        let (board, boards) = (line / BOARD_BYTES, self.boards);
        if purpose == Purpose::Stimulus && board < 4 && board >= boards {
            return Err(unfit(format!(
                "is on an interface board that the machine does not have (boards: {boards})"
            )));
        }
        Ok(name)
    }

    /// Where a bit of a byte among locations is.
    fn flag(locations: &[FlagLocation], byte: usize, bit: u8) -> Option<Place> {
        locations.get(byte).map(|location| match location.unpacked {
            true => Place::bytes(location.offset + u32::from(bit), Type::Logical),
            false => Place::bits(location.offset, Type::Bits, bit, 1),
        })
    }

    /// The line of a bit on the machine's boards, whose lines begin at `lines`.
    fn line(&self, lines: Option<u32>, byte: u8, bit: u8) -> Option<Place> {
        let lines = lines.filter(|_| byte < self.line_bytes())?;
        Some(Place::bits(lines + u32::from(byte), Type::Bits, bit, 1))
    }

    /// Where the value and the lines of a variable are. Words of flags are two bytes, which need not lie together, and
    /// OP is kept outside the image.
    fn places(&self, name: NctName) -> (Option<Place>, Option<Place>) {
        let NctTables { inputs, outputs, flags, .. } = &*self.tables;
        let Offsets { lines_in, lines_out, rh, q, t, h, m, rp } = self.offsets;
        let word = |first: Option<u32>, number: u32| {
            (first.map(|first| Place::bytes(first + number * 2, Type::Word)), None)
        };
        match name {
            NctName::I { byte, bit: Some(bit) } => {
                (Self::flag(inputs, byte.into(), bit), self.line(lines_in, byte, bit))
            }
            NctName::Y { byte, bit: Some(bit) } => {
                (Self::flag(outputs, byte.into(), bit), self.line(lines_out, byte, bit))
            }
            NctName::F { byte, bit: Some(bit) } => (Self::flag(flags, byte.into(), bit), None),
            NctName::P { byte, bit: Some(bit) } => {
                let line = self.line(lines_in, byte, bit);
                (line, line)
            }
            NctName::O { byte, bit: Some(bit) } => {
                let line = self.line(lines_out, byte, bit);
                (line, line)
            }
            NctName::Rh(n) => word(rh, n.into()),
            NctName::Q(n) => word(q, n.into()),
            NctName::T(n) => word(t, n.into()),
            NctName::H(n) => word(h, n.into()),
            NctName::M(n) => word(m, n.into()),
            NctName::Rp(n) => word(rp, n.into()),
            NctName::I { bit: None, .. }
            | NctName::Y { bit: None, .. }
            | NctName::P { bit: None, .. }
            | NctName::O { bit: None, .. }
            | NctName::F { bit: None, .. }
            | NctName::Op(_) => (None, None),
        }
    }
}

impl Names for NctNames {
    fn find(&self, name: &str, purpose: Purpose) -> Result<VariableKey, NameError> {
        self.variable(name, purpose).map(key)
    }

    fn canonical(&self, key: VariableKey) -> String {
        name(key).map_or_else(String::new, |name| name.to_string())
    }

    fn properties(&self, key: VariableKey) -> Properties {
        let Some(name) = name(key) else { return Properties::internal(Class::Integer, None) };
        let class = if name.is_bit() { Class::Logical } else { Class::Integer };
        let (value, line) = self.places(name);
        let (direction, can_be_forced) = match name {
            NctName::I { byte, .. } | NctName::P { byte, .. } => {
                (Direction::Input, usize::from(byte) < IMAGE_BYTES)
            }
            // Those that drive no line are flags to the NC.
            NctName::Y { byte, .. } | NctName::O { byte, .. } if byte < self.line_bytes() => {
                (Direction::Output, true)
            }
            NctName::Y { byte, .. } | NctName::O { byte, .. } => {
                (Direction::Internal, usize::from(byte) < LINE_BYTES)
            }
            _ => (Direction::Internal, false),
        };
        let unit = match name {
            NctName::T(_) => "20 ms",
            NctName::H(_) => "s",
            NctName::M(_) => "min",
            _ => "",
        };
        // A group of flags without its last digit is a word (NCT 2.1.1), as OP is.
        let width = (class == Class::Integer && value.is_none()).then_some(16);
        let internal = Properties::internal(class, value);
        Properties { direction, width, line, unit, can_be_forced, ..internal }
    }

    /// NCT has no arrays.
    fn element(&self, _: VariableKey, _: u32) -> Option<VariableKey> {
        None
    }

    fn parse(&self, _: VariableKey, text: &str) -> Result<Setting, ValueError> {
        parse(text)
    }

    fn declared(&self) -> Vec<(String, VariableKey)> {
        self.tables.named.iter().map(|&name| (name.to_string(), key(name))).collect()
    }

    /// The lines of the interface boards that the machine has: `O000`, `O001` and on.
    fn outputs(&self) -> Vec<(String, VariableKey)> {
        let lines = (0..self.line_bytes()).flat_map(|byte| (0..8).map(move |bit| (byte, bit)));
        let named = lines.map(|(byte, bit)| NctName::O { byte, bit: Some(bit) });
        named.map(|name| (name.to_string(), key(name))).collect()
    }

    /// The lines of the interface boards that the machine has, by their flags I and Y and by their own name O; and the
    /// flags and registers that the program names.
    fn shown_in_image(&self) -> Vec<VariableKey> {
        let lines =
            (0..self.line_bytes()).flat_map(|byte| (0..8).map(move |bit| (byte, Some(bit))));
        let mut names: Vec<NctName> = lines
            .flat_map(|(byte, bit)| {
                [NctName::I { byte, bit }, NctName::Y { byte, bit }, NctName::O { byte, bit }]
            })
            .chain(self.tables.named.iter().copied())
            .collect();
        names.sort();
        names.dedup();
        let shown =
            |name: &NctName| !matches!(name, NctName::P { .. }) && self.places(*name).0.is_some();
        names.into_iter().filter(shown).map(key).collect()
    }

    /// `P012` of I012, `O012` of Y012; of a word those of its two bytes.
    fn lines(&self, key: VariableKey) -> Vec<VariableKey> {
        type Line = fn(u8, u8) -> NctName;
        let input: Line = |byte, bit| NctName::P { byte, bit: Some(bit) };
        let output: Line = |byte, bit| NctName::O { byte, bit: Some(bit) };
        let (line, byte, bit) = match name(key) {
            Some(NctName::I { byte, bit } | NctName::P { byte, bit }) => (input, byte, bit),
            Some(NctName::Y { byte, bit } | NctName::O { byte, bit }) => (output, byte, bit),
            _ => return vec![],
        };
        let bits = match bit {
            Some(bit) => vec![(byte, bit)],
            None => [byte, byte.saturating_add(1)]
                .into_iter()
                .flat_map(|byte| (0..8).map(move |bit| (byte, bit)))
                .collect(),
        };
        let wired = bits.into_iter().filter(|(byte, _)| *byte < self.line_bytes());
        wired.map(|(byte, bit)| self::key(line(byte, bit))).collect()
    }

    fn safe_lines(&self, outputs: &SafeOutputs) -> Result<SafeLines, Vec<NameError>> {
        self.lines_at_stop(outputs)
    }

    fn share_forced_bits(&self, a: VariableKey, b: VariableKey) -> bool {
        name(a).zip(name(b)).is_some_and(|(a, b)| forces::share_bits(a, b))
    }
}
