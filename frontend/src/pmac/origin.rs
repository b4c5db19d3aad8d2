//! Where the characters of a preprocessed text came from.

use plcc_diag::{Diagnostic, Span};

/// A stretch of preprocessed text: byte offsets, `end` exclusive.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct At {
    /// Offset of the first byte.
    pub(crate) start: u32,
    /// Offset behind the last byte.
    pub(crate) end: u32,
}

impl At {
    /// From one offset up to another.
    pub(crate) fn new(start: usize, end: usize) -> Self {
        let clamp = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
        Self { start: clamp(start), end: clamp(end) }
    }
}

/// What a stretch of preprocessed text was in the sources.
#[derive(Clone, Copy, Debug)]
enum Source {
    /// It stands there as it is.
    Direct(Span),
    /// It is the replacement of the name at `used`, out of the definition at `defined`.
    Macro { used: Span, defined: Span },
}

#[derive(Clone, Copy, Debug)]
struct Segment {
    start: u32,
    source: Source,
}

/// The way back from preprocessed text to the sources.
#[derive(Clone, Debug, Default)]
pub(crate) struct Origins {
    segments: Vec<Segment>,
}

impl Origins {
    /// From `start` on the text is that of `span`, byte for byte.
    pub(crate) fn direct(&mut self, start: usize, span: Span) {
        self.push(start, Source::Direct(span));
    }

    /// From `start` on the text is a replacement.
    pub(crate) fn expanded(&mut self, start: usize, used: Span, defined: Span) {
        self.push(start, Source::Macro { used, defined });
    }

    fn push(&mut self, start: usize, source: Source) {
        let start = At::new(start, start).start;
        match self.segments.last_mut() {
            Some(last) if last.start == start => last.source = source,
            _ => self.segments.push(Segment { start, source }),
        }
    }

    fn find(&self, offset: u32) -> Option<Segment> {
        let index = self.segments.partition_point(|s| s.start <= offset).checked_sub(1)?;
        self.segments.get(index).copied()
    }

    /// The place in the sources; for a replacement the name that was replaced, and the definition.
    pub(crate) fn place(&self, at: At) -> (Span, Option<Span>) {
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
            // A template's value stands in no text.
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

    /// A diagnostic maker: adds the definition's place to what is found in a replacement.
    pub(crate) fn diagnose(&self, at: At, make: impl FnOnce(Span) -> Diagnostic) -> Diagnostic {
        let (span, defined) = self.place(at);
        match defined {
            Some(defined) => make(span).label(defined, "in this definition"),
            None => make(span),
        }
    }
}
