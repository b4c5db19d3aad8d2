//! The words of a program, for editors.

use std::collections::HashMap;

use plcc_abi::pmi::{Format, Lines, Type};
use plcc_diag::{FileId, SourceMap, Span};

use crate::common::words::{
    Appearance, Comments, Declaration, DeclarationKind, Word, WordKind, Words, plain,
};
use crate::pmi::ast::{Checked, Meaning, Symbol};
use crate::pmi::read::cursor::Cursor;
use crate::pmi::read::split;
use crate::pmi::read::syntax::{DeclarationForm, Form, Logic, LogicForm, Text};
use crate::pmi::read::token::{Kind, RESERVED, Token};
use crate::pmi::reference::executive;

/// The words of a program and of all files that it includes.
pub(super) fn words(checked: &Checked, text: &Text, sources: &SourceMap) -> Words {
    let symbols = checked.symbols.iter().map(|symbol| (symbol.name.as_str(), symbol)).collect();
    let mut finder = Finder {
        symbols,
        words: Words::default(),
        open: vec![],
        section: None,
        appearances: vec![],
    };
    let files = (0..sources.len() as u32).map(FileId);
    let of_file = |id| Comments::new(id, split::comments(sources.text(id)).collect());
    let mut comments: Vec<Comments> = files.clone().map(of_file).collect();
    for statement in &text.statements {
        let cursor = statement.cursor(sources, &text.tokens);
        let span = statement_span(statement.extent.file, cursor.tokens);
        finder.words.statements.push(span);
        finder.appearances.clear();
        finder.appearances.resize(cursor.tokens.len(), None);
        match &statement.form {
            Form::Declaration(declaration) => finder.declaration(&declaration.form, &cursor),
            Form::Logic(logic) => finder.logic(logic, &cursor),
        }
        let mut comments = comments.get_mut(span.file.0 as usize);
        for (at, &token) in cursor.tokens.iter().enumerate() {
            if let Some(comments) = &mut comments {
                comments.add_before(token.start, &mut finder.words.words);
            }
            finder.token(&cursor, token, finder.appearances.get(at).copied().flatten());
        }
    }
    finder.end_section();
    let mut words = finder.words;
    for (id, mut comments) in files.zip(comments) {
        comments.add_before(u32::MAX, &mut words.words);
        if let Some(at) = sources.included_from(id) {
            let end = at.start + "$INCLUDE".len() as u32;
            words.words.push(plain(Span { end, ..at }, WordKind::Directive));
            words.words.push(plain(Span { start: end, ..at }, WordKind::Text));
        }
    }
    declarations(checked, &mut words);
    words.sorted(sources)
}

/// From the first token of a statement to its last one.
fn statement_span(file: FileId, tokens: &[Token]) -> Span {
    let start = tokens.first().map_or(0, |token| token.start);
    let end = tokens.last().map_or(start, |token| token.end);
    Span { file, start, end }
}

/// The declarations of a program, with the extents of the statements.
fn declarations(checked: &Checked, words: &mut Words) {
    let extent = |at: Span, statements: &[Span]| {
        let next = statements.partition_point(|it| (it.file, it.start) <= (at.file, at.start));
        let own = next.checked_sub(1).and_then(|own| statements.get(own)).copied();
        own.filter(|own| own.file == at.file && own.end >= at.end).unwrap_or(at)
    };
    let mut statements = words.statements.clone();
    statements.sort_unstable();
    for symbol in &checked.symbols {
        let Some(at) = symbol.declared else { continue };
        let (kind, detail) = describe(symbol, checked);
        let (name, extent) = (symbol.name.clone(), extent(at, &statements));
        words.declarations.push(Declaration { name, at, extent, kind, detail });
    }
}

