//! What the download program does to the files before it sends them: directives such as `#define`
//! and `#include`, templates (`$(NAME)`), and comments.
//!
//! The result is one text without comments and directives, with `\n` at each line's end, and with
//! the [place in the sources](Origins) of every byte. Time and space are linear in what is read and
//! written. What is written is limited, so that definitions that double a text again and again end
//! in an error.

use std::collections::HashMap;

use plcc_diag::{Diagnostic, FileId, MessageText, SourceMap, Span};

use super::comments::{ends_inside_comment, strip_comment};
use super::directives::template_definition;
use super::macros::Macro;
use super::template::{ExpandedLine, TemplateValues};
use crate::common::{FileLoader, IncludeBudget, MemoryLoader, Options};
use crate::pmac::origin::{Origins, TextRange};

/// Deepest nesting of includes, conditionals and replacements.
pub(super) const MAX_NESTING: usize = 256;

/// How many digits of an address may follow a name.
pub(super) const MAX_DIGITS: usize = 6;

/// Bytes that the replacements of names and templates may produce.
const MAX_PRODUCED: usize = 2 << 20;

/// The same limit for a text that is not part of the program, such as the condition of a
/// breakpoint.
const MAX_REPLACED: usize = 64 << 10;

/// A preprocessed download.
#[derive(Debug, Default)]
pub(crate) struct Preprocessed {
    /// The text. Its last character is a line end that was added. Its place in the sources is the
    /// last line of the last file, where errors about something missing are shown.
    pub(crate) text: String,
    /// Where it is in the sources.
    pub(crate) origins: Origins,
    /// The ranges of templates without value and default. Each is reported once, and their lines
    /// have no further errors.
    pub(crate) undefined_templates: Vec<TextRange>,
    /// Whether an included file is missing. A name that nothing defines may be defined there.
    pub(crate) incomplete: bool,
    /// The names that are defined at the end of the text, in alphabetical order.
    pub(crate) names: Vec<DefinedName>,
}

/// A name that `#define` defined.
#[derive(Clone, Debug)]
pub(crate) struct DefinedName {
    pub(crate) name: String,
    /// What it is replaced by.
    pub(crate) body: String,
    /// Where that text is.
    pub(crate) defined: Span,
}

/// A file that is being read.
pub(super) struct OpenFile {
    pub(super) file: FileId,
    /// The offset of the next line.
    pub(super) pos: usize,
    /// How many conditionals were open when the file was entered.
    pub(super) conditionals: usize,
}

/// An `#ifdef` or `#ifndef` whose `#endif` has not come yet.
pub(super) struct Conditional {
    pub(super) at: Span,
    /// Whether the branch that the text is in is read.
    pub(super) active: bool,
    /// Whether the conditional itself is in text that is read.
    pub(super) outer: bool,
    pub(super) seen_else: bool,
}

/// The state of preprocessing.
pub(super) struct Preprocessor<'a> {
    pub(super) sources: &'a mut SourceMap,
    pub(super) loader: &'a dyn FileLoader,
    pub(super) options: &'a Options,
    pub(super) macros: HashMap<String, Macro>,
    pub(super) files: Vec<OpenFile>,
    pub(super) conditionals: Vec<Conditional>,
    pub(super) preprocessed: Preprocessed,
    pub(super) diagnostics: Vec<Diagnostic>,
    /// How many bytes replacements may still add to the text.
    pub(super) budget: usize,
    /// What may still be included.
    pub(super) include_budget: IncludeBudget,
    /// A file in whose rest there is no `*/`, so that it need not be searched again.
    pub(super) file_without_comment_end: Option<FileId>,
    /// Whether the next line begins inside a block comment.
    pub(super) in_block_comment: bool,
    /// The values of templates that the text defines by `#define $(NAME) VALUE`.
    pub(super) templates: HashMap<String, String>,
}

/// Preprocesses files as one download, in their order: what one file defines holds in the next ones
/// too. Returns the text and what is wrong with it.
pub(crate) fn preprocess(
    map: &mut SourceMap,
    files: &[FileId],
    loader: &dyn FileLoader,
    options: &Options,
) -> (Preprocessed, Vec<Diagnostic>) {
    let mut this = Preprocessor::new(map, loader, options);
    for &file in files {
        this.file(file);
    }
    if let Some(end) = files.iter().rev().find_map(|&file| last_line(this.sources, file)) {
        this.preprocessed.origins.expanded(this.preprocessed.text.len(), end, end);
        this.preprocessed.text.push('\n');
    }
    let names = this.macros.into_iter();
    let names = names.map(|(name, Macro { body, defined, .. })| {
        let body = body.as_ref().to_owned();
        DefinedName { name, body, defined }
    });
    this.preprocessed.names = names.collect();
    this.preprocessed.names.sort_unstable_by(|a, b| a.name.cmp(&b.name));
    (this.preprocessed, this.diagnostics)
}

