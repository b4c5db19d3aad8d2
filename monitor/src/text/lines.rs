//! Lines of sources without comments: continued lines of PMI joined, files included in their place, and
//! what the manuals do not show left out.

use plcc_abi::Dialect;
use plcc_diag::{FileId, SourceMap};

/// How deep files are included in one another at most.
const MAX_INCLUDES: usize = 16;

/// A line to be shown.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct SourceLine {
    pub(super) file: FileId,
    /// Its first and last line in the file.
    pub(super) line: u32,
    pub(super) end_line: u32,
    /// Its number as it is shown.
    pub(super) number: String,
    /// Its text. Of NCT each comment is replaced by blanks, so that columns stay what they were.
    pub(super) text: String,
}

/// The lines of a program that are shown.
pub(super) fn lines(sources: &SourceMap, dialect: Dialect) -> Vec<SourceLine> {
    let mut found = vec![];
    let all = (0..u32::try_from(sources.len()).unwrap_or(u32::MAX)).map(FileId);
    let mut included = vec![];
    for file in all.clone() {
        // A file that another one includes is shown there.
        if included.contains(&file) {
            continue;
        }
        let mut reader = Reader { sources, dialect, included: &mut included, found: &mut found };
        reader.file(file, None, 0);
    }
    if dialect == Dialect::Pmi {
        // "Specification statements are not displayed" (PMI 5.1): what ends with $END is one.
        let is_directive = |line: &SourceLine| line.text.trim_start().starts_with('$');
        let first = found.iter().rposition(is_directive).map_or(0, |at| at + 1);
        found.drain(..first);
        join_continued(&mut found);
    }
    found.retain(|line| !line.text.trim().is_empty());
    found
}

/// Joins PMI's continued lines: `#` at the end of a line continues the statement on the next one.
fn join_continued(lines: &mut Vec<SourceLine>) {
    let mut joined: Vec<SourceLine> = vec![];
    for line in lines.drain(..) {
        match joined.last_mut() {
            Some(last) if last.text.ends_with('#') && last.file == line.file => {
                last.text.pop();
                let kept = last.text.trim_end().len();
                last.text.truncate(kept);
                last.text.push_str(line.text.trim_start());
                last.end_line = line.end_line;
            }
            _ => joined.push(line),
        }
    }
    for line in &mut joined {
        if line.text.ends_with('#') {
            line.text.pop();
        }
    }
    *lines = joined;
}

struct Reader<'a> {
    sources: &'a SourceMap,
    dialect: Dialect,
    included: &'a mut Vec<FileId>,
    found: &'a mut Vec<SourceLine>,
}

impl Reader<'_> {
    /// Takes in a file. `from` is the line of the file that includes it.
    fn file(&mut self, file: FileId, from: Option<u32>, depth: usize) {
        let text = match self.dialect {
            Dialect::Nct => without_nct_comments(self.sources.text(file)),
            Dialect::Pmi => without_line_comments(self.sources.text(file), &["?"]),
            Dialect::Pmac => without_line_comments(self.sources.text(file), &[";", "//"]),
        };
        for (line, text) in (1..).zip(text.lines()) {
            let text = text.trim_end();
            if let Some(inner) = self.included_by(text).filter(|_| depth < MAX_INCLUDES) {
                self.included.push(inner);
                self.file(inner, Some(line), depth + 1);
                continue;
            }
            let number = match from {
                Some(outer) => format!("{outer}.{line}"),
                None => line.to_string(),
            };
            self.found.push(SourceLine { file, line, end_line: line, number, text: text.into() });
        }
    }

    /// The file that a line includes.
    fn included_by(&self, text: &str) -> Option<FileId> {
        let word = match self.dialect {
            Dialect::Pmi => "$include",
            Dialect::Pmac => "#include",
            Dialect::Nct => return None,
        };
        let text = text.trim_start();
        let head = text.get(..word.len())?;
        if !head.eq_ignore_ascii_case(word) {
            return None;
        }
        let quotes = ['"', '<', '>', ' ', '\t'];
        let path = text.get(word.len()..)?.trim_matches(quotes).replace('\\', "/");
        let name = path.rsplit('/').next()?.to_lowercase();
        let all = (0..u32::try_from(self.sources.len()).unwrap_or(u32::MAX)).map(FileId);
        all.into_iter().find(|&file| {
            let known = self.sources.path(file).replace('\\', "/").to_lowercase();
            known.rsplit('/').next() == Some(name.as_str()) && !self.included.contains(&file)
        })
    }
}

