//! One expression alone.

use plcc_abi::image::{read_i32, read_u8};
use plcc_abi::mini::Kind;
use plcc_diag::{Diagnostic, FileId, Span};

use super::ast::{self, Operand, Term};
use super::{Program, read};
use crate::common::{Evaluate, EvaluationError, Expression, Value};

#[derive(Debug)]
struct Evaluator {
    terms: Vec<Term>,
    /// By the variable's index, whether it is a bit, and its offset.
    places: Vec<(bool, u32)>,
    is_bit: bool,
}

impl Evaluate for Evaluator {
    fn evaluate(&self, image: &[u8]) -> Result<Value, EvaluationError> {
        let value = ast::evaluate(&self.terms, |index| match self.places.get(index) {
            Some(&(true, offset)) => read_u8(image, offset).into(),
            Some(&(false, offset)) => read_i32(image, offset),
            None => 0,
        });
        Ok(match self.is_bit {
            true => Value::Logical(value != 0),
            false => Value::Integer(value.into()),
        })
    }
}

pub(super) fn expression(program: &Program, text: &str) -> Result<Expression, Vec<Diagnostic>> {
    let span = Span { file: FileId(0), start: 0, end: text.len() as u32 };
    let symbols = &program.code.symbols;
    let terms = read::expression(symbols, &text.to_uppercase(), span).map_err(|error| vec![error])?;
    let is_bit = |index: usize| symbols.get(index).is_some_and(|one| one.kind != Kind::Number);
    let mut variables: Vec<String> = vec![];
    for term in &terms {
        if let Operand::Variable(index) = term.operand
            && let Some(symbol) = symbols.get(index)
            && !variables.contains(&symbol.name)
        {
            variables.push(symbol.name.clone());
        }
    }
    let logical = |term: &Term| {
        term.not || matches!(term.operand, Operand::Variable(index) if is_bit(index))
    };
    let (_, size) = program.code.regions();
    let evaluator = Evaluator {
        is_bit: terms.iter().all(logical),
        places: symbols.iter().map(|one| (one.kind != Kind::Number, one.offset)).collect(),
        terms,
    };
    Ok(Expression::new(text, variables, size as usize, evaluator))
}