/// Whether one of a program's names, which are in alphabetical order, may be in a text. Names may follow a number
/// and in front of the last digits of an address too, see [`Preprocessor::name_length`]; so this may be true of a text
/// without names, but is not false of one that has some.
pub(crate) fn may_have_name(text: &str, names: &[DefinedName]) -> bool {
    let is_name =
        |part: &str| names.binary_search_by(|known| known.name.as_str().cmp(part)).is_ok();
    text.split(|c| !is_word(c)).any(|word| {
        let digits = word.len() - word.trim_end_matches(|c: char| c.is_ascii_hexdigit()).len();
        let mut shorter = (0..=digits.min(MAX_DIGITS)).filter_map(|n| word.get(..word.len() - n));
        shorter.any(is_name) || is_name(word.trim_start_matches(|c: char| c.is_ascii_digit()))
    })
}

/// Replaces a program's names in a text that is not part of the program, such as the condition of a
/// breakpoint. The text is in `file` of `sources`.
pub(crate) fn replace_names(
    sources: &mut SourceMap,
    file: FileId,
    names: &[DefinedName],
) -> (Preprocessed, Vec<Diagnostic>) {
    let (loader, options) = (MemoryLoader::new(), Options::default());
    let mut this = Preprocessor::new(sources, &loader, &options);
    this.budget = MAX_REPLACED;
    this.macros = names
        .iter()
        .map(|DefinedName { name, body, defined }| {
            let body = body.as_str().into();
            (
                name.clone(),
                Macro { body, defined: *defined, expanding: false, has_undefined_template: false },
            )
        })
        .collect();
    this.file(file);
    (this.preprocessed, this.diagnostics)
}

/// The last line of a file that is not blank: where a missing `#endif` or CLOSE is reported.
fn last_line(map: &SourceMap, file: FileId) -> Option<Span> {
    let text = map.text(file).trim_end();
    let start = text.rfind(['\n', '\r']).map_or(0, |line| line + 1);
    let line = text.get(start..).unwrap_or("").trim_start();
    (!line.is_empty()).then(|| Span::new(file, text.len() - line.len(), text.len()))
}

/// Whether a character may be in a name.
pub(crate) fn is_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// The characters of a name that are at an offset; empty if there are none.
pub(super) fn word_at(text: &str, start: usize) -> &str {
    let tail = text.get(start..).unwrap_or("");
    tail.find(|c| !is_word(c)).map_or(tail, |end| tail.get(..end).unwrap_or(""))
}

impl<'a> Preprocessor<'a> {
    fn new(sources: &'a mut SourceMap, loader: &'a dyn FileLoader, options: &'a Options) -> Self {
        Self {
            sources,
            loader,
            options,
            macros: HashMap::new(),
            files: Vec::new(),
            conditionals: Vec::new(),
            preprocessed: Preprocessed::default(),
            diagnostics: Vec::new(),
            budget: MAX_PRODUCED,
            include_budget: IncludeBudget::default(),
            file_without_comment_end: None,
            in_block_comment: false,
            templates: HashMap::new(),
        }
    }

    /// Reads a file, with the files that it includes.
    fn file(&mut self, file: FileId) {
        self.files.push(OpenFile { file, pos: 0, conditionals: 0 });
        while let Some(frame) = self.files.last() {
            let (file, pos) = (frame.file, frame.pos);
            // The line is copied, since the source map grows while it is read.
            let text = self.sources.text(file);
            if pos >= text.len() {
                self.leave_file();
                continue;
            }
            let tail = text.get(pos..).unwrap_or("");
            let length = tail.find(['\n', '\r']).unwrap_or(tail.len());
            let line = tail.get(..length).unwrap_or("").to_owned();
            let next = pos + length + usize::from(length < tail.len());
            if let Some(frame) = self.files.last_mut() {
                frame.pos = next;
            }
            self.line(file, pos, &line);
        }
    }

    /// Ends the file that is read, and reports the conditionals that it has left open.
    fn leave_file(&mut self) {
        let Some(frame) = self.files.pop() else { return };
        self.in_block_comment = false;
        for open in self.conditionals.drain(frame.conditionals.min(self.conditionals.len())..) {
            let end = last_line(self.sources, frame.file).unwrap_or(open.at);
            self.diagnostics.push(
                Diagnostic::error("PMAC-9", end, "an #endif is missing")
                    .label(open.at, "this conditional has none")
                    .help("end it with #endif in the same file"),
            );
        }
    }

    /// Whether the text is read: it is not in a branch that a conditional leaves out.
    pub(super) fn active(&self) -> bool {
        self.conditionals.last().is_none_or(|c| c.active)
    }

