//! Lines of sources without comments, included files in their place.

use plcc_diag::{FileId, SourceMap};

/// How deep files are included in one another at most.
const MAX_INCLUDES: usize = 16;

/// A line to be shown.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SourceLine {
    /// The file that it stands in.
    pub file: FileId,
    /// Its first line in the file.
    pub line: u32,
    /// Its last line in the file.
    pub end_line: u32,
    /// Its number as it is shown.
    pub number: String,
    /// Its text. A comment may have been replaced by blanks, so that columns stay what they were.
    pub text: String,
    /// The text of its comment, without the sign that begins it; empty without one.
    pub comment: String,
}

/// The lines of all files, without comments, which `without_comments` takes out of a file's text. A line that begins with
/// the word `include` is replaced by the file that it includes.
pub fn lines(
    sources: &SourceMap,
    without_comments: &dyn Fn(&str) -> String,
    include: Option<&str>,
) -> Vec<SourceLine> {
    let mut reader = Reader { sources, without_comments, include, included: vec![], found: vec![] };
    for file in files(sources) {
        // A file that another one includes is shown there.
        if !reader.included.contains(&file) {
            reader.file(file, None, 0);
        }
    }
    reader.found
}

fn files(sources: &SourceMap) -> impl Iterator<Item = FileId> + use<> {
    (0..u32::try_from(sources.len()).unwrap_or(u32::MAX)).map(FileId)
}

struct Reader<'a> {
    sources: &'a SourceMap,
    without_comments: &'a dyn Fn(&str) -> String,
    include: Option<&'a str>,
    included: Vec<FileId>,
    found: Vec<SourceLine>,
}

impl Reader<'_> {
    /// Takes in a file. `from` is the line of the file that includes it.
    fn file(&mut self, file: FileId, from: Option<u32>, depth: usize) {
        let whole = self.sources.text(file);
        let text = (self.without_comments)(whole);
        for ((line, text), whole) in (1..).zip(text.lines()).zip(whole.lines()) {
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
            let (text, comment) = (text.to_owned(), comment_of(whole, text));
            self.found.push(SourceLine { file, line, end_line: line, number, text, comment });
        }
    }

    /// The file that a line includes.
    fn included_by(&self, text: &str) -> Option<FileId> {
        let word = self.include?;
        let text = text.trim_start();
        let head = text.get(..word.len())?;
        if !head.eq_ignore_ascii_case(word) {
            return None;
        }
        let quotes = ['"', '<', '>', ' ', '\t'];
        let path = text.get(word.len()..)?.trim_matches(quotes).replace('\\', "/");
        let name = path.rsplit('/').next()?.to_lowercase();
        files(self.sources).find(|&file| {
            let known = self.sources.path(file).replace('\\', "/").to_lowercase();
            known.rsplit('/').next() == Some(name.as_str()) && !self.included.contains(&file)
        })
    }
}

/// The comment of a line: what the same line without comments does not have, without the signs around it.
fn comment_of(whole: &str, text: &str) -> String {
    let without = text.chars().map(Some).chain(std::iter::repeat(None));
    let (mut comment, mut within) = (String::new(), false);
    for (c, left) in whole.chars().zip(without) {
        // A blank of the comment is one of the line without it too.
        within = left != Some(c) || within && c.is_whitespace();
        if within {
            comment.push(c);
        }
    }
    comment.trim_matches(|c: char| c.is_whitespace() || ";?/*".contains(c)).to_owned()
}

/// A text without comments that go from one of the marks to the end of their line; they may not begin in quotes.
pub fn without_line_comments(text: &str, marks: &[&str]) -> String {
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

/// The numbers and texts of lines that are not blank, for tests.
#[cfg(test)]
pub(crate) fn shown(lines: Vec<SourceLine>) -> Vec<(String, String)> {
    let lines = lines.into_iter().filter(|line| !line.text.trim().is_empty());
    lines.map(|line| (line.number, line.text)).collect()
}

/// Sources for tests: path and text of each file.
#[cfg(test)]
pub(crate) fn sources(files: &[(&str, &str)]) -> SourceMap {
    let mut sources = SourceMap::new();
    for (path, text) in files {
        sources.add((*path).to_owned(), text.as_bytes());
    }
    sources
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_has_its_comment_without_the_signs_around_it() {
        let sources = sources(&[("a", "A=1 ; the door; closed\n; alone\nB=2\nC=\";\" ; text\n")]);
        let found = lines(&sources, &|text| without_line_comments(text, &[";"]), None);
        let comments: Vec<&str> = found.iter().map(|line| line.comment.as_str()).collect();
        assert_eq!(comments, ["the door; closed", "alone", "", "text"]);
        assert_eq!(comment_of("A /* one two */ B", "A               B"), "one two");
    }
}
