//! The download program's directives: `#define`, `#undef`, `#ifdef`, `#ifndef`, `#else`, `#endif`
//! and `#include`.

use std::path::Path;

use plcc_diag::{Diagnostic, Span};

use super::comments::strip_comment;
use super::macros::Macro;
use super::preprocess::{Conditional, MAX_NESTING, OpenFile, Preprocessor, word_at};
use super::template::{ExpandedLine, Template};
use crate::common::{Inclusion, find_include};

impl Preprocessor<'_> {
    /// Executes a directive; false if `word`, in small letters, is not a directive. The `#` is at
    /// the offset `lead` of the line, the text after the word at `tail`.
    pub(super) fn directive(
        &mut self,
        word: &str,
        line: &ExpandedLine<'_>,
        lead: usize,
        tail: usize,
    ) -> bool {
        match word {
            "define" | "undef" | "ifdef" | "ifndef" | "else" | "endif" | "include" => {}
            _ => return false,
        }
        let at = line.span(lead..line.text.trim_end().len());
        let rest = line.text.get(tail..).unwrap_or("");
        let trimmed = rest.trim_start();
        let name_start = tail + (rest.len() - trimmed.len());
        let name = word_at(trimmed, 0);
        match word {
            "ifdef" | "ifndef" => {
                let outer = self.active();
                let active = outer && self.is_defined(name) == (word == "ifdef");
                if self.conditionals.len() >= MAX_NESTING {
                    self.error(at, "PMAC-9", "conditionals nest too deep: 256 levels at most");
                } else {
                    self.conditionals.push(Conditional { at, active, outer, seen_else: false });
                }
            }
            "else" | "endif" => {
                let floor = self.files.last().map_or(0, |f| f.conditionals);
                let open = self.conditionals.len() > floor;
                match self.conditionals.last_mut().filter(|_| open) {
                    Some(_) if word == "endif" => {
                        self.conditionals.pop();
                    }
                    Some(open) if !open.seen_else => {
                        open.seen_else = true;
                        open.active = open.outer && !open.active;
                    }
                    _ => self.error(at, "PMAC-9", format!("#{word} without its #ifdef or #ifndef")),
                }
            }
            _ if !self.active() => {}
            "include" => self.include(at, trimmed),
            "undef" => {
                self.macros.remove(name);
            }
            _ if name.is_empty() => {
                let message = "this #define has no name: it defines nothing";
                self.diagnostics.push(Diagnostic::warning("PMAC-W8", at, message));
            }
            _ => {
                let rest = trimmed.get(name.len()..).unwrap_or("");
                let body = strip_comment(rest).trim();
                let body_start = name_start + name.len() + (rest.len() - rest.trim_start().len());
                let range = body_start..body_start + body.len();
                let defined = if body.is_empty() { at } else { line.span(range.clone()) };
                let has_undefined_template = line.has_undefined_template(range);
                let entry =
                    Macro { body: body.into(), defined, expanding: false, has_undefined_template };
                self.macros.insert(name.to_owned(), entry);
            }
        }
        true
    }

    /// Whether a name is defined, by the text or by `--define`.
    fn is_defined(&self, name: &str) -> bool {
        self.macros.contains_key(name) || self.options.defines.iter().any(|(n, _)| n == name)
    }

    /// Opens the file that `#include` names; `at` is the place of the directive, `written` the text
    /// after its word.
    fn include(&mut self, at: Span, written: &str) {
        let (from, close) = match written.chars().next() {
            Some('"') => (1, '"'),
            Some('<') => (1, '>'),
            _ => (0, ' '),
        };
        let tail = written.get(from..).unwrap_or("");
        let name = match close {
            ' ' => strip_comment(tail),
            _ => tail.find(close).map_or(tail, |end| tail.get(..end).unwrap_or("")),
        };
        let name = name.trim();
        if name.is_empty() {
            return self.error(at, "PMAC-3", "#include needs a file name");
        }
        if self.files.len() >= MAX_NESTING {
            return self.error(at, "PMAC-X2", "includes nest too deep: 256 levels at most");
        }
        if self.include_budget.is_exceeded() {
            self.preprocessed.incomplete = true;
            return;
        }
        let includer = Path::new(self.sources.path(at.file)).to_owned();
        match find_include(self.loader, &includer, name, &self.options.include_dirs) {
            Some(found) => {
                let path = found.path.to_string_lossy().into_owned();
                if self.files.iter().any(|f| Path::new(self.sources.path(f.file)) == found.path) {
                    return self.error(at, "PMAC-X2", format!("`{name}` includes itself"));
                }
                if !self.may_include(found.bytes.len(), at) {
                    return;
                }
                let file = self.sources.add_included(path, &found.bytes, at);
                self.files.push(OpenFile { file, pos: 0, conditionals: self.conditionals.len() });
            }
            None => {
                self.preprocessed.incomplete = true;
                if !self.may_include(0, at) {
                    return;
                }
                self.diagnostics.push(
                    Diagnostic::error("PMAC-X2", at, format!("the file `{name}` is not found"))
                        .help("it is looked for beside this file, by its trailing parts, and in -I folders"),
                );
            }
        }
    }
}

impl Preprocessor<'_> {
    /// Whether a file of `length` bytes may be included. The first one that may not is reported.
    fn may_include(&mut self, length: usize, at: Span) -> bool {
        let inclusion = self.include_budget.include(length);
        if inclusion == Inclusion::Exceeds {
            self.diagnostics.push(
                Diagnostic::error("PMAC-X5", at, "with this file the download includes too much")
                    .note("a download may include 4 MiB; a file counts as 1 KiB at least")
                    .help("include each file once"),
            );
        }
        self.preprocessed.incomplete |= inclusion != Inclusion::Allowed;
        inclusion == Inclusion::Allowed
    }
}

/// The name and the value of `#define $(NAME) VALUE`.
pub(super) fn template_definition(line: &str) -> Option<(&str, &str)> {
    let rest = line.trim_start().strip_prefix('#')?.trim_start();
    let word = word_at(rest, 0);
    let rest = rest.get(word.len()..).filter(|_| word.eq_ignore_ascii_case("define"))?;
    Template::name_and_rest(rest.trim_start())
}
