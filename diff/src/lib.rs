//! Which statements of two versions of a program differ in meaning, and what depends on them.
//!
//! Statements are compared as the program means them: comments, layout and the base of a number do not count, an input or output
//! is its place rather than its name, a name of a PMAC's `#define` is what it stands for. A statement that stands elsewhere counts
//! only if it has passed one with which its order matters.
//!
//! | file | holds |
//! | --- | --- |
//! | `unit.rs` | the statements of a program, each with what it means, reads, writes and controls |
//! | `align.rs` | which statements of the two versions belong together |
//! | `depend.rs` | what depends on a statement, and by way of which variables |
//!
//! ```
//! use plcc_diag::SourceMap;
//! use plcc_diff::{Change, Version, compare};
//! use plcc_frontend::common::{MemoryLoader, Options};
//! use plcc_frontend::language::LANGUAGES;
//!
//! let read = |text: &str| {
//!     let mut sources = SourceMap::new();
//!     let file = sources.add("a.pmi", text.as_bytes());
//!     let words = LANGUAGES[0].words(&mut sources, &[file], &MemoryLoader::new(), &Options::default());
//!     Version { sources, words }
//! };
//! let old = read("$OUTPUT\nLAMP = 1/0\n$END\nA = B & C ? both\nLAMP = A\n");
//! let new = read("$OUTPUT\nLIGHT = 1/0\n$END\nA = B ! C\nLIGHT = A\n");
//! let found = compare(&old, &new);
//! assert_eq!(found.len(), 1);
//! assert_eq!(found[0].change, Change::Changed);
//! assert_eq!(found[0].affected[1].name, "LAMP");
//! ```

mod align;
mod depend;
mod unit;

use plcc_diag::{SourceMap, Span};
use plcc_frontend::common::Words;

use align::{Pair, align};
use depend::Graph;
use unit::units;

/// A version of a program.
#[derive(Clone, Debug)]
pub struct Version {
    /// Its files.
    pub sources: SourceMap,
    /// The words of its files.
    pub words: Words,
}

/// What has happened to a statement.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Change {
    /// It means something else.
    Changed,
    /// The new version has it, the old one has not.
    Added,
    /// The old version has it, the new one has not.
    Removed,
    /// It is elsewhere, and has passed a statement with which its order matters.
    Moved,
}

impl Change {
    /// The word for it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Changed => "changed",
            Self::Added => "added",
            Self::Removed => "removed",
            Self::Moved => "moved",
        }
    }
}

/// A variable that depends on a statement.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Affected {
    /// The variable, as the version that has the statement calls it.
    pub name: String,
    /// The variables by way of which it depends on the statement, from the statement on; empty for one that the statement
    /// writes itself.
    pub via: Vec<String>,
    /// Whether it is not a variable but a statement that sends a command or a message; the name is its text then.
    pub is_statement: bool,
}

/// A statement that differs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// What has happened to it.
    pub change: Change,
    /// Where it is in the old version.
    pub old: Option<Span>,
    /// Where it is in the new version.
    pub new: Option<Span>,
    /// What depends on it, the nearest first.
    pub affected: Vec<Affected>,
}

/// The statements in which two versions of a program differ, in the order of the new one; removed ones where they would stand.
pub fn compare(old: &Version, new: &Version) -> Vec<Difference> {
    let (old_units, new_units) = (units(old), units(new));
    let (old_graph, new_graph) = (Graph::of(old, &old_units), Graph::of(new, &new_units));
    let pairs = align(&old_units, &new_units);
    let difference = |pair: &Pair| {
        let mut affected: Vec<Affected> = vec![];
        for (graph, unit) in [(&old_graph, pair.old), (&new_graph, pair.new)] {
            for one in unit.map_or_else(Vec::new, |unit| graph.affected(unit)) {
                if affected.iter().all(|known| known.name != one.name) {
                    affected.push(one);
                }
            }
        }
        affected.sort_by_key(|one| one.via.len());
        let span = |units: &[unit::Unit], at: Option<usize>| Some(units.get(at?)?.span);
        Difference {
            change: pair.change,
            old: span(&old_units, pair.old),
            new: span(&new_units, pair.new),
            affected,
        }
    };
    pairs.iter().map(difference).collect()
}