/// A text without comments that go to the end of their line; they may not begin in quotes.
fn without_line_comments(text: &str, marks: &[&str]) -> String {
    let mut out = String::with_capacity(text.len());
    for line in text.lines() {
        let mut in_quotes = false;
        let end = line.char_indices().find_map(|(at, c)| {
            if c == '"' {
                in_quotes = !in_quotes;
            }
            let rest = line.get(at..).unwrap_or_default();
            let begins = !in_quotes && marks.iter().any(|mark| rest.starts_with(mark));
            begins.then_some(at)
        });
        out.push_str(line.get(..end.unwrap_or(line.len())).unwrap_or(line).trim_end());
        out.push('\n');
    }
    out
}

/// A text of NCT with blanks in the place of comments: `;` to the end of a line, `/* */`.
fn without_nct_comments(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut rest = text.chars().peekable();
    let (mut in_block, mut in_line) = (false, false);
    while let Some(c) = rest.next() {
        if c == '\n' {
            in_line = false;
            out.push('\n');
        } else if in_block {
            out.push(' ');
            if c == '*' && rest.peek() == Some(&'/') {
                rest.next();
                out.push(' ');
                in_block = false;
            }
        } else if in_line {
            out.push(' ');
        } else if c == ';' {
            in_line = true;
            out.push(' ');
        } else if c == '/' && rest.peek() == Some(&'*') {
            rest.next();
            out.push_str("  ");
            in_block = true;
        } else {
            out.push(c);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(dialect: Dialect, files: &[(&str, &str)]) -> Vec<(String, String)> {
        let mut sources = SourceMap::new();
        for (path, text) in files {
            sources.add((*path).to_owned(), text.as_bytes());
        }
        lines(&sources, dialect).into_iter().map(|line| (line.number, line.text)).collect()
    }

    fn pair(number: &str, text: &str) -> (String, String) {
        (number.into(), text.into())
    }

    #[test]
    fn pmi_shows_statements_without_specifications_and_comments() {
        let main =
            "$INPUT\nA 0.0 ? input\n$END\n? nothing\nB = A &  #\n  /C ? both\n$INCLUDE \"X.PMI\"\n";
        let found = texts(Dialect::Pmi, &[("main.pmi", main), ("lib/x.pmi", "D=B\n? no\nE=B\n")]);
        // $INCLUDE is no statement either, but what it includes is.
        assert_eq!(found, [pair("5", "B = A &/C"), pair("7.1", "D=B"), pair("7.3", "E=B")]);
    }

    #[test]
    fn nct_keeps_columns() {
        let found = texts(Dialect::Nct, &[("a.plc", ":001 /* a\nb */ U001 ;c\n\nJ1")]);
        assert_eq!(found, [pair("1", ":001"), pair("2", "     U001"), pair("4", "J1")]);
    }

    #[test]
    fn pmac_includes_files_in_their_place() {
        let main = "#include <IO.H>\nP1=2 ; no\nSEND\"a;b\"//c";
        let found = texts(Dialect::Pmac, &[("m.pmc", main), ("io.h", "M1->X:0,0")]);
        assert_eq!(found, [pair("1.1", "M1->X:0,0"), pair("2", "P1=2"), pair("3", "SEND\"a;b\"")]);
    }
}
