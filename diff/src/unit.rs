//! The statements of a program, each with what it means, reads, writes and controls.

use std::collections::{BTreeSet, HashMap};

use plcc_diag::Span;
use plcc_frontend::common::words::{Appearance, Declaration, DeclarationKind, Word, WordKind};

use crate::Version;

/// A statement, a declaration, or the words between statements, such as an ENDIF.
#[derive(Clone, Debug)]
pub(crate) struct Unit {
    /// From its first word to its last one.
    pub(crate) span: Span,
    /// What it means, to be compared.
    pub(crate) meaning: String,
    /// The variables that it looks at.
    pub(crate) reads: BTreeSet<String>,
    /// The variables that it gives a value, or declares.
    pub(crate) writes: BTreeSet<String>,
    /// The labels, subroutines and programs that it goes to, calls, starts or stops.
    pub(crate) calls: BTreeSet<String>,
    /// Whether it goes to them, so that what stands between is left out.
    pub(crate) jumps: bool,
    /// Whether the order of the statements around it has a meaning that its variables do not show: a condition, a label, a
    /// jump.
    pub(crate) directs: bool,
    /// Whether it does something besides giving variables values: a command, a message.
    pub(crate) acts: bool,
    /// Whether it is a declaration, whose place has no meaning.
    pub(crate) declares: bool,
}

/// What resolves names.
struct Names<'v> {
    version: &'v Version,
    declarations: HashMap<&'v str, &'v Declaration>,
    /// The offsets at which the words begin that begin or end a block.
    directing: BTreeSet<Span>,
}

/// The statements of a version, in the order of its files.
pub(crate) fn units(version: &Version) -> Vec<Unit> {
    let words = &version.words;
    let declarations = words.declarations.iter().map(|it| (it.name.as_str(), it)).collect();
    let mut directing = BTreeSet::new();
    for block in &words.blocks {
        let ends =
            [words.at(block.file, block.start), words.at(block.file, block.end.saturating_sub(1))];
        directing.extend(ends.into_iter().flatten().map(|word| word.span));
    }
    let names = Names { version, declarations, directing };
    let mut groups: Vec<(Option<Span>, Vec<&Word>)> = vec![];
    for word in words.words.iter().filter(|word| word.kind != WordKind::Comment) {
        let statement = statement_of(&words.statements, word.span);
        let line = |word: &Word| version.sources.line(word.span.file, word.span.start);
        match groups.last_mut() {
            Some((own, group))
                if *own == statement
                    && group.last().is_some_and(|last| {
                        statement.is_some()
                            || last.span.file == word.span.file && line(last) == line(word)
                    }) =>
            {
                group.push(word);
            }
            _ => groups.push((statement, vec![word])),
        }
    }
    groups.iter().filter_map(|(_, group)| names.unit(group)).collect()
}

/// The shortest statement that a word lies in.
fn statement_of(statements: &[Span], word: Span) -> Option<Span> {
    let next = statements.partition_point(|it| (it.file, it.start) <= (word.file, word.start));
    let earlier = statements.get(..next)?.iter().rev().take(8);
    let holding = earlier.filter(|it| it.file == word.file && it.end >= word.end);
    holding.min_by_key(|it| it.end - it.start).copied()
}

