//! Tokens with the values that a statement read or wrote.

use plcc_abi::Dialect;
use plcc_debugger::trace::Access;
use plcc_frontend::common::Value;
use plcc_frontend::language;

use super::RowFlow;
use crate::session::values;
use crate::text::Piece;
use crate::view::Token;

/// A statement of NCT with what it did.
pub(super) fn nct_token(
    piece: &Piece,
    statement: u32,
    flow: &RowFlow,
    name: &dyn Fn(&Access) -> Option<String>,
) -> Token {
    let executed = flow.by_statement.iter().find(|(of, _)| *of == statement);
    let access = executed.and_then(|(_, executed)| executed.accesses.first());
    let (mut truth, mut value) = (None, None);
    match access.map(|access| access.value) {
        Some(Value::Logical(bit)) => truth = Some(bit),
        Some(other) => value = Some(values::shown(other, language(Dialect::Nct))),
        None => {}
    }
    let name = access.and_then(name);
    Token { text: piece.text.clone(), role: piece.role, truth, value, name }
}

/// A token with the value that the statement read or wrote.
pub(super) fn token(
    piece: &Piece,
    named: &[(String, Access)],
    used: &mut [bool],
    dialect: Dialect,
) -> Token {
    let mut token = Token {
        text: piece.text.clone(),
        role: piece.role,
        truth: None,
        value: None,
        name: piece.name.clone(),
    };
    let Some(own) = &piece.name else { return token };
    let is_own = |name: &str| match name.strip_prefix(own.as_str()) {
        Some("") => true,
        Some(rest) => dialect == Dialect::Pmi && rest.starts_with('['),
        // A Q-variable has its coordinate system in front of it.
        None => {
            name.starts_with('&')
                && name.trim_start_matches(|c| c == '&' || char::is_numeric(c)) == own
        }
    };
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
        value => token.value = Some(values::shown(value, language(dialect))),
    }
    token
}