/// What a declared symbol is.
fn describe(symbol: &Symbol, checked: &Checked) -> (DeclarationKind, String) {
    let ty = match symbol.ty {
        Type::Logical => "LOGICAL",
        Type::Integer => "INTEGER",
        Type::Long => "LONG",
    };
    let array = symbol.elements.map_or_else(String::new, |count| format!(", {count} elements"));
    let announcement = |list: &[crate::pmi::ast::Announcement]| {
        list.iter().any(|it| checked.symbol(it.symbol).is_some_and(|it| it.name == symbol.name))
    };
    match &symbol.meaning {
        Meaning::Input(lines) => (DeclarationKind::Input, format!("{ty} input, {}", place(lines))),
        Meaning::Output(lines) => {
            (DeclarationKind::Output, format!("{ty} output, {}", place(lines)))
        }
        Meaning::Constant(values) => {
            let is_key = checked.keys.iter().any(|(name, _)| *name == symbol.name);
            let values: Vec<String> = values.iter().take(8).map(i32::to_string).collect();
            let kind = if is_key { DeclarationKind::Key } else { DeclarationKind::Constant };
            let what = if is_key { "key" } else { "constant" };
            (kind, format!("{ty} {what}{array} = {}", values.join(", ")))
        }
        Meaning::TimerControl(index) => {
            let timer = checked.timers.get(*index as usize);
            let delay = timer.map_or(0, |timer| timer.preset);
            (
                DeclarationKind::Contact,
                format!("control contact of a timer of {} ms", i64::from(delay) * 20),
            )
        }
        Meaning::Derived => (
            DeclarationKind::Contact,
            "delayed contact of a timer, or output of a flip-flop".into(),
        ),
        Meaning::Clock(_) => (DeclarationKind::Contact, "clock of a flip-flop".into()),
        Meaning::Pin(_) => (DeclarationKind::Contact, "preset or clear of a flip-flop".into()),
        Meaning::Label(_) => (DeclarationKind::Label, "label".into()),
        Meaning::Variable if announcement(&checked.faults) => {
            (DeclarationKind::Announcement, "fault".into())
        }
        Meaning::Variable if announcement(&checked.messages) => {
            (DeclarationKind::Announcement, "message".into())
        }
        Meaning::Variable | Meaning::ReadOnly | Meaning::ResetOnly => {
            let meaning =
                executive::meaning(&symbol.name).map_or_else(String::new, |it| format!(": {it}"));
            (DeclarationKind::Variable, format!("{ty} variable{array}{meaning}"))
        }
        Meaning::Unknown => (DeclarationKind::Variable, "its declaration has an error".into()),
    }
}

/// Where the lines of an input or output are.
fn place(lines: &Lines) -> String {
    let Lines { port, low, count, format } = *lines;
    if count == 1 {
        return format!("port {port}, bit {low}");
    }
    let format = match format {
        Format::Bcd => "BCD",
        Format::TwosComplement => "TWOC",
        Format::Bit | Format::Binary => "B",
    };
    format!("port {port}, bits {low} to {}, {format}", low + count - 1)
}

/// The words in declarations: formats of lines, kinds of timers, and when M codes are told.
const WORDS_OF_DECLARATIONS: [&str; 6] = ["B", "BCD", "TWOC", "D", "E", "P"];

struct Finder<'a> {
    symbols: HashMap<&'a str, &'a Symbol>,
    words: Words,
    /// The words IF that are open, and the ELSE after them.
    open: Vec<Span>,
    /// The directive of the section that is read, and where the section's last statement ends.
    section: Option<(Span, Span)>,
    /// For each token of the statement that is read what is done with what it names.
    appearances: Vec<Option<Appearance>>,
}

