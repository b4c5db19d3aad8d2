//! Tokens with the values that a statement read or wrote.

use plcc_frontend::common::Value;
use plcc_frontend::presentation::Piece;
use plcc_replay::DebuggedProgram;
use plcc_replay::trace::Access;

use super::RowFlow;
use crate::session::values;
use crate::view::Token;

/// A token that is a whole statement, with what that did.
pub(super) fn statement_token(
    piece: &Piece,
    statement: u32,
    flow: &RowFlow,
    program: &DebuggedProgram,
) -> Token {
    let executed = flow.by_statement.iter().find(|(of, _)| *of == statement);
    let access = executed.and_then(|(_, executed)| executed.accesses.first());
    let (mut truth, mut value) = (None, None);
    match access.map(|access| access.value) {
        Some(Value::Logical(bit)) => truth = Some(bit),
        Some(other) => value = Some(values::shown(other, program.language())),
        None => {}
    }
    let name = access.and_then(|access| program.name(access.variable));
    Token { text: piece.text.clone(), role: piece.role, truth, value, name }
}

/// A token with the value that the statement read or wrote.
pub(super) fn token(
    piece: &Piece,
    named: &[(String, Access)],
    used: &mut [bool],
    program: &DebuggedProgram,
) -> Token {
    let mut token = Token {
        text: piece.text.clone(),
        role: piece.role,
        truth: None,
        value: None,
        name: piece.name.clone(),
    };
    let Some(own) = &piece.name else { return token };
    let is_own = |name: &str| program.checked().is_written_as(name, own);
    let fits = |access: &Access| access.is_write == piece.target;
    let candidates =
        || named.iter().enumerate().filter(|(_, (name, access))| is_own(name) && fits(access));
    // The next one that no token has, or else the last one: a variable that stands twice is read once
    // by some interpreters.
    let fresh = candidates().find(|(at, _)| !used.get(*at).copied().unwrap_or(true));
    let Some((at, (name, access))) = fresh.or_else(|| candidates().next_back()) else {
        return token;
    };
    if let Some(used) = used.get_mut(at) {
        *used = true;
    }
    token.name = Some(name.clone());
    match access.value {
        Value::Logical(value) => token.truth = Some(value != piece.negated),
        value => token.value = Some(values::shown(value, program.language())),
    }
    token
}
