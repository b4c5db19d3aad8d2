//! The words of a program, for editors.
//!
//! A statement of NCT names at most one variable, whose name ends it; a condition is a row of tests, each with a name of its
//! own (NCT 4.3). Names have a fixed number of digits, so that the text of a name is its canonical spelling.

use plcc_diag::{FileId, SourceMap, Span};

use crate::common::words::{
    Appearance, Comments, Declaration, DeclarationKind, Word, WordKind, Words, plain,
};
use crate::nct::ast::{Op, Opens, Stmt};
use crate::nct::read::cursor::{comments, is_blank};

/// The words of the program in `file`, which has these statements.
pub(super) fn words(sources: &SourceMap, file: FileId, statements: &[Stmt]) -> Words {
    let text = sources.text(file);
    let mut words = Words::default();
    let mut comments = Comments::new(file, comments(text));
    let mut open: Vec<Span> = vec![];
    let mut module: Option<Module> = None;
    let mut last = Span::new(file, 0, 0);
    for stmt in statements {
        words.statements.push(stmt.span);
        comments.add_before(stmt.span.start, &mut words.words);
        statement(text, stmt, &mut words.words);
        match stmt.op {
            Op::If { .. } => open.push(stmt.span),
            Op::Else { .. } => {
                words.blocks.extend(open.pop().map(|first| first.to(stmt.span)));
                open.push(stmt.span);
            }
            Op::EndIf => words.blocks.extend(open.pop().map(|first| first.to(stmt.span))),
            Op::Label(number) => {
                if let Some(module) = module.take() {
                    module.end(last, &mut words);
                }
                module = Some(Module { number, at: stmt.span });
            }
            _ => {}
        }
        last = stmt.span;
    }
    comments.add_before(u32::MAX, &mut words.words);
    if let Some(module) = module {
        module.end(last, &mut words);
    }
    words.sorted(sources)
}

/// A label and all up to the next one.
struct Module {
    number: u16,
    at: Span,
}

impl Module {
    /// Adds its declaration, now that it is known where it ends.
    fn end(self, last: Span, words: &mut Words) {
        let Self { number, at } = self;
        let detail = match number {
            0 => "module of level 0, which goes on where it was interrupted",
            1 => "module of each 20 ms",
            2 => "module of the fast level",
            3..=196 => "label, called by C or gone to by G",
            197 => "captions of softkeys",
            198 => "messages with an index",
            199 => "messages",
            _ => "text about the program",
        };
        let (name, extent) = (format!(":{number:03}"), at.to(last));
        let kind = if number < 3 { DeclarationKind::Program } else { DeclarationKind::Label };
        words.blocks.push(extent);
        words.declarations.push(Declaration { name, at, extent, kind, detail: detail.into() });
    }
}

/// Adds the words of a statement.
fn statement(text: &str, stmt: &Stmt, words: &mut Vec<Word>) {
    use Appearance::{Called, Declared, GoneTo, Read, Tested, Written};
    let span = stmt.span;
    let label = |number: u16, appearance| Word {
        name: Some(format!(":{number:03}")),
        appearance: Some(appearance),
        ..plain(span, WordKind::Label)
    };
    let appearance = match stmt.op {
        Op::Label(number) => return words.push(label(number, Declared)),
        Op::Goto(number) => return words.push(label(number, GoneTo)),
        Op::Call(number) => return words.push(label(number, Called)),
        Op::Text => return words.push(plain(span, WordKind::Text)),
        Op::If { .. } | Op::Bad { opens: Opens::Yes | Opens::Perhaps } => Tested,
        Op::Set(_) | Op::Clear(_) | Op::Store { .. } | Op::Count { .. } | Op::Update { .. } => {
            Written
        }
        Op::Bad { opens: Opens::No }
        | Op::Load(_)
        | Op::Arith { .. }
        | Op::Shift { .. }
        | Op::Bin
        | Op::Bcd
        | Op::Push(_)
        | Op::Apply { .. }
        | Op::Else { .. }
        | Op::EndIf
        | Op::GotoIndirect(_)
        | Op::CallIndirect(_)
        | Op::Return
        | Op::End(_)
        | Op::Area { .. } => Read,
    };
    pieces(text, span, appearance, words);
}

/// The letters that a name can begin with, the longest first.
const SPACES: [&str; 13] = ["RH", "RP", "FI", "I", "V", "P", "Y", "O", "F", "Q", "T", "H", "M"];

