//! The words of a download, for editors.
//!
//! Names are looked for in the files as they are written, before the preprocessor has replaced anything, since that is what
//! editors show. What is done with a name is known from the statement that was read there.

use std::collections::HashMap;

use plcc_abi::pmac::{Layout, PmacName};
use plcc_diag::{FileId, SourceMap, Span};

use super::ast::{Download, FUNCTIONS};
use super::plc_lists::{Part, Switched, list, number, plc_name, program_word};
use super::read::comments::comments;
use super::read::cursor::Cursor;
use super::read::preprocess::DefinedName;
use super::read::words::{MOTION, ONLINE, PLC, find};
use super::uses::{Does, Statements};
use crate::common::tokens::{Raw, raw};
use crate::common::words::{
    Appearance, Declaration, DeclarationKind, Word, WordKind, Words, plain,
};

/// The words of a download and of all files that it includes.
pub(super) fn words(
    sources: &SourceMap,
    names: &[DefinedName],
    download: &Download,
    layout: Layout,
) -> Words {
    let statements = Statements::of(download);
    let mut cutter = Cutter {
        layout,
        names: names.iter().map(|name| (name.name.as_str(), name)).collect(),
        known: HashMap::new(),
        words: Words::default(),
        open: vec![],
        program: None,
        until: 0,
    };
    cutter.words.statements = statements.places().collect();
    for id in (0..sources.len() as u32).map(FileId) {
        cutter.file(sources, id, &statements);
    }
    for declaration in &mut cutter.words.declarations {
        if declaration.kind != DeclarationKind::Program {
            declaration.detail = sources.slice(declaration.extent).trim().to_owned();
        }
    }
    cutter.words.sorted(sources)
}

/// What a word means.
#[derive(Clone, Debug)]
struct Meaning {
    kind: WordKind,
    name: Option<String>,
    defined_as: Option<String>,
    structure: Option<Structure>,
}

/// What a word of the language begins or ends.
#[derive(Clone, Copy, Debug)]
enum Structure {
    Open,
    Close,
    Begin,
    Else,
    End,
}

impl Structure {
    fn of(word: &str) -> Option<Self> {
        Some(match word.to_ascii_uppercase().as_str() {
            "OPEN" | "OPE" => Self::Open,
            "CLOSE" | "CLO" | "CLS" => Self::Close,
            "IF" | "WHILE" => Self::Begin,
            "ELSE" => Self::Else,
            "ENDIF" | "ENDI" | "ENDWHILE" | "ENDW" => Self::End,
            _ => return None,
        })
    }
}

struct Cutter<'a> {
    layout: Layout,
    /// The names of `#define`.
    names: HashMap<&'a str, &'a DefinedName>,
    /// What each word was found to mean.
    known: HashMap<String, Meaning>,
    words: Words,
    /// The words IF and WHILE that are open.
    open: Vec<Span>,
    /// The buffer that is open: its name, and where OPEN stands.
    program: Option<(String, Span)>,
    /// Up to where the words of the file have been added.
    until: u32,
}

