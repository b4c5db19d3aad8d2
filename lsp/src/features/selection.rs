//! What is selected step by step around a place: the word, the statement, its blocks, the whole text.

use gen_lsp_types::{Position, SelectionRange};
use plcc_diag::Span;

use crate::program::At;

/// The steps around each of some positions, from the inside out.
pub(crate) fn selection(at: At<'_>, positions: &[Position]) -> Vec<SelectionRange> {
    positions.iter().map(|&position| around(at, position)).collect()
}

fn around(at: At<'_>, position: Position) -> SelectionRange {
    let program = at.program;
    let offset = program.encoding.offset(&program.sources, at.file, position);
    let holds = |span: &Span| span.file == at.file && span.start <= offset && offset <= span.end;
    let whole = Span { file: at.file, start: 0, end: program.sources.text(at.file).len() as u32 };
    let line = program.sources.line(at.file, offset);
    let start = program.sources.line_start(at.file, line);
    let line = Span {
        file: at.file,
        start,
        end: start + program.sources.line_text(at.file, line).len() as u32,
    };
    let blocks = program.words.blocks.iter().chain(&program.words.statements).copied();
    let word = At { offset, ..at }.word().map(|word| word.span);
    let mut steps: Vec<Span> = blocks.chain(word).chain([line, whole]).filter(holds).collect();
    // From the largest to the smallest, each inside the one before.
    steps.sort_by_key(|span| (std::cmp::Reverse(span.end - span.start), span.start));
    let mut outer: Option<SelectionRange> = None;
    let mut last = whole;
    for step in steps {
        if outer.is_some() && (step == last || step.start < last.start || step.end > last.end) {
            continue;
        }
        last = step;
        outer = Some(SelectionRange { range: program.range(step), parent: outer.map(Box::new) });
    }
    outer.unwrap_or_else(|| SelectionRange { range: program.range(whole), parent: None })
}

#[cfg(test)]
mod tests {
    use plcc_abi::Dialect;

    use super::*;
    use crate::program::tests::{at, with_cursor};

    #[test]
    fn steps_go_from_the_word_to_the_whole_text() {
        let of = with_cursor(Dialect::Pmi, "$END\nIF A\n  BC = A & D\nENDIF\n");
        let found = selection(at(&of), &[Position { line: 2, character: 3 }]);
        let mut widths = vec![];
        let mut next = found.first();
        while let Some(step) = next {
            widths.push((step.range.start.line, step.range.start.character, step.range.end.line));
            next = step.parent.as_deref();
        }
        assert_eq!(widths, [(2, 2, 2), (2, 2, 2), (2, 0, 2), (1, 0, 3), (0, 0, 4)]);
    }
}
