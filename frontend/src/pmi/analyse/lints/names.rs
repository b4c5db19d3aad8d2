//! `near-name`: an undeclared LOGICAL whose name is nearly that of a declared variable.

use std::hash::{BuildHasher, Hasher, RandomState};
use std::ops::RangeInclusive;

use plcc_abi::pmi::Type;
use plcc_diag::{Diagnostic, Span};

use crate::pmi::ast::{Checked, Meaning, Op, Symbol};

/// The lengths of names that are compared. Shorter ones are alike by chance; longer ones, which only
/// programs without the compiler's limits can have (PMI 2.2.3), would cost the square of their length.
const LENGTHS: RangeInclusive<usize> = 3..=64;

/// Finds LOGICALs that an assignment declares (PMI 2.2.4) and whose names differ by one letter, or by
/// two neighbours that have changed places, from a name of the specification section. Names that
/// differ in a digit are meant to: `PB1` and `PB2`. So is a name that the program also reads: a
/// misspelt one is only assigned.
pub(super) fn near_names(checked: &Checked, found: &mut Vec<Diagnostic>) {
    let mut statements: Vec<Span> = checked.steps.iter().map(|step| step.span).collect();
    statements.sort_unstable_by_key(|span| (span.file, span.start));
    let in_a_statement = |place: Span| {
        let after =
            statements.partition_point(|span| (span.file, span.start) <= (place.file, place.start));
        let statement = after.checked_sub(1).and_then(|at| statements.get(at));
        statement.is_some_and(|span| span.file == place.file && place.start < span.end)
    };
    let mut read = vec![false; checked.symbols.len()];
    for op in &checked.ops {
        if let Op::Load(id) | Op::LoadAt(id, _) | Op::Element(id) = *op
            && let Some(read) = read.get_mut(id.0 as usize)
        {
            *read = true;
        }
    }
    let candidates = read.iter().zip(&checked.symbols).filter(|(_, symbol)| {
        !symbol.executive && symbol.declared.is_some() && LENGTHS.contains(&symbol.name.len())
    });
    let (mut undeclared, mut declared) = (Vec::new(), Vec::new());
    for (is_read, symbol) in candidates {
        let Some(span) = symbol.declared else { continue };
        let is_implicit = symbol.ty == Type::Logical
            && symbol.meaning == Meaning::Variable
            && in_a_statement(span);
        match (is_implicit, &symbol.meaning) {
            (true, _) if *is_read => {}
            (true, _) => undeclared.push((symbol, span)),
            (false, Meaning::Label(_) | Meaning::Unknown) => {}
            (false, _) => declared.push((symbol, span)),
        }
    }
    if undeclared.is_empty() {
        return;
    }
    let index = Index::new(&declared);
    for (symbol, span) in undeclared {
        if let Some((near, place)) = index.nearest(&symbol.name) {
            let message = format!(
                "{} is declared nowhere and is nearly {near}: it is a LOGICAL of its own",
                symbol.name
            );
            found.push(
                Diagnostic::warning("PMI-W5", span, message)
                    .label(place, format!("{near} is declared here"))
                    .replace(near.to_owned())
                    .help(format!(
                        "write {near} if that was meant; else list {} after $LOGICAL",
                        symbol.name
                    )),
            );
        }
    }
}

/// The declared names by what is left of them when one letter is taken out, or none. Two names can be
/// near only if one such rest of each is the same; so each name is compared with few others, however
/// many there are. A rest is known by its hash alone, since a program may have a million of them; rests
/// that share a hash by chance cost a comparison.
struct Index<'a> {
    declared: &'a [(&'a Symbol, Span)],
    /// The hash of each rest and the index of its name in `declared`, in rising order.
    by_rest: Vec<(u64, u32)>,
    hashes: RandomState,
}

impl<'a> Index<'a> {
    fn new(declared: &'a [(&'a Symbol, Span)]) -> Self {
        let hashes = RandomState::new();
        let rests = declared.iter().map(|(symbol, _)| symbol.name.len() + 1).sum();
        let mut by_rest = Vec::with_capacity(rests);
        for (index, (symbol, _)) in (0u32..).zip(declared) {
            by_rest.extend(rest_hashes(&hashes, &symbol.name).map(|hash| (hash, index)));
        }
        by_rest.sort_unstable();
        Self { declared, by_rest, hashes }
    }

    /// The first declared name, in the alphabet, that is near.
    fn nearest(&self, name: &str) -> Option<(&'a str, Span)> {
        rest_hashes(&self.hashes, name)
            .flat_map(|hash| {
                let first = self.by_rest.partition_point(|(other, _)| *other < hash);
                let equal = self.by_rest.get(first..).unwrap_or(&[]).iter();
                equal.take_while(move |(other, _)| *other == hash)
            })
            .filter_map(|(_, index)| self.declared.get(*index as usize))
            .map(|(symbol, span)| (symbol.name.as_str(), *span))
            .filter(|(other, _)| is_near(name, other))
            .min()
    }
}

/// The hashes of a name, and of the name without each of its letters.
fn rest_hashes(hashes: &RandomState, name: &str) -> impl Iterator<Item = u64> {
    let hash = move |head: &str, tail: &str| {
        let mut hasher = hashes.build_hasher();
        hasher.write(head.as_bytes());
        hasher.write(tail.as_bytes());
        hasher.finish()
    };
    let without = name.char_indices().map(move |(at, letter)| {
        let (head, rest) = name.split_at(at);
        hash(head, rest.get(letter.len_utf8()..).unwrap_or(""))
    });
    std::iter::once(hash(name, "")).chain(without)
}

/// Whether two names differ by one letter that is missing or another one, or by two letters that
/// have changed places; letters only, no digits.
fn is_near(a: &str, b: &str) -> bool {
    let (a, b) = (a.as_bytes(), b.as_bytes());
    let head = a.iter().zip(b).take_while(|(x, y)| x == y).count();
    let rest = |name: &[u8]| name.get(head..).unwrap_or(&[]).to_vec();
    let (a, b) = (rest(a), rest(b));
    let tail = a.iter().rev().zip(b.iter().rev()).take_while(|(x, y)| x == y).count();
    let middle = |rest: &[u8]| rest.get(..rest.len() - tail).unwrap_or(&[]).to_vec();
    let (a, b) = (middle(&a), middle(&b));
    let letters = a.iter().chain(&b).all(u8::is_ascii_alphabetic);
    letters
        && match (a.as_slice(), b.as_slice()) {
            ([_], [_] | []) | ([], [_]) => true,
            ([a, b], [c, d]) => a == d && b == c,
            _ => false,
        }
}

#[cfg(test)]
mod tests {
    use super::is_near;

    #[test]
    fn names_are_near_by_a_letter_or_a_swap() {
        for (a, b) in [("PUMP", "PUMPS"), ("READY", "REDAY"), ("CLAMP", "CLAMS"), ("ABB", "AB")] {
            assert!(is_near(a, b) && is_near(b, a), "{a} {b}");
        }
        for (a, b) in
            [("PB1", "PB2"), ("PB1", "PB"), ("PUMP", "PUMP"), ("AB", "ABCD"), ("P12", "P21")]
        {
            assert!(!is_near(a, b), "{a} {b}");
        }
    }
}