/// Adds the words in the text of a statement: letters with digits are names, `,20` and `.0F` numbers.
fn pieces(text: &str, span: Span, appearance: Appearance, words: &mut Vec<Word>) {
    let bytes = text.as_bytes();
    let byte = |at: usize| bytes.get(at).copied().filter(|_| at < span.end as usize);
    let mut at = span.start as usize;
    let piece = |from: usize, to: usize, kind| plain(Span::new(span.file, from, to), kind);
    while let Some(first) = byte(at) {
        let from = at;
        if first.is_ascii_uppercase() {
            while byte(at).is_some_and(|b| b.is_ascii_uppercase()) {
                at += 1;
            }
            let letters = at;
            while byte(at).is_some_and(|b| b.is_ascii_digit()) {
                at += 1;
            }
            let letters = text.get(from..letters).unwrap_or_default();
            name(text, (from, letters, at), span, appearance, words);
        } else if first == b',' || first == b'.' {
            at += 1;
            while byte(at)
                .is_some_and(|b| b.is_ascii_hexdigit() && (first == b'.' || b.is_ascii_digit()))
            {
                at += 1;
            }
            words.push(piece(from, at, WordKind::Number));
        } else if first.is_ascii_digit() {
            while byte(at).is_some_and(|b| b.is_ascii_digit()) {
                at += 1;
            }
            words.push(piece(from, at, WordKind::Number));
        } else {
            let rest = text.get(at..).unwrap_or_default();
            let c = rest.chars().next().unwrap_or(' ');
            at += c.len_utf8();
            if !is_blank(c) {
                words.push(piece(from, at, WordKind::Operator));
            }
        }
    }
}

/// Adds the words of letters with the digits after them: what is done, and what it is done to.
fn name(
    text: &str,
    (from, letters, to): (usize, &str, usize),
    span: Span,
    appearance: Appearance,
    words: &mut Vec<Word>,
) {
    let end = from + letters.len();
    if end == to {
        return words.push(plain(Span::new(span.file, from, to), WordKind::Keyword));
    }
    let digits = text.get(end..to).unwrap_or_default();
    // `U012` and `D012` switch Y012 (NCT 4.1).
    let switched = matches!(letters, "U" | "D").then_some(("Y", end));
    let space = switched.or_else(|| {
        let space = SPACES.into_iter().find(|space| letters.ends_with(space))?;
        // `LQ01` loads Q01, but `NT00` tests T00.
        Some((space, end - space.len()))
    });
    let Some((space, start)) = space else {
        words.push(plain(Span::new(span.file, from, end), WordKind::Keyword));
        return words.push(plain(Span::new(span.file, end, to), WordKind::Number));
    };
    if start > from {
        words.push(plain(Span::new(span.file, from, start), WordKind::Keyword));
    }
    // Of a word whose address is in another one, it is the other one that is named.
    let space = if space == "FI" { "F" } else { space };
    words.push(Word {
        name: Some(format!("{space}{digits}")),
        appearance: Some(appearance),
        ..plain(Span::new(span.file, start, to), WordKind::Variable)
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::Options;

    fn words_of(sources: &mut SourceMap, file: FileId) -> Words {
        crate::nct::words_and_rest(sources, file, &Options::default()).0
    }

    /// The words of a program that name something: text, name, what is done with it.
    fn named(text: &str) -> Vec<(String, String, Option<Appearance>)> {
        let mut sources = SourceMap::new();
        let file = sources.add("a.nct", text.as_bytes());
        let words = words_of(&mut sources, file);
        let named = words.words.into_iter().filter_map(|word| {
            Some((sources.slice(word.span).to_owned(), word.name.clone()?, word.appearance))
        });
        named.collect()
    }

    #[test]
    fn names_are_found_with_what_is_done_with_them() {
        use Appearance::{Called, Declared, Read, Tested, Written};
        let text = ":001 ; main I012\n(I012ANF0103) U012 E DF0103 Z\nLF020 +RH005 SQ01 C003 J1\n:003 UO012 R\n:000 J0\n";
        let word = |text: &str, name: &str, appearance| {
            (text.to_owned(), name.to_owned(), Some(appearance))
        };
        assert_eq!(
            named(text),
            [
                word(":001", ":001", Declared),
                word("I012", "I012", Tested),
                word("F0103", "F0103", Tested),
                word("012", "Y012", Written),
                word("F0103", "F0103", Written),
                word("F020", "F020", Read),
                word("RH005", "RH005", Read),
                word("Q01", "Q01", Written),
                word("C003", ":003", Called),
                word(":003", ":003", Declared),
                word("O012", "O012", Written),
                word(":000", ":000", Declared),
            ]
        );
    }

    #[test]
    fn labels_reach_to_the_next_one() {
        let text = ":001\nU012\nJ1\n:000 J0";
        let mut sources = SourceMap::new();
        let file = sources.add("a.nct", text.as_bytes());
        let words = words_of(&mut sources, file);
        let found: Vec<(&str, &str)> = words
            .declarations
            .iter()
            .map(|it| (it.name.as_str(), sources.slice(it.extent)))
            .collect();
        assert_eq!(found, [(":001", ":001\nU012\nJ1"), (":000", ":000 J0")]);
    }
}
