//! Draws diagnostics for people: an excerpt of the source with the place marked, by the library
//! ariadne.
//!
//! The library is handed only the lines around the places, so that the cost of an excerpt does not
//! grow with the file, and of very long lines only a piece.

use std::ops::Range;

use ariadne::{CharSet, Color, Config, IndexType, Label, Report, ReportKind, Source};
use plcc_abi::printable;

use crate::{Diagnostic, FileId, Severity, SourceMap, Span};

/// Draws one diagnostic as text of several lines. `color` adds the escape sequences of colours and
/// should be on for terminals only.
pub fn draw(map: &SourceMap, diagnostic: &Diagnostic, color: bool) -> String {
    let kind = match diagnostic.severity {
        Severity::Error => ReportKind::Error,
        Severity::Warning => ReportKind::Warning,
        Severity::Note => ReportKind::Custom("Note", Color::Cyan),
    };
    let config = Config::default()
        .with_color(color)
        .with_char_set(CharSet::Unicode)
        .with_index_type(IndexType::Byte);
    let shown = drawable(map, diagnostic.span);
    // Labels that cannot be drawn in the excerpt become notes.
    let (drawn, as_notes): (Vec<&crate::Label>, Vec<_>) = diagnostic
        .labels()
        .iter()
        .partition(|label| can_be_drawn_with(map, shown, drawable(map, label.span)));
    let labels = drawn.iter().map(|label| drawable(map, label.span));
    let excerpts = Excerpts::new(map, std::iter::once(shown).chain(labels).collect());
    let main = excerpts.place(shown.file, shown.range());
    let tint = match diagnostic.severity {
        Severity::Error => Color::Red,
        Severity::Warning => Color::Yellow,
        Severity::Note => Color::Cyan,
    };
    let mut report = Report::build(kind, main.clone())
        .with_config(config)
        .with_code(diagnostic.code)
        .with_message(printable(&diagnostic.message))
        .with_label(
            Label::new(main)
                .with_message("here")
                .with_color(tint)
                .with_order(label_order(map, diagnostic, shown)),
        );
    for label in drawn {
        let span = drawable(map, label.span);
        let place = excerpts.place(span.file, span.range());
        let order = label_order(map, diagnostic, span);
        report = report
            .with_label(Label::new(place).with_message(printable(&label.text)).with_order(order));
    }
    for label in as_notes {
        let (line, column) = map.line_col(label.span.file, label.span.start);
        let text = printable(&label.text);
        report = report.with_note(format!("line {line}, column {column}: {text}"));
    }
    let mut file = diagnostic.span.file;
    while let Some(at) = map.included_from(file) {
        let line = map.line_col(at.file, at.start).0;
        let path = printable(map.path(at.file));
        report = report.with_note(format!("included from {path}:{line}"));
        file = at.file;
    }
    for note in diagnostic.notes() {
        report = report.with_note(printable(note));
    }
    if let Some(help) = &diagnostic.help {
        report = report.with_help(printable(help));
    }
    let mut out = Vec::new();
    // Writing to memory does not fail.
    let _ = report.finish().write(excerpts, &mut out);
    let text = String::from_utf8_lossy(&out);
    // The library colours the heading of a note even when it is told not to.
    if color { text.into_owned() } else { without_colors(&text) }
}

/// The number by which the library orders a label among the others. It draws labels in this order,
/// and puts those of one file into one frame only if their lines come in rising order. So labels in
/// the diagnostic's own file are ordered by their lines, and those in other files follow.
fn label_order(map: &SourceMap, diagnostic: &Diagnostic, span: Span) -> i32 {
    if span.file != diagnostic.span.file {
        return i32::MAX;
    }
    let (line, _) = map.line_col(span.file, span.end.saturating_sub(1).max(span.start));
    i32::try_from(line).unwrap_or(i32::MAX - 1).min(i32::MAX - 1)
}

/// Removes the escape sequences of colours.
fn without_colors(text: &str) -> String {
    let mut pieces = text.split("\u{1b}[");
    let mut out = pieces.next().unwrap_or("").to_owned();
    for piece in pieces {
        let end = piece.find(|c: char| !c.is_ascii_digit() && c != ';').unwrap_or(piece.len());
        let rest = piece.get(end..).unwrap_or("");
        out.push_str(rest.strip_prefix('m').unwrap_or(rest));
    }
    out
}

/// On a long line an excerpt reaches this many bytes to the left and to the right of the places
/// that it shows.
const CONTEXT: usize = 240;

/// Between its first and its last place an excerpt shows no line that has more bytes than this.
const MAX_LINE: usize = 4 * CONTEXT;

/// The library numbers the lines of the text that it is given from 1. So that the numbers are those
/// of the file, an excerpt gets as many empty lines in front as the file has lines before it. Above
/// this many that would take too much time. Then the numbers beside the lines are wrong, and only
/// the heading shows the right one.
const MAX_EMPTY_LINES: usize = 100_000;

