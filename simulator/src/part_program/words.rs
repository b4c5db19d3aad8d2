//! Which words a control takes.

use plcc_abi::Dialect;
use plcc_abi::machine::simulator::Decimal;
use plcc_abi::pmi::DeclaredCode;

use crate::arc::Plane;
use crate::setup::Rules;

/// What a letter is for a control.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Letter {
    /// G.
    Code,
    /// M.
    Function,
    /// The axis with this number.
    Axis(usize),
    /// A (0), B (1) or C (2) as a function.
    Misc(usize),
    /// F.
    Feed,
    /// S.
    Speed,
    /// T.
    Tool,
    /// N.
    Number,
    /// I (0), J (1) or K (2).
    Centre(usize),
    /// R.
    Radius,
    /// P.
    Parameter,
    /// X of a control whose table has no axis X, for G61 to G66.
    AuxPosition,
}

/// What a G code is for a control.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Code {
    /// G0.
    Rapid,
    /// G1.
    Line,
    /// G2 (true) or G3.
    Arc(bool),
    /// G17 to G19.
    Plane(Plane),
    /// G33 (NCT).
    Thread,
    /// G28 (NCT).
    Home,
    /// G74 and G84 (NCT).
    Tap,
    /// G81.1 (true) or G80 (NCT).
    Chopping(bool),
    /// G4.
    Dwell,
    /// G90 (true) or G91.
    Absolute(bool),
    /// A code without effect; the number of its group.
    Nothing(u8),
    /// G61 to G66: the number of the auxiliary axis.
    Aux(u8),
    /// One that only the program declares.
    Declared,
}

impl Code {
    /// Two codes of a group can't be in one block.
    pub(super) fn group(self, number: i128) -> i128 {
        match self {
            Self::Rapid | Self::Line | Self::Arc(_) | Self::Thread => -1,
            Self::Plane(_) => -5,
            Self::Dwell | Self::Home => -2,
            Self::Tap | Self::Chopping(_) => -6,
            Self::Absolute(_) => -3,
            Self::Nothing(group) => -10 - i128::from(group),
            Self::Aux(_) => -4,
            Self::Declared => number,
        }
    }
}

impl Rules {
    /// What a letter is; `None` for one that the control or the table lacks.
    pub(super) fn letter(&self, letter: char) -> Option<Letter> {
        if let Some(misc) = "ABC".find(letter).filter(|_| self.misc.contains(letter)) {
            return Some(Letter::Misc(misc));
        }
        if let Some(axis) = self.letters.iter().position(|name| *name == Some(letter)) {
            return Some(Letter::Axis(axis));
        }
        Some(match letter {
            'G' => Letter::Code,
            'M' => Letter::Function,
            'F' => Letter::Feed,
            'S' => Letter::Speed,
            'T' => Letter::Tool,
            'N' => Letter::Number,
            'I' => Letter::Centre(0),
            'J' => Letter::Centre(1),
            'K' => Letter::Centre(2),
            'R' => Letter::Radius,
            'P' => Letter::Parameter,
            'X' if self.aux > 0 => Letter::AuxPosition,
            _ => return None,
        })
    }

    /// What a G code does that is not the program's own: the code by its number.
    fn built_in(&self, number: i128) -> Option<Code> {
        let inch = self.is_inch;
        let is_nct = self.dialect == Dialect::Nct;
        Some(match number {
            28 if is_nct => Code::Home,
            33 if is_nct => Code::Thread,
            74 | 84 if is_nct => Code::Tap,
            80 if is_nct => Code::Chopping(false),
            0 => Code::Rapid,
            1 => Code::Line,
            2 => Code::Arc(true),
            3 => Code::Arc(false),
            4 => Code::Dwell,
            90 => Code::Absolute(true),
            91 => Code::Absolute(false),
            17 => Code::Plane(Plane::Xy),
            18 => Code::Plane(Plane::Zx),
            19 => Code::Plane(Plane::Yz),
            20 if inch => Code::Nothing(1),
            21 if !inch => Code::Nothing(1),
            40 => Code::Nothing(2),
            49 => Code::Nothing(3),
            54 => Code::Nothing(4),
            64 => Code::Nothing(5),
            94 => Code::Nothing(6),
            97 => Code::Nothing(7),
            _ => return None,
        })
    }

    /// What a G code with a fraction is; there is G81.1 alone.
    pub(super) fn code_with_fraction(&self, number: Decimal) -> Option<Code> {
        let is_it = self.dialect == Dialect::Nct
            && number.integer().is_none()
            && number.times(1_000_000) == Some(81_100_000);
        is_it.then_some(Code::Chopping(true))
    }

    /// What a G code is, and its number in the program's list if that declares it; `None` for one that is not taken.
    pub(super) fn code(&self, number: i128) -> Option<(Code, Option<u16>)> {
        let declared = self.declared('G', number);
        let aux = match number {
            61..=66 if declared.is_some() => Some(Code::Aux((number - 61) as u8)),
            _ => None,
        };
        let code = aux.or(self.built_in(number)).or(declared.map(|_| Code::Declared))?;
        Some((code, declared))
    }

    /// The number in the program's list of a code that it declares (PMI).
    pub(super) fn declared(&self, letter: char, number: i128) -> Option<u16> {
        let is_it =
            |code: &DeclaredCode| code.letter == letter && i128::from(code.number) == number;
        let at = self.codes.iter().position(is_it)?;
        u16::try_from(at).ok()
    }

    /// The largest number of S, T and the functions.
    pub(super) fn largest(&self) -> i128 {
        if self.dialect == Dialect::Nct { 65_535 } else { 0x7FFF_FFFF }
    }

    /// The largest M.
    pub(super) fn largest_m(&self) -> i128 {
        if self.dialect == Dialect::Pmi { 299 } else { 999 }
    }
}
