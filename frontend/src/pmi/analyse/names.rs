//! The names of a program.

use std::collections::HashMap;

use plcc_abi::pmi::Type;
use plcc_diag::Span;

use crate::common::{VariableClass, closest};
use crate::pmi::{
    ast::{Meaning, Symbol, SymbolId},
    reference::executive::{Executive, Variable},
};

/// Names that no program may declare (PMI 2.2.3).
pub(crate) const RESERVED: [&str; 7] = ["IF", "ELSE", "ELSEIF", "ENDIF", "GOTO", "T", "F"];

/// How many names all suggestions of a program may be compared with; each costs a walk over all
/// there are.
const COMPARISONS: usize = 500_000;

/// All names: the executive's from the start, the program's as they are declared.
pub(crate) struct Names {
    symbols: Vec<Symbol>,
    index: HashMap<String, SymbolId>,
    comparisons: usize,
}

impl Names {
    /// The executive's names.
    pub(crate) fn new(executive: &Executive) -> Self {
        let mut this = Self { symbols: vec![], index: HashMap::new(), comparisons: COMPARISONS };
        for variable in executive.variables() {
            let Variable { name, ty, class, elements } = variable.clone();
            let meaning = match class {
                VariableClass::ReadOnly => Meaning::ReadOnly,
                VariableClass::ReadWrite => Meaning::Variable,
                VariableClass::ResetOnly => Meaning::ResetOnly,
            };
            this.push(Symbol {
                name,
                ty,
                elements,
                meaning,
                declared: None,
                named: false,
                executive: true,
            });
        }
        this
    }

    /// The names of a checked program.
    pub(crate) fn of(symbols: &[Symbol]) -> Self {
        let mut this = Self { symbols: vec![], index: HashMap::new(), comparisons: COMPARISONS };
        for symbol in symbols {
            this.push(symbol.clone());
        }
        this
    }

    fn push(&mut self, symbol: Symbol) -> SymbolId {
        let id = SymbolId(self.symbols.len() as u32);
        self.index.insert(symbol.name.clone(), id);
        self.symbols.push(symbol);
        id
    }

    /// Finds a name.
    pub(crate) fn find(&self, name: &str) -> Option<SymbolId> {
        self.index.get(name).copied()
    }

    /// A symbol.
    pub(crate) fn get(&self, id: SymbolId) -> Option<&Symbol> {
        self.symbols.get(id.0 as usize)
    }

    /// A symbol, to be changed.
    pub(crate) fn get_mut(&mut self, id: SymbolId) -> Option<&mut Symbol> {
        self.symbols.get_mut(id.0 as usize)
    }

    /// Notes that the program names the symbol.
    pub(crate) fn mark_named(&mut self, id: SymbolId) {
        if let Some(symbol) = self.get_mut(id) {
            symbol.named = true;
        }
    }

    /// Declares a name of the program; one that exists is the error's other place.
    pub(crate) fn declare(
        &mut self,
        name: &str,
        at: Span,
        ty: Type,
        elements: Option<u32>,
        meaning: Meaning,
    ) -> Result<SymbolId, Option<Span>> {
        let symbol = Symbol {
            name: name.to_owned(),
            ty,
            elements,
            meaning,
            declared: Some(at),
            named: true,
            executive: name.starts_with('@'),
        };
        let Some(known) = self.find(name) else { return Ok(self.push(symbol)) };
        match self.get_mut(known) {
            // What a faulty statement left may be declared properly.
            Some(slot) if slot.meaning == Meaning::Unknown => {
                *slot = symbol;
                Ok(known)
            }
            slot => Err(slot.and_then(|slot| slot.declared)),
        }
    }

    /// Declares a name about which nothing is known, so that its uses are no further errors.
    pub(crate) fn declare_unknown(&mut self, name: &str, at: Span) {
        if !RESERVED.contains(&name) && self.find(name).is_none() {
            let _ = self.declare(name, at, Type::Logical, None, Meaning::Unknown);
        }
    }

    /// The name nearest to one that does not exist.
    pub(crate) fn suggest(&mut self, name: &str, labels: bool) -> Option<String> {
        self.comparisons = self.comparisons.checked_sub(self.symbols.len())?;
        let executive = name.starts_with('@');
        let fitting = self.symbols.iter().filter(|symbol| {
            symbol.executive == executive && matches!(symbol.meaning, Meaning::Label(_)) == labels
        });
        closest(name, fitting.map(|symbol| symbol.name.as_str())).map(str::to_owned)
    }

    /// All symbols.
    pub(crate) fn into_symbols(self) -> Vec<Symbol> {
        self.symbols
    }
}