/// Whether every line in a piece of a text is short enough to be drawn.
fn lines_are_short(text: &str, piece: Range<usize>) -> bool {
    let piece = text.get(piece).unwrap_or("");
    piece.split(['\n', '\r']).all(|line| line.len() <= MAX_LINE)
}

/// The place itself, or only its beginning if its lines are too long to be drawn.
fn drawable(map: &SourceMap, span: Span) -> Span {
    let text = map.text(span.file);
    if lines_are_short(text, span.range()) {
        return span;
    }
    let mut end = (span.start as usize + CONTEXT).min(text.len());
    while !text.is_char_boundary(end) {
        end -= 1;
    }
    Span::new(span.file, span.start as usize, end)
}

/// Whether a further place can be drawn in one excerpt with the main one. If it is in another file
/// it gets an excerpt of its own.
fn can_be_drawn_with(map: &SourceMap, main: Span, other: Span) -> bool {
    let from = main.start.min(other.start) as usize;
    let to = main.end.max(other.end) as usize;
    main.file != other.file || lines_are_short(map.text(main.file), from..to)
}

/// A place as the library takes it: a file, and the bytes of its excerpt.
type Place = (FileId, Range<usize>);

/// The excerpt of one file: some whole lines, or a piece of a very long one.
struct Excerpt {
    id: FileId,
    /// The file's path, with the column at which the excerpt begins if that is not 1.
    name: String,
    /// The byte offset in the file at which it starts.
    start: usize,
    /// The number of empty lines in front of it, see [`MAX_EMPTY_LINES`].
    empty_lines: usize,
    source: Source<String>,
}

/// The excerpts of a diagnostic, one for each file that it has a place in.
struct Excerpts {
    files: Vec<Excerpt>,
}

impl Excerpts {
    /// Cuts the excerpts that show all of some places.
    fn new(map: &SourceMap, spans: Vec<Span>) -> Self {
        let mut files: Vec<Excerpt> = Vec::new();
        let mut ids: Vec<FileId> = spans.iter().map(|s| s.file).collect();
        ids.sort();
        ids.dedup();
        for id in ids {
            let here = spans.iter().filter(|s| s.file == id);
            let start = here.clone().map(|s| s.start as usize).min().unwrap_or(0);
            let end = here.map(|s| s.end as usize).max().unwrap_or(0);
            let text = map.text(id);
            let start = cut_before(text, start.min(text.len()));
            let end = cut_behind(text, end.clamp(start, text.len()));
            let (line, column) = map.line_col(id, start as u32);
            // Each byte stays one, since places count bytes. A carriage return is the end of a line, or part of one.
            let piece =
                text.get(start..end).unwrap_or("").replace("\r\n", " \n").replace('\r', "\n");
            let piece = printable(&piece).replace('\t', " ");
            let lines = (line as usize).saturating_sub(1);
            let empty_lines = if lines <= MAX_EMPTY_LINES { lines } else { 0 };
            let source = Source::from("\n".repeat(empty_lines) + &piece)
                .with_display_line_offset(lines - empty_lines);
            let mut name = printable(map.path(id)).into_owned();
            if column > 1 {
                name.push_str(&format!(" (from column {column})"));
            }
            files.push(Excerpt { id, name, start, empty_lines, source });
        }
        Self { files }
    }

    /// The bytes of an excerpt that show a range of bytes of the file.
    fn place(&self, id: FileId, range: Range<usize>) -> Place {
        let (base, empty_lines) =
            self.files.iter().find(|f| f.id == id).map_or((0, 0), |f| (f.start, f.empty_lines));
        let start = range.start.saturating_sub(base) + empty_lines;
        (id, start..(range.end.saturating_sub(base) + empty_lines).max(start))
    }
}

/// The start of the line that holds the byte at `at`, but no further than [`CONTEXT`] bytes back.
fn cut_before(text: &str, at: usize) -> usize {
    let mut limit = at.saturating_sub(CONTEXT);
    while !text.is_char_boundary(limit) {
        limit += 1;
    }
    let piece = text.get(limit..at).unwrap_or("");
    match piece.rfind(['\n', '\r']) {
        Some(line) => limit + line + 1,
        None => limit,
    }
}

/// The end of the line that holds the byte at `at`, but no further than [`CONTEXT`] bytes on.
fn cut_behind(text: &str, at: usize) -> usize {
    let mut limit = (at + CONTEXT).min(text.len());
    while !text.is_char_boundary(limit) {
        limit -= 1;
    }
    let piece = text.get(at..limit).unwrap_or("");
    piece.find(['\n', '\r']).map_or(limit, |line| at + line)
}

impl ariadne::Cache<FileId> for Excerpts {
    type Storage = String;

    fn fetch(&mut self, id: &FileId) -> Result<&Source<String>, impl std::fmt::Debug> {
        self.files.iter().find(|f| f.id == *id).map(|f| &f.source).ok_or("no such file")
    }

