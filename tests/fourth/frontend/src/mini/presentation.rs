//! What is shown of a program.

use plcc_abi::mini::Kind;
use plcc_diag::{FileId, SourceMap};

use super::Program;
use crate::common::Accessed;
use crate::presentation::{
    Block, IoPoint, Piece, Presentation, Row, StatementPlaces, Wording, rows,
};

/// What is told of the variable at an offset.
pub(super) fn accessed(offset: u32) -> Accessed {
    Accessed::one(0, offset)
}

impl Presentation for Program {
    fn name(&self, accessed: Accessed) -> Option<String> {
        let symbol = self.code.symbols.iter().find(|symbol| symbol.offset == accessed.first);
        symbol.map(|symbol| symbol.name.clone())
    }

    fn accessed(&self, name: &str) -> Option<Accessed> {
        let name = name.trim().to_uppercase();
        let symbol = self.code.symbols.iter().find(|symbol| symbol.name == name);
        symbol.map(|symbol| accessed(symbol.offset))
    }

    fn is_outside_image(&self, _: Accessed) -> bool {
        false
    }

    fn text(&self, sources: &SourceMap, places: &StatementPlaces) -> Vec<Row> {
        let words = super::words::words(sources, FileId(0));
        let block = |piece: &Piece| match piece.text.to_uppercase().as_str() {
            "IF" => Some(Block::Opens),
            "END" => Some(Block::Closes),
            _ => None,
        };
        let wording = Wording {
            continued_by: None,
            statements_are_tokens: false,
            lines: &|_| {},
            block: &block,
            begins_part: &|_| false,
        };
        rows(sources, &words, places, &wording)
    }

    fn io_points(&self, _: &[String], _: &[u8]) -> Vec<IoPoint> {
        let symbols = self.code.symbols.iter().filter(|symbol| symbol.kind != Kind::Number);
        let point = |symbol: &plcc_abi::mini::Symbol| IoPoint {
            name: symbol.name.clone(),
            place: format!("line {}", symbol.offset),
            output: symbol.kind == Kind::Output,
            bit: true,
            lines: vec![],
        };
        symbols.map(point).collect()
    }
}
