//! Cuts lines into tokens, and finds the variables that they name.

use std::collections::HashMap;

use plcc_abi::pmi::{Role as PmiRole, Type};
use plcc_abi::{Tables, pmac};
use plcc_debugger::DebuggedProgram;
use plcc_diag::FileId;

use super::Piece;
use crate::view::Role;

/// Cuts the lines of one program.
pub(super) struct Cutter<'a> {
    program: &'a DebuggedProgram,
    /// PMI: what each name is.
    pmi: HashMap<&'a str, (PmiRole, Type)>,
    /// PMAC: what each word was found to be.
    words: HashMap<String, (Role, Option<String>)>,
}

/// A word, number, text, blank or sign of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Raw<'t> {
    Blank(&'t str),
    /// Letters, digits, `_` and `@`, beginning with no digit.
    Word(&'t str),
    /// The same, beginning with a digit or `$`.
    Number(&'t str),
    Text(&'t str),
    Sign(&'t str),
}

impl<'t> Raw<'t> {
    fn text(self) -> &'t str {
        match self {
            Self::Blank(text)
            | Self::Word(text)
            | Self::Number(text)
            | Self::Text(text)
            | Self::Sign(text) => text,
        }
    }
}

fn is_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_' || c == '@'
}

/// Cuts a line, from left to right, without knowing the language.
fn raw<'t>(line: &'t str) -> Vec<Raw<'t>> {
    let mut found = vec![];
    let mut rest = line;
    while let Some(first) = rest.chars().next() {
        let run = |is: &dyn Fn(char) -> bool| {
            rest.char_indices().find(|&(_, c)| !is(c)).map_or(rest.len(), |(at, _)| at)
        };
        let (length, make): (usize, fn(&'t str) -> Raw<'t>) = if first.is_whitespace() {
            (run(&char::is_whitespace), Raw::Blank)
        } else if first == '"' {
            let end = rest.char_indices().skip(1).find(|&(_, c)| c == '"');
            (end.map_or(rest.len(), |(at, _)| at + 1), Raw::Text)
        } else if first.is_ascii_digit() {
            (run(&|c| is_word(c) || c == '.'), Raw::Number)
        } else if first == '$' {
            let digits = rest.char_indices().skip(1).find(|&(_, c)| !c.is_ascii_hexdigit());
            (digits.map_or(rest.len(), |(at, _)| at), Raw::Number)
        } else if is_word(first) {
            (run(&is_word), Raw::Word)
        } else {
            (first.len_utf8(), Raw::Sign)
        };
        let (piece, after) = rest.split_at_checked(length.max(1)).unwrap_or((rest, ""));
        found.push(make(piece));
        rest = after;
    }
    found
}

fn piece(text: &str, role: Role) -> Piece {
    Piece { text: text.into(), role, name: None, negated: false, target: false, statement: None }
}

impl<'a> Cutter<'a> {
    pub(super) fn new(program: &'a DebuggedProgram) -> Self {
        let pmi = match &program.tables().tables {
            Tables::Pmi(tables) => {
                let symbols = tables.symbols.iter();
                symbols.map(|symbol| (symbol.name.as_str(), (symbol.role, symbol.ty))).collect()
            }
            _ => HashMap::new(),
        };
        Self { program, pmi, words: HashMap::new() }
    }

    /// A line of PMI.
    pub(super) fn pmi(&mut self, line: &str) -> Vec<Piece> {
        const KEYWORDS: [&str; 6] = ["IF", "ELSE", "ELSEIF", "ENDIF", "GOTO", "END"];
        let raw = raw(line);
        let mut pieces: Vec<Piece> = vec![];
        let mut is_label_next = false;
        for (at, &token) in raw.iter().enumerate() {
            let next = raw.get(at + 1).copied();
            match token {
                Raw::Blank(text) => pieces.push(piece(text, Role::Blank)),
                Raw::Text(text) => pieces.push(piece(text, Role::Text)),
                Raw::Number(text) => pieces.push(piece(text, Role::Constant)),
                Raw::Sign(text) => pieces.push(piece(text, Role::Operator)),
                Raw::Word(text) if is_label_next || next == Some(Raw::Sign(":")) => {
                    is_label_next = false;
                    pieces.push(piece(text, Role::Label));
                }
                Raw::Word(text) => {
                    is_label_next = text == "GOTO";
                    let Some(&(role, ty)) = self.pmi.get(text) else {
                        let is_keyword = KEYWORDS.contains(&text);
                        let role = if is_keyword { Role::Keyword } else { Role::Constant };
                        pieces.push(piece(text, role));
                        continue;
                    };
                    if role == PmiRole::Constant && next != Some(Raw::Sign("[")) {
                        pieces.push(piece(text, Role::Constant));
                        continue;
                    }
                    let mut variable = piece(text, Role::Variable);
                    variable.name = Some(text.into());
                    // `/SOL1` is a unit (PMI 5.1).
                    let is_single = ty == Type::Logical && next != Some(Raw::Sign("["));
                    if is_single && pieces.last().is_some_and(|last| last.text == "/") {
                        pieces.pop();
                        variable.text = format!("/{text}");
                        variable.negated = true;
                    }
                    pieces.push(variable);
                }
            }
        }
        mark_target(&mut pieces);
        pieces
    }

    /// A line of PMAC.
    pub(super) fn pmac(&mut self, line: &str) -> Vec<Piece> {
        let mut pieces = vec![];
        for token in raw(line) {
            match token {
                Raw::Blank(text) => pieces.push(piece(text, Role::Blank)),
                Raw::Text(text) => pieces.push(piece(text, Role::Text)),
                Raw::Sign(text) => pieces.push(piece(text, Role::Operator)),
                Raw::Number(text) => {
                    let end = text.find(|c: char| !(c.is_ascii_digit() || c == '.' || c == '$'));
                    let (number, word) = match end {
                        // A name may begin with a digit, and glued statements with what looks so.
                        Some(end) if !text.starts_with('$') && self.word(text).1.is_none() => {
                            text.split_at_checked(end).unwrap_or((text, ""))
                        }
                        Some(_) if !text.starts_with('$') => ("", text),
                        _ => (text, ""),
                    };
                    if !number.is_empty() {
                        pieces.push(piece(number, Role::Constant));
                    }
                    if !word.is_empty() {
                        pieces.push(self.pmac_word(word));
                    }
                }
                Raw::Word(text) => pieces.push(self.pmac_word(text)),
            }
        }
        mark_target(&mut pieces);
        pieces
    }

    fn pmac_word(&mut self, text: &str) -> Piece {
        let (role, name) = self.word(text);
        Piece { name, ..piece(text, role) }
    }

    /// What a word of PMAC is: a variable by its own name or by a name that the program defined.
    fn word(&mut self, text: &str) -> (Role, Option<String>) {
        if let Some(known) = self.words.get(text) {
            return known.clone();
        }
        let found = self.look_up(text);
        self.words.insert(text.into(), found.clone());
        found
    }

    fn look_up(&self, text: &str) -> (Role, Option<String>) {
        let Tables::Pmac(tables) = &self.program.tables().tables else {
            return (Role::Keyword, None);
        };
        let layout = pmac::Layout::new(tables.controller);
        if let Ok(name) = pmac::PmacName::parse(text, &layout) {
            return (Role::Variable, Some(name.to_string()));
        }
        match self.program.expression(text) {
            Ok(expression) => match expression.variables() {
                [] => (Role::Constant, None),
                [name] => (Role::Variable, Some(name.clone())),
                _ => (Role::Variable, None),
            },
            Err(_) => (Role::Keyword, None),
        }
    }

    /// A line of NCT, in which each statement is a token.
    pub(super) fn nct(
        &mut self,
        line: &str,
        file: FileId,
        number: u32,
        statements: &[u32],
    ) -> Vec<Piece> {
        let chars: Vec<char> = line.chars().collect();
        let text = |from: usize, to: usize| -> String {
            chars.get(from..to.min(chars.len())).unwrap_or_default().iter().collect()
        };
        let mut spans: Vec<(usize, usize, u32)> = statements
            .iter()
            .filter_map(|&statement| {
                let place = self.program.place(statement)?;
                let from = (place.column as usize).checked_sub(1)?;
                let to = match place.end_line == number {
                    true => (place.end_column as usize).saturating_sub(1),
                    false => chars.len(),
                };
                (place.file == file && from < to).then_some((from, to, statement))
            })
            .collect();
        spans.sort_unstable();
        let mut pieces = vec![];
        let mut at = 0;
        for (from, to, statement) in spans {
            if from < at {
                continue;
            }
            between(&text(at, from), &mut pieces);
            let mut token = piece(&text(from, to), Role::Variable);
            token.statement = Some(statement);
            pieces.push(token);
            at = to;
        }
        between(&text(at, chars.len()), &mut pieces);
        pieces
    }
}

/// What stands between the statements of NCT: blanks, labels, the signs of conditions.
fn between(text: &str, pieces: &mut Vec<Piece>) {
    for token in raw(text) {
        let text = token.text();
        match token {
            Raw::Blank(_) => pieces.push(piece(text, Role::Blank)),
            Raw::Text(_) => pieces.push(piece(text, Role::Text)),
            Raw::Number(_) if pieces.last().is_some_and(|last| last.text == ":") => {
                pieces.pop();
                pieces.push(piece(&format!(":{text}"), Role::Label));
            }
            Raw::Number(_) => pieces.push(piece(text, Role::Constant)),
            Raw::Word(_) => pieces.push(piece(text, Role::Keyword)),
            Raw::Sign(_) => pieces.push(piece(text, Role::Operator)),
        }
    }
}

/// Marks the variables in front of `=` where a statement can begin: at the beginning of a line, or, on a
/// PMAC, after a whole statement.
fn mark_target(pieces: &mut [Piece]) {
    let is_comparison = |pieces: &[Piece], at: usize| {
        let before = pieces.get(..at).unwrap_or_default();
        let open = before.iter().filter(|piece| piece.text == "(").count();
        let closed = before.iter().filter(|piece| piece.text == ")").count();
        open > closed
    };
    for at in 0..pieces.len() {
        let is_assignment = pieces.get(at).is_some_and(|piece| piece.text == "=");
        if !is_assignment || is_comparison(pieces, at) {
            continue;
        }
        // An index in brackets stands between the array and the sign.
        let mut depth = 0_usize;
        for target in pieces.get_mut(..at).unwrap_or_default().iter_mut().rev() {
            match target.text.as_str() {
                "]" => depth += 1,
                "[" => depth = depth.saturating_sub(1),
                _ if depth == 0 && target.role == Role::Variable => {
                    target.target = true;
                    break;
                }
                _ if depth == 0 && target.role != Role::Blank => break,
                _ => {}
            }
        }
        // The second sign of `A=B=C` is a comparison. On a line of a PMAC, further statements may follow.
        if pieces.iter().all(|piece| piece.statement.is_none()) && is_one_expression(pieces, at) {
            return;
        }
    }
}

/// Whether all that stands after the sign `=` at a place is one expression. It is none if two operands follow each
/// other without an operator, as where a PMAC's next statement begins on the same line.
fn is_one_expression(pieces: &[Piece], at: usize) -> bool {
    let after = pieces.get(at + 1..).unwrap_or_default();
    let pieces: Vec<_> = after.iter().filter(|piece| piece.role != Role::Blank).collect();
    let is_operand = |piece: &Piece| matches!(piece.role, Role::Variable | Role::Constant);
    !pieces.array_windows().any(|[a, b]| {
        (is_operand(a) || a.text == ")") && (is_operand(b) && !b.negated || b.role == Role::Keyword)
    })
}

/// The name by which the directory lists a line: its target, its label or its keyword (PMI 5.1).
pub(super) fn name_of(pieces: &[Piece]) -> String {
    let visible = || pieces.iter().filter(|piece| piece.role != Role::Blank);
    if let Some(label) = visible().next().filter(|piece| piece.role == Role::Label) {
        let colon = if label.text.starts_with(':') { "" } else { ":" };
        return format!("{}{colon}", label.text);
    }
    let target = visible().find(|piece| piece.target);
    let first = visible().next();
    let named = match first {
        Some(first) if first.role == Role::Keyword => Some(first),
        _ => target.or(first),
    };
    named.map_or_else(String::new, |piece| piece.text.clone())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_cut_without_loss() {
        for line in ["A = /B&(C[2]+$FF)", "P1=0P2=60_SEC \"x y\"", "\"open", "é=1"] {
            let again: String = raw(line).iter().map(|token| token.text()).collect();
            assert_eq!(again, line);
        }
        assert_eq!(raw("A1=12"), [Raw::Word("A1"), Raw::Sign("="), Raw::Number("12")]);
    }
}
