//! The contacts of PMI's conditions and logical assignments. A statement is read again from its text, since the checked
//! program has no places of operands.

use plcc_diag::{SourceMap, Span};

use crate::common::{Gate, Logic, LogicBuilder, Value};
use crate::pmi::{
    Program,
    ast::{Action, Step},
    read::{
        cursor::Cursor,
        expression::{ExpressionReader, Until},
        lexer::lex,
        split::Extent,
        syntax::{Part, PartKind},
        token::{Kind, Token},
    },
};

impl Program {
    /// As [`logic`](crate::CheckedProgram::logic).
    pub(super) fn contacts(&self, sources: &SourceMap) -> Vec<Option<Logic>> {
        self.checked.steps.iter().map(|step| self.contacts_of(step, sources)).collect()
    }

    fn contacts_of(&self, step: &Step, sources: &SourceMap) -> Option<Logic> {
        let Span { file, start, end } = step.span;
        let text = sources.text(file);
        let mut tokens = vec![];
        lex(text, start, end, self.limits, &mut tokens);
        let until = match step.action {
            Action::Assign { .. } => Until::End,
            Action::If { .. } => Until::Condition,
            Action::Jump { .. } => return None,
        };
        let begin = begin(&tokens, until)?;
        let mut cursor = Cursor::new(text, &tokens, Extent { file, start, end, open: false });
        cursor.at = begin;
        let mut parts = vec![];
        let read = ExpressionReader::new(&mut cursor, &mut parts, self.limits).read(until);
        if read.error.is_some() {
            return None;
        }
        Split { program: self, cursor: &cursor, builder: LogicBuilder::default() }.split(&parts)
    }
}

/// The index of the token with which the expression of a statement begins.
fn begin(tokens: &[Token], until: Until) -> Option<usize> {
    let mut depth = 0;
    for (at, token) in tokens.iter().enumerate() {
        match token.kind {
            Kind::LBracket => depth += 1,
            Kind::RBracket => depth -= 1,
            Kind::Eq if depth == 0 && until == Until::End => return Some(at + 1),
            Kind::LParen if until == Until::Condition => return Some(at + 1),
            _ => {}
        }
    }
    None
}

/// A part of the expression that is complete.
#[derive(Clone, Copy)]
struct Piece {
    /// The indices of its first and its last token.
    first: usize,
    last: usize,
    /// Whether it was put to the logic already, since it is a gate.
    is_gate: bool,
}

/// Splits an expression at its gates.
struct Split<'s> {
    program: &'s Program,
    cursor: &'s Cursor<'s>,
    builder: LogicBuilder,
}

impl Split<'_> {
    fn index_of(&self, token: Token) -> usize {
        self.cursor.tokens.partition_point(|other| other.start < token.start)
    }

    fn split(mut self, parts: &[Part]) -> Option<Logic> {
        // Gates combine what was put to the builder last, so that contacts have to be put there in the order of the parts.
        let contacts = contact_starts(parts)?;
        let mut stack: Vec<Piece> = vec![];
        let mut arrays = vec![];
        for (at, part) in parts.iter().enumerate() {
            let own = self.index_of(part.token);
            match part.kind {
                PartKind::Operand => stack.push(Piece { first: own, last: own, is_gate: false }),
                PartKind::Array => {
                    arrays.push(own);
                    continue;
                }
                PartKind::Element => {
                    stack.pop()?;
                    stack.push(Piece { first: arrays.pop()?, last: own, is_gate: false });
                }
                PartKind::Unary => {
                    let of = stack.pop()?;
                    let is_not = part.token.kind == Kind::Slash;
                    if is_not && contacts.get(at).copied().unwrap_or(false) {
                        self.builder.not();
                    }
                    stack.push(Piece { first: own, last: of.last, is_gate: is_not });
                }
                PartKind::Binary => {
                    let (right, left) = (stack.pop()?, stack.pop()?);
                    let gate = match part.token.kind {
                        Kind::And => Some(Gate::And),
                        Kind::Or => Some(Gate::Or),
                        _ => None,
                    };
                    if let Some(gate) = gate.filter(|_| contacts.get(at).copied().unwrap_or(false))
                    {
                        self.builder.gate(gate);
                    }
                    stack.push(Piece {
                        first: left.first,
                        last: right.last,
                        is_gate: gate.is_some(),
                    });
                }
                PartKind::Missing => return None,
            }
            let piece = *stack.last()?;
            if !piece.is_gate && contacts.get(at).copied().unwrap_or(false) {
                self.contact(piece)?;
            }
        }
        self.builder.finish()
    }

    /// Puts a contact to the logic.
    fn contact(&mut self, piece: Piece) -> Option<()> {
        let tokens = self.cursor.tokens;
        let (mut first, mut last) = (piece.first, piece.last);
        // Parentheses that stand around a part of it belong to it.
        let depth = |first: usize, last: usize| {
            let all = tokens.get(first..=last).unwrap_or_default();
            let (mut open, mut unopened) = (0usize, 0usize);
            for token in all {
                match token.kind {
                    Kind::LParen => open += 1,
                    Kind::RParen if open == 0 => unopened += 1,
                    Kind::RParen => open -= 1,
                    _ => {}
                }
            }
            (open, unopened)
        };
        while depth(first, last).1 > 0 && first > 0 {
            first -= 1;
        }
        while depth(first, last).0 > 0 && last + 1 < tokens.len() {
            last += 1;
        }
        let words: Vec<&str> =
            tokens.get(first..=last)?.iter().map(|token| self.cursor.slice(*token)).collect();
        let text = words.join(" ");
        let value = self.program.expression(&text).ok()?;
        let image = vec![0; self.program.layout.size as usize];
        if matches!(value.evaluate(&image), Ok(Value::Integer(_) | Value::Real(_))) {
            return None;
        }
        let span =
            self.cursor.span_of(*tokens.get(first)?).to(self.cursor.span_of(*tokens.get(last)?));
        let name: String = words.concat();
        self.builder.contact(&name, span, value);
        Some(())
    }
}

/// For each part whether a contact or a gate ends with it: whether everything above it in the expression is a gate.
/// `None` where the parts are not an expression.
fn contact_starts(parts: &[Part]) -> Option<Vec<bool>> {
    let is_gate = |part: &Part| match part.kind {
        PartKind::Unary => part.token.kind == Kind::Slash,
        PartKind::Binary => matches!(part.token.kind, Kind::And | Kind::Or),
        _ => false,
    };
    // For each part the parts that are its operands.
    let mut stack: Vec<usize> = vec![];
    let mut operands: Vec<[Option<usize>; 2]> = vec![];
    for (at, part) in parts.iter().enumerate() {
        let own = match part.kind {
            PartKind::Operand | PartKind::Missing => [None, None],
            PartKind::Array => {
                operands.push([None, None]);
                continue;
            }
            PartKind::Element | PartKind::Unary => [Some(stack.pop()?), None],
            PartKind::Binary => {
                let right = stack.pop()?;
                [Some(stack.pop()?), Some(right)]
            }
        };
        operands.push(own);
        stack.push(at);
    }
    let mut reached = vec![false; parts.len()];
    *reached.get_mut(stack.pop()?)? = true;
    for at in (0..parts.len()).rev() {
        if reached.get(at).copied().unwrap_or(false) && parts.get(at).is_some_and(is_gate) {
            for operand in operands.get(at).into_iter().flatten().flatten() {
                *reached.get_mut(*operand)? = true;
            }
        }
    }
    Some(reached)
}
