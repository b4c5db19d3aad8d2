//! The words of a download, for editors.
//!
//! Names are looked for in the files as they are written, before the preprocessor has replaced anything, since that is what
//! editors show. What is done with a name is known from the statement that was read there.

use std::collections::HashMap;

use plcc_abi::pmac::{Layout, PmacName};
use plcc_diag::{FileId, SourceMap, Span};

use super::ast::{Action, Download, FUNCTIONS, StmtKind};
use super::presentation::opened_plc;
use super::read::comments::comments;
use super::read::cursor::Cursor;
use super::read::preprocess::DefinedName;
use super::read::words::{MOTION, ONLINE, PLC, find};
use crate::common::tokens::{Raw, raw};
use crate::common::words::{Appearance, Declaration, DeclarationKind, Word, WordKind, Words};

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
    };
    cutter.words.statements = statements.0.iter().map(|(span, _)| *span).collect();
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

/// What a statement does with the variables that it names.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Does {
    /// The first one gets a value.
    Assigns,
    /// The first one is defined.
    Defines,
    /// A condition looks at them.
    Tests,
    /// Programs are started or stopped: bit n is PLC n.
    Switches { compiled: bool, programs: u32 },
    /// They are read.
    Reads,
}

/// The statements and on-line commands, by their places in the sources.
struct Statements(Vec<(Span, Does)>);

impl Statements {
    fn of(download: &Download) -> Self {
        let place = |at| download.origins.place(at).0;
        let online = download.online.iter().map(|online| {
            let does = match &online.action {
                Action::Assign(..) | Action::Defaults(..) => Does::Assigns,
                Action::Define(..) => Does::Defines,
                Action::Plc(_, set) => {
                    Does::Switches { compiled: set.compiled, programs: set.bits }
                }
                Action::System(_)
                | Action::Write(..)
                | Action::Save
                | Action::DeletePlcc(_)
                | Action::Motion(_) => Does::Reads,
            };
            (place(online.at), does)
        });
        let statements = download.statements().map(|stmt| {
            let does = match stmt.kind {
                StmtKind::Assign(..) => Does::Assigns,
                StmtKind::Define(_) => Does::Defines,
                StmtKind::If(..) | StmtKind::While(..) => Does::Tests,
                StmtKind::Plc(_, set) => {
                    Does::Switches { compiled: set.compiled, programs: set.bits }
                }
                StmtKind::Jump(_)
                | StmtKind::EndWhile(_)
                | StmtKind::Address(..)
                | StmtKind::AddressBy(..)
                | StmtKind::Text(..)
                | StmtKind::Word(..)
                | StmtKind::Save
                | StmtKind::Motion(..)
                | StmtKind::Loop(..) => Does::Reads,
            };
            (place(stmt.at), does)
        });
        let mut found: Vec<(Span, Does)> = online.chain(statements).collect();
        found.sort_by_key(|(span, _)| (span.file, span.start, std::cmp::Reverse(span.end)));
        Self(found)
    }

    /// The statement at a place: where it begins, and what it does.
    fn at(&self, file: FileId, offset: u32) -> Option<(Span, Does)> {
        let next = self.0.partition_point(|(span, _)| (span.file, span.start) <= (file, offset));
        // The shortest of those that begin at the same place comes last.
        let mut earlier = self.0.get(..next)?.iter().rev().take(4);
        earlier.find(|(span, _)| span.file == file && span.end > offset).copied()
    }
}

/// What a word means.
#[derive(Clone, Debug)]
struct Meaning {
    kind: WordKind,
    name: Option<String>,
    defined_as: Option<String>,
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
}

