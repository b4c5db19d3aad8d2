//! The names of the variables that statements access, and what a name means.

use plcc_abi::pmi::{PmiName, PmiTables, Role};

use crate::common::Accessed;
use crate::pmi::access;

/// The variables of a program by their offsets.
#[derive(Clone, Debug)]
pub(super) struct Names {
    /// First offset, bytes of an element, elements (`None` for no array), name; by rising offset.
    symbols: Vec<(u32, u32, Option<u32>, String)>,
    /// Offset of each timer's counter, and the name of its control contact.
    counters: Vec<(u32, String)>,
}

impl Names {
    pub(super) fn new(tables: &PmiTables) -> Self {
        let mut symbols: Vec<_> = tables
            .symbols
            .iter()
            .map(|symbol| (symbol.offset, symbol.ty.size(), symbol.elements, symbol.name.clone()))
            .collect();
        symbols.sort();
        let counters = tables.symbols.iter().filter_map(|symbol| match symbol.role {
            Role::TimerControl(timer) => {
                let timer = tables.timers.get(timer as usize)?;
                Some((timer.counter, symbol.name.clone()))
            }
            _ => None,
        });
        Self { counters: counters.collect(), symbols }
    }

    pub(super) fn name(&self, accessed: Accessed) -> Option<String> {
        let offset = accessed.first;
        if let Some((_, control)) = self.counters.iter().find(|(counter, _)| *counter == offset) {
            return Some(format!("{control}#COUNT"));
        }
        let at = self.symbols.partition_point(|(first, ..)| *first <= offset).checked_sub(1)?;
        let (first, size, elements, name) = self.symbols.get(at)?;
        let index = (offset - first) / (*size).max(1);
        match elements {
            None => (index == 0).then(|| name.clone()),
            Some(count) => (index < *count).then(|| format!("{name}[{index}]")),
        }
    }

    pub(super) fn accessed(&self, text: &str) -> Option<Accessed> {
        let (name, index) = match text.trim().parse().ok()? {
            PmiName::Variable(name) => (name, None),
            PmiName::Element(name, index) => (name, Some(index)),
            PmiName::Counter(control) => {
                let (counter, _) = self.counters.iter().find(|(_, name)| *name == control)?;
                return Some(access::accessed(*counter));
            }
            PmiName::Line(..) => return None,
        };
        let (first, size, elements, _) = self.symbols.iter().find(|(.., known)| *known == name)?;
        let count = elements.unwrap_or(1);
        let (from, to) = match index {
            Some(index) if index >= count => return None,
            Some(index) => (index, index + 1),
            None => (0, count),
        };
        Some(access::range(first + from * size, first + to * size))
    }
}
