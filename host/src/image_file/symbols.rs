//! The table of symbols of a program: which of its variables are inputs and outputs, where their values
//! and their physical lines lie in the process image, and which of them other processes can give.

use std::sync::Arc;

use plcc_abi::nct::layout::region;
use plcc_abi::nct::{FlagLocation, NctName, NctTables};
use plcc_abi::pmac::{self, Definition, Kind, Layout, PmacTables, Space};
use plcc_abi::pmi::{Format, Lines, PmiTables, Role};
use plcc_abi::{ImageType, Program, Tables};
use plcc_image::{Direction, Place, Symbol, Type};

use plcc_runtime::{Executive, Purpose, VariableKey};

/// How many bytes of lines an interface board of NCT has, of inputs and of outputs each.
const BOARD_BYTES: usize = 10;

/// The variables of a program as the image file shows them.
#[derive(Clone, Debug, Default)]
pub struct SymbolTable {
    /// All of them. Those that can be given have slots, numbered from 0 in this order.
    pub symbols: Vec<Symbol>,
    /// For each slot its variable, and its name for entries of the journal.
    pub(super) slots: Vec<(VariableKey, Arc<str>)>,
}

impl SymbolTable {
    /// The table of a program. `executive` is a control with this program; names are looked up in it, and it runs
    /// no tick.
    pub fn new(program: &Program, executive: &mut dyn Executive) -> Self {
        let mut symbols = match &program.tables {
            Tables::Pmi(tables) => of_pmi(tables),
            Tables::Nct(tables) => of_nct(tables, program, executive.outputs().len()),
            Tables::Pmac(tables) => of_pmac(tables),
        };
        let mut slots = vec![];
        for symbol in &mut symbols {
            if symbol.direction == Direction::Output || symbol.elements != 1 {
                continue;
            }
            let found = executive.find(&symbol.name, Purpose::Stimulus).ok();
            let key = found.and_then(|variable| executive.keys(variable).first().copied());
            if let Some(key) = key {
                symbol.slot = Some(slots.len() as u32);
                slots.push((key, symbol.name.as_str().into()));
            }
        }
        Self { symbols, slots }
    }
}

/// A variable that has no lines of its own.
fn variable(name: String, value: Place, direction: Direction) -> Symbol {
    Symbol { name, value, line: None, elements: 1, direction, slot: None, unit: String::new() }
}

/// PMI: what the program declares, and the variables of the executive.
fn of_pmi(tables: &PmiTables) -> Vec<Symbol> {
    let place = |lines: Lines| {
        let ty = match lines.format {
            Format::Bit | Format::Binary => Type::Bits,
            Format::TwosComplement => Type::SignedBits,
            Format::Bcd => Type::Bcd,
        };
        Place::bits(tables.ports + u32::from(lines.port), ty, lines.low, lines.count)
    };
    let symbol = |symbol: &plcc_abi::pmi::Symbol| {
        let ty = match symbol.ty {
            plcc_abi::pmi::Type::Logical => Type::Logical,
            plcc_abi::pmi::Type::Integer => Type::Integer,
            plcc_abi::pmi::Type::Long => Type::Long,
        };
        let (direction, line) = match symbol.role {
            Role::Input(lines) => (Direction::Input, Some(place(lines))),
            Role::Output(lines) => (Direction::Output, Some(place(lines))),
            _ => (Direction::Internal, None),
        };
        let elements = symbol.elements.unwrap_or(1);
        let value = Place::bytes(symbol.offset, ty);
        Symbol { line, elements, ..variable(symbol.name.clone(), value, direction) }
    };
    tables.symbols.iter().map(symbol).collect()
}

