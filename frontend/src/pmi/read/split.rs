//! Splits files into statements: lines, comments, continuations, `$INCLUDE` (PMI 2.2.2, 3.3.5).

use std::path::Path;

use plcc_diag::{Diagnostic, FileId, SourceMap, Span};

use crate::common::{FileLoader, IncludeBudget, Inclusion, Limits, Options, find_include};
use crate::pmi::read::{
    diagnostic::{self, error},
    lexer::plain,
};

/// How many characters fit in a line of the original editor.
const LINE_LIMIT: usize = 71;

/// Where a statement's text is, without the comment after it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Extent {
    pub(crate) file: FileId,
    pub(crate) start: u32,
    pub(crate) end: u32,
    /// Whether its last line is to be continued, but the file ends there.
    pub(crate) open: bool,
}

/// The statements of a program and of all files that it includes.
pub(crate) struct Split {
    pub(crate) statements: Vec<Extent>,
    /// The last line of the program's own file that is not empty. An error about something that is
    /// missing points there.
    pub(crate) last: Span,
}

/// Splits the program in `file`, and the files that it includes, into statements.
pub(crate) fn split(
    sources: &mut SourceMap,
    file: FileId,
    loader: &dyn FileLoader,
    options: &Options,
    diagnostics: &mut Vec<Diagnostic>,
) -> Split {
    let budget = IncludeBudget::default();
    let mut reader = Reader { sources, loader, options, diagnostics, budget, statements: vec![] };
    let last = reader.file(file);
    Split { statements: reader.statements, last }
}

struct Reader<'a> {
    sources: &'a mut SourceMap,
    loader: &'a dyn FileLoader,
    options: &'a Options,
    diagnostics: &'a mut Vec<Diagnostic>,
    /// What may still be included.
    budget: IncludeBudget,
    statements: Vec<Extent>,
}

/// One physical line.
struct Line {
    /// Offset of its first character that is not a blank; the line's end if there is none.
    start: usize,
    /// Offset after its last character that is not a blank and in no comment.
    end: usize,
    /// Offset of its `#`, if it is continued.
    hash: Option<usize>,
    /// Where its first curly quote or dash outside comments starts and ends.
    typographic: Option<(usize, usize)>,
    /// Offset of its comment: the `?`, or what follows a `#`.
    comment: Option<usize>,
}

impl Line {
    fn is_blank(&self) -> bool {
        self.start >= self.end && self.hash.is_none()
    }
}

/// Finds the parts of the line `text[from..to]`.
fn scan(text: &str, from: usize, to: usize) -> Line {
    let mut line = Line { start: to, end: from, hash: None, typographic: None, comment: None };
    let mut quoted = false;
    for (i, raw) in text.get(from..to).unwrap_or("").char_indices() {
        let at = from + i;
        let c = plain(raw);
        match c {
            '?' if !quoted => {
                line.comment = Some(at);
                break;
            }
            '#' if !quoted => {
                line.hash = Some(at);
                line.comment = Some(at + 1);
                line.start = line.start.min(at);
                return line;
            }
            '"' => quoted = !quoted,
            _ => {}
        }
        if !raw.is_ascii() && (c == '"' || c == '-') && line.typographic.is_none() {
            line.typographic = Some((at, at + raw.len_utf8()));
        }
        if c != ' ' {
            line.start = line.start.min(at);
            line.end = at + raw.len_utf8();
        }
    }
    line
}

/// Where the comments of a text begin and end, its blanks left out.
pub(crate) fn comments(text: &str) -> impl Iterator<Item = (usize, usize)> {
    lines(text).filter_map(|(from, to)| {
        let start = scan(text, from, to).comment?;
        let comment = text.get(start..to)?;
        let start = start + comment.len() - comment.trim_start().len();
        Some((start, start + comment.trim().len())).filter(|(start, end)| start < end)
    })
}

/// The offsets of the lines of a text, without their ends.
fn lines(text: &str) -> impl Iterator<Item = (usize, usize)> {
    let mut at = 0;
    std::iter::from_fn(move || {
        let rest = text.get(at..).filter(|rest| !rest.is_empty())?;
        let len = rest.find(['\r', '\n']).unwrap_or(rest.len());
        let line = (at, at + len);
        let end = rest.get(len..).unwrap_or("");
        at += len + if end.starts_with("\r\n") { 2 } else { end.len().min(1) };
        Some(line)
    })
}

