//! Indents the bodies of conditions, and nothing else: no token changes, which is checked.

use std::collections::{BTreeMap, HashSet};

use gen_lsp_types::{FormattingOptions, Position, Range, TextEdit};
use plcc_diag::Span;
use plcc_frontend::common::words::WordKind;

use crate::program::{At, Program};

/// The edits that indent a document.
///
/// # Errors
/// When the text would not be the same program, which is a mistake of the server.
pub(crate) fn format(at: At<'_>, options: &FormattingOptions) -> Result<Vec<TextEdit>, String> {
    let edits = indentations(at, options);
    if is_same(at, &edits) {
        Ok(edits)
    } else {
        Err("the text would not be the same program".into())
    }
}

/// A line whose white space in front is to be another one.
fn indentations(at: At<'_>, options: &FormattingOptions) -> Vec<TextEdit> {
    let program = at.program;
    let sources = &program.sources;
    let line = |offset: u32| sources.line(at.file, offset);
    let unit = if options.insert_spaces {
        " ".repeat(options.tab_size.min(16) as usize)
    } else {
        "\t".into()
    };
    let lines = sources.line_count(at.file) as usize;
    let mut depth = vec![0_u32; lines + 2];
    // Sections and modules are declared, and have no depth of their own.
    let declared = program.words.declarations.iter();
    let declared = declared.filter(|it| !it.detail.starts_with("buffer")).map(|it| it.extent);
    let declared: HashSet<Span> = declared.collect();
    let blocks = program.words.blocks.iter().filter(|block| block.file == at.file);
    let conditions = blocks.filter(|block| !declared.contains(*block) && is_condition(at, **block));
    for &Span { start, end, .. } in conditions {
        for between in line(start) + 1..line(end) {
            depth.get_mut(between as usize).into_iter().for_each(|depth| *depth += 1);
        }
    }
    // A statement that goes on in further lines.
    for &Span { start, end, .. } in program.words.statements.iter().filter(|it| it.file == at.file)
    {
        for further in line(start) + 1..=line(end) {
            depth.get_mut(further as usize).into_iter().for_each(|depth| *depth += 1);
        }
    }
    // Lines inside a comment or a text stay as they are.
    let mut is_inside = vec![false; lines + 2];
    for word in program.words.of_file(at.file) {
        if matches!(word.kind, WordKind::Comment | WordKind::Text) {
            for inside in line(word.span.start) + 1..=line(word.span.end) {
                is_inside.get_mut(inside as usize).into_iter().for_each(|it| *it = true);
            }
        }
    }
    let mut edits = vec![];
    for number in 1..=lines as u32 {
        let text = sources.line_text(at.file, number);
        let white = text.len() - text.trim_start_matches([' ', '\t']).len();
        let is_kept = is_inside.get(number as usize) == Some(&true) || text.trim().is_empty();
        let depth = depth.get(number as usize).copied().unwrap_or(0);
        let wanted = unit.repeat(depth.min(64) as usize);
        if is_kept || text.get(..white) == Some(wanted.as_str()) {
            continue;
        }
        let at = |character: usize| Position { line: number - 1, character: character as u32 };
        edits.push(TextEdit { range: Range { start: at(0), end: at(white) }, new_text: wanted });
    }
    edits
}

/// Whether a block is the body of a condition or loop, or a buffer: it begins and ends with a word of the language.
fn is_condition(at: At<'_>, block: Span) -> bool {
    let of = |offset: u32| at.program.words.at(at.file, offset).map(|word| word.kind);
    let kinds = (of(block.start), of(block.end.saturating_sub(1)));
    // NCT's conditions begin with a test, and its Z is a word.
    matches!(
        kinds,
        (
            Some(WordKind::Keyword | WordKind::Variable | WordKind::Operator),
            Some(WordKind::Keyword)
        )
    )
}

/// Whether the text with the edits has the same words.
fn is_same(at: At<'_>, edits: &[TextEdit]) -> bool {
    let program = at.program;
    let before = program.sources.text(at.file);
    let (mut text, mut copied) = (String::with_capacity(before.len()), 0);
    for edit in edits {
        let offset =
            |position| program.encoding.offset(&program.sources, at.file, position) as usize;
        let Some(kept) = before.get(copied..offset(edit.range.start)) else { return false };
        text.push_str(kept);
        text.push_str(&edit.new_text);
        copied = offset(edit.range.end);
    }
    text.push_str(before.get(copied..).unwrap_or_default());
    let after = program.with_texts(BTreeMap::from([(at.file, text)]), at.documents);
    fn words(program: &Program) -> impl Iterator<Item = (WordKind, &str)> {
        program.words.words.iter().map(|it| (it.kind, program.sources.slice(it.span)))
    }
    fn codes(program: &Program) -> impl Iterator<Item = &'static str> {
        program.diagnostics().iter().filter(|it| it.is_error()).map(|it| it.code)
    }
    words(program).eq(words(&after)) && codes(program).eq(codes(&after))
}

#[cfg(test)]
mod tests {
    use plcc_abi::Dialect;

    use super::*;
    use crate::program::tests::{at, with_cursor};

    fn formatted(dialect: Dialect, text: &str) -> String {
        let of = with_cursor(dialect, text);
        let options =
            FormattingOptions { tab_size: 2, insert_spaces: true, ..FormattingOptions::default() };
        let edits = format(at(&of), &options).unwrap();
        let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
        for edit in edits {
            let line = lines.get_mut(edit.range.start.line as usize).unwrap();
            line.replace_range(..edit.range.end.character as usize, &edit.new_text);
        }
        lines.join("\n")
    }

    #[test]
    fn bodies_are_indented() {
        let text = "$END\n   IF A\nB = T\n? no\nIF C\nB = F\nENDIF\nELSE\nB = C & #\nD\nENDIF";
        let expected = "$END\nIF A\n  B = T\n  ? no\n  IF C\n    B = F\n  ENDIF\nELSE\n  B = C & #\n    D\nENDIF";
        assert_eq!(formatted(Dialect::Pmi, text), expected);
        let text = "OPEN PLC 1 CLEAR\nIF (P1=1)\nP2=1\nENDIF\n CLOSE";
        let expected = "OPEN PLC 1 CLEAR\n  IF (P1=1)\n    P2=1\n  ENDIF\nCLOSE";
        assert_eq!(formatted(Dialect::Pmac, text), expected);
    }

    #[test]
    fn comments_of_several_lines_stay() {
        let text = "OPEN PLC 1 CLEAR\n/* a\n   b */\nCLOSE";
        assert_eq!(formatted(Dialect::Pmac, text), "OPEN PLC 1 CLEAR\n  /* a\n   b */\nCLOSE");
    }
}