impl Cutter<'_> {
    /// Adds the words of a file.
    fn file(&mut self, sources: &SourceMap, file: FileId, statements: &Statements) {
        let text = sources.text(file);
        let (mut at, mut comments) = (0, comments(text).into_iter().peekable());
        self.open.clear();
        self.program = None;
        self.until = 0;
        while at < text.len() {
            // Up to the next comment or the line's end.
            let line_end = text
                .get(at..)
                .and_then(|rest| rest.find(['\r', '\n']))
                .map_or(text.len(), |n| at + n);
            let comment = comments.peek().copied().filter(|&(start, _)| start <= line_end);
            let end = comment.map_or(line_end, |(start, _)| start);
            let begins_line =
                at == 0 || text.get(..at).is_some_and(|before| before.ends_with(['\r', '\n']));
            self.segment(text, Span::new(file, at, end), begins_line, statements);
            at = match comment {
                Some((start, end)) => {
                    self.push(plain(Span::new(file, start, end), WordKind::Comment));
                    comments.next();
                    end
                }
                None => end + 1,
            };
        }
        self.end_program(Span::new(file, text.trim_end().len(), text.trim_end().len()));
    }

    /// Adds the words of a line, or of a part of one.
    fn segment(&mut self, text: &str, span: Span, begins_line: bool, statements: &Statements) {
        let line = text.get(span.range()).unwrap_or_default();
        if begins_line && line.trim_start().starts_with('#') {
            return self.directive(line, span);
        }
        let mut at = span.start;
        for token in raw(line) {
            let end = at + token.text().len() as u32;
            // A list of programs is taken at once, and may end in a token: `ENAPLC1..3DISPLC4`.
            let start = at.max(self.until);
            at = end;
            let place = Span { start, end, ..span };
            let rest = line.get((start - span.start) as usize..).unwrap_or_default();
            let text = rest.get(..end.saturating_sub(start) as usize).unwrap_or_default();
            match token {
                _ if text.is_empty() => {}
                Raw::Blank(_) => {}
                Raw::Text(_) => self.text(text, place, statements),
                Raw::Sign(_) => self.push(plain(place, WordKind::Operator)),
                Raw::Number(_) if !text.starts_with(char::is_alphabetic) => {
                    self.number(text, place, rest, statements);
                }
                Raw::Number(_) | Raw::Word(_) => self.word(text, place, rest, statements),
            }
        }
    }

    /// A text in quotes. Those programs are words of it which it starts or stops as a COMMAND.
    fn text(&mut self, text: &str, at: Span, statements: &Statements) {
        let does = statements.at(at.file, at.start);
        let Some((_, Does::Commands(switched))) = does.filter(|_| text.len() > 2) else {
            return self.push(plain(at, WordKind::Text));
        };
        let (mut start, mut from) = (at.start, 0);
        while let Some(rest) = text.get(from..).filter(|_| !switched.is_empty()) {
            let Some((end, compiled)) = program_word(rest) else { break };
            from += end;
            for part in self.list(text.get(from..).unwrap_or_default(), compiled, switched) {
                let span = part_of(at, from, &part);
                let before = Span { start, end: span.start, ..at };
                self.push(plain(before, WordKind::Text));
                self.push_part(text, from, span, part, WordKind::Text);
                start = span.end;
            }
        }
        self.push(plain(Span { start, ..at }, WordKind::Text));
    }

    /// The parts of the list of programs with which a text begins.
    fn list(&self, text: &str, compiled: bool, switched: Switched) -> Vec<Part> {
        list(text, compiled, switched, |name| self.program_number(name))
    }

    /// The number of a program that a name of `#define` stands for.
    fn program_number(&self, name: &str) -> Option<u32> {
        self.names.get(name)?.body.trim().parse().ok()
    }

    /// Adds the words of the list of programs that begins `from` bytes after a place, with the word in front of it, and
    /// returns whether there is a list.
    fn programs(
        &mut self,
        at: Span,
        from: usize,
        rest: &str,
        compiled: bool,
        of: Switched,
    ) -> bool {
        let parts = self.list(rest.get(from..).unwrap_or_default(), compiled, of);
        let is_there = !parts.is_empty();
        if is_there && from > 0 {
            self.push(plain(Span { end: at.start + from as u32, ..at }, WordKind::Keyword));
        }
        for part in parts {
            let span = part_of(at, from, &part);
            self.push_part(rest, from, span, part, WordKind::Operator);
            self.until = span.end;
        }
        is_there
    }

    /// Adds a part of the list of programs that begins at an offset of a text. One that names none is of the kind `otherwise`.
    fn push_part(&mut self, text: &str, from: usize, at: Span, part: Part, otherwise: WordKind) {
        let mut programs = part.programs.into_iter();
        let Some(name) = programs.next() else { return self.push(plain(at, otherwise)) };
        self.words.further.extend(programs.map(|name| (at, name)));
        let written = text.get(from + part.from..from + part.to).unwrap_or_default();
        let defined_as = self.names.contains_key(written).then(|| written.to_owned());
        let (name, appearance) = (Some(name), Some(Appearance::Called));
        self.push(Word { span: at, kind: WordKind::Label, name, defined_as, appearance });
    }

    fn push(&mut self, word: Word) {
        self.words.words.push(word);
    }

    /// A directive such as `#define NAME text`.
    fn directive(&mut self, line: &str, span: Span) {
        let lead = line.len() - line.trim_start().len();
        let rest = line.get(lead + 1..).unwrap_or_default();
        let word =
            rest.trim_start().split(|c: char| !c.is_alphanumeric()).next().unwrap_or_default();
        let word_end = lead + 1 + (rest.len() - rest.trim_start().len()) + word.len();
        let place = |from: usize, to: usize| Span {
            start: span.start + from as u32,
            end: span.start + to as u32,
            ..span
        };
        self.push(plain(place(lead, word_end), WordKind::Directive));
        let tail = line.get(word_end..).unwrap_or_default();
        if word.eq_ignore_ascii_case("include") {
            let from = word_end + tail.len() - tail.trim_start().len();
            return self.push(plain(place(from, line.trim_end().len()), WordKind::Text));
        }
        let is_define = word.eq_ignore_ascii_case("define");
        let (mut at, mut is_first) = (word_end, true);
        for token in raw(tail) {
            let (from, to) = (at, at + token.text().len());
            at = to;
            match token {
                Raw::Blank(_) => continue,
                Raw::Text(_) => self.push(plain(place(from, to), WordKind::Text)),
                Raw::Sign(_) => self.push(plain(place(from, to), WordKind::Operator)),
                Raw::Word(name) if is_first => {
                    self.defined(name, place(from, to), is_define.then_some(span))
                }
                Raw::Word(word) | Raw::Number(word) => {
                    let meaning = self.meaning(word);
                    let kind = match token {
                        Raw::Number(_) if meaning.name.is_none() => WordKind::Number,
                        _ => meaning.kind,
                    };
                    let appearance = meaning.name.as_ref().map(|_| Appearance::Read);
                    let Meaning { name, defined_as, .. } = meaning;
                    self.push(Word { span: place(from, to), kind, name, defined_as, appearance });
                }
            }
            is_first = false;
        }
    }

    /// The name after `#define`, `#undef` and `#ifdef`.
    fn defined(&mut self, name: &str, at: Span, define: Option<Span>) {
        let Meaning { name: stands_for, .. } = self.meaning(name);
        let kind = if stands_for.is_some() { WordKind::Variable } else { WordKind::Constant };
        let appearance =
            Some(if define.is_some() { Appearance::Declared } else { Appearance::Tested });
        let defined_as = Some(name.to_owned());
        self.push(Word { span: at, kind, name: stands_for, defined_as, appearance });
        if let Some(extent) = define {
            let (name, kind, detail) =
                (name.to_owned(), DeclarationKind::Definition, String::new());
            self.words.declarations.push(Declaration { name, at, extent, kind, detail });
        }
    }

    /// A number, a name that begins with a digit, or a number with a word glued to it.
    fn number(&mut self, text: &str, at: Span, rest: &str, statements: &Statements) {
        // A comment may be between PLC and the number.
        if let Some((_, Does::Switches(switched))) = statements.at(at.file, at.start)
            && self.programs(at, 0, rest, switched.is_compiled(), switched)
        {
            return self.rest_of(text, at, rest, statements);
        }
        let end = text.find(|c: char| !(c.is_ascii_digit() || c == '.' || c == '$'));
        let end = end.filter(|_| !text.starts_with('$') && self.meaning(text).name.is_none());
        let (number, word) = end.and_then(|end| text.split_at_checked(end)).unwrap_or((text, ""));
        let split = at.start + number.len() as u32;
        if !number.is_empty() {
            self.push(plain(Span { end: split, ..at }, WordKind::Number));
        }
        if !word.is_empty() {
            let rest = rest.get(number.len()..).unwrap_or_default();
            self.word(word, Span { start: split, ..at }, rest, statements);
        }
    }

    /// What is left of a token after a list of programs.
    fn rest_of(&mut self, token: &str, at: Span, rest: &str, statements: &Statements) {
        let from = (self.until.max(at.start) - at.start) as usize;
        let Some(word) = token.get(from..).filter(|left| !left.is_empty()) else { return };
        let at = Span { start: at.start + from as u32, ..at };
        self.word(word, at, rest.get(from..).unwrap_or_default(), statements);
    }

    /// A word; `rest` is the text from it on.
    fn word(&mut self, text: &str, at: Span, rest: &str, statements: &Statements) {
        let does = statements.at(at.file, at.start);
        if let Some((_, Does::Switches(switched))) = does
            && let Some((end, compiled)) = program_word(text)
            && self.programs(at, end, rest, compiled, switched)
        {
            return self.rest_of(text, at, rest, statements);
        }
        let letters = text.trim_end_matches(|c: char| c.is_ascii_digit());
        let is_program = || ["PLC", "PLCC"].iter().any(|it| it.eq_ignore_ascii_case(letters));
        if letters.len() < text.len() && is_program() {
            let split = at.start + letters.len() as u32;
            self.push(plain(Span { end: split, ..at }, WordKind::Keyword));
            return self.push(plain(Span { start: split, ..at }, WordKind::Number));
        }
        let Meaning { kind, name, defined_as, structure } = self.meaning(text);
        match structure {
            Some(Structure::Open) => {
                self.end_program(at);
                self.program = self.opened(rest).map(|name| (name, at));
            }
            Some(Structure::Close) => self.end_program(at),
            Some(Structure::Begin) => self.open.push(at),
            Some(Structure::Else) => self.end_block(at, true),
            Some(Structure::End) => self.end_block(at, false),
            None => {}
        }
        let is_variable = name.is_some();
        let is_first = |span: Span| {
            let before = self.words.words.iter().rev().take_while(|word| {
                word.span.file == at.file
                    && word.span.start >= span.start
                    && word.span.start < at.start
            });
            !before.into_iter().any(|word| word.name.is_some())
        };
        let appearance = is_variable.then(|| match does {
            Some((span, Does::Assigns)) if is_first(span) => Appearance::Written,
            Some((span, Does::Defines)) if is_first(span) => Appearance::Declared,
            Some((_, Does::Tests)) => Appearance::Tested,
            _ => Appearance::Read,
        });
        if let (Some(Appearance::Declared), Some(name), Some((extent, _))) =
            (appearance, &name, does)
        {
            let (name, kind, detail) = (name.clone(), DeclarationKind::Variable, String::new());
            self.words.declarations.push(Declaration { name, at, extent, kind, detail });
        }
        self.push(Word { span: at, kind, name, defined_as, appearance });
    }

    /// The PLC or PLCC that a text opens which begins with OPEN.
    fn opened(&self, text: &str) -> Option<String> {
        let mut cur = Cursor::new(text);
        if !(cur.eat_abbreviated("OPEN", 3) && cur.eat_word("PLC")) {
            return None;
        }
        let compiled = matches!(cur.byte(), b'C' | b'c');
        cur.pos += usize::from(compiled);
        let number = number(&mut cur, |name| self.program_number(name))?;
        Some(plc_name(compiled, number))
    }

    /// Ends an IF or WHILE at a word; `again` says that another body begins there.
    fn end_block(&mut self, word: Span, again: bool) {
        self.words.blocks.extend(self.open.pop().map(|first| first.to(word)));
        if again {
            self.open.push(word);
        }
    }

    /// Ends the program that is open.
    fn end_program(&mut self, last: Span) {
        self.open.clear();
        let Some((name, at)) = self.program.take() else { return };
        let extent = at.to(last);
        let (kind, detail) = (DeclarationKind::Program, format!("buffer of {name}"));
        self.words.blocks.push(extent);
        self.words.declarations.push(Declaration { name, at, extent, kind, detail });
    }

    /// What a word means by itself.
    fn meaning(&mut self, text: &str) -> Meaning {
        if let Some(known) = self.known.get(text) {
            return known.clone();
        }
        let found = self.look_up(text);
        self.known.insert(text.to_owned(), found.clone());
        found
    }

    fn look_up(&self, text: &str) -> Meaning {
        let structure = Structure::of(text);
        if self.names.contains_key(text) {
            let name = self.variable_of(text);
            let kind = if name.is_some() { WordKind::Variable } else { WordKind::Constant };
            return Meaning { kind, name, defined_as: Some(text.to_owned()), structure };
        }
        if let Ok(name @ PmacName::Variable(_)) = PmacName::parse(text, &self.layout) {
            let (kind, name) = (WordKind::Variable, Some(name.to_string()));
            return Meaning { kind, name, defined_as: None, structure };
        }
        let is_function = FUNCTIONS.iter().any(|(name, _)| name.eq_ignore_ascii_case(text));
        let is_program = ["PLC", "PLCC"].iter().any(|it| it.eq_ignore_ascii_case(text));
        let is_word = || is_program || find(Cursor::new(text), PLC.or(ONLINE).or(MOTION)).is_some();
        let kind = if is_function || is_word() { WordKind::Keyword } else { WordKind::Constant };
        Meaning { kind, name: None, defined_as: None, structure }
    }

    /// The variable that a name of `#define` stands for, if its whole replacement is one.
    fn variable_of(&self, name: &str) -> Option<String> {
        let mut text = name;
        // Definitions may name each other in a circle.
        for _ in 0..16 {
            let Some(defined) = self.names.get(text) else { break };
            text = defined.body.trim();
        }
        let name = PmacName::parse(text, &self.layout).ok()?;
        matches!(name, PmacName::Variable(_)).then(|| name.to_string())
    }
}

