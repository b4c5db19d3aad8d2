//! The words of a program's sources, for editors: what each of them is, and what the program does with it there.
//!
//! They are made by the readers that the compiler itself uses, and also of a program with errors. Where a statement can't be
//! read, its words are there nevertheless.

use std::collections::{HashMap, HashSet};
use std::iter::Peekable;
use std::sync::OnceLock;

use plcc_diag::{FileId, SourceMap, Span};

use super::trailing_comment::{split_comment, trailing_comment};

/// What a word is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum WordKind {
    /// A comment, with its mark.
    Comment,
    /// A word of the language.
    Keyword,
    /// A directive, which is for the compiler or for the download.
    Directive,
    /// A variable.
    Variable,
    /// A name that stands for a constant, or a `#define` whose replacement is not a variable alone.
    Constant,
    /// A label, or the name of a program, which can be gone to or started.
    Label,
    /// A number.
    Number,
    /// A text in quotes, or the text of a message.
    Text,
    /// A sign.
    Operator,
}

/// What the program does with the variable or label that a word names.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Appearance {
    /// It is declared or defined here.
    Declared,
    /// It is loaded or computed with.
    Read,
    /// It gets a value.
    Written,
    /// A condition looks at it.
    Tested,
    /// The program goes on there, and does not come back.
    GoneTo,
    /// It is called, started or stopped.
    Called,
}

/// A word.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Word {
    /// Where it is.
    pub span: Span,
    /// What it is.
    pub kind: WordKind,
    /// The variable, constant or label that it names, in canonical spelling. Of an element it is the array. An alias that a
    /// `#define` makes has the variable that it stands for.
    pub name: Option<String>,
    /// The name under which it is defined, if that is another one: the one of a `#define`.
    pub defined_as: Option<String>,
    /// What is done with it.
    pub appearance: Option<Appearance>,
}

/// What a declaration declares.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum DeclarationKind {
    /// An input.
    Input,
    /// An output.
    Output,
    /// A variable of the program.
    Variable,
    /// A constant.
    Constant,
    /// A timer's or flip-flop's contact.
    Contact,
    /// A fault or a message.
    Announcement,
    /// A touch key.
    Key,
    /// A label, a module, a subroutine.
    Label,
    /// A PLC, a motion program.
    Program,
    /// A name of a `#define`.
    Definition,
}

/// A declaration: of a variable, a label, a program, a name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Declaration {
    /// The name that it declares, as a word's `name`, or its `defined_as` where it has one.
    pub name: String,
    /// Where the name is.
    pub at: Span,
    /// The whole declaration; of a program or subroutine all its statements.
    pub extent: Span,
    /// What it declares.
    pub kind: DeclarationKind,
    /// What it says, in a line: `input of port 1, bit 0`.
    pub detail: String,
}

/// The words and declarations of a program, each list in the order of files and places.
#[derive(Clone, Debug, Default)]
pub struct Words {
    /// The words. None overlaps another one.
    pub words: Vec<Word>,
    /// The declarations.
    pub declarations: Vec<Declaration>,
    /// Statements that include a file: the place of its name, and the file.
    pub includes: Vec<(Span, FileId)>,
    /// What can be folded, apart from comments: conditions, loops, programs, sections. Each reaches from its first word to its
    /// last one.
    pub blocks: Vec<Span>,
    /// The places of all statements.
    pub statements: Vec<Span>,
    /// What words name beside their own name, by the places of the words: the points of `2..5` name the programs 3 and 4.
    pub further: Vec<(Span, String)>,
    /// Where names are in the lists. Much that editors ask does without.
    index: OnceLock<Index>,
}

/// The places of names in the lists of words and declarations.
#[derive(Clone, Debug, Default)]
struct Index {
    /// Words, by the variable, constant or label that they name.
    named: HashMap<String, Vec<usize>>,
    /// Words, by the name of the `#define`.
    defined: HashMap<String, Vec<usize>>,
    /// Declarations, by the name.
    declared: HashMap<String, Vec<usize>>,
}

