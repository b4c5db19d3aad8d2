//! What depends on a statement, and by way of which variables.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use crate::unit::Unit;
use crate::{Affected, Version};

/// Which statements read which variables, and which ones run only as others say.
pub(crate) struct Graph<'u> {
    version: &'u Version,
    units: &'u [Unit],
    /// By a variable, the statements that read it.
    readers: BTreeMap<&'u str, Vec<usize>>,
    /// By a statement, those that run only as it says: the body of a condition, what it jumps over, what it calls.
    governed: Vec<Vec<usize>>,
}

impl<'u> Graph<'u> {
    pub(crate) fn of(version: &'u Version, units: &'u [Unit]) -> Self {
        let mut readers: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
        for (at, unit) in units.iter().enumerate() {
            for name in &unit.reads {
                readers.entry(name).or_default().push(at);
            }
        }
        let mut governed = vec![vec![]; units.len()];
        let in_span = |span: plcc_diag::Span| {
            let from =
                units.partition_point(|it| (it.span.file, it.span.start) < (span.file, span.start));
            let to =
                units.partition_point(|it| (it.span.file, it.span.start) < (span.file, span.end));
            from..to
        };
        let declared: BTreeSet<plcc_diag::Span> =
            version.words.declarations.iter().map(|it| it.extent).collect();
        for block in &version.words.blocks {
            let inside = in_span(*block);
            let first = inside.start;
            let body: Vec<usize> = inside.skip(1).collect();
            // A whole program or section is not run because of its first word.
            if let Some(list) = governed.get_mut(first).filter(|_| !declared.contains(block)) {
                list.extend(body);
            }
        }
        for (at, unit) in units.iter().enumerate() {
            for called in &unit.calls {
                for declaration in version.words.declared(called) {
                    let extent = in_span(declaration.extent);
                    // A jump forwards leaves out what is between.
                    let between = if unit.jumps { at + 1..extent.start } else { 0..0 };
                    let list = governed.get_mut(at).into_iter();
                    list.for_each(|list| list.extend(extent.clone().chain(between.clone())));
                }
            }
        }
        Self { version, units, readers, governed }
    }

    /// What depends on a statement, the nearest first.
    pub(crate) fn affected(&self, unit: usize) -> Vec<Affected> {
        let mut found: Vec<Affected> = vec![];
        let mut known: BTreeSet<&str> = BTreeSet::new();
        let mut done: BTreeSet<usize> = BTreeSet::new();
        // Statements that do something else, each with the variables by way of which that came.
        let mut open: VecDeque<(usize, Vec<String>)> = VecDeque::from([(unit, vec![])]);
        while let Some((at, via)) = open.pop_front() {
            let Some(unit) = self.units.get(at).filter(|_| done.insert(at)) else { continue };
            if unit.acts {
                let name = self.version.sources.slice(unit.span).to_owned();
                found.push(Affected { name, via: via.clone(), is_statement: true });
            }
            let governed = self.governed.get(at).into_iter().flatten();
            open.extend(governed.map(|&next| (next, via.clone())));
            for name in &unit.writes {
                if !known.insert(name) {
                    continue;
                }
                found.push(Affected { name: name.clone(), via: via.clone(), is_statement: false });
                let mut longer = via.clone();
                longer.push(name.clone());
                let readers = self.readers.get(name.as_str()).into_iter().flatten();
                open.extend(readers.map(|&reader| (reader, longer.clone())));
            }
        }
        found
    }
}
