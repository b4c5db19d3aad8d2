//! The download program's macros: `#define` and its kind, `$(NAME)` templates, comments, includes.
//!
//! The result is one text, comments and directives gone, line ends `\n`, with the
//! [way back](Origins) to the sources. Time and space are linear in what is read and written, and
//! what is written is bounded, so that definitions that double again and again end in an error.

use std::collections::HashMap;
use std::path::Path;

use plcc_diag::{Diagnostic, FileId, SourceMap, Span};

use super::origin::{At, Origins};
use super::template::{Line, Template, Values};
use crate::common::{FileLoader, Options, find_include};

/// Deepest nesting of includes, conditionals and replacements.
const MAX_NESTING: usize = 256;

/// Bytes that replacements and includes may produce besides the sources' own.
const MAX_PRODUCED: usize = 16 << 20;

/// A preprocessed download.
#[derive(Debug, Default)]
pub(crate) struct Flat {
    /// The text. Its last character stands for the last line of the last file.
    pub(crate) text: String,
    /// Where it comes from.
    pub(crate) origins: Origins,
    /// Stretches around a template that nothing defines: no further errors there.
    pub(crate) poisoned: Vec<At>,
    /// An included file is missing: names that nothing defines may be defined there.
    pub(crate) incomplete: bool,
    /// The names that are defined at the end, in alphabetical order.
    pub(crate) names: Vec<String>,
}

struct Macro {
    body: std::rc::Rc<str>,
    defined: Span,
    busy: bool,
    /// A template that nothing defines stands in it.
    unknown: bool,
}

/// A file being read.
struct Frame {
    file: FileId,
    pos: usize,
    /// Conditionals open when the file was entered.
    conditionals: usize,
}

struct Conditional {
    at: Span,
    /// This branch is read.
    active: bool,
    /// The conditional itself stands in text that is read.
    outer: bool,
    seen_else: bool,
}

struct Preprocessor<'a> {
    map: &'a mut SourceMap,
    loader: &'a dyn FileLoader,
    options: &'a Options,
    macros: HashMap<String, Macro>,
    frames: Vec<Frame>,
    conditionals: Vec<Conditional>,
    flat: Flat,
    diagnostics: Vec<Diagnostic>,
    /// Bytes of replacements and includes that may still come.
    budget: usize,
    no_block_end: Option<FileId>,
    in_block: bool,
    /// What `#define $(NAME) VALUE` says.
    templates: HashMap<String, String>,
}

/// What `--define` and the text say, and who hears of what it does not say.
struct Defines<'a> {
    options: &'a Options,
    diagnostics: &'a mut Vec<Diagnostic>,
    /// The line has been complained of.
    told: bool,
    templates: &'a HashMap<String, String>,
}

impl Values for Defines<'_> {
    fn value(&self, name: &str) -> Option<String> {
        let given = || self.options.defines.iter().rev().find(|(n, _)| n == name).map(|(_, v)| v);
        self.templates.get(name).or_else(given).cloned()
    }

    fn unknown(&mut self, name: &str, at: Span) {
        if !std::mem::replace(&mut self.told, true) {
            self.diagnostics.push(
                Diagnostic::error("PMAC-X3", at, format!("nothing says what $({name}) is"))
                    .help(format!("give its value: --define {name}=VALUE")),
            );
        }
    }
}

/// Preprocesses files as one download, in their order. Definitions reach from one to the next.
pub(crate) fn preprocess(
    map: &mut SourceMap,
    files: &[FileId],
    loader: &dyn FileLoader,
    options: &Options,
) -> (Flat, Vec<Diagnostic>) {
    let mut this = Preprocessor {
        map,
        loader,
        options,
        macros: HashMap::new(),
        frames: Vec::new(),
        conditionals: Vec::new(),
        flat: Flat::default(),
        diagnostics: Vec::new(),
        budget: MAX_PRODUCED,
        no_block_end: None,
        in_block: false,
        templates: HashMap::new(),
    };
    for &file in files {
        this.file(file);
    }
    if let Some(end) = files.iter().rev().find_map(|&file| last_line(this.map, file)) {
        this.flat.origins.expanded(this.flat.text.len(), end, end);
        this.flat.text.push('\n');
    }
    this.flat.names = this.macros.into_keys().collect();
    this.flat.names.sort_unstable();
    (this.flat, this.diagnostics)
}

