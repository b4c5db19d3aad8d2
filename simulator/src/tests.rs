//! Tests with variables that are nothing but a table of names: the program's side is played by the test.

mod auxiliary;
mod diagrams;
mod nct;
mod pmi;
mod random;

use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use plcc_abi::machine::Machine;
use plcc_abi::nct::NctTables;
use plcc_abi::pmi::{DeclaredCode, PmiTables};
use plcc_abi::{Dialect, Program, Tables};
use plcc_diag::SourceMap;

use crate::access::{Access, Handle, Use};
use crate::event::Told;
use crate::setup::{Rules, Setup};
use crate::simulator::{Simulator, Strictness};

/// Variables of any name.
#[derive(Default)]
struct Table {
    numbers: HashMap<String, u32>,
    values: Vec<i64>,
    by_row: Vec<bool>,
    revision: u64,
    /// The flags of which a byte consists.
    bytes: HashMap<u32, [u32; 8]>,
}

impl Table {
    fn number(&mut self, name: &str) -> u32 {
        if let Some(number) = self.numbers.get(name) {
            return *number;
        }
        let number = self.values.len() as u32;
        self.numbers.insert(name.into(), number);
        self.values.push(0);
        self.by_row.push(false);
        number
    }
}

impl Access for Table {
    fn find(&mut self, name: &str, wanted: Use) -> Result<Handle, String> {
        if name.starts_with('?') {
            return Err(format!("nothing is called {name}"));
        }
        if wanted != Use::Byte {
            return Ok(Handle(self.number(name)));
        }
        let byte = name.get(..name.len() - 1).unwrap_or_default();
        let flags = std::array::from_fn(|bit| self.number(&format!("{byte}{bit}")));
        let number = self.number(&format!("byte {name}"));
        self.bytes.insert(number, flags);
        Ok(Handle(number))
    }

    fn holds(&self, _: Handle, number: i64) -> bool {
        (0..100).contains(&number)
    }

    fn overlap(&self, a: Handle, b: Handle) -> bool {
        a == b
    }

    fn is_output_line(&self, _: Handle) -> bool {
        false
    }

    fn read(&self, Handle(number): Handle) -> i64 {
        match self.bytes.get(&number) {
            None => self.values[number as usize],
            Some(flags) => {
                let bits = flags.iter().enumerate();
                bits.fold(0, |byte, (bit, flag)| byte | (self.values[*flag as usize] & 1) << bit)
            }
        }
    }

    fn write(&mut self, Handle(number): Handle, value: i64) -> bool {
        let is_there = self.values[number as usize] == value;
        if !self.by_row[number as usize] {
            self.values[number as usize] = value;
        }
        is_there
    }

    fn range(&self, _: &[Handle]) -> Option<Range<usize>> {
        None
    }

    fn image(&self) -> &[u8] {
        &[]
    }

    fn row(&mut self, Handle(number): Handle, value: i64) {
        self.values[number as usize] = value;
        self.by_row[number as usize] = true;
        self.revision += 1;
    }

    fn revision(&self) -> u64 {
        self.revision
    }
}

/// A control with a simulator.
struct Desk {
    table: Table,
    simulator: Simulator,
    /// What was told, with the ticks.
    told: Vec<(u64, Told)>,
    tick: u64,
}

fn program(dialect: Dialect, codes: &[DeclaredCode]) -> Program {
    let tables = match dialect {
        Dialect::Pmi => Tables::Pmi(PmiTables { codes: codes.to_vec(), ..PmiTables::default() }),
        _ => Tables::Nct(NctTables::default()),
    };
    Program { files: vec![], image_size: 0, regions: vec![], tasks: vec![], tables, names: vec![] }
}

impl Desk {
    /// A control with a machine file and a part program.
    fn new(dialect: Dialect, machine: &str, codes: &[DeclaredCode], part: Option<&str>) -> Self {
        let machine = Machine::parse(machine).unwrap();
        let table = machine.simulator.unwrap_or_default();
        let program = program(dialect, codes);
        let mut setup = Setup::new(&table, &program, &[], 20_000_000).unwrap();
        if let Some(part) = part {
            let mut sources = SourceMap::new();
            let file = sources.add("part.nc", part.as_bytes());
            let found = setup.read_part_program(&sources, file);
            let errors: Vec<_> = found.iter().filter(|found| found.is_error()).collect();
            assert!(errors.is_empty(), "{errors:?}");
        }
        let mut variables = Table::default();
        let strictness = Strictness::Refuse;
        let made = Simulator::new(Arc::new(setup), 20_000_000, &mut variables, strictness);
        let (simulator, _) = made.unwrap();
        Self { table: variables, simulator, told: vec![], tick: 0 }
    }

    /// Sets a variable as the program would.
    fn set(&mut self, name: &str, value: i64) {
        let number = self.table.number(name);
        self.table.values[number as usize] = value;
    }

    fn get(&mut self, name: &str) -> i64 {
        let number = self.table.number(name);
        self.table.values[number as usize]
    }

    fn key(&mut self, name: &str, value: i64) {
        let number = self.simulator.keys().iter().position(|key| key.name == name).unwrap();
        self.simulator.key(number, value, &mut self.table);
    }

    /// Does a step.
    fn step(&mut self) {
        self.simulator.step(&mut self.table);
        let tick = self.tick;
        self.told.extend(self.simulator.take_told().map(|told| (tick, told)));
        if self.table.by_row.contains(&true) {
            self.table.by_row.fill(false);
            self.table.revision += 1;
        }
        self.tick += 1;
    }

    /// Does a step, and gives these variables.
    fn see<const N: usize>(&mut self, names: [&str; N]) -> [i64; N] {
        self.step();
        names.map(|name| self.get(name))
    }
}

/// The codes of the mistakes of a part program, with their places.
fn mistakes(dialect: Dialect, machine: &str, part: &str) -> Vec<(&'static str, u32, u32)> {
    let table = Machine::parse(machine).unwrap().simulator.unwrap_or_default();
    let code = |letter, number| DeclaredCode { letter, number, delayed: false };
    let rules = Rules::new(&table, &program(dialect, &[code('M', 8), code('G', 61)]));
    let mut sources = SourceMap::new();
    let file = sources.add("part.nc", part.as_bytes());
    let (_, found) = crate::read_part_program(&rules, &sources, file);
    let place = |found: &plcc_diag::Diagnostic| {
        let (line, column) = sources.line_col(file, found.span.start);
        (found.code, line, column)
    };
    found.iter().map(place).collect()
}