impl Cutter<'_> {
    /// Adds the words of a file.
    fn file(&mut self, sources: &SourceMap, file: FileId, statements: &Statements) {
        let text = sources.text(file);
        let comments = comments(text);
        for &(start, end) in &comments {
            self.words.words.push(plain(Span::new(file, start, end), WordKind::Comment));
        }
        let (mut at, mut comments) = (0, comments.into_iter().peekable());
        self.open.clear();
        self.program = None;
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
                Some((_, end)) => {
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
            let place = Span { start: at, end, ..span };
            match token {
                Raw::Blank(_) => {}
                Raw::Text(_) => self.push(plain(place, WordKind::Text)),
                Raw::Sign(_) => self.push(plain(place, WordKind::Operator)),
                Raw::Number(number) => self.number(number, place, statements),
                Raw::Word(word) => {
                    let rest = line.get((at - span.start) as usize..).unwrap_or_default();
                    self.word(word, place, rest, statements);
                }
            }
            at = end;
        }
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
    fn number(&mut self, text: &str, at: Span, statements: &Statements) {
        let end = text.find(|c: char| !(c.is_ascii_digit() || c == '.' || c == '$'));
        let end = end.filter(|_| !text.starts_with('$') && self.meaning(text).name.is_none());
        let (number, word) = end.and_then(|end| text.split_at_checked(end)).unwrap_or((text, ""));
        let split = at.start + number.len() as u32;
        let place = Span { end: split, ..at };
        if !number.is_empty() {
            let program = number.parse().ok().and_then(|number| switched(statements, at, number));
            self.push(match program {
                Some(name) => called(place, name),
                None => plain(place, WordKind::Number),
            });
        }
        if !word.is_empty() {
            self.word(word, Span { start: split, ..at }, "", statements);
        }
    }

    /// A word; `rest` is the text from it on.
    fn word(&mut self, text: &str, at: Span, rest: &str, statements: &Statements) {
        let letters = text.trim_end_matches(|c: char| c.is_ascii_digit());
        let upper = text.to_ascii_uppercase();
        // `PLC3` and `ENAPLC3` end with the number of a program.
        let number = text.get(letters.len()..).and_then(|digits| digits.parse().ok());
        if let Some(name) = number.and_then(|number| switched(statements, at, number)) {
            let split = at.start + letters.len() as u32;
            self.push(plain(Span { end: split, ..at }, WordKind::Keyword));
            return self.push(called(Span { start: split, ..at }, name));
        }
        if number.is_some() && ["PLC", "PLCC"].iter().any(|it| it.eq_ignore_ascii_case(letters)) {
            let split = at.start + letters.len() as u32;
            self.push(plain(Span { end: split, ..at }, WordKind::Keyword));
            return self.push(plain(Span { start: split, ..at }, WordKind::Number));
        }
        match upper.as_str() {
            "OPEN" | "OPE" => {
                self.end_program(at);
                self.program = opened_plc(rest).map(|name| (name, at));
            }
            "CLOSE" | "CLO" | "CLS" => self.end_program(at),
            "IF" | "WHILE" => self.open.push(at),
            "ELSE" => self.end_block(at, true),
            "ENDIF" | "ENDI" | "ENDWHILE" | "ENDW" => self.end_block(at, false),
            _ => {}
        }
        let meaning = self.meaning(text);
        let Meaning { kind, name, defined_as } = meaning;
        let is_variable = name.is_some();
        let does = statements.at(at.file, at.start);
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
        if self.names.contains_key(text) {
            let name = self.variable_of(text);
            let kind = if name.is_some() { WordKind::Variable } else { WordKind::Constant };
            return Meaning { kind, name, defined_as: Some(text.to_owned()) };
        }
        if let Ok(name @ PmacName::Variable(_)) = PmacName::parse(text, &self.layout) {
            return Meaning {
                kind: WordKind::Variable,
                name: Some(name.to_string()),
                defined_as: None,
            };
        }
        let is_function = FUNCTIONS.iter().any(|(name, _)| name.eq_ignore_ascii_case(text));
        let is_program = ["PLC", "PLCC"].iter().any(|it| it.eq_ignore_ascii_case(text));
        let is_word = || is_program || find(Cursor::new(text), PLC.or(ONLINE).or(MOTION)).is_some();
        let kind = if is_function || is_word() { WordKind::Keyword } else { WordKind::Constant };
        Meaning { kind, name: None, defined_as: None }
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

/// A word that names nothing.
fn plain(span: Span, kind: WordKind) -> Word {
    Word { span, kind, name: None, defined_as: None, appearance: None }
}

/// A word that names a program which is started or stopped.
fn called(span: Span, name: String) -> Word {
    Word { name: Some(name), appearance: Some(Appearance::Called), ..plain(span, WordKind::Label) }
}

/// The program with a number, if the statement at a place starts or stops it.
fn switched(statements: &Statements, at: Span, number: u32) -> Option<String> {
    let Some((_, Does::Switches { compiled, programs })) = statements.at(at.file, at.start) else {
        return None;
    };
    let is_named = number < 32 && programs & (1 << number) != 0;
    is_named.then(|| format!("{}{number}", if compiled { "PLCC" } else { "PLC" }))
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
    fn words_in_comments_and_texts_are_no_names() {
        let (_, words) = found("OPEN PLC 1 CLEAR /* P1\nP2 */ SEND\"P3\" // P4\nCLOSE");
        assert!(words.words.iter().all(|word| word.name.is_none()));
    }
}
