//! The names that a download's `#define` gives to variables, and what its comments say of them.

use plcc_abi::GivenName;
use plcc_abi::given_name::is_alias;
use plcc_abi::pmac::PmacName;
use plcc_diag::FileId;

use super::Program;
use super::language::COMMENT_SIGNS;
use crate::common::split_comment;

/// How many definitions may stand for each other until one names a variable.
const MAX_CHAIN: usize = 16;

impl Program {
    /// The canonical name of a variable, if a text is the name of one.
    fn variable(&self, text: &str) -> Option<String> {
        let name = PmacName::parse(text, &self.loaded.layout).ok()?;
        matches!(name, PmacName::Variable(_)).then(|| name.to_string())
    }

    /// What `#define` replaces a word by.
    fn body(&self, word: &str) -> Option<&str> {
        let at = self.names.binary_search_by(|known| known.name.as_str().cmp(word)).ok()?;
        Some(self.names.get(at)?.body.trim())
    }

    /// The variable that is all that a word is replaced by, maybe by way of other words.
    fn defined_variable(&self, word: &str) -> Option<String> {
        let mut body = self.body(word)?;
        for _ in 0..MAX_CHAIN {
            match self.body(body) {
                Some(next) => body = next,
                None => return self.variable(body),
            }
        }
        None
    }

    /// The names that `#define` gives, and then the comments behind these definitions and those of M- and
    /// L-variables, all in the order of the text. Names that the language has itself are left out.
    pub(super) fn names_in_source(&self) -> Vec<GivenName> {
        let given = |defined: &super::preprocess::DefinedName| {
            let alias = defined.name.clone();
            let is_given = is_alias(&alias) && self.variable(&alias).is_none();
            let name = self.defined_variable(&alias).filter(|_| is_given)?;
            Some(GivenName { name, alias, ..GivenName::default() })
        };
        let mut defined: Vec<_> = self.names.iter().collect();
        defined.sort_by_key(|name| (name.defined.file, name.defined.start));
        let mut names: Vec<GivenName> = defined.into_iter().filter_map(given).collect();
        let files = (0..self.sources.len()).map(|file| self.sources.text(FileId(file as u32)));
        for line in files.flat_map(str::lines) {
            let (statement, comment) = split_comment(line, COMMENT_SIGNS);
            if comment.is_empty() {
                continue;
            }
            let statement = statement.trim();
            let defined = statement.strip_prefix('#').map(str::trim_start);
            let name = match (defined, statement.split_once("->")) {
                (Some(directive), _) => {
                    let mut words = directive.split_whitespace();
                    let is_define = words.next().is_some_and(|w| w.eq_ignore_ascii_case("define"));
                    words.next().filter(|_| is_define).and_then(|word| self.defined_variable(word))
                }
                (None, Some((left, _))) => {
                    let left = left.trim();
                    self.variable(left).or_else(|| self.defined_variable(left))
                }
                (None, None) => None,
            };
            if let Some(name) = name {
                names.push(GivenName { name, text: comment.to_owned(), ..GivenName::default() });
            }
        }
        names
    }
}
