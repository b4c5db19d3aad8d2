//! A small PMI control for tests: an image, timers, and the statement interpreter.
#![allow(clippy::panic, clippy::unwrap_used, dead_code)]

use plcc_abi::{
    Engine, Outcome, Program, Scan, Tables,
    engine::NoHost,
    image,
    pmi::{PmiTables, Symbol, TimerKind, Type},
};
use plcc_diag::SourceMap;
use plcc_frontend::{
    common::{MemoryLoader, Options},
    pmi,
};

/// A control with one program.
pub(crate) struct Control {
    program: Program,
    pub(crate) engine: pmi::Interpreter,
    image: Vec<u8>,
}

impl Control {
    /// A control with the program `text` at power-up. The program must have no errors.
    pub(crate) fn new(text: &str) -> Self {
        let mut sources = SourceMap::new();
        let file = sources.add("main.pmi", text.as_bytes());
        let options = Options::default();
        let (program, diagnostics) = pmi::check(&mut sources, file, &MemoryLoader::new(), &options);
        let program = program.unwrap_or_else(|| panic!("{text}\n{diagnostics:?}"));
        let lowered = program.lower().unwrap();
        let mut image = vec![0; lowered.program.image_size as usize];
        let Tables::Pmi(tables) = &lowered.program.tables else { panic!() };
        for &(offset, ty, value) in &tables.initial {
            write(&mut image, ty, offset, value);
        }
        Self { program: lowered.program, engine: program.counting_interpreter(), image }
    }

    pub(crate) fn tables(&self) -> &PmiTables {
        let Tables::Pmi(tables) = &self.program.tables else { panic!() };
        tables
    }

    pub(crate) fn symbol(&self, name: &str) -> &Symbol {
        self.tables().symbols.iter().find(|s| s.name == name).unwrap_or_else(|| panic!("{name}"))
    }

    /// Gives a variable a value.
    pub(crate) fn set(&mut self, name: &str, value: i32) {
        let symbol = self.symbol(name).clone();
        write(&mut self.image, symbol.ty, symbol.offset, value);
    }

    /// The value of a variable or of an element (`A[3]`).
    pub(crate) fn get(&self, name: &str) -> i32 {
        let (name, index) = match name.split_once('[') {
            Some((name, rest)) => (name, rest.trim_end_matches(']').parse().unwrap()),
            None => (name, 0),
        };
        let symbol = self.symbol(name);
        read(&self.image, symbol.ty, symbol.offset + index * symbol.ty.size())
    }

    /// Lets `units` times 20 ms pass for the timers, then runs a scan.
    pub(crate) fn scan_after(&mut self, units: u32) -> Outcome {
        for timer in self.tables().timers.clone() {
            for _ in 0..units {
                let count = image::read_i32(&self.image, timer.counter);
                if count > 0 {
                    image::write_i32(&mut self.image, timer.counter, count - 1);
                    if count == 1 {
                        let on = u8::from(timer.kind == TimerKind::E);
                        image::write_u8(&mut self.image, timer.delayed, on);
                    }
                }
            }
        }
        self.engine.call(0, None, &mut Scan::new(&mut self.image, &mut NoHost))
    }

    /// Lets 20 ms pass for the timers, then runs a scan.
    pub(crate) fn scan(&mut self) -> Outcome {
        self.scan_after(1)
    }
}

fn read(image: &[u8], ty: Type, offset: u32) -> i32 {
    match ty {
        Type::Logical => i32::from(image::read_u8(image, offset)),
        Type::Integer => i32::from(image::read_i16(image, offset)),
        Type::Long => image::read_i32(image, offset),
    }
}

fn write(image: &mut [u8], ty: Type, offset: u32, value: i32) {
    match ty {
        Type::Logical => image::write_u8(image, offset, u8::from(value != 0)),
        Type::Integer => image::write_i16(image, offset, value as i16),
        Type::Long => image::write_i32(image, offset, value),
    }
}
