//! Coverage: how often each statement ran, and what was seen of each contact. The statement interpreter tells it, which
//! walks the statements of the source.

mod html;
mod lcov;
mod observed;

use plcc_diag::{FileId, SourceMap, Span};
use plcc_frontend::CheckedProgram;
use plcc_frontend::common::Logic;
use serde::Serialize;

pub use html::html;
pub use lcov::lcov;
pub use observed::ObservedEngine;

/// What was seen of a contact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ContactCounts {
    /// How often it was 0.
    pub zero: u64,
    /// How often it was 1.
    pub one: u64,
    /// How often turning it alone would have changed the result, which was 0.
    pub decided_zero: u64,
    /// How often turning it alone would have changed the result, which was 1.
    pub decided_one: u64,
}

impl ContactCounts {
    fn add(&mut self, other: Self) {
        self.zero += other.zero;
        self.one += other.one;
        self.decided_zero += other.decided_zero;
        self.decided_one += other.decided_one;
    }

    /// Whether it decided both results.
    pub fn is_decided(self) -> bool {
        self.decided_zero > 0 && self.decided_one > 0
    }

    /// Whether it was seen 0 and 1.
    pub fn is_seen(self) -> bool {
        self.zero > 0 && self.one > 0
    }
}

/// The statements of a program with their contacts: what is counted.
#[derive(Debug)]
pub struct Map {
    /// The place of each statement, by its number.
    statements: Vec<Option<Span>>,
    logic: Vec<Option<Logic>>,
}

impl Map {
    /// Of a program that was read from these sources.
    pub fn new(checked: &dyn CheckedProgram, sources: &SourceMap) -> Self {
        Self { statements: checked.statements(), logic: checked.logic(sources) }
    }

    fn logic(&self, statement: usize) -> Option<&Logic> {
        self.logic.get(statement)?.as_ref()
    }
}

/// What runs have counted, by the statements' numbers.
#[derive(Clone, Debug, Default)]
pub struct Counts {
    runs: Vec<u64>,
    contacts: Vec<Vec<ContactCounts>>,
}

impl Counts {
    /// Nothing was run yet.
    pub fn new(map: &Map) -> Self {
        let contacts = |at: usize| map.logic(at).map_or(0, |logic| logic.contacts().len());
        let count = map.statements.len();
        Self {
            runs: vec![0; count],
            contacts: (0..count).map(|at| vec![ContactCounts::default(); contacts(at)]).collect(),
        }
    }

    /// Adds what another run has counted.
    pub fn add(&mut self, other: &Self) {
        for (own, other) in self.runs.iter_mut().zip(&other.runs) {
            *own += other;
        }
        let pairs = self.contacts.iter_mut().flatten().zip(other.contacts.iter().flatten());
        pairs.for_each(|(own, other)| own.add(*other));
    }

    /// A statement is executed; `image` is the process image before it.
    fn see(&mut self, map: &Map, statement: usize, image: &[u8]) {
        let Some(runs) = self.runs.get_mut(statement) else { return };
        *runs += 1;
        let (Some(logic), Some(counts)) = (map.logic(statement), self.contacts.get_mut(statement))
        else {
            return;
        };
        let Some(seen) = logic.see(image) else { return };
        for (count, (value, decided)) in counts.iter_mut().zip(&seen.contacts) {
            match value {
                false => count.zero += 1,
                true => count.one += 1,
            }
            match (decided, seen.result) {
                (true, false) => count.decided_zero += 1,
                (true, true) => count.decided_one += 1,
                (false, _) => {}
            }
        }
    }

    /// How many statements ran, and how many sides of contacts were seen: it grows when something new is covered.
    pub fn reached(&self) -> usize {
        let runs = self.runs.iter().filter(|runs| **runs > 0).count();
        let side = |count: u64| usize::from(count > 0);
        let contacts = self.contacts.iter().flatten().map(|counts| {
            side(counts.zero)
                + side(counts.one)
                + side(counts.decided_zero)
                + side(counts.decided_one)
        });
        runs + contacts.sum::<usize>()
    }

    /// What of this is new beside `known`: the numbers of statements and contacts that these runs cover for the first time.
    pub fn is_new_beside(&self, known: &Self) -> bool {
        let mut both = known.clone();
        both.add(self);
        both.reached() > known.reached()
    }
}

/// A contact with what was seen of it.
#[derive(Clone, Debug)]
pub struct CoveredContact {
    /// Its text.
    pub name: String,
    /// Where it stands.
    pub span: Span,
    /// Its column, from 1.
    pub column: u32,
    /// What was seen.
    pub counts: ContactCounts,
    /// The tests that covered it: in which it decided.
    pub tests: Vec<usize>,
}

/// A statement with how often it ran.
#[derive(Clone, Debug)]
pub struct CoveredStatement {
    /// Its place.
    pub span: Span,
    /// Its line, from 1.
    pub line: u32,
    /// How often it ran.
    pub runs: u64,
    /// Its contacts.
    pub contacts: Vec<CoveredContact>,
    /// The tests that ran it.
    pub tests: Vec<usize>,
}

