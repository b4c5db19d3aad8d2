//! The table of a program's names, those of the executive among them.

use std::collections::HashMap;

use plcc_abi::pmi::Type;
use plcc_diag::Span;

use crate::common::{VariableClass, closest};
use crate::pmi::{
    ast::{Meaning, Symbol, SymbolId},
    read::token::RESERVED,
    reference::executive::{Executive, Variable},
};

/// How many comparisons of names all suggestions ("did you mean") of a program may take together.
/// Each suggestion compares with every name; when the sum is used up, errors have none.
const COMPARISONS: usize = 500_000;

/// All names and what they stand for: the executive's from the start, the program's once they are
/// declared.
#[derive(Debug)]
pub(crate) struct Names {
    symbols: Vec<Symbol>,
    index: HashMap<String, SymbolId>,
    /// How many comparisons suggestions may still take.
    comparisons: usize,
}

impl Names {
    /// A table with the names of the executive alone.
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

    /// The table of a checked program's names.
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

    /// Notes that the program uses the symbol.
    pub(crate) fn mark_named(&mut self, id: SymbolId) {
        if let Some(symbol) = self.get_mut(id) {
            symbol.named = true;
        }
    }

    /// Declares a name of the program.
    ///
    /// # Errors
    /// A name that is declared already: where, or `None` for one of the executive's.
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
            // The name comes from a declaration with an error; this one replaces it.
            Some(slot) if slot.meaning == Meaning::Unknown => {
                *slot = symbol;
                Ok(known)
            }
            slot => Err(slot.and_then(|slot| slot.declared)),
        }
    }

    /// Declares a name about which nothing is known, unless it is declared already. No use of it
    /// will be an error.
    pub(crate) fn declare_unknown(&mut self, name: &str, at: Span) {
        if !RESERVED.contains(&name) && self.find(name).is_none() {
            let _ = self.declare(name, at, Type::Logical, None, Meaning::Unknown);
        }
    }

    /// The label, or else the variable, with the name nearest to `name`, which does not exist.
    pub(crate) fn suggest(&mut self, name: &str, labels: bool) -> Option<String> {
        self.comparisons = self.comparisons.checked_sub(self.symbols.len())?;
        let executive = name.starts_with('@');
        let fitting = self.symbols.iter().filter(|symbol| {
            symbol.executive == executive && matches!(symbol.meaning, Meaning::Label(_)) == labels
        });
        closest(name, fitting.map(|symbol| symbol.name.as_str())).map(str::to_owned)
    }

    /// Lets suggestions take as many comparisons again as those of a whole program.
    pub(crate) fn renew_suggestions(&mut self) {
        self.comparisons = COMPARISONS;
    }

    /// All symbols.
    pub(crate) fn into_symbols(self) -> Vec<Symbol> {
        self.symbols
    }
}