/// The place of a part of a list which begins `from` bytes after a place.
fn part_of(at: Span, from: usize, part: &Part) -> Span {
    let place = |offset: usize| at.start + (from + offset) as u32;
    Span { start: place(part.from), end: place(part.to), ..at }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::MemoryLoader;
    use crate::common::Options;

    fn words_of(sources: &mut SourceMap, file: FileId) -> Words {
        crate::pmac::check_with_words(sources, &[file], &MemoryLoader::new(), &Options::default()).2
    }

    fn found(text: &str) -> (SourceMap, Words) {
        let mut sources = SourceMap::new();
        let file = sources.add("a.pmc", text.as_bytes());
        let words = words_of(&mut sources, file);
        (sources, words)
    }

    #[test]
    fn names_are_found_with_what_is_done_with_them() {
        use Appearance::{Called, Declared, Read, Tested, Written};
        let text = "#define DOOR M11 ; a door\n#define LIMIT 20\nM11->Y:$FFC2,0\nOPEN PLC 3 CLEAR\n\
                    IF (DOOR=1 AND P2<LIMIT)P1=P2+1ENDIF\nENAPLC4\nCLOSE\n";
        let (sources, words) = found(text);
        let named = words.words.iter().filter_map(|word| {
            let text = sources.slice(word.span);
            Some((text, word.name.as_deref()?, word.appearance?))
        });
        assert_eq!(
            named.collect::<Vec<_>>(),
            [
                ("DOOR", "M11", Declared),
                ("M11", "M11", Read),
                ("M11", "M11", Declared),
                ("DOOR", "M11", Tested),
                ("P2", "P2", Tested),
                ("P1", "P1", Written),
                ("P2", "P2", Read),
                ("4", "PLC4", Called),
            ]
        );
        let limit = words.words.iter().filter(|word| word.defined_as.as_deref() == Some("LIMIT"));
        assert_eq!(limit.count(), 2);
        let declared: Vec<(&str, &str)> = words
            .declarations
            .iter()
            .map(|it| (it.name.as_str(), sources.slice(it.extent)))
            .collect();
        let plc = text.get(text.find("OPEN").unwrap()..text.len() - 1).unwrap();
        assert_eq!(
            declared,
            [
                ("DOOR", "#define DOOR M11 "),
                ("LIMIT", "#define LIMIT 20"),
                ("M11", "M11->Y:$FFC2,0"),
                ("PLC3", plc),
            ]
        );
    }

    #[test]
    fn programs_are_named_by_lists_ranges_and_texts_of_commands() {
        let text = "#define OIL 9\nOPEN PLC 1 CLEAR\nENABLE PLC 2..5, $6,OIL DISPLC7..8P1=2\n\
                    CMD\"DIS PLC 2,4..5 P2=3 ENAPLCC1\"PAUSE PLC /* x */ 3\nRESUME PLC3\n\
                    SEND\"ENA PLC2\"CLOSE\nOPEN PLC OIL\nCLOSE\nENABLE PLC 1\n";
        let (sources, words) = found(text);
        let called = words.words.iter().filter(|it| it.appearance == Some(Appearance::Called));
        let named: Vec<(&str, Vec<&str>)> =
            called.map(|it| (sources.slice(it.span), words.names_of(it).collect())).collect();
        assert_eq!(
            named,
            [
                ("2", vec!["PLC2"]),
                ("..", vec!["PLC3", "PLC4"]),
                ("5", vec!["PLC5"]),
                ("$6", vec!["PLC6"]),
                ("OIL", vec!["PLC9"]),
                ("7", vec!["PLC7"]),
                ("8", vec!["PLC8"]),
                ("2", vec!["PLC2"]),
                ("4", vec!["PLC4"]),
                ("5", vec!["PLC5"]),
                ("1", vec!["PLCC1"]),
                ("3", vec!["PLC3"]),
                ("3", vec!["PLC3"]),
                ("1", vec!["PLC1"]),
            ]
        );
        assert_eq!(words.uses_of("PLC3"), (3, 0));
        let of_4 = words.words.iter().find(|it| it.name.as_deref() == Some("PLC4")).unwrap();
        assert_eq!(words.same_as(of_4).len(), 2);
        // Nothing of the lines is left out.
        let shown: String = words.words.iter().map(|it| sources.slice(it.span)).collect();
        let dense = text.replace(char::is_whitespace, "");
        assert_eq!(shown.replace(char::is_whitespace, ""), dense);
        let opened = words.declarations.iter().filter(|it| it.kind == DeclarationKind::Program);
        assert_eq!(opened.map(|it| it.name.as_str()).collect::<Vec<_>>(), ["PLC1", "PLC9"]);
    }

    #[test]
    fn words_in_comments_and_texts_are_no_names() {
        let (_, words) = found("OPEN PLC 1 CLEAR /* P1\nP2 */ SEND\"P3\" // P4\nCLOSE");
        assert!(words.words.iter().all(|word| word.name.is_none()));
    }
}