/// The coverage of a program by tests.
#[derive(Debug)]
pub struct Coverage {
    /// The program's sources.
    pub sources: SourceMap,
    /// Its statements, in the order of the text.
    pub statements: Vec<CoveredStatement>,
    /// The names of the tests.
    pub tests: Vec<String>,
}

/// How much was covered.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Summary {
    /// The statements that ran, and all.
    pub statements: (usize, usize),
    /// The contacts that decided both results, and all.
    pub contacts: (usize, usize),
}

impl Summary {
    /// Both together.
    pub fn plus(self, other: Self) -> Self {
        let sum = |a: (usize, usize), b: (usize, usize)| (a.0 + b.0, a.1 + b.1);
        Self {
            statements: sum(self.statements, other.statements),
            contacts: sum(self.contacts, other.contacts),
        }
    }

    /// The line for people.
    pub fn line(self) -> String {
        let share = |(part, all): (usize, usize)| match all {
            0 => String::new(),
            all => format!(" ({} %)", part * 100 / all),
        };
        let Self { statements, contacts } = self;
        format!(
            "coverage: {} of {} statements{}, {} of {} contacts decided both ways{}",
            statements.0,
            statements.1,
            share(statements),
            contacts.0,
            contacts.1,
            share(contacts),
        )
    }
}

impl Coverage {
    /// Merges what tests have counted, each with its name.
    pub fn new(map: &Map, sources: &SourceMap, tests: &[(String, Counts)]) -> Self {
        let mut all = Counts::new(map);
        tests.iter().for_each(|(_, counts)| all.add(counts));
        let mut statements = vec![];
        for (at, span) in map.statements.iter().enumerate() {
            let Some(span) = *span else { continue };
            let by = |covers: &dyn Fn(&Counts) -> bool| -> Vec<usize> {
                let numbered = tests.iter().enumerate();
                numbered
                    .filter(|(_, (_, counts))| covers(counts))
                    .map(|(number, _)| number)
                    .collect()
            };
            let contacts = map.logic(at).map_or(&[][..], Logic::contacts).iter().enumerate();
            let contacts = contacts.map(|(index, contact)| {
                let counts = |counts: &Counts| {
                    let found = counts.contacts.get(at).and_then(|contacts| contacts.get(index));
                    found.copied().unwrap_or_default()
                };
                CoveredContact {
                    name: contact.name.clone(),
                    span: contact.span,
                    column: sources.line_col(contact.span.file, contact.span.start).1,
                    counts: counts(&all),
                    tests: by(&|of| {
                        let counts = counts(of);
                        counts.decided_zero > 0 || counts.decided_one > 0
                    }),
                }
            });
            let runs = |counts: &Counts| counts.runs.get(at).copied().unwrap_or(0);
            statements.push(CoveredStatement {
                span,
                line: sources.line(span.file, span.start),
                runs: runs(&all),
                contacts: contacts.collect(),
                tests: by(&|counts| runs(counts) > 0),
            });
        }
        statements.sort_by_key(|statement| (statement.span.file, statement.span.start));
        let tests = tests.iter().map(|(name, _)| name.clone()).collect();
        Self { sources: sources.clone(), statements, tests }
    }

    /// How much was covered.
    pub fn summary(&self) -> Summary {
        let mut summary = Summary::default();
        for statement in &self.statements {
            summary.statements.0 += usize::from(statement.runs > 0);
            summary.statements.1 += 1;
            for contact in &statement.contacts {
                summary.contacts.0 += usize::from(contact.counts.is_decided());
                summary.contacts.1 += 1;
            }
        }
        summary
    }

    /// The files that have statements.
    fn files(&self) -> Vec<FileId> {
        let mut files: Vec<FileId> =
            self.statements.iter().map(|statement| statement.span.file).collect();
        files.dedup();
        files
    }
}

#[derive(Serialize)]
struct ContactLine<'c> {
    name: &'c str,
    column: u32,
    zero: u64,
    one: u64,
    decided_zero: u64,
    decided_one: u64,
}

#[derive(Serialize)]
struct StatementLine<'c> {
    file: &'c str,
    line: u32,
    runs: u64,
    contacts: Vec<ContactLine<'c>>,
}

/// The coverage of programs as JSON: a line for each statement, then one with the numbers of all.
pub fn json(all: &[Coverage]) -> String {
    let mut text = String::new();
    let mut summary = Summary::default();
    for coverage in all {
        summary = summary.plus(coverage.summary());
        for statement in &coverage.statements {
            let contacts = statement.contacts.iter().map(|contact| ContactLine {
                name: &contact.name,
                column: contact.column,
                zero: contact.counts.zero,
                one: contact.counts.one,
                decided_zero: contact.counts.decided_zero,
                decided_one: contact.counts.decided_one,
            });
            let line = StatementLine {
                file: coverage.sources.path(statement.span.file),
                line: statement.line,
                runs: statement.runs,
                contacts: contacts.collect(),
            };
            // JSON of these fields does not fail.
            text.push_str(&serde_json::to_string(&line).unwrap_or_default());
            text.push('\n');
        }
    }
    text.push_str(&serde_json::to_string(&summary).unwrap_or_default());
    text.push('\n');
    text
}

#[cfg(test)]
mod tests;