/// The last line of a file that holds a character, where what is absent is missed.
fn last_line(map: &SourceMap, file: FileId) -> Option<Span> {
    let text = map.text(file).trim_end();
    let start = text.rfind(['\n', '\r']).map_or(0, |line| line + 1);
    let line = text.get(start..).unwrap_or("").trim_start();
    (!line.is_empty()).then(|| Span::new(file, text.len() - line.len(), text.len()))
}

/// Whether a character may stand in a name.
pub(crate) fn is_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

fn word_at(text: &str, start: usize) -> &str {
    let tail = text.get(start..).unwrap_or("");
    tail.find(|c| !is_word(c)).map_or(tail, |end| tail.get(..end).unwrap_or(""))
}

impl Preprocessor<'_> {
    fn file(&mut self, file: FileId) {
        self.frames.push(Frame { file, pos: 0, conditionals: 0 });
        while let Some(frame) = self.frames.last() {
            let (file, pos) = (frame.file, frame.pos);
            // The text is taken out of the map's reach by value, a line at a time.
            let text = self.map.text(file);
            if pos >= text.len() {
                self.leave();
                continue;
            }
            let tail = text.get(pos..).unwrap_or("");
            let length = tail.find(['\n', '\r']).unwrap_or(tail.len());
            let line = tail.get(..length).unwrap_or("").to_owned();
            let next = pos + length + usize::from(length < tail.len());
            if let Some(frame) = self.frames.last_mut() {
                frame.pos = next;
            }
            self.line(file, pos, &line);
        }
    }

    fn leave(&mut self) {
        let Some(frame) = self.frames.pop() else { return };
        self.in_block = false;
        for open in self.conditionals.drain(frame.conditionals.min(self.conditionals.len())..) {
            let end = last_line(self.map, frame.file).unwrap_or(open.at);
            self.diagnostics.push(
                Diagnostic::error("PMAC-9", end, "an #endif is missing")
                    .label(open.at, "this conditional has none")
                    .help("end it with #endif in the same file"),
            );
        }
    }

    fn active(&self) -> bool {
        self.conditionals.last().is_none_or(|c| c.active)
    }

    fn line(&mut self, file: FileId, start: usize, line: &str) {
        if !self.in_block
            && let Some((name, value)) = template_definition(line)
        {
            if self.active() {
                self.templates.insert(name.to_owned(), strip_comment(value).trim().to_owned());
            }
            self.flat.text.push('\n');
            return;
        }
        let mut defines = Defines {
            options: self.options,
            diagnostics: &mut self.diagnostics,
            told: false,
            templates: &self.templates,
        };
        // Where nothing is read, no template needs a value.
        let line = match self.conditionals.last().is_none_or(|c| c.active) {
            true => Line::expand(file, start, line, self.in_block, &mut defines),
            false => Line::plain(file, start, line),
        };
        let text = &*line.text;
        if !self.spend_line(&line, text.len()) {
            return;
        }
        let lead = text.len() - text.trim_start().len();
        if !self.in_block
            && let Some(rest) = text.get(lead..).and_then(|l| l.strip_prefix('#'))
        {
            // A line of them is a rule or a heading.
            if rest.starts_with('#') {
                self.flat.text.push('\n');
                return;
            }
            let blank = rest.len() - rest.trim_start().len();
            let word = word_at(rest, blank);
            let tail = lead + 1 + blank + word.len();
            if self.directive(&word.to_ascii_lowercase(), &line, lead, tail) {
                let open = open_block(text.get(tail..).unwrap_or(""));
                let next = self.frames.last().map_or(0, |frame| frame.pos);
                self.in_block = open && self.block_ends(file, next);
                self.flat.text.push('\n');
                return;
            }
        }
        if self.active() {
            self.text_line(file, start, &line);
        }
        self.flat.text.push('\n');
    }

    /// Pays for what templates add to a line.
    fn spend_line(&mut self, line: &Line<'_>, length: usize) -> bool {
        !line.is_replaced() || self.spend(length, line.span(0..length))
    }

    /// Does what a directive says; false where the word is none.
    /// The line's first character is at `lead`, what follows the word at `tail`.
    fn directive(&mut self, word: &str, line: &Line<'_>, lead: usize, tail: usize) -> bool {
        match word {
            "define" | "undef" | "ifdef" | "ifndef" | "else" | "endif" | "include" => {}
            _ => return false,
        }
        let at = line.span(lead..line.text.trim_end().len());
        let rest = line.text.get(tail..).unwrap_or("");
        let trimmed = rest.trim_start();
        let name_start = tail + (rest.len() - trimmed.len());
        let name = word_at(trimmed, 0);
        match word {
            "ifdef" | "ifndef" => {
                let outer = self.active();
                let active = outer && self.is_defined(name) == (word == "ifdef");
                if self.conditionals.len() >= MAX_NESTING {
                    self.error(at, "PMAC-9", "conditionals nest too deep: 256 levels at most");
                } else {
                    self.conditionals.push(Conditional { at, active, outer, seen_else: false });
                }
            }
            "else" | "endif" => {
                let floor = self.frames.last().map_or(0, |f| f.conditionals);
                let open = self.conditionals.len() > floor;
                match self.conditionals.last_mut().filter(|_| open) {
                    Some(_) if word == "endif" => {
                        self.conditionals.pop();
                    }
                    Some(open) if !open.seen_else => {
                        open.seen_else = true;
                        open.active = open.outer && !open.active;
                    }
                    _ => self.error(at, "PMAC-9", format!("#{word} without its #ifdef or #ifndef")),
                }
            }
            _ if !self.active() => {}
            "include" => self.include(at, trimmed),
            "undef" => {
                self.macros.remove(name);
            }
            // A #define of nothing is left over where a name was taken out.
            _ if name.is_empty() && strip_comment(trimmed).trim().is_empty() => {}
            _ if name.is_empty() => self.error(at, "PMAC-3", "#define needs a name"),
            _ => {
                let rest = trimmed.get(name.len()..).unwrap_or("");
                let body = strip_comment(rest).trim();
                let body_start = name_start + name.len() + (rest.len() - rest.trim_start().len());
                let range = body_start..body_start + body.len();
                let defined = if body.is_empty() { at } else { line.span(range.clone()) };
                let unknown = line.is_unknown(range);
                let entry = Macro { body: body.into(), defined, busy: false, unknown };
                self.macros.insert(name.to_owned(), entry);
            }
        }
        true
    }

    /// Whether the text, or `--define`, defines a name.
    fn is_defined(&self, name: &str) -> bool {
        self.macros.contains_key(name) || self.options.defines.iter().any(|(n, _)| n == name)
    }

    fn error(&mut self, at: Span, code: &'static str, message: impl Into<String>) {
        self.diagnostics.push(Diagnostic::error(code, at, message));
    }

    fn include(&mut self, at: Span, written: &str) {
        let (from, close) = match written.chars().next() {
            Some('"') => (1, '"'),
            Some('<') => (1, '>'),
            _ => (0, ' '),
        };
        let tail = written.get(from..).unwrap_or("");
        let name = match close {
            ' ' => strip_comment(tail),
            _ => tail.find(close).map_or(tail, |end| tail.get(..end).unwrap_or("")),
        };
        let name = name.trim();
        if name.is_empty() {
            return self.error(at, "PMAC-3", "#include needs a file name");
        }
        if self.frames.len() >= MAX_NESTING {
            return self.error(at, "PMAC-X2", "includes nest too deep: 256 levels at most");
        }
        let includer = Path::new(self.map.path(at.file)).to_owned();
        match find_include(self.loader, &includer, name, &self.options.include_dirs) {
            Some(found) => {
                let path = found.path.to_string_lossy().into_owned();
                if self.frames.iter().any(|f| Path::new(self.map.path(f.file)) == found.path) {
                    return self.error(at, "PMAC-X2", format!("`{name}` includes itself"));
                }
                if !self.spend(found.bytes.len(), at) {
                    return;
                }
                let file = self.map.add_included(path, &found.bytes, at);
                self.frames.push(Frame { file, pos: 0, conditionals: self.conditionals.len() });
            }
            None => {
                self.flat.incomplete = true;
                self.diagnostics.push(
                    Diagnostic::error("PMAC-X2", at, format!("the file `{name}` is not found"))
                        .help("it is looked for beside this file, by its trailing parts, and in -I folders"),
                );
            }
        }
    }

    /// Takes `bytes` from the budget; false, with one error, when it is used up.
    fn spend(&mut self, bytes: usize, at: Span) -> bool {
        if self.budget == 0 {
            return false;
        }
        self.budget = self.budget.saturating_sub(bytes.max(1));
        if self.budget == 0 {
            self.diagnostics.push(
                Diagnostic::error("PMAC-6", at, "the text grows beyond all bounds here")
                    .note("replacements and includes may produce 16 MiB")
                    .help("look for definitions that name each other many times over"),
            );
            return false;
        }
        true
    }

    /// Copies a line without its comment, names replaced.
    fn text_line(&mut self, file: FileId, start: usize, text: &Line<'_>) {
        let line = &*text.text;
        let mut pos = 0;
        let mut from = 0;
        let mut quoted = false;
        let bytes = line.as_bytes();
        while let Some(&b) = bytes.get(pos) {
            if self.in_block {
                match line.get(pos..).and_then(|tail| tail.find("*/")) {
                    Some(end) => {
                        pos += end + 2;
                        from = pos;
                        self.in_block = false;
                        self.flat.text.push(' ');
                        continue;
                    }
                    None => return,
                }
            }
            let c = match b {
                0..0x80 => b as char,
                _ => line.get(pos..).and_then(|t| t.chars().next()).unwrap_or(' '),
            };
            if c == '"' {
                quoted = !quoted;
                pos += 1;
            } else if quoted {
                pos += c.len_utf8();
            } else if c == ';' || (c == '/' && bytes.get(pos + 1) == Some(&b'/')) {
                break;
            } else if c == '/' && bytes.get(pos + 1) == Some(&b'*') {
                self.copy(text, from..pos);
                if self.block_ends(file, start + pos + 2) {
                    self.in_block = true;
                    pos += 2;
                    from = pos;
                } else {
                    return;
                }
            } else if is_word(c) {
                let before = bytes.get(..pos).and_then(|b| b.last());
                let length = self.name_length(word_at(line, pos), before);
                let word = line.get(pos..pos + length).unwrap_or("");
                if self.macros.contains_key(word) {
                    self.copy(text, from..pos);
                    self.expand(word, text.span(pos..pos + length));
                    from = pos + length;
                }
                pos += length;
            } else {
                pos += c.len_utf8();
            }
        }
        self.copy(text, from..pos.min(line.len()));
    }

    /// How much of a word is looked up as one name: all of it, but for what has no other meaning,
    /// a name right behind a number (`20MSEC`) and one before an address's last digits (`$PAGE00`).
    /// `before` is what the word stands behind.
    fn name_length(&self, word: &str, before: Option<&u8>) -> usize {
        let is_name = |part: Option<&str>| part.is_some_and(|p| self.macros.contains_key(p));
        let hex = |part: &str| part.bytes().all(|b| b.is_ascii_hexdigit());
        if is_name(Some(word)) {
            return word.len();
        }
        let split = match before.map_or('\n', |&b| char::from(b)) {
            '$' if hex(word) => None,
            '$' => (1..word.len())
                .rev()
                .take(6)
                .take_while(|&at| word.get(at..).is_none_or(hex))
                .find(|&at| is_name(word.get(..at))),
            c if is_word(c) => None,
            _ => word
                .find(|c: char| !c.is_ascii_digit())
                .filter(|&at| at > 0 && is_name(word.get(at..))),
        };
        split.unwrap_or(word.len())
    }

    /// Whether `*/` comes behind an offset. Where it once did not, it never does further on.
    fn block_ends(&mut self, file: FileId, from: usize) -> bool {
        if self.no_block_end == Some(file) {
            return false;
        }
        let found = self.map.text(file).get(from..).is_some_and(|tail| tail.contains("*/"));
        if !found {
            self.no_block_end = Some(file);
        }
        found
    }

    fn copy(&mut self, line: &Line<'_>, range: std::ops::Range<usize>) {
        let Flat { text, origins, poisoned, .. } = &mut self.flat;
        line.copy(range, text, origins, poisoned);
    }

    fn expand(&mut self, name: &str, used: Span) {
        let Some(entry) = self.macros.get(name) else { return };
        let (body, defined) = (entry.body.clone(), entry.defined);
        self.replace(&body, used, defined, name.to_owned());
    }

    /// Writes a replacement, searched again for other names, without recursion.
    fn replace(&mut self, body: &std::rc::Rc<str>, used: Span, defined: Span, name: String) {
        struct Level {
            body: std::rc::Rc<str>,
            pos: usize,
            quoted: bool,
            defined: Span,
            name: String,
        }
        let mut levels: Vec<Level> = Vec::new();
        let mut next = Some((body.clone(), defined, name));
        loop {
            if let Some((body, defined, name)) = next.take() {
                let start = self.flat.text.len();
                if let Some(entry) = self.macros.get_mut(&name) {
                    entry.busy = true;
                    if entry.unknown {
                        self.flat.poisoned.push(At::new(start, start + 1));
                    }
                }
                self.flat.origins.expanded(start, used, defined);
                levels.push(Level { body, pos: 0, quoted: false, defined, name });
            }
            let Some(level) = levels.last_mut() else { return };
            let Some(c) = level.body.get(level.pos..).and_then(|t| t.chars().next()) else {
                if let Some(entry) = self.macros.get_mut(&level.name) {
                    entry.busy = false;
                }
                levels.pop();
                if let Some(outer) = levels.last() {
                    let outer = outer.defined;
                    self.flat.origins.expanded(self.flat.text.len(), used, outer);
                }
                continue;
            };
            let body = level.body.clone();
            let length = match is_word(c) {
                true => {
                    let before = self.flat.text.as_bytes().last();
                    self.name_length(word_at(&body, level.pos), before)
                }
                false => c.len_utf8(),
            };
            let piece = body.get(level.pos..level.pos + length).unwrap_or("");
            level.quoted ^= c == '"';
            let quoted = level.quoted;
            level.pos += length;
            if !self.spend(length, used) {
                for level in levels {
                    if let Some(entry) = self.macros.get_mut(&level.name) {
                        entry.busy = false;
                    }
                }
                return;
            }
            if is_word(c)
                && !quoted
                && let Some(entry) = self.macros.get(piece)
                && !entry.busy
            {
                if levels.len() >= MAX_NESTING {
                    self.error(used, "PMAC-6", "definitions nest too deep: 256 levels at most");
                } else {
                    let (body, defined) = (entry.body.clone(), entry.defined);
                    next = Some((body, defined, piece.to_owned()));
                }
            } else {
                self.flat.text.push_str(piece);
            }
        }
    }
}

