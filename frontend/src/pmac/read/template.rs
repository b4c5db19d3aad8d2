//! Templates: `$(NAME)` and `$(NAME=DEFAULT)`, whose values a user's build scripts give.
//!
//! They are replaced before anything else reads a line, in quotes too, but not in comments. So a
//! template at the beginning of a line can switch the line off: with the value `;` the line is a
//! comment, with an empty value it is read.

use std::collections::HashMap;

use plcc_diag::{Diagnostic, FileId, Span};

use crate::common::Options;
use crate::pmac::origin::{Origins, TextRange};

/// Deepest nesting of templates in defaults and values.
const MAX_NESTING: usize = 16;

/// Longest line that templates may make.
const MAX_LINE: usize = 1 << 20;

/// Longest template. Without this limit, a line of many `$(A=` that nothing closes would take time
/// in the square of its length.
const MAX_TEMPLATE: usize = 4096;

/// How many parentheses may be open at a time in a template's default. As [`MAX_TEMPLATE`] does, this
/// bounds the time for a line of very many templates that nothing closes.
const MAX_OPEN: usize = 64;

/// A line of a file with its templates replaced.
pub(crate) struct ExpandedLine<'a> {
    file: FileId,
    /// Offset of the line in its file.
    start: usize,
    /// The text after replacement.
    pub(crate) text: std::borrow::Cow<'a, str>,
    /// The pieces of the text, by rising offset. There are none if the line has no template.
    pieces: Vec<Piece>,
}

/// A piece of an expanded line. It ends where the next one begins.
#[derive(Clone, Copy)]
struct Piece {
    /// Offset in the expanded line.
    offset: usize,
    /// Offset in the line as written.
    source_offset: usize,
    /// If it replaces a template, the length of that in the line as written.
    template_length: Option<usize>,
    /// Whether it replaces a template that has neither a value nor a default.
    undefined: bool,
}

/// The values of templates, from `--define` and from the text. A template without a value is
/// reported once for each line.
pub(crate) struct TemplateValues<'a> {
    pub(crate) options: &'a Options,
    pub(crate) diagnostics: &'a mut Vec<Diagnostic>,
    /// Whether this line has had its error.
    pub(crate) is_reported: bool,
    /// The values that the text defines by `#define $(NAME) VALUE`.
    pub(crate) templates: &'a HashMap<String, String>,
    /// How many bytes replacements may still add to the text.
    pub(crate) budget: usize,
    /// The length of the values that were taken. Values name further templates, so that the line
    /// itself may stay short.
    pub(crate) taken: usize,
}

impl TemplateValues<'_> {
    /// The value of a template's name, if it has one.
    fn value(&mut self, name: &str) -> Option<String> {
        // The line is left out when this is reached, so that any value will do.
        if self.taken >= self.budget {
            return Some(String::new());
        }
        let given = || self.options.defines.iter().rev().find(|(n, _)| n == name).map(|(_, v)| v);
        let value = self.templates.get(name).or_else(given)?;
        self.taken += value.len().max(1);
        Some(value.clone())
    }

    /// Reports that a template at `at` has neither a value nor a default.
    fn report_missing(&mut self, name: &str, at: Span) {
        if !std::mem::replace(&mut self.is_reported, true) {
            self.diagnostics.push(
                Diagnostic::error("PMAC-X3", at, format!("nothing says what $({name}) is"))
                    .help(format!("give its value: --define {name}=VALUE")),
            );
        }
    }
}

impl<'a> ExpandedLine<'a> {
    /// A line that is left as it is.
    pub(crate) fn plain(file: FileId, start: usize, text: &'a str) -> Self {
        Self { file, start, text: text.into(), pieces: Vec::new() }
    }