/// NCT: the lines of the interface boards that the machine has, by their flags I and Y and by their own
/// name O; and the flags and registers that the program names.
fn of_nct(tables: &NctTables, program: &Program, lines: usize) -> Vec<Symbol> {
    let region = |name: &str| program.region(name).map(|region| region.offset);
    let bytes = (lines / 8).min(4 * BOARD_BYTES) as u8;
    let flag = |places: &[FlagLocation], byte: usize, bit: u8| {
        places.get(byte).map(|location| match location.unpacked {
            true => Place::bytes(location.offset + u32::from(bit), Type::Logical),
            false => Place::bits(location.offset, Type::Bits, bit, 1),
        })
    };
    let line = |name: &str, byte: u8, bit: u8| {
        let line = |from| Place::bits(from + u32::from(byte), Type::Bits, bit, 1);
        (byte < bytes).then(|| region(name).map(line)).flatten()
    };
    let mut names: Vec<NctName> = (0..bytes)
        .flat_map(|byte| (0..8).map(move |bit| (byte, Some(bit))))
        .flat_map(|(byte, bit)| {
            [NctName::I { byte, bit }, NctName::Y { byte, bit }, NctName::O { byte, bit }]
        })
        .chain(tables.named.iter().copied())
        .collect();
    names.sort();
    names.dedup();
    let symbol = |name: NctName| {
        let register = |of: &str, number: u32, unit: &str| {
            let place = Place::bytes(region(of)? + number * 2, Type::Word);
            let unit = unit.to_owned();
            Some(Symbol { unit, ..variable(name.to_string(), place, Direction::Internal) })
        };
        let (value, line, direction) = match name {
            NctName::I { byte, bit: Some(bit) } => {
                let line = line(region::LINES_IN, byte, bit);
                (flag(&tables.inputs, byte.into(), bit)?, line, Direction::Input)
            }
            NctName::Y { byte, bit: Some(bit) } => {
                let line = line(region::LINES_OUT, byte, bit);
                let direction =
                    if line.is_some() { Direction::Output } else { Direction::Internal };
                (flag(&tables.outputs, byte.into(), bit)?, line, direction)
            }
            NctName::O { byte, bit: Some(bit) } => {
                let line = line(region::LINES_OUT, byte, bit)?;
                (line, Some(line), Direction::Output)
            }
            NctName::F { byte, bit: Some(bit) } => {
                (flag(&tables.flags, byte.into(), bit)?, None, Direction::Internal)
            }
            NctName::Rh(n) => return register(region::RH, n.into(), ""),
            NctName::Q(n) => return register(region::Q, n.into(), ""),
            NctName::T(n) => return register(region::T, n.into(), "20 ms"),
            NctName::H(n) => return register(region::H, n.into(), "s"),
            NctName::M(n) => return register(region::M, n.into(), "min"),
            NctName::Rp(n) => return register(region::RP, n.into(), ""),
            // Words of flags are two bytes, which need not lie together.
            _ => return None,
        };
        Some(Symbol { line, ..variable(name.to_string(), value, direction) })
    };
    names.into_iter().filter_map(symbol).collect()
}

/// PMAC: P, Q and I that the download names, and M and L that are bits of words.
fn of_pmac(tables: &PmacTables) -> Vec<Symbol> {
    let layout = Layout::new(tables.controller);
    let mut image = vec![0; layout.size as usize];
    pmac::Run::unpack(&tables.initial, &mut image);
    let all = Tables::Pmac(tables.clone());
    let doubles = all.symbols().into_iter().filter(|symbol| symbol.ty == ImageType::Double);
    let mut symbols: Vec<Symbol> = doubles
        .map(|symbol| {
            let value = Place::bytes(symbol.offset, Type::Double);
            variable(symbol.name, value, Direction::Internal)
        })
        .collect();
    let is_output = |named: &pmac::Variable| {
        tables.outputs.iter().any(|output| output.variable.as_ref() == Some(named))
    };
    let direction = |named: &pmac::Variable| {
        let definition = match named.kind {
            Kind::M => {
                let at = layout.definition_offset(named.number);
                Definition::decode(plcc_abi::image::read_u64(&image, at))
            }
            Kind::L => tables.l.iter().find(|(number, _)| *number == named.number)?.1,
            Kind::I | Kind::P | Kind::Q => return None,
        };
        let is_io = match definition {
            Definition::X { address, .. } => layout.is_io(Space::X, address),
            Definition::Y { address, .. } => layout.is_io(Space::Y, address),
            _ => false,
        };
        Some(match (is_output(named), is_io) {
            (true, _) => Direction::Output,
            (false, true) => Direction::Input,
            (false, false) => Direction::Internal,
        })
    };
    for field in all.bit_fields() {
        let is_named = |named: &&pmac::Variable| match named.kind {
            Kind::M => field.name == format!("M{}", named.number),
            Kind::L => field.name == format!("L{}", named.number),
            Kind::I | Kind::P | Kind::Q => false,
        };
        let named = tables.named.iter().find(is_named);
        let ty = if field.signed { Type::SignedBits } else { Type::Bits };
        let value = Place::bits(field.offset, ty, field.first, field.width);
        let direction = named.and_then(direction).unwrap_or(Direction::Internal);
        symbols.push(variable(field.name, value, direction));
    }
    symbols
}