    /// Reads a line, which begins at the offset `start` of its file: a directive, or text.
    fn line(&mut self, file: FileId, start: usize, line: &str) {
        if !self.in_block_comment
            && let Some((name, value)) = template_definition(line)
        {
            if self.active() {
                self.templates.insert(name.to_owned(), strip_comment(value).trim().to_owned());
            }
            self.preprocessed.text.push('\n');
            return;
        }
        let mut defines = TemplateValues {
            options: self.options,
            diagnostics: &mut self.diagnostics,
            is_reported: false,
            templates: &self.templates,
            budget: self.budget,
            taken: 0,
        };
        // In a branch that is left out, a template needs no value.
        let line = match self.conditionals.last().is_none_or(|c| c.active) {
            true => ExpandedLine::expand(file, start, line, self.in_block_comment, &mut defines),
            false => ExpandedLine::plain(file, start, line),
        };
        let taken = defines.taken;
        let text = &*line.text;
        if !self.spend_on_templates(&line, taken.max(text.len())) {
            return;
        }
        let lead = text.len() - text.trim_start().len();
        if !self.in_block_comment
            && let Some(rest) = text.get(lead..).and_then(|l| l.strip_prefix('#'))
        {
            // A line that begins with several `#` is a heading.
            if rest.starts_with('#') {
                self.preprocessed.text.push('\n');
                return;
            }
            let blank = rest.len() - rest.trim_start().len();
            let word = word_at(rest, blank);
            let tail = lead + 1 + blank + word.len();
            if self.directive(&word.to_ascii_lowercase(), &line, lead, tail) {
                let open = ends_inside_comment(text.get(tail..).unwrap_or(""));
                let next = self.files.last().map_or(0, |frame| frame.pos);
                self.in_block_comment = open && self.comment_ends(file, next);
                self.preprocessed.text.push('\n');
                return;
            }
        }
        if self.active() {
            self.text_line(file, start, &line);
        }
        self.preprocessed.text.push('\n');
    }

    /// Counts a line in which templates were replaced against the limit; false when that is
    /// reached.
    fn spend_on_templates(&mut self, line: &ExpandedLine<'_>, length: usize) -> bool {
        !line.is_replaced() || self.spend(length, line.span(0..length))
    }

    pub(super) fn error(&mut self, at: Span, code: &'static str, message: impl Into<MessageText>) {
        self.diagnostics.push(Diagnostic::error(code, at, message));
    }

    /// Takes `bytes` from what the text may still grow by. When nothing is left it returns false, the
    /// first time with an error at `at`.
    pub(super) fn spend(&mut self, bytes: usize, at: Span) -> bool {
        if self.budget == 0 {
            return false;
        }
        self.budget = self.budget.saturating_sub(bytes.max(1));
        if self.budget == 0 {
            self.diagnostics.push(
                Diagnostic::error("PMAC-X6", at, "with this name the replacements are too long")
                    .note("what replaces defined names and templates may have 2 MiB in all")
                    .help("look for definitions that name each other many times over"),
            );
            return false;
        }
        true
    }

