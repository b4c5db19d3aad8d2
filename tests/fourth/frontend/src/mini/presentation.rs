//! What is shown of a program.

use plcc_abi::mini::Kind;
use plcc_diag::SourceMap;

use super::Program;
use crate::common::Accessed;
use crate::presentation::lines::{SourceLine, lines, without_line_comments};
use crate::presentation::tokens::{Raw, mark_target, raw};
use crate::presentation::{
    Block, IoPoint, Piece, Presentation, Role, Row, StatementPlaces, rows,
};

/// What is told of the variable at an offset.
pub(super) fn accessed(offset: u32) -> Accessed {
    Accessed::one(0, offset)
}

impl Program {
    fn pieces(&self, line: &str) -> Vec<Piece> {
        let piece = |token: &Raw<'_>| {
            let text = token.text();
            let upper = text.to_uppercase();
            let is_variable = self.code.symbols.iter().any(|symbol| symbol.name == upper);
            let role = match token {
                Raw::Blank(_) => Role::Blank,
                Raw::Word(_) if is_variable => Role::Variable,
                Raw::Word(_) => Role::Keyword,
                Raw::Number(_) => Role::Constant,
                Raw::Text(_) => Role::Text,
                Raw::Sign(_) => Role::Operator,
            };
            Piece { name: is_variable.then_some(upper), ..Piece::new(text, role) }
        };
        let mut pieces: Vec<Piece> = raw(line).iter().map(piece).collect();
        mark_target(&mut pieces);
        pieces
    }
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
        let lines = lines(sources, &|text| without_line_comments(text, &[";"]), None);
        let cut = |line: &SourceLine, _: &[u32]| self.pieces(&line.text);
        let block = |piece: &Piece| match piece.text.to_uppercase().as_str() {
            "IF" => Some(Block::Opens),
            "END" => Some(Block::Closes),
            _ => None,
        };
        rows(lines, places, cut, block, |_| false)
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
