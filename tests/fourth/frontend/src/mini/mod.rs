//! MINI: a language of a handful of statements, which shows what a further language takes.
//!
//! ```text
//! INPUT START          ; a bit from the machine
//! OUTPUT LAMP          ; a bit to it
//! NUMBER TIMES
//! LAMP = START & /LAMP ; from left to right: + - & |, and / for NOT
//! IF LAMP
//! COUNT TIMES          ; adds 1
//! END
//! ```

mod ast;
mod expression;
mod language;
mod lower;
mod oracle;
mod presentation;
mod read;
mod words;

use std::sync::Arc;

use plcc_abi::mini::{Kind, Symbol};
use plcc_abi::{Region, Tables};
use plcc_diag::SourceMap;

pub use language::Mini;

/// The name of the region of the bits, and of that of the numbers.
const BITS: &str = "bits";
const NUMBERS: &str = "numbers";

/// A program without errors.
#[derive(Clone, Debug)]
pub struct Program {
    code: Arc<ast::Code>,
    sources: SourceMap,
}

impl ast::Code {
    /// The regions of the image, and its size.
    fn regions(&self) -> (Vec<Region>, u32) {
        let count = |is_bit: bool| {
            let own = self.symbols.iter().filter(|one| (one.kind != Kind::Number) == is_bit);
            own.count() as u32
        };
        let bits = count(true).next_multiple_of(8).max(8);
        let numbers = (4 * count(false)).next_multiple_of(8).max(8);
        let region = |name: &str, offset, size, bits| Region { name: name.into(), offset, size, bits };
        let regions = vec![region(BITS, 0, bits, true), region(NUMBERS, bits, numbers, false)];
        (regions, bits + numbers)
    }

    /// Gives each variable its place.
    fn lay_out(&mut self) {
        let (_, size) = self.regions();
        let bits = self.symbols.iter().filter(|one| one.kind != Kind::Number).count() as u32;
        let (mut bit, mut number) = (0, bits.next_multiple_of(8).max(8));
        for symbol in &mut self.symbols {
            let (next, width) = match symbol.kind {
                Kind::Number => (&mut number, 4),
                Kind::Input | Kind::Output => (&mut bit, 1),
            };
            symbol.offset = *next;
            *next += width;
        }
        debug_assert!(number <= size);
    }

    fn symbol(&self, index: usize) -> Option<&Symbol> {
        self.symbols.get(index)
    }
}

impl Program {
    fn tables(&self, tasks: Vec<plcc_abi::Task>) -> plcc_abi::Program {
        let (regions, image_size) = self.code.regions();
        let files = (0..self.sources.len() as u32).map(plcc_diag::FileId);
        plcc_abi::Program {
            files: files.map(|file| self.sources.path(file).to_owned()).collect(),
            image_size,
            regions,
            tasks,
            tables: Tables::Mini(plcc_abi::mini::MiniTables { symbols: self.code.symbols.clone() }),
            names: vec![],
        }
    }
}
