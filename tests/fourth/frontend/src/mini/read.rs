//! Text to a checked program.

use plcc_abi::mini::{Kind, Symbol};
use plcc_diag::{Diagnostic, FileId, SourceMap, Span};

use super::ast::{Action, Code, Op, Operand, Step, Term};

/// Reads a file.
pub(super) fn read(sources: &SourceMap, file: FileId) -> (Code, Vec<Diagnostic>) {
    let (mut code, mut found) = (Code::default(), vec![]);
    let mut open: Vec<usize> = vec![];
    let mut at = 0;
    for (line, full) in (1..).zip(sources.text(file).split_inclusive('\n')) {
        let text = full.split(';').next().unwrap_or("");
        let start = at + (text.len() - text.trim_start().len()) as u32;
        at += full.len() as u32;
        let text = text.trim();
        if text.is_empty() {
            continue;
        }
        let span = Span { file, start, end: start + text.len() as u32 };
        let upper = text.to_uppercase();
        let (word, rest) = upper.split_once(char::is_whitespace).unwrap_or((&upper, ""));
        let kind = match word {
            "INPUT" => Some(Kind::Input),
            "OUTPUT" => Some(Kind::Output),
            "NUMBER" => Some(Kind::Number),
            _ => None,
        };
        if let Some(kind) = kind {
            code.symbols.push(Symbol { name: rest.trim().into(), kind, offset: 0 });
            continue;
        }
        let action = match word {
            "END" => match open.pop() {
                Some(begun) => {
                    let here = code.steps.len();
                    if let Some(Action::If { otherwise, .. }) =
                        code.steps.get_mut(begun).map(|step| &mut step.action)
                    {
                        *otherwise = here;
                    }
                    Ok(Action::End)
                }
                None => Err(Diagnostic::error("MINI-3", span, "no IF is open here")),
            },
            "IF" => expression(&code.symbols, rest, span).map(|condition| {
                open.push(code.steps.len());
                Action::If { condition, otherwise: usize::MAX }
            }),
            "COUNT" => variable(&code.symbols, rest, span).map(|to| {
                let term = |operand| Term { op: Op::Add, not: false, operand };
                Action::Assign { to, value: vec![term(Operand::Variable(to)), term(Operand::Number(1))] }
            }),
            _ => match upper.split_once('=') {
                Some((name, value)) => variable(&code.symbols, name, span).and_then(|to| {
                    let value = expression(&code.symbols, value, span)?;
                    Ok(Action::Assign { to, value })
                }),
                None => Err(Diagnostic::error("MINI-1", span, "this is not a statement")),
            },
        };
        match action {
            Ok(action) => code.steps.push(Step { action, span, line }),
            Err(error) => found.push(error),
        }
    }
    if let Some(step) = open.pop().and_then(|begun| code.steps.get(begun)) {
        found.push(Diagnostic::error("MINI-3", step.span, "this IF has no END"));
    }
    code.lay_out();
    (code, found)
}

fn variable(symbols: &[Symbol], name: &str, span: Span) -> Result<usize, Diagnostic> {
    let name = name.trim();
    let found = symbols.iter().position(|symbol| symbol.name == name);
    found.ok_or_else(|| {
        Diagnostic::error("MINI-2", span, format!("no variable is named `{name}`"))
    })
}

/// Reads an expression, which is in capitals.
pub(super) fn expression(
    symbols: &[Symbol],
    text: &str,
    span: Span,
) -> Result<Vec<Term>, Diagnostic> {
    let mut terms = vec![];
    let (mut op, mut rest) = (Op::Add, text.trim());
    loop {
        let not = rest.starts_with('/');
        rest = rest.trim_start_matches('/').trim_start();
        let end = rest.find(['+', '-', '&', '|']).unwrap_or(rest.len());
        let (word, behind) = rest.split_at_checked(end).unwrap_or((rest, ""));
        let operand = match word.trim().parse() {
            Ok(number) => Operand::Number(number),
            Err(_) => Operand::Variable(variable(symbols, word, span)?),
        };
        terms.push(Term { op, not, operand });
        op = match behind.chars().next() {
            None => return Ok(terms),
            Some('+') => Op::Add,
            Some('-') => Op::Subtract,
            Some('&') => Op::And,
            Some(_) => Op::Or,
        };
        rest = behind.get(1..).unwrap_or("").trim_start();
    }
}