    fn display<'a>(&self, id: &'a FileId) -> Option<impl std::fmt::Display + 'a> {
        self.files.iter().find(|f| f.id == *id).map(|f| f.name.clone())
    }
}

#[cfg(test)]
mod tests {
    use crate::{Diagnostic, Severity, SourceMap, Span};

    #[test]
    fn an_excerpt_shows_line_place_and_help() {
        let mut map = SourceMap::new();
        let id = map.add("m.pmi", b"A = 1\nB = C\n");
        let diagnostic = Diagnostic::error("PMI-31", Span::new(id, 10, 11), "nothing is named C")
            .help("declare it");
        let drawn = super::draw(&map, &diagnostic, false);
        for part in ["[PMI-31]", "nothing is named C", "m.pmi:2:5", " 2 │ B = C", "declare it"] {
            assert!(drawn.contains(part), "{part} is missing in\n{drawn}");
        }
    }

    #[test]
    fn what_a_terminal_would_obey_is_not_written() {
        let mut map = SourceMap::new();
        let id = map.add("m\u{1b}[2J.pmi", "A = 1\nB\u{1b}]0;x\u{7} = \u{9b}C\n".as_bytes());
        let diagnostic =
            Diagnostic::error("PMI-5", Span::new(id, 6, 13), "`B\u{1b}` is not a name")
                .label(Span::new(id, 7, 8), "\u{1b}")
                .help("remove \u{202e}");
        let drawn = super::draw(&map, &diagnostic, false);
        assert!(!drawn.chars().any(|c| c.is_control() && c != '\n'), "{drawn:?}");
        assert!(!drawn.contains('\u{202e}'), "{drawn:?}");
        assert!(drawn.contains("B?]0;x? = ·C") && drawn.contains("`B?` is not a name"), "{drawn}");
    }

    #[test]
    fn an_earlier_place_stands_in_the_same_frame() {
        let mut map = SourceMap::new();
        let id = map.add("m.pmi", b"A\nB\nA\n");
        let diagnostic = Diagnostic::error("PMI-10", Span::new(id, 4, 5), "A again")
            .label(Span::new(id, 0, 1), "it is declared here");
        let drawn = super::draw(&map, &diagnostic, false);
        assert_eq!(drawn.matches("m.pmi:").count(), 1, "{drawn}");
        assert!(drawn.contains("m.pmi:3:1"), "{drawn}");
        assert!(drawn.find("it is declared here") < drawn.find("╰── here"), "{drawn}");
    }

    #[test]
    fn lines_of_every_system_are_shown_alike() {
        let draw = |text: &str| {
            let mut map = SourceMap::new();
            let id = map.add("m.pmi", text.as_bytes());
            let [first, last] = ["A1", "A3"].map(|part| text.find(part).unwrap_or_default());
            let at = |start: usize| Span::new(id, start, start + 2);
            let diagnostic = Diagnostic::error("PMI-10", at(last), "A again");
            let drawn = super::draw(&map, &diagnostic.label(at(first), "it is here"), false);
            drawn.lines().map(|line| format!("{}\n", line.trim_end())).collect::<String>()
        };
        let drawn = draw("A1\nB2\nA3\n");
        assert!(drawn.contains(" 1 │ A1\n") && drawn.contains(" 3 │ A3\n"), "{drawn}");
        assert_eq!(draw("A1\r\nB2\r\nA3\r\n"), drawn);
        assert_eq!(draw("A1\rB2\rA3\r"), drawn);
    }

    #[test]
    fn without_colours_there_are_none() {
        let mut map = SourceMap::new();
        let id = map.add("m.pmc", b"OPEN PROG 1\n");
        let warning = Diagnostic::warning("PMAC-N1", Span::new(id, 0, 4), "skipped");
        let mut note = warning;
        note.severity = Severity::Note;
        assert!(!super::draw(&map, &note, false).contains('\u{1b}'));
        assert!(super::draw(&map, &note, true).contains('\u{1b}'));
    }

    #[test]
    fn a_line_of_a_mebibyte_is_cut() {
        let mut map = SourceMap::new();
        let text = vec![b'A'; 1 << 20];
        let id = map.add("m.pmi", &text);
        let diagnostic = Diagnostic::error("PMI-5", Span::new(id, 500_000, 500_001), "no");
        assert!(super::draw(&map, &diagnostic, false).len() < 4096);
        let far = diagnostic.label(Span::new(id, 7, 8), "it began here");
        let drawn = super::draw(&map, &far, false);
        assert!(drawn.contains("line 1, column 8: it began here"), "{drawn}");
        assert!(drawn.len() < 4096, "{drawn}");
        let all = Diagnostic::error("PMI-5", Span::new(id, 0, 1 << 20), "no");
        assert!(super::draw(&map, &all, false).len() < 4096);
    }
}
