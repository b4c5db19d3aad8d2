//! What a name is: its declaration, the comment beside it, what the language says of it, and how often it is used.

use gen_lsp_types::{Contents, Hover, MarkupContent, MarkupKind, Range};
use plcc_abi::GivenName;
use plcc_frontend::common::Controller;
use plcc_frontend::common::words::{Word, WordKind};
use plcc_frontend::language;

use crate::program::{At, Program};

/// What the word at a place is.
pub(crate) fn hover(at: At<'_>) -> Option<Hover> {
    let word = at.word()?;
    if matches!(word.kind, WordKind::Comment | WordKind::Text) {
        return None;
    }
    let value = of_word(at.program, word)?;
    Some(shown(value, at.program.range(word.span)))
}

/// What is shown of a range, in Markdown.
pub(super) fn shown(value: String, range: Range) -> Hover {
    let contents = Contents::MarkupContent(MarkupContent { kind: MarkupKind::Markdown, value });
    Hover { contents, range: Some(range) }
}

/// What a name of a program is that is written elsewhere.
pub(crate) fn of_name(program: &Program, name: &str) -> Option<String> {
    let words = program.words.words.iter().filter(|word| word.name.is_some());
    let same = |word: &&Word| program.sources.slice(word.span).eq_ignore_ascii_case(name);
    of_word(program, words.into_iter().find(same)?)
}

/// What a word of a program is, in Markdown.
fn of_word(program: &Program, word: &Word) -> Option<String> {
    let mut parts: Vec<String> = vec![];
    let written = program.sources.slice(word.span);
    let title = match (&word.defined_as, &word.name) {
        (Some(defined), Some(name)) => format!("**{defined}** = {name}"),
        (Some(name), None) | (None, Some(name)) => format!("**{name}**"),
        (None, None) => format!("**{written}**"),
    };
    for declaration in program.words.declarations_of(word) {
        let line = program.sources.line(declaration.at.file, declaration.at.start);
        let file = program
            .path(declaration.at.file)
            .file_name()
            .map(|it| it.to_string_lossy().into_owned());
        let mut text = format!("`{}`", declaration.detail.replace('`', "'"));
        if let Some(comment) = program.comment(declaration.at) {
            text.push_str("  \n");
            text.push_str(&comment);
        }
        text.push_str(&format!("  \n{}:{line}", file.unwrap_or_default()));
        parts.push(text);
    }
    let of_word = program.given().iter().filter(|it| Some(&it.name) == word.name.as_ref());
    let mut said = GivenName::default();
    of_word.for_each(|it| said.complete(it));
    // The comment of a declaration is there already.
    if parts.iter().any(|part| part.contains(&said.text)) {
        said.text.clear();
    }
    if !said.line().is_empty() && word.defined_as.as_ref() != Some(&said.line()) {
        parts.push(said.line());
    }
    // What a name of a #define stands for has a declaration of its own.
    if let (Some(_), Some(name)) = (&word.defined_as, &word.name) {
        let of = program.words.declared(name);
        parts.extend(of.map(|it| format!("`{}`", it.detail.replace('`', "'"))));
    }
    if let Some(number) = number(written).filter(|_| word.kind == WordKind::Number) {
        parts.push(number);
    }
    let topic = word.name.as_deref().unwrap_or(written);
    let controller: Option<Controller> = Some(program.options.controller);
    if let Some(text) = language(program.dialect).explain(topic, controller) {
        parts.push(format!("```text\n{}\n```", text.trim_end()));
    }
    if let Some(name) = &word.name {
        let (read, written) = program.words.uses_of(name);
        parts.push(format!("read {}, written {}", times(read), times(written)));
    }
    if parts.is_empty() {
        return None;
    }
    Some(format!("{title}\n\n{}", parts.join("\n\n")))
}

/// A number of times in words.
pub(crate) fn times(count: usize) -> String {
    match count {
        0 => "never".into(),
        1 => "once".into(),
        count => format!("{count} times"),
    }
}

/// A number in the other base: `$FF` and `.FF` are hexadecimal, others decimal.
pub(crate) fn number(text: &str) -> Option<String> {
    if let Some(digits) = text.strip_prefix(['$', '.']) {
        return Some(format!("{} decimal", u64::from_str_radix(digits, 16).ok()?));
    }
    let value: u64 = text.trim_start_matches(',').parse().ok()?;
    (value > 9).then(|| format!("{value:X} hexadecimal"))
}

#[cfg(test)]
mod tests {
    use plcc_abi::Dialect;

    use super::*;
    use crate::program::tests::{at, with_cursor};

    fn shown(dialect: Dialect, text: &str) -> String {
        match hover(at(&with_cursor(dialect, text))).map(|it| it.contents) {
            Some(Contents::MarkupContent(it)) => it.value,
            _ => String::new(),
        }
    }

    #[test]
    fn a_variable_shows_its_declaration_and_comment() {
        let text = "$INPUT\nDOOR = 1/3 ? door closed\n$END\nA = DO|OR\n";
        assert_eq!(
            shown(Dialect::Pmi, text),
            "**DOOR**\n\n`LOGICAL input, port 1, bit 3`  \ndoor closed  \na.pmi:2\n\nread once, written never"
        );
    }

    #[test]
    fn a_defined_name_shows_what_it_stands_for() {
        let text =
            "#define DOOR M11 ; door closed\nM11->Y:$FFC2,0\nOPEN PLC 1 CLEAR\nP1=D|OOR\nCLOSE";
        let shown = shown(Dialect::Pmac, text);
        assert!(
            shown.starts_with("**DOOR** = M11\n\n`#define DOOR M11`  \ndoor closed"),
            "{shown}"
        );
        assert!(shown.contains("`M11->Y:$FFC2,0`"), "{shown}");
    }

    #[test]
    fn what_the_control_gives_is_explained() {
        assert!(shown(Dialect::Nct, ":001 I5|47 U012 J1").contains("I547"), "NCT");
        assert!(shown(Dialect::Pmi, "$END\nA = @F|RO\n").contains("@FRO"), "PMI");
    }

    #[test]
    fn numbers_are_shown_in_the_other_base() {
        assert_eq!(number("$FF").as_deref(), Some("255 decimal"));
        assert_eq!(number(".00FE").as_deref(), Some("254 decimal"));
        assert_eq!(number(",20").as_deref(), Some("14 hexadecimal"));
        assert_eq!(number("7"), None);
    }
}