    /// A line with its templates replaced. A template without value and default is reported to
    /// `values` and becomes `1`, with which most statements are valid. `block` says whether the
    /// line begins inside a block comment.
    pub(crate) fn expand(
        file: FileId,
        start: usize,
        text: &'a str,
        mut block: bool,
        values: &mut TemplateValues<'_>,
    ) -> Self {
        if !text.contains("$(") && !text.contains("${") {
            return Self::plain(file, start, text);
        }
        let mut out = String::new();
        let mut pieces =
            vec![Piece { offset: 0, source_offset: 0, template_length: None, undefined: false }];
        let mut state = CommentState::default();
        let mut pos = 0;
        while let Some(c) = text.get(pos..).and_then(|t| t.chars().next()) {
            let rest = text.get(pos..).unwrap_or("");
            if block {
                let end = rest.find("*/").map_or(rest.len(), |end| end + 2);
                out.push_str(rest.get(..end).unwrap_or(""));
                pos += end;
                block = false;
                continue;
            }
            let template = if c == '$' && !state.comment { Template::read(rest) } else { None };
            let Some(template) = template else {
                state.step(rest);
                block = state.block;
                out.push(c);
                pos += c.len_utf8();
                continue;
            };
            let at = Span::new(file, start + pos, start + pos + template.length);
            let found = template.value(values, at, 0);
            let undefined = found.is_none();
            let value = found.unwrap_or_else(|| "1".to_owned());
            pieces.push(Piece {
                offset: out.len(),
                source_offset: pos,
                template_length: Some(template.length),
                undefined,
            });
            for (i, _) in value.char_indices() {
                state.step(value.get(i..).unwrap_or(""));
            }
            if out.len() + value.len() <= MAX_LINE {
                out.push_str(&value);
            }
            pos += template.length;
            pieces.push(Piece {
                offset: out.len(),
                source_offset: pos,
                template_length: None,
                undefined: false,
            });
        }
        Self { file, start, text: out.into(), pieces }
    }

    /// Whether templates were replaced in it.
    pub(crate) fn is_replaced(&self) -> bool {
        !self.pieces.is_empty()
    }

    fn piece(&self, offset: usize) -> Option<(usize, Piece)> {
        let index = self.pieces.partition_point(|p| p.offset <= offset).checked_sub(1)?;
        Some((index, *self.pieces.get(index)?))
    }

    /// The place in the file of a range of the expanded line.
    pub(crate) fn span(&self, range: std::ops::Range<usize>) -> Span {
        let point = |offset: usize, end: bool| match self.piece(offset) {
            None => offset,
            Some((_, Piece { source_offset, template_length: Some(length), .. })) => {
                source_offset + if end { length } else { 0 }
            }
            Some((_, piece)) => piece.source_offset + (offset - piece.offset),
        };
        let start = point(range.start, false);
        let end = match range.end.checked_sub(1).filter(|last| *last >= range.start) {
            Some(last) if self.piece(last).is_some_and(|(_, p)| p.template_length.is_some()) => {
                point(last, true)
            }
            Some(last) => point(last, true) + 1,
            None => start,
        };
        Span::new(self.file, self.start + start, self.start + end.max(start))
    }

    /// Whether a template without value and default is in a range of the expanded line.
    pub(crate) fn has_undefined_template(&self, range: std::ops::Range<usize>) -> bool {
        self.pieces.iter().any(|p| p.undefined && p.offset < range.end && p.offset >= range.start)
    }

    /// Appends a range of the line to `out`, its places to `origins`, and the ranges of templates
    /// without value and default to `undefined_templates`.
    pub(crate) fn copy(
        &self,
        range: std::ops::Range<usize>,
        out: &mut String,
        origins: &mut Origins,
        undefined_templates: &mut Vec<TextRange>,
    ) {
        let mut pos = range.start;
        while pos < range.end {
            let (end, template, undefined) = match self.piece(pos) {
                None => (range.end, false, false),
                Some((index, piece)) => {
                    let next = self.pieces.get(index + 1).map_or(usize::MAX, |p| p.offset);
                    (next.min(range.end), piece.template_length.is_some(), piece.undefined)
                }
            };
            let at = out.len();
            let span = self.span(pos..end);
            if template {
                origins.expanded(at, span, span);
            } else {
                origins.direct(at, span);
            }
            out.push_str(self.text.get(pos..end).unwrap_or(""));
            if undefined {
                undefined_templates.push(TextRange::new(at, out.len()));
            }
            pos = end;
        }
    }
}

