//! Names of the variables that statements access, and whether an access concerns a name.

use std::ops::Range;

use plcc_abi::nct::NctName;
use plcc_abi::pmac::{Controller, Layout, PmacName};
use plcc_abi::pmi::{PmiName, PmiTables, Role};
use plcc_frontend::common::Accessed;

/// A variable whose accesses are looked for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Target {
    /// PMI: the range of offsets of the variable, of the element, or of the whole array.
    Pmi(Range<u32>),
    /// NCT.
    Nct(NctName),
    /// PMAC.
    Pmac(PmacName),
}

impl Target {
    /// What a name means on a PMAC.
    pub(crate) fn pmac(name: &str, controller: Controller) -> Option<Self> {
        let name = PmacName::parse(name, &Layout::new(controller)).ok()?;
        // Statements enable and disable PLCs, but no observer is told that as a write.
        let is_plc = matches!(name, PmacName::Plc { .. });
        (!is_plc).then_some(Self::Pmac(name))
    }

    /// Whether an access is one of this variable. For NCT, an access of a word is also one of its bits, and the
    /// other way round.
    pub fn concerns(&self, accessed: Accessed) -> bool {
        match (self, accessed) {
            (Self::Pmi(offsets), Accessed::Pmi(offset)) => offsets.contains(&offset),
            (Self::Nct(one), Accessed::Nct(other)) => match (flags(*one), flags(other)) {
                (Some((a, bits)), Some((b, others))) => {
                    a == b && bits.start < others.end && others.start < bits.end
                }
                _ => *one == other,
            },
            (Self::Pmac(one), Accessed::Pmac(other)) => *one == other,
            _ => false,
        }
    }
}

/// Of a name of bits (I, Y, F, P, O) its letter, and the range of the bits that it means, where bit `b` of byte
/// `n` has the number `8 * n + b`: one bit, or the 16 bits of a word. `None` for registers.
fn flags(name: NctName) -> Option<(&'static str, Range<u32>)> {
    let (byte, bit) = match name {
        NctName::I { byte, bit }
        | NctName::Y { byte, bit }
        | NctName::P { byte, bit }
        | NctName::O { byte, bit } => (u32::from(byte), bit),
        NctName::F { byte, bit } => (u32::from(byte), bit),
        _ => return None,
    };
    let first = byte * 8;
    let bits = match bit {
        Some(bit) => first + u32::from(bit)..first + u32::from(bit) + 1,
        None => first..first + 16,
    };
    Some((name.letters(), bits))
}

/// The variables of a PMI program by their offsets.
#[derive(Clone, Debug, Default)]
pub(crate) struct PmiPlaces {
    /// First offset, bytes of an element, elements (`None` for no array), name; by rising offset.
    symbols: Vec<(u32, u32, Option<u32>, String)>,
    /// Offset of each timer's counter, and the name of its control contact.
    counters: Vec<(u32, String)>,
}

impl PmiPlaces {
    pub(crate) fn new(tables: &PmiTables) -> Self {
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

    pub(crate) fn name(&self, offset: u32) -> Option<String> {
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

    pub(crate) fn target(&self, text: &str) -> Option<Target> {
        let (name, index) = match text.trim().parse().ok()? {
            PmiName::Variable(name) => (name, None),
            PmiName::Element(name, index) => (name, Some(index)),
            PmiName::Counter(control) => {
                let (counter, _) = self.counters.iter().find(|(_, name)| *name == control)?;
                return Some(Target::Pmi(*counter..counter + 1));
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
        Some(Target::Pmi(first + from * size..first + to * size))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_word_of_nct_meets_its_bits() {
        let name = |text: &str| -> NctName { text.parse().unwrap() };
        let concerns =
            |one: &str, other: &str| Target::Nct(name(one)).concerns(Accessed::Nct(name(other)));
        assert!(concerns("F0203", "F020"));
        assert!(concerns("F0213", "F020"));
        assert!(concerns("F020", "F0207"));
        assert!(!concerns("F0223", "F020"));
        assert!(!concerns("Y012", "I012"));
        assert!(concerns("RH060", "RH060") && !concerns("RH060", "RH061"));
    }
}