impl Names<'_> {
    /// The unit that some words make; `None` for those that mean nothing by themselves: directives, whose meaning is in the
    /// statements that use what they define.
    fn unit(&self, words: &[&Word]) -> Option<Unit> {
        let (first, last) = (words.first()?, words.last()?);
        if first.kind == WordKind::Directive {
            return None;
        }
        let with = |appearances: &[Appearance]| -> BTreeSet<String> {
            let found =
                words.iter().filter(|it| it.appearance.is_some_and(|it| appearances.contains(&it)));
            found.filter(|it| it.kind != WordKind::Label).filter_map(|it| it.name.clone()).collect()
        };
        let mut reads = with(&[Appearance::Read, Appearance::Tested]);
        let writes = with(&[Appearance::Written, Appearance::Declared]);
        let declared: Vec<&Declaration> = writes
            .iter()
            .filter_map(|name| self.declarations.get(name.as_str()).copied())
            .filter(|it| words.iter().any(|word| word.span == it.at))
            .filter(|_| words.iter().any(|word| word.appearance == Some(Appearance::Declared)))
            .collect();
        // The contacts of a timer or flip-flop follow each other.
        if declared.iter().filter(|it| it.kind == DeclarationKind::Contact).count() > 1 {
            reads.extend(writes.iter().cloned());
        }
        let labels = words.iter().filter(|it| it.kind == WordKind::Label);
        let jumps = labels.clone().any(|it| it.appearance == Some(Appearance::GoneTo));
        let calls = labels.clone().filter(|it| it.appearance != Some(Appearance::Declared));
        let calls: BTreeSet<String> = calls.filter_map(|it| it.name.clone()).collect();
        let directs =
            labels.count() > 0 || words.iter().any(|it| self.directing.contains(&it.span));
        let is_text = words.iter().any(|it| it.kind == WordKind::Text);
        let acts = writes.is_empty() && declared.is_empty() && is_text;
        let meaning = if declared.is_empty() {
            self.meanings(words)
        } else {
            let order = |it: &&Declaration| self.identity(&it.name);
            let mut parts: Vec<String> =
                declared.iter().map(|it| format!("{} {}", order(it), it.detail)).collect();
            // The text of a fault or message, and what its values are.
            let is_told = declared.iter().any(|it| {
                matches!(
                    it.kind,
                    DeclarationKind::Announcement | DeclarationKind::Key | DeclarationKind::Contact
                )
            });
            if is_told || self.sources_arrow(words) {
                parts.push(self.meanings(words));
            }
            parts.join(" ")
        };
        let declares = !declared.is_empty();
        Some(Unit {
            span: first.span.to(last.span),
            meaning,
            reads,
            writes,
            calls,
            jumps,
            directs,
            acts,
            declares,
        })
    }

    /// Whether words are a definition with `->`, all of whose text counts.
    fn sources_arrow(&self, words: &[&Word]) -> bool {
        words.array_windows().any(|[a, b]| {
            self.version.sources.slice(a.span) == "-" && self.version.sources.slice(b.span) == ">"
        })
    }

    /// What words mean. A blank after a word of the language has no meaning: `PLC 1` is `PLC1`.
    fn meanings(&self, words: &[&Word]) -> String {
        let mut meaning = String::new();
        for word in words {
            meaning.push_str(&self.meaning(word));
            if word.kind != WordKind::Keyword {
                meaning.push(' ');
            }
        }
        meaning
    }

    /// What a word means.
    fn meaning(&self, word: &Word) -> String {
        let text = self.version.sources.slice(word.span);
        match (word.kind, &word.name, &word.defined_as) {
            (WordKind::Variable, Some(name), _) => self.identity(name),
            (WordKind::Constant, None, Some(defined)) => self.replacement(defined),
            (WordKind::Number, ..) => number(text),
            (WordKind::Text, ..) => text.to_owned(),
            (WordKind::Label | WordKind::Constant, Some(name), _) => name.clone(),
            _ => text.to_ascii_uppercase(),
        }
    }

    /// What tells a variable from others: its place if it is an input or output, else its name.
    fn identity(&self, name: &str) -> String {
        match self.declarations.get(name) {
            Some(it) if matches!(it.kind, DeclarationKind::Input | DeclarationKind::Output) => it
                .detail
                .split_once("port ")
                .map_or_else(|| name.to_owned(), |(_, place)| format!("port {place}")),
            _ => name.to_owned(),
        }
    }

    /// What a name of a `#define` stands for, names in it replaced in turn.
    fn replacement(&self, name: &str) -> String {
        let mut text = name.to_owned();
        for _ in 0..16 {
            let Some(it) = self.declarations.get(text.as_str()) else { break };
            let Some((_, body)) = it.detail.split_once(name_of(it)) else { break };
            text = body.trim().to_owned();
        }
        number(&text)
    }
}

fn name_of(it: &Declaration) -> &str {
    &it.name
}

/// A number without its base and needless zeros; any other text as it is.
fn number(text: &str) -> String {
    let hexadecimal =
        text.strip_prefix(['$', '.']).and_then(|digits| u64::from_str_radix(digits, 16).ok());
    if let Some(value) = hexadecimal {
        return value.to_string();
    }
    match text.trim_start_matches(',').parse::<f64>() {
        Ok(value) if value.is_finite() => value.to_string(),
        _ => text.split_whitespace().collect::<Vec<_>>().join(" "),
    }
}
