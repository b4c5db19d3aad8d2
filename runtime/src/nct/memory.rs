//! The NC's memory as MR and MW reach it: macro variables and parameters (NCT 4.15).

use plcc_abi::nct::{NctSettings, arithmetic::from_bcd};
use serde::{Deserialize, Serialize};

use super::operand::{Fault, Locals};

/// The parameter that says how many pots the magazine has.
const MAGAZINE: u16 = 61;
/// Macro variables #1 to #999 hold decimal fractions.
const FRACTIONS: usize = 1000;
/// Macro variables from #2000 on hold integers.
const INTEGERS_FROM: u16 = 2000;
/// Macro variables and parameters have numbers below this.
const NUMBERS: usize = 10_000;
/// The largest shift count.
const MAX_SHIFT: u8 = 8;

/// The NC's memory. Vacant macro variables and parameters that nobody set are 0.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct NcMemory {
    fractions: Vec<f64>,
    integers: Vec<i32>,
    parameters: Vec<i64>,
}

/// One register of the memory.
#[derive(Clone, Copy)]
enum Cell {
    Fraction(u16),
    Integer(u16),
    Parameter(u16),
}

impl NcMemory {
    pub(super) fn new(settings: &NctSettings) -> Self {
        let mut memory = Self {
            fractions: vec![0.0; FRACTIONS],
            integers: vec![0; NUMBERS - usize::from(INTEGERS_FROM)],
            parameters: vec![0; NUMBERS],
        };
        for &(number, value) in &settings.parameters {
            if let Some(cell) = memory.parameters.get_mut(usize::from(number)) {
                *cell = value;
            }
        }
        for &(number, value) in &settings.macros {
            match macro_cell(number) {
                Some(Cell::Fraction(_)) => memory.set(Cell::Fraction(number), value),
                Some(cell) => memory.set(cell, value.round()),
                None => {}
            }
        }
        memory
    }

    /// Whether it has as many cells of each kind as another one.
    pub(super) fn fits(&self, other: &Self) -> bool {
        let lengths = |memory: &Self| {
            (memory.fractions.len(), memory.integers.len(), memory.parameters.len())
        };
        lengths(self) == lengths(other)
    }

    /// The number of pots in the tool magazine.
    pub(super) fn magazine(&self) -> i64 {
        self.parameters.get(usize::from(MAGAZINE)).copied().unwrap_or(0)
    }

    fn set(&mut self, cell: Cell, value: f64) {
        match cell {
            Cell::Fraction(n) => store(&mut self.fractions, n, value),
            Cell::Integer(n) => store(&mut self.integers, n - INTEGERS_FROM, value as i32),
            Cell::Parameter(n) => store(&mut self.parameters, n, value as i64),
        }
    }

    /// The cell's value with the decimal point moved by `shift` places where it has one.
    fn get(&self, cell: Cell, shift: u8) -> f64 {
        match cell {
            Cell::Fraction(n) => {
                let value = self.fractions.get(usize::from(n)).copied().unwrap_or(0.0);
                (value * 10_f64.powi(shift.into())).round()
            }
            Cell::Integer(n) => {
                self.integers.get(usize::from(n - INTEGERS_FROM)).copied().unwrap_or(0).into()
            }
            // Parameters that a double can't hold exactly are far beyond four bytes anyhow.
            Cell::Parameter(n) => self.parameters.get(usize::from(n)).copied().unwrap_or(0) as f64,
        }
    }

    /// MR: copies a macro variable or parameter to local variables, as a signed number.
    pub(super) fn read(&self, locals: &mut Locals<'_>, area: u16) {
        let mut fault = Fault::default();
        if let Some(request) = Request::check(locals, area, &mut fault) {
            let value = self.get(request.cell, request.shift);
            let limit = 2_f64.powi(i32::from(request.size) * 8 - 1);
            if (-limit..limit).contains(&value) {
                locals.set_number(request.address, request.size, value as i64);
            } else {
                fault.syntax = true;
            }
        }
        fault.write(locals);
    }

    /// MW: copies a signed number from local variables to a macro variable or parameter.
    pub(super) fn write(&mut self, locals: &mut Locals<'_>, area: u16) {
        let mut fault = Fault::default();
        if let Some(request) = Request::check(locals, area, &mut fault) {
            let value = locals.number(request.address, request.size) as f64;
            let value = match request.cell {
                Cell::Fraction(_) => value / 10_f64.powi(request.shift.into()),
                Cell::Integer(_) | Cell::Parameter(_) => value,
            };
            self.set(request.cell, value);
        }
        fault.write(locals);
    }
}

fn store<T>(cells: &mut [T], index: u16, value: T) {
    if let Some(cell) = cells.get_mut(usize::from(index)) {
        *cell = value;
    }
}

/// The macro variable of a number; #0 and #1000 to #1999 can't be reached.
fn macro_cell(number: u16) -> Option<Cell> {
    match number {
        1..=999 => Some(Cell::Fraction(number)),
        INTEGERS_FROM..=9999 => Some(Cell::Integer(number)),
        _ => None,
    }
}

/// What MR or MW is to copy, read from a register area in which nothing is wrong.
struct Request {
    /// How many bytes the number has.
    size: u16,
    /// By how many places the decimal point moves.
    shift: u8,
    cell: Cell,
    /// The local variable.
    address: u16,
}

impl Request {
    /// Reads the format (bytes of the number, shift count), the segment (1 macro variables, 2
    /// parameters), the number in it and the local variable.
    fn check(locals: &Locals<'_>, area: u16, fault: &mut Fault) -> Option<Self> {
        *fault = Fault::of_area(area, 8);
        if fault.any() {
            return None;
        }
        let size = u16::from(locals.byte(area));
        let shift = locals.byte(area + 1);
        fault.syntax |= !matches!(size, 1 | 2 | 4) || shift > MAX_SHIFT;
        let segment = locals.word(area + 2);
        let number = from_bcd(locals.word(area + 4));
        fault.not_bcd |= number.is_none();
        let cell = match (segment, number) {
            (1, Some(number)) => macro_cell(number),
            (2, Some(number)) => Some(Cell::Parameter(number)),
            _ => None,
        };
        // A number that is not BCD says nothing about its range.
        fault.syntax |= !matches!(segment, 1 | 2) || (number.is_some() && cell.is_none());
        let address = fault.address(locals.word(area + 6), size.min(4));
        if fault.any() {
            return None;
        }
        cell.map(|cell| Self { size, shift, cell, address })
    }
}