impl Index {
    fn of(words: &Words) -> Self {
        let Words { words, declarations, further, .. } = words;
        let mut index = Self::default();
        let enter = |map: &mut HashMap<String, Vec<usize>>, name: &str, at| match map.get_mut(name)
        {
            Some(places) => places.push(at),
            None => {
                map.insert(name.to_owned(), vec![at]);
            }
        };
        for (at, word) in words.iter().enumerate() {
            word.name.iter().for_each(|name| enter(&mut index.named, name, at));
            word.defined_as.iter().for_each(|name| enter(&mut index.defined, name, at));
        }
        for (span, name) in further {
            if let Ok(at) = words.binary_search_by_key(span, |word| word.span) {
                enter(&mut index.named, name, at);
            }
        }
        let further: HashSet<&String> = further.iter().map(|(_, name)| name).collect();
        for name in further {
            index.named.entry(name.clone()).or_default().sort_unstable();
        }
        for (at, declaration) in declarations.iter().enumerate() {
            enter(&mut index.declared, &declaration.name, at);
        }
        index
    }
}

/// A word that names nothing.
pub(crate) fn plain(span: Span, kind: WordKind) -> Word {
    Word { span, kind, name: None, defined_as: None, appearance: None }
}

/// The comments of a file, to be put among its words in their order.
pub(crate) struct Comments {
    file: FileId,
    places: Peekable<std::vec::IntoIter<(usize, usize)>>,
}

impl Comments {
    /// Comments by where they begin and end, in their order.
    pub(crate) fn new(file: FileId, places: Vec<(usize, usize)>) -> Self {
        Self { file, places: places.into_iter().peekable() }
    }

    /// Adds those that begin before an offset.
    pub(crate) fn add_before(&mut self, offset: u32, words: &mut Vec<Word>) {
        while let Some((start, end)) = self.places.next_if(|&(start, _)| start < offset as usize) {
            words.push(plain(Span::new(self.file, start, end), WordKind::Comment));
        }
    }
}

impl Words {
    /// Sorts the lists and drops words that lie in others, such as a name in a comment.
    #[must_use]
    pub(crate) fn sorted(mut self, sources: &SourceMap) -> Self {
        let order =
            |word: &Word| (word.span.file, word.span.start, std::cmp::Reverse(word.span.end));
        if !self.words.is_sorted_by_key(order) {
            self.words.sort_by_key(order);
        }
        let mut end = (FileId(0), 0);
        self.words.retain(|word| {
            let overlaps = word.span.file == end.0 && word.span.start < end.1;
            let is_empty = word.span.start >= word.span.end;
            if !overlaps && !is_empty {
                end = (word.span.file, word.span.end);
            }
            !overlaps && !is_empty
        });
        self.declarations.sort_by_key(|it| (it.at.file, it.at.start));
        self.blocks.sort_unstable();
        self.statements.sort_unstable();
        self.includes = (0..sources.len() as u32)
            .map(FileId)
            .filter_map(|file| Some((sources.included_from(file)?, file)))
            .collect();
        self.further.sort_unstable();
        self
    }

    fn index(&self) -> &Index {
        self.index.get_or_init(|| Index::of(self))
    }

    /// The words of a file.
    pub fn of_file(&self, file: FileId) -> &[Word] {
        let from = self.words.partition_point(|word| word.span.file < file);
        let to = self.words.partition_point(|word| word.span.file <= file);
        self.words.get(from..to).unwrap_or_default()
    }

    /// The word at an offset: the one that holds it, else the one that ends there.
    pub fn at(&self, file: FileId, offset: u32) -> Option<&Word> {
        let words = self.of_file(file);
        let next = words.partition_point(|word| word.span.start <= offset);
        let before = next.checked_sub(1).and_then(|at| words.get(at))?;
        if offset < before.span.end {
            return Some(before);
        }
        // An operator ends where a name begins: the name is meant, which `before` is already.
        (offset == before.span.end && before.kind != WordKind::Operator).then_some(before).or_else(
            || {
                let earlier = next.checked_sub(2).and_then(|at| words.get(at))?;
                (offset == earlier.span.end).then_some(earlier)
            },
        )
    }