    /// Appends a line to the text, without its comments and with its names replaced.
    fn text_line(&mut self, file: FileId, start: usize, text: &ExpandedLine<'_>) {
        let line = &*text.text;
        let mut pos = 0;
        let mut from = 0;
        let mut quoted = false;
        let bytes = line.as_bytes();
        while let Some(&b) = bytes.get(pos) {
            if self.in_block_comment {
                match line.get(pos..).and_then(|tail| tail.find("*/")) {
                    Some(end) => {
                        pos += end + 2;
                        from = pos;
                        self.in_block_comment = false;
                        self.preprocessed.text.push(' ');
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
                if self.comment_ends(file, start + pos + 2) {
                    self.in_block_comment = true;
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
                    self.expand_macro(word, text.span(pos..pos + length));
                    from = pos + length;
                }
                pos += length;
            } else {
                pos += c.len_utf8();
            }
        }
        self.copy(text, from..pos.min(line.len()));
    }

    /// Whether `*/` is after an offset of a file. If not, the file is remembered, and the rest
    /// of it is not searched again.
    fn comment_ends(&mut self, file: FileId, from: usize) -> bool {
        if self.file_without_comment_end == Some(file) {
            return false;
        }
        let found = self.sources.text(file).get(from..).is_some_and(|tail| tail.contains("*/"));
        if !found {
            self.file_without_comment_end = Some(file);
        }
        found
    }

    /// Appends a range of a line to the text.
    fn copy(&mut self, line: &ExpandedLine<'_>, range: std::ops::Range<usize>) {
        let Preprocessed { text, origins, undefined_templates, .. } = &mut self.preprocessed;
        line.copy(range, text, origins, undefined_templates);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(text: &str, options: &Options) -> (String, Vec<&'static str>) {
        let mut map = SourceMap::new();
        let file = map.add("m.pmc", text.as_bytes());
        let loader = MemoryLoader::new().with("inc/a.pmc", "P9=FOO\n");
        let (preprocessed, diagnostics) = preprocess(&mut map, &[file], &loader, options);
        let text = preprocessed.text.strip_suffix('\n').unwrap_or_default();
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
    fn names_may_follow_numbers_and_precede_digits_of_an_address() {
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
    fn comment_signs_in_quotes_begin_no_comment() {
        assert_eq!(plain("#define A 1\nCMD\"A;//A\" A // A\n"), "CMD\"A;//A\" 1");
        assert_eq!(plain("#define S SEND\"A;\" ; c\n#define A 1\nS A"), "SEND\"A;\" 1");
        assert_eq!(plain("#define A 5 /* x\ny */ P2 A /* z */\n#define B 1 /* x */\nB"), "P2 5 1");
        assert_eq!(plain("## heading\nP1 ###\n  ####"), "P1 ###");
        assert_eq!(plain("P1 /* x\ny */ P2 /* open\nP3"), "P1 P2 P3");
    }

    #[test]
    fn ifdef_and_ifndef_choose_which_lines_are_read() {
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
    fn a_define_without_a_name_is_only_a_warning() {
        let (text, codes) = run("#define\n#Define ; none\nP1", &Options::default());
        assert_eq!((text.trim(), codes), ("P1", vec!["PMAC-W8", "PMAC-W8"]));
        assert_eq!(run("#define =5\n", &Options::default()).1, ["PMAC-W8"]);
    }

    #[test]
    fn template_parameters_need_a_value() {
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
    fn macros_that_grow_without_bound_are_one_error() {
        let mut text = String::from("#define A0 xx\n");
        for i in 1..60 {
            text.push_str(&format!("#define A{i} A{} A{}\n", i - 1, i - 1));
        }
        text.push_str("A59\nA59\n");
        assert_eq!(run(&text, &Options::default()).1, ["PMAC-X6"]);
    }

    /// Without a limit on what is read of the replacements, these take hours.
    #[test]
    fn a_long_replacement_is_not_read_again_when_the_text_may_not_grow() {
        let long = "B".repeat(1 << 20);
        for (definition, used) in [("A", "A\n"), ("$(A)", "$(A)\n"), ("$(A)", "$(A)")] {
            let text = format!("#define {definition} {long}\n{}", used.repeat(1 << 16));
            assert_eq!(run(&text, &Options::default()).1, ["PMAC-X6"], "{definition}");
        }
    }

    #[test]
    fn templates_that_name_each_other_many_times_over_are_one_error() {
        let mut text = String::from("#define $(A0)\n");
        for i in 1..15 {
            text.push_str(&format!("#define $(A{i}) {}\n", format!("$(A{})", i - 1).repeat(20)));
        }
        text.push_str("P1=1 $(A14)\nP2=$(A14)\n");
        assert_eq!(run(&text, &Options::default()).1, ["PMAC-X6"]);
    }

    #[test]
    fn files_that_include_each_other_many_times_over_are_one_error() {
        let mut map = SourceMap::new();
        let file = map.add("m.pmc", b"#include \"f0\"\nP1=1\n");
        let mut loader = MemoryLoader::new();
        for n in 0..40 {
            let next = format!("#include \"f{}\"\n", n + 1);
            loader = loader.with(format!("f{n}"), next.repeat(2));
        }
        let loader = loader.with("f40", "P2=2\n".repeat(100));
        let (preprocessed, diagnostics) =
            preprocess(&mut map, &[file], &loader, &Options::default());
        assert_eq!(diagnostics.iter().map(|d| d.code).collect::<Vec<_>>(), ["PMAC-X5"]);
        assert!(preprocessed.text.len() < 5 << 20);
        assert!(preprocessed.text.trim_end().ends_with("P1=1"));
    }

    #[test]
    fn an_expanded_macro_has_the_places_of_its_use_and_definition() {
        let mut map = SourceMap::new();
        let file = map.add("m", b"#define A P1=\nP2=3 A4\nA");
        let (preprocessed, _) =
            preprocess(&mut map, &[file], &MemoryLoader::new(), &Options::default());
        let start = preprocessed.text.rfind("P1=").unwrap();
        let (used, defined) = preprocessed.origins.place(TextRange::new(start, start + 3));
        assert_eq!((used.start, used.end), (22, 23));
        assert_eq!(defined.map(|d| (d.start, d.end)), Some((10, 13)));
        let start = preprocessed.text.find("A4").unwrap();
        assert_eq!(preprocessed.origins.place(TextRange::new(start, start + 2)).0.start, 19);
    }
}
