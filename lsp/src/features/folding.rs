//! What can be folded: conditions, programs, sections, comments of several lines.

use gen_lsp_types::{FoldingRange, FoldingRangeKind};
use plcc_diag::Span;
use plcc_frontend::common::words::WordKind;

use crate::program::At;

/// The parts of a document that can be folded.
pub(crate) fn folding(at: At<'_>) -> Vec<FoldingRange> {
    let program = at.program;
    let line = |offset: u32| program.sources.line(at.file, offset) - 1;
    let range = |start_line: u32, end_line: u32, kind: Option<FoldingRangeKind>| {
        (start_line < end_line).then_some(FoldingRange {
            start_line,
            end_line,
            kind,
            ..FoldingRange::default()
        })
    };
    let blocks = program.words.blocks.iter().filter(|block| block.file == at.file);
    let mut found: Vec<FoldingRange> =
        blocks.filter_map(|&Span { start, end, .. }| range(line(start), line(end), None)).collect();
    // Comments that follow each other, each alone on its line, fold together.
    let mut group: Option<(u32, u32)> = None;
    let mut last_line = None;
    for word in program.words.of_file(at.file) {
        let (first, last) = (line(word.span.start), line(word.span.end));
        let is_alone = last_line != Some(first);
        last_line = Some(last);
        if word.kind == WordKind::Comment && is_alone {
            group = match group {
                Some((start, end)) if end + 1 == first => Some((start, last)),
                other => {
                    found.extend(other.and_then(|(start, end)| {
                        range(start, end, Some(FoldingRangeKind::Comment))
                    }));
                    Some((first, last))
                }
            };
        }
    }
    found.extend(group.and_then(|(start, end)| range(start, end, Some(FoldingRangeKind::Comment))));
    found
}

#[cfg(test)]
mod tests {
    use plcc_abi::Dialect;

    use super::*;
    use crate::program::tests::{at, with_cursor};

    fn lines(dialect: Dialect, text: &str) -> Vec<(u32, u32)> {
        folding(at(&with_cursor(dialect, text)))
            .iter()
            .map(|it| (it.start_line, it.end_line))
            .collect()
    }

    #[test]
    fn bodies_of_conditions_sections_and_comments_fold() {
        let text = "? one\n? two\n$LOGICAL\nA\n$END\nIF A\nB = T\nELSE\nB = F\nENDIF\n";
        assert_eq!(lines(Dialect::Pmi, text), [(2, 3), (5, 7), (7, 9), (0, 1)]);
    }
}