impl Reader<'_> {
    /// Reads a file. Returns the place of its last line that is not empty.
    fn file(&mut self, file: FileId) -> Span {
        let text = self.sources.text(file).to_owned();
        let included = self.sources.included_from(file).is_some();
        let mut last = Span::new(file, 0, 0);
        let mut typographic = None;
        let mut open: Option<Extent> = None;
        // The start of an `$INCLUDE` whose name follows on the next line.
        let mut unnamed: Option<usize> = None;
        for (from, to) in lines(&text) {
            let line = scan(&text, from, to);
            let raw = text.get(from..to).unwrap_or("");
            if !raw.trim().is_empty() {
                let indent = raw.len() - raw.trim_start().len();
                last = Span::new(file, from + indent, from + raw.trim_end().len());
            }
            typographic = typographic.or(line.typographic);
            self.check_length(file, raw, from);
            if let Some(start) = unnamed.take() {
                let name = file_name(text.get(line.start..to).unwrap_or(""));
                let line = Line { start, ..line };
                self.include(file, &text, &line, name, included);
                continue;
            }
            let Some(mut statement) = open.take() else {
                if let Some(written) = include_name(&text, &line, to) {
                    if written.is_empty() && line.hash.is_some() {
                        unnamed = Some(line.start);
                    } else {
                        self.include(file, &text, &line, written, included);
                    }
                } else if !line.is_blank() {
                    let start = line.start as u32;
                    let end = line.end.max(line.start) as u32;
                    let statement = Extent { file, start, end, open: line.hash.is_some() };
                    self.put(statement, &mut open);
                }
                continue;
            };
            // The rest of a continued statement, or a blank line that ends it.
            if line.is_blank() {
                statement.open = false;
            } else {
                if line.end > line.start {
                    statement.end = line.end as u32;
                }
                statement.open = line.hash.is_some();
            }
            self.put(statement, &mut open);
        }
        if let Some(statement) = open {
            self.statements.push(statement);
        }
        if let Some(start) = unnamed {
            let span = Span::new(file, start, start + "$INCLUDE".len());
            self.diagnostics.push(no_name(span));
        }
        if let Some((start, end)) = typographic {
            let span = Span::new(file, start, end);
            let what = "curly quotes or dashes: they are read as \" and -";
            self.diagnostics.push(
                Diagnostic::warning(diagnostic::TYPOGRAPHY, span, what)
                    .help("this comes from copying out of a PDF; write the plain characters"),
            );
        }
        last
    }

    /// Keeps a statement in `open` if the next line continues it, otherwise adds it to the list.
    fn put(&mut self, statement: Extent, open: &mut Option<Extent>) {
        if statement.open {
            *open = Some(statement);
        } else if statement.end > statement.start {
            self.statements.push(statement);
        }
    }

    /// Warns of a line that is too long for the original editor.
    fn check_length(&mut self, file: FileId, raw: &str, from: usize) {
        if self.options.limits == Limits::None || raw.len() <= LINE_LIMIT {
            return;
        }
        let Some((over, _)) = raw.char_indices().nth(LINE_LIMIT) else { return };
        let span = Span::new(file, from + over, from + raw.len());
        let what = "the original editor has no room for more than 71 characters in a line";
        self.diagnostics.push(
            Diagnostic::warning(diagnostic::LONG_LINE, span, what)
                .help("go on in the next line after a `#`, or compile with `--limits none`"),
        );
    }

    /// Reads the file that the `$INCLUDE` in `line` names as `written`, or reports why it can't.
    /// `nested` says that the line is in an included file itself.
    fn include(&mut self, file: FileId, text: &str, line: &Line, written: &str, nested: bool) {
        let start = line.start as u32;
        let all = Span::new(file, line.start, line.end);
        let after = text.get(line.start..line.end).unwrap_or("");
        let named = line.start + after.rfind(written).unwrap_or(0);
        let name = Span::new(file, named, named + written.len());
        let problem = if nested {
            error(6, all, "an included file includes a file itself")
                .help("include both files from the main program")
        } else if written.is_empty() {
            no_name(all)
        } else if written.contains(['"', '<', '>', '|', '*']) {
            error(7, name, format!("`{written}` is not a file name"))
                .help("a file name has no quotes and none of < > | *")
        } else if self.budget.is_exceeded() {
            return;
        } else {
            let home = self.sources.path(file).to_owned();
            let dirs = &self.options.include_dirs;
            match find_include(self.loader, Path::new(&home), written, dirs) {
                Some(found) if found.path == Path::new(&home) => {
                    error(6, all, "a file includes itself").help("include another file")
                }
                Some(found) => {
                    match self.budget.include(found.bytes.len()) {
                        Inclusion::Allowed => {}
                        Inclusion::Exceeds => return self.diagnostics.push(too_much(all)),
                        Inclusion::Refused => return,
                    }
                    let path = found.path.to_string_lossy().into_owned();
                    let at = Span { file, start, end: line.end as u32 };
                    let inner = self.sources.add_included(path, &found.bytes, at);
                    self.file(inner);
                    return;
                }
                None => match self.budget.include(0) {
                    Inclusion::Exceeds => too_much(all),
                    _ => error(8, name, format!("the file `{written}` cannot be read"))
                        .help("it is looked for beside this file and in the folders given with -I"),
                },
            }
        };
        self.diagnostics.push(problem);
    }
}

/// The file that an `$INCLUDE` line names; `None` if the line is not an `$INCLUDE`.
fn include_name<'a>(text: &'a str, line: &Line, to: usize) -> Option<&'a str> {
    let rest = text.get(line.start..to)?.strip_prefix("$INCLUDE")?;
    if rest.starts_with(|c: char| c.is_ascii_alphanumeric()) {
        return None;
    }
    Some(file_name(rest))
}

/// The name of a file: what is before a comment or a `#`, without blanks around it.
fn file_name(rest: &str) -> &str {
    let end = rest.find(['?', '#']).unwrap_or(rest.len());
    rest.get(..end).unwrap_or("").trim()
}

fn too_much(span: Span) -> Diagnostic {
    let what = "with this file the program includes more than 4 MiB";
    Diagnostic::error(diagnostic::TOO_MUCH_INCLUDED, span, what)
        .note("a file counts as 1 KiB at least")
        .help("include each file once")
}

fn no_name(span: Span) -> Diagnostic {
    error(7, span, "the name of the file to include is missing")
        .help("write it after $INCLUDE: $INCLUDE MESSAGES.PMI")
}
