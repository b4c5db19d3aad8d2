//! Ranges of preprocessed text, and the places in the sources where they came from.

use plcc_diag::{Diagnostic, Span};

/// A range of bytes of the preprocessed text.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct TextRange {
    /// Offset of the first byte.
    pub(crate) start: u32,
    /// Offset after the last byte.
    pub(crate) end: u32,
}

impl TextRange {
    /// The range from the offset `start` up to the offset `end`, which is not part of it.
    pub(crate) fn new(start: usize, end: usize) -> Self {
        let clamp = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
        Self { start: clamp(start), end: clamp(end) }
    }
}

/// Where a segment of preprocessed text came from.
#[derive(Clone, Copy, Debug)]
enum Source {
    /// It is in the sources unchanged, from the beginning of the span on.
    Direct(Span),
    /// It replaces the name or the template at `used`. `defined` is the definition's replacement
    /// text; of a template, whose value is in no source, it is equal to `used`.
    Macro { used: Span, defined: Span },
}

/// A part of the preprocessed text that came from one place. It ends where the next one starts.
#[derive(Clone, Copy, Debug)]
struct Segment {
    start: u32,
    source: Source,
}

/// For each byte of the preprocessed text the place in the sources where it came from.
#[derive(Clone, Debug, Default)]
pub(crate) struct Origins {
    segments: Vec<Segment>,
}

impl Origins {
    /// Records that the text from the offset `start` on is that of `span`, byte for byte. Segments
    /// are recorded in the order of their offsets.
    pub(crate) fn direct(&mut self, start: usize, span: Span) {
        self.push(start, Source::Direct(span));
    }

    /// Records that the text from the offset `start` on replaces what is at `used`, out of the
    /// definition at `defined`.
    pub(crate) fn expanded(&mut self, start: usize, used: Span, defined: Span) {
        self.push(start, Source::Macro { used, defined });
    }

    fn push(&mut self, start: usize, source: Source) {
        let start = TextRange::new(start, start).start;
        match self.segments.last_mut() {
            Some(last) if last.start == start => last.source = source,
            _ => self.segments.push(Segment { start, source }),
        }
    }

    fn find(&self, offset: u32) -> Option<Segment> {
        let index = self.segments.partition_point(|s| s.start <= offset).checked_sub(1)?;
        self.segments.get(index).copied()
    }

    /// The place in the sources of a range of preprocessed text. For a replacement it is the place
    /// of the name that was replaced, and the second value is that of its definition.
    pub(crate) fn place(&self, at: TextRange) -> (Span, Option<Span>) {
        let none = Span::new(plcc_diag::FileId(0), 0, 0);
        let Some(first) = self.find(at.start) else { return (none, None) };
        let begin = Self::point(first, at.start, at.start);
        let end = at.end.max(at.start);
        let last = match end.checked_sub(1).filter(|&e| e > at.start).and_then(|e| self.find(e)) {
            Some(segment) => Self::point(segment, end - 1, end),
            None => Self::point(first, at.start, end),
        };
        let defined = match first.source {
            Source::Direct(_) => None,
            Source::Macro { used, defined } => (used != defined).then_some(defined),
        };
        (begin.to(last), defined)
    }

    fn point(segment: Segment, from: u32, to: u32) -> Span {
        match segment.source {
            Source::Direct(span) => {
                let offset = |at: u32| (span.start + (at - segment.start)).min(span.end);
                Span { file: span.file, start: offset(from), end: offset(to) }
            }
            Source::Macro { used, .. } => used,
        }
    }

    /// The diagnostic that `make` makes for the place in the sources of `at`. In a replacement, the
    /// place of the definition is added as a label.
    pub(crate) fn diagnose(
        &self,
        at: TextRange,
        make: impl FnOnce(Span) -> Diagnostic,
    ) -> Diagnostic {
        let (span, defined) = self.place(at);
        match defined {
            Some(defined) => make(span).label(defined, "in this definition"),
            None => make(span),
        }
    }
}