    /// The comment that stands after a place on the same line, without its mark; else the comment that fills the line above.
    /// `signs` are what begins a comment in the language.
    pub fn comment_beside(&self, sources: &SourceMap, at: Span, signs: &[&str]) -> Option<String> {
        if let Some(beside) = trailing_comment(sources, at, signs) {
            return Some(beside);
        }
        let above = sources.line(at.file, at.start).checked_sub(1)?;
        let (statement, comment) = split_comment(sources.line_text(at.file, above), signs);
        (statement.trim().is_empty() && !comment.is_empty()).then(|| comment.to_owned())
    }

    /// All that a word names.
    pub fn names_of<'w>(&'w self, word: &'w Word) -> impl Iterator<Item = &'w str> {
        let from = self.further.partition_point(|(span, _)| *span < word.span);
        let further = self.further.get(from..).unwrap_or_default().iter();
        let further = further.take_while(|(span, _)| *span == word.span);
        word.name.as_deref().into_iter().chain(further.map(|(_, name)| name.as_str()))
    }

    /// All words that name the same variable, constant or label as a word, in their order. A name of a `#define` is another one
    /// than the variable that it stands for.
    pub fn same_as<'w>(&'w self, word: &Word) -> Vec<&'w Word> {
        let places: Vec<usize> = match &word.defined_as {
            Some(defined) => self.index().defined.get(defined).cloned().unwrap_or_default(),
            None => {
                let names = self.names_of(word);
                let places = names.filter_map(|name| self.index().named.get(name)).flatten();
                let mut places: Vec<usize> = places.copied().collect();
                // Of several names some may be named by the same words.
                places.sort_unstable();
                places.dedup();
                places
            }
        };
        let is_label = word.kind == WordKind::Label;
        let same = places.into_iter().filter_map(|at| self.words.get(at));
        same.filter(|other| {
            word.defined_as.is_some() || (other.kind == WordKind::Label) == is_label
        })
        .collect()
    }

    /// The declarations of a name, in their order.
    pub fn declared(&self, name: &str) -> impl Iterator<Item = &Declaration> {
        let found = self.index().declared.get(name).into_iter().flatten();
        found.filter_map(|&at| self.declarations.get(at))
    }

    /// The declarations of what a word names: of the name itself, else of what it stands for.
    pub fn declarations_of(&self, word: &Word) -> Vec<&Declaration> {
        let own = word.defined_as.iter().flat_map(|name| self.declared(name));
        let own: Vec<&Declaration> = own.collect();
        if !own.is_empty() {
            return own;
        }
        self.names_of(word).flat_map(|name| self.declared(name)).collect()
    }

    /// How often a variable is read or tested, and how often it is written.
    pub fn uses_of(&self, name: &str) -> (usize, usize) {
        let own = self.index().named.get(name).into_iter().flatten();
        count(own.filter_map(|&at| self.words.get(at)))
    }

    /// The same of each variable, in no order.
    pub fn uses(&self) -> impl Iterator<Item = (&str, (usize, usize))> {
        self.index().named.keys().map(|name| (name.as_str(), self.uses_of(name)))
    }
}

/// How many of some words read or test a variable, and how many give it a value.
fn count<'w>(words: impl Iterator<Item = &'w Word>) -> (usize, usize) {
    words.fold((0, 0), |(read, written), word| match word.appearance {
        Some(Appearance::Read | Appearance::Tested | Appearance::GoneTo | Appearance::Called) => {
            (read + 1, written)
        }
        Some(Appearance::Written) => (read, written + 1),
        Some(Appearance::Declared) | None => (read, written),
    })
}