impl Finder<'_> {
    /// A declaration: its names are declared, those in texts are read.
    fn declaration(&mut self, form: &DeclarationForm, cursor: &Cursor<'_>) {
        if let DeclarationForm::Directive(_) = form {
            self.end_section();
            let span = statement_span(cursor.statement.file, cursor.tokens);
            self.section = Some((span, span));
        } else if let Some((_, last)) = &mut self.section {
            *last = statement_span(cursor.statement.file, cursor.tokens);
        }
        let is_text = matches!(form, DeclarationForm::Announcement { .. });
        for (token, appearance) in cursor.tokens.iter().zip(&mut self.appearances) {
            if !matches!(token.kind, Kind::Name | Kind::Executive) {
                continue;
            }
            let declared = self.symbols.get(cursor.slice(*token)).and_then(|it| it.declared);
            if declared == Some(cursor.span_of(*token)) {
                *appearance = Some(Appearance::Declared);
            } else if is_text {
                *appearance = Some(Appearance::Read);
            }
        }
    }

    /// Ends the section of the directive that was read last, if more than the directive is in it.
    fn end_section(&mut self) {
        if let Some((first, last)) = self.section.take()
            && first != last
            && first.file == last.file
        {
            self.words.blocks.push(first.to(last));
        }
    }

    /// A statement of the logic.
    fn logic(&mut self, logic: &Logic, cursor: &Cursor<'_>) {
        self.end_section();
        let used = match &logic.form {
            LogicForm::If { .. } | LogicForm::ElseIf { .. } => Appearance::Tested,
            LogicForm::Assignment { .. }
            | LogicForm::Else { .. }
            | LogicForm::EndIf { .. }
            | LogicForm::Goto { .. }
            | LogicForm::Other { .. } => Appearance::Read,
        };
        for (token, appearance) in cursor.tokens.iter().zip(&mut self.appearances) {
            if matches!(token.kind, Kind::Name | Kind::Executive) {
                *appearance = Some(used);
            }
        }
        let mut note = |start: u32, what| {
            let at = cursor.tokens.binary_search_by_key(&start, |token| token.start).ok();
            if let Some(appearance) = at.and_then(|at| self.appearances.get_mut(at)) {
                *appearance = Some(what);
            }
        };
        logic.labels.iter().for_each(|label| note(label.start, Appearance::Declared));
        match &logic.form {
            LogicForm::Assignment { name, .. } => {
                note(name.start, Appearance::Written);
            }
            LogicForm::If { word, .. } => self.open.push(cursor.span_of(*word)),
            LogicForm::ElseIf { word, .. } | LogicForm::Else { word, .. } => {
                self.end_block(cursor.span_of(*word), true)
            }
            LogicForm::EndIf { word } => self.end_block(cursor.span_of(*word), false),
            LogicForm::Goto { label, .. } => {
                label.iter().for_each(|label| note(label.start, Appearance::GoneTo));
            }
            LogicForm::Other { .. } => {}
        }
    }

    /// Ends a body of an IF at a word; `again` says that another one begins there.
    fn end_block(&mut self, word: Span, again: bool) {
        if let Some(first) = self.open.pop().filter(|first| first.file == word.file) {
            self.words.blocks.push(first.to(word));
        }
        if again {
            self.open.push(word);
        }
    }

    fn token(&mut self, cursor: &Cursor<'_>, token: Token, appearance: Option<Appearance>) {
        let (text, span) = (cursor.slice(token), cursor.span_of(token));
        let kind = match token.kind {
            Kind::Name if appearance != Some(Appearance::Declared) && RESERVED.contains(&text) => {
                WordKind::Keyword
            }
            // Of a declaration all other names are declared or in a text.
            Kind::Name if appearance.is_none() && WORDS_OF_DECLARATIONS.contains(&text) => {
                WordKind::Keyword
            }
            Kind::Name | Kind::Executive => match self.symbols.get(text).map(|it| &it.meaning) {
                Some(Meaning::Label(_)) => WordKind::Label,
                Some(Meaning::Constant(_)) => WordKind::Constant,
                None if appearance == Some(Appearance::GoneTo) => WordKind::Label,
                Some(_) | None => WordKind::Variable,
            },
            Kind::Directive => WordKind::Directive,
            Kind::Number(_) => WordKind::Number,
            Kind::Text => WordKind::Text,
            Kind::Bad(_) => return,
            Kind::Eq
            | Kind::Ne
            | Kind::Lt
            | Kind::Le
            | Kind::Gt
            | Kind::Ge
            | Kind::Plus
            | Kind::Minus
            | Kind::Star
            | Kind::Slash
            | Kind::Percent
            | Kind::And
            | Kind::Or
            | Kind::LParen
            | Kind::RParen
            | Kind::LBracket
            | Kind::RBracket
            | Kind::Comma
            | Kind::Colon => WordKind::Operator,
        };
        let is_name = matches!(kind, WordKind::Label | WordKind::Constant | WordKind::Variable);
        let name = is_name.then(|| text.to_owned());
        let appearance = appearance.filter(|_| is_name);
        self.words.words.push(Word { span, kind, name, defined_as: None, appearance });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::MemoryLoader;
    use crate::common::Options;

    fn words_of(sources: &mut SourceMap, file: FileId) -> Words {
        crate::pmi::words_and_rest(sources, file, &MemoryLoader::new(), &Options::default()).0
    }

    /// The words of a program that name something, each with what is done with it.
    fn named(text: &str) -> Vec<(String, WordKind, Option<Appearance>)> {
        let mut sources = SourceMap::new();
        let file = sources.add("a.pmi", text.as_bytes());
        let words = words_of(&mut sources, file);
        let named = words.words.iter().filter(|word| word.name.is_some());
        named
            .map(|word| (sources.slice(word.span).to_owned(), word.kind, word.appearance))
            .collect()
    }

    #[test]
    fn names_are_found_with_what_is_done_with_them() {
        use Appearance::{Declared, GoneTo, Read, Tested, Written};
        use WordKind::{Constant, Label, Variable};
        let text = "$INPUT\nA = 1/0 ? the door A\n$INTEGER\nC = 3, V[2]\n$FAULT\nFLT = \"x\", C\n$END\nL1: IF A & @FRO > C\n\
                    GOTO L1\nV[C] = V[0] + C\nB = A\nENDIF\n";
        let word = |text: &str, kind, appearance| (text.to_owned(), kind, Some(appearance));
        let expected = [
            word("A", Variable, Declared),
            word("C", Constant, Declared),
            word("V", Variable, Declared),
            word("FLT", Variable, Declared),
            word("C", Constant, Read),
            word("L1", Label, Declared),
            word("A", Variable, Tested),
            word("@FRO", Variable, Tested),
            word("C", Constant, Tested),
            word("L1", Label, GoneTo),
            word("V", Variable, Written),
            word("C", Constant, Read),
            word("V", Variable, Read),
            word("C", Constant, Read),
            word("B", Variable, Written),
            word("A", Variable, Read),
        ];
        assert_eq!(named(text), expected);
    }

    #[test]
    fn words_of_declarations_name_nothing() {
        let text = "$TIMER\nE/T1/T1D = 50\n$INPUT\nD = 1/0\nPOS = 2/0-3/BCD\n$MCODE\n@M05/D\n$END\nT1 = D\n";
        let names: Vec<String> = named(text).into_iter().map(|it| it.0).collect();
        assert_eq!(names, ["T1", "T1D", "D", "POS", "@M05", "T1", "D"]);
    }

    #[test]
    fn statements_with_errors_have_their_words_too() {
        let names: Vec<String> = named("$LOGICAL\nA\n$END\nB = A & & C\nIF A = \nD = 2A\n")
            .into_iter()
            .map(|it| it.0)
            .collect();
        for name in ["A", "B", "C", "D"] {
            assert!(names.iter().any(|found| found == name), "{name} in {names:?}");
        }
    }

    #[test]
    fn declarations_say_what_they_declare() {
        let text =
            "$INPUT\nPOS = 2/0-3/BCD\n$TIMER\nE/T1/T1D = 50\n$END\nT1 = POS > 2\nS1: B = T1D\n";
        let mut sources = SourceMap::new();
        let file = sources.add("a.pmi", text.as_bytes());
        let words = words_of(&mut sources, file);
        let found: Vec<(&str, &str)> =
            words.declarations.iter().map(|it| (it.name.as_str(), it.detail.as_str())).collect();
        assert_eq!(
            found,
            [
                ("POS", "INTEGER input, port 2, bits 0 to 3, BCD"),
                ("T1", "control contact of a timer of 1000 ms"),
                ("T1D", "delayed contact of a timer, or output of a flip-flop"),
                ("S1", "label"),
                ("B", "LOGICAL variable"),
            ]
        );
    }
}