/// Whether a text ends in a block comment.
fn open_block(mut text: &str) -> bool {
    loop {
        let before = strip_comment(text);
        let Some(comment) = text.get(before.len()..).and_then(|c| c.strip_prefix("/*")) else {
            return false;
        };
        match comment.find("*/") {
            Some(end) => text = comment.get(end + 2..).unwrap_or(""),
            None => return true,
        }
    }
}

/// The name and the value of `#define $(NAME) VALUE`.
fn template_definition(line: &str) -> Option<(&str, &str)> {
    let rest = line.trim_start().strip_prefix('#')?.trim_start();
    let word = word_at(rest, 0);
    let rest = rest.get(word.len()..).filter(|_| word.eq_ignore_ascii_case("define"))?;
    Template::named(rest.trim_start())
}

/// A definition's text up to a comment outside quotes.
fn strip_comment(text: &str) -> &str {
    let mut quoted = false;
    let bytes = text.as_bytes();
    for (i, &b) in bytes.iter().enumerate() {
        let next = bytes.get(i + 1);
        match b {
            b'"' => quoted = !quoted,
            b';' if !quoted => return text.get(..i).unwrap_or(text),
            b'/' if !quoted && matches!(next, Some(b'/' | b'*')) => {
                return text.get(..i).unwrap_or(text);
            }
            _ => {}
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::MemoryLoader;

    fn run(text: &str, options: &Options) -> (String, Vec<&'static str>) {
        let mut map = SourceMap::new();
        let file = map.add("m.pmc", text.as_bytes());
        let loader = MemoryLoader::new().with("inc/a.pmc", "P9=FOO\n");
        let (flat, diagnostics) = preprocess(&mut map, &[file], &loader, options);
        let text = flat.text.strip_suffix('\n').unwrap_or_default();
        (text.to_owned(), diagnostics.iter().map(|d| d.code).collect())
    }

    fn plain(text: &str) -> String {
        let (out, codes) = run(text, &Options::default());
        assert!(codes.is_empty(), "{codes:?}");
        out.split_whitespace().collect::<Vec<_>>().join(" ")
    }

    #[test]
    fn whole_words_are_replaced_again_and_again() {
        assert_eq!(plain("#define A B+1\n#define B P5 ; c\nA AA a $B\n"), "P5+1 AA a $P5");
        assert_eq!(plain("#DEFINE 60_SEC 60*I10\nP1=60_SEC"), "P1=60*I10");
    }

    #[test]
    fn names_stand_behind_numbers_and_before_digits_of_an_address() {
        assert_eq!(plain("#define MS *8388608/I10\nI5111=20MS P5MS"), "I5111=20*8388608/I10 P5MS");
        assert_eq!(plain("#define T 20MS;\n#define MS *4\nI5111=T"), "I5111=20*4");
        let page = "#define Page B8\n#define Next Page1A\n#define A 5\n";
        let text = format!("{page}M1->Y:$Page00,0 M2->L:$Next M3->L:$1A M4->L:$Pager Page00");
        assert_eq!(plain(&text), "M1->Y:$B800,0 M2->L:$B81A M3->L:$1A M4->L:$Pager Page00");
    }

    #[test]
    fn a_name_is_not_replaced_in_its_own_replacement() {
        assert_eq!(plain("#define A B A\n#define B A C\nA"), "A C A");
    }

    #[test]
    fn quotes_and_comments_stay_apart() {
        assert_eq!(plain("#define A 1\nCMD\"A;//A\" A // A\n"), "CMD\"A;//A\" 1");
        assert_eq!(plain("#define S SEND\"A;\" ; c\n#define A 1\nS A"), "SEND\"A;\" 1");
        assert_eq!(plain("#define A 5 /* x\ny */ P2 A /* z */\n#define B 1 /* x */\nB"), "P2 5 1");
        assert_eq!(plain("## heading\nP1 ###\n  ####"), "P1 ###");
        assert_eq!(plain("P1 /* x\ny */ P2 /* open\nP3"), "P1 P2 P3");
    }

    #[test]
    fn conditionals_choose() {
        let text = "#define A\n#ifdef A\n1\n#ifndef A\n2\n#else\n3\n#endif\n#Else\n4\n#EndIf\n5";
        assert_eq!(plain(text), "1 3 5");
        assert_eq!(run("#endif\n", &Options::default()).1, ["PMAC-9"]);
        assert_eq!(run("#ifdef X\n", &Options::default()).1, ["PMAC-9"]);
    }

    #[test]
    fn includes_are_found_and_see_the_definitions() {
        assert_eq!(plain("#define FOO 3\n#include \"c:\\x\\INC\\A.PMC\"\nP1"), "P9=3 P1");
        assert_eq!(plain("#define FOO 4\n#include INC/A.PMC ; bare\nP1"), "P9=4 P1");
        assert_eq!(run("#include ; x\n", &Options::default()).1, ["PMAC-3"]);
        assert_eq!(run("#include <none.pmc>\n", &Options::default()).1, ["PMAC-X2"]);
    }

    #[test]
    fn a_define_of_nothing_is_nothing() {
        assert_eq!(plain("#define\n#Define ; none\nP1"), "P1");
        assert_eq!(run("#define =5\n", &Options::default()).1, ["PMAC-3"]);
    }

    #[test]
    fn templates_need_a_value() {
        let mut options = Options::default();
        assert_eq!(run("#$(M)J+", &options), ("#1J+\n".into(), vec!["PMAC-X3"]));
        options.defines.push(("M".into(), "7".into()));
        assert_eq!(run("#$(M)J+", &options), ("#7J+\n".into(), vec![]));
    }

    #[test]
    fn templates_have_defaults_and_stand_in_quotes() {
        assert_eq!(plain("P1=$(A=5)$(B=)0 CMD\"#$(M=$(N=3))K\" ; $(C)"), "P1=50 CMD\"#3K\"");
        assert_eq!(plain("$(C=;)P1=2\nP2=$(D=P(3)) $(E=CMD \\\"%0\\\")"), "P2=P(3) CMD \"%0\"");
        assert_eq!(
            plain("#define A M$(B=7)10\nA=$(A=1) ${D=2} $(X Y) $(=) $("),
            "M710=1 2 $(X Y) $(=) $("
        );
        let mut options = Options::default();
        options.defines.push(("C".into(), String::new()));
        options.defines.push(("M".into(), "$(C)4".into()));
        let (text, codes) = run("$(C=;)#define A 1\nA CMD\"#$(M)J\" /* $(Z)\n$(Z) */ P1", &options);
        assert_eq!((text.as_str(), codes.len()), ("\n1 CMD\"#4J\" \n  P1\n", 0));
    }

    #[test]
    fn templates_are_defined_in_the_text_too() {
        let text = "#define $(N) 5 ; c\n#Define $(M=1) $(N)7\nP$(M=2)=$(N)\n#define $(N)\nA$(N)B";
        assert_eq!(plain(text), "P57=5 AB");
    }

    #[test]
    fn a_template_without_a_value_is_one_error_a_line() {
        let text = "#define A M$(X)1\nA=$(X)+$(Y)\n#ifdef NO\nP1=$(Y)\n#endif\nA=1 ; $(Z)";
        assert_eq!(run(text, &Options::default()).1, ["PMAC-X3", "PMAC-X3"]);
    }

    #[test]
    fn bombs_end_in_one_error() {
        let mut text = String::from("#define A0 xx\n");
        for i in 1..60 {
            text.push_str(&format!("#define A{i} A{} A{}\n", i - 1, i - 1));
        }
        text.push_str("A59\nA59\n");
        assert_eq!(run(&text, &Options::default()).1, ["PMAC-6"]);
    }

    #[test]
    fn places_know_use_and_definition() {
        let mut map = SourceMap::new();
        let file = map.add("m", b"#define A P1=\nP2=3 A4\nA");
        let (flat, _) = preprocess(&mut map, &[file], &MemoryLoader::new(), &Options::default());
        let start = flat.text.rfind("P1=").unwrap();
        let (used, defined) = flat.origins.place(At::new(start, start + 3));
        assert_eq!((used.start, used.end), (22, 23));
        assert_eq!(defined.map(|d| (d.start, d.end)), Some((10, 13)));
        let start = flat.text.find("A4").unwrap();
        assert_eq!(flat.origins.place(At::new(start, start + 2)).0.start, 19);
    }
}