/// Whether a place in a line is in quotes or in a comment.
#[derive(Default)]
struct CommentState {
    quoted: bool,
    comment: bool,
    block: bool,
}

impl CommentState {
    /// Goes one character further: the first one of `rest`.
    fn step(&mut self, rest: &str) {
        if self.comment {
            return;
        }
        if rest.starts_with('"') {
            self.quoted = !self.quoted;
        }
        self.comment = !self.quoted && (rest.starts_with(';') || rest.starts_with("//"));
        self.block = !self.quoted && rest.starts_with("/*");
    }
}

/// `$(NAME)` or `$(NAME=DEFAULT)`, or the same with braces.
pub(crate) struct Template<'a> {
    name: &'a str,
    default: Option<&'a str>,
    length: usize,
}

impl<'a> Template<'a> {
    /// The name of the template at the beginning of a text, and the text after the template.
    pub(crate) fn name_and_rest(text: &'a str) -> Option<(&'a str, &'a str)> {
        let template = Self::read(text)?;
        Some((template.name, text.get(template.length..)?))
    }

    /// The template at the beginning of a text, if there is one.
    fn read(text: &'a str) -> Option<Self> {
        let (open, close) = match text.get(..2)? {
            "$(" => ('(', ')'),
            "${" => ('{', '}'),
            _ => return None,
        };
        let inner = text.get(2..)?;
        let plain = |c: char| c.is_alphanumeric() || matches!(c, '_' | '-' | '.' | ':' | ' ');
        let name = inner.char_indices().find(|&(i, c)| !plain(c) || i > MAX_TEMPLATE)?.0;
        let name = inner.get(..name)?;
        if name.trim().is_empty() || name.trim().contains(' ') {
            return None;
        }
        let after = inner.get(name.len()..)?;
        if after.starts_with(close) {
            return Some(Self { name: name.trim(), default: None, length: name.len() + 3 });
        }
        if !after.starts_with('=') {
            return None;
        }
        let mut depth = 1usize;
        let mut escaped = false;
        for (i, c) in after.char_indices().take_while(|(i, _)| *i < MAX_TEMPLATE) {
            match c {
                _ if escaped => escaped = false,
                '\\' => escaped = true,
                c if c == open => depth += 1,
                c if c == close => depth -= 1,
                _ => {}
            }
            if depth > MAX_OPEN {
                return None;
            }
            if depth == 0 {
                let default = after.get(1..i);
                return Some(Self { name: name.trim(), default, length: name.len() + i + 3 });
            }
        }
        None
    }

    /// The template's value or its default, with the templates in it replaced up to `MAX_NESTING`
    /// levels deep. `None` if a template has neither, which is reported at `at`.
    fn value(&self, values: &mut TemplateValues<'_>, at: Span, depth: usize) -> Option<String> {
        let text = match (values.value(self.name), self.default) {
            (Some(given), _) => given,
            (None, Some(default)) => unescape(default),
            (None, None) => {
                values.report_missing(self.name, at);
                return None;
            }
        };
        if depth >= MAX_NESTING || !text.contains('$') {
            return Some(text);
        }
        let mut out = String::new();
        let mut rest = text.as_str();
        while let Some(dollar) = rest.find('$') {
            out.push_str(rest.get(..dollar)?);
            rest = rest.get(dollar..)?;
            match Template::read(rest) {
                Some(template) => {
                    out.push_str(&template.value(values, at, depth + 1)?);
                    rest = rest.get(template.length..)?;
                }
                None => {
                    out.push('$');
                    rest = rest.get(1..)?;
                }
            }
            if out.len() > MAX_LINE {
                return None;
            }
        }
        out.push_str(rest);
        Some(out)
    }
}

/// A default without the backslashes in front of its quotes.
fn unescape(text: &str) -> String {
    let mut out = String::new();
    let mut chars = text.chars().peekable();
    while let Some(c) = chars.next() {
        match chars.peek() {
            Some('"' | '\'') if c == '\\' => {}
            _ => out.push(c),
        }
    }
    out
}
