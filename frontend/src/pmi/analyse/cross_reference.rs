//! The cross-reference: where each variable is read, written and tested.

use plcc_diag::{FileId, SourceMap};

use crate::common::{CrossReference, CrossReferenceBuilder, Use};
use crate::pmi::ast::{Action, Checked, Item, Op, Ops, SymbolId, Target};
use crate::pmi::reference::executive;

/// Makes the cross-reference of a program. An array counts as one variable. A variable in the text
/// of a fault or message counts as read in the line that declares the fault or message.
pub(crate) fn cross_reference(checked: &Checked, sources: &SourceMap) -> CrossReference {
    let mut finder = Finder { checked, sources, found: CrossReferenceBuilder::default() };
    for step in &checked.steps {
        let file = step.span.file;
        match &step.action {
            Action::Assign { target, value } => {
                let symbol = match target {
                    Target::Scalar(symbol) | Target::At(symbol, _) => symbol,
                    Target::Element(symbol, index) => {
                        finder.operands(index, file, step.line, Use::Read);
                        symbol
                    }
                };
                finder.operands(value, file, step.line, Use::Read);
                finder.add(*symbol, file, step.line, Use::Written);
            }
            Action::If { condition, .. } => {
                finder.operands(condition, file, step.line, Use::Tested);
            }
            Action::Jump { .. } => {}
        }
    }
    for announcement in checked.faults.iter().chain(&checked.messages) {
        let symbol = checked.symbol(announcement.symbol);
        let Some(place) = symbol.and_then(|symbol| symbol.declared) else { continue };
        let line = sources.line(place.file, place.start);
        for item in &announcement.items {
            if let Item::Value(symbol) = item {
                finder.add(*symbol, place.file, line, Use::Read);
            }
        }
    }
    finder.found.finish(|name| executive::meaning(name).map(str::to_owned))
}

struct Finder<'a> {
    checked: &'a Checked,
    sources: &'a SourceMap,
    found: CrossReferenceBuilder,
}

impl Finder<'_> {
    /// Adds a use of a variable.
    fn add(&mut self, id: SymbolId, file: FileId, line: u32, used: Use) {
        if let Some(symbol) = self.checked.symbol(id) {
            self.found.add(&symbol.name, self.sources, file, line, used);
        }
    }

    /// Adds the variables of an expression.
    fn operands(&mut self, ops: &Ops, file: FileId, line: u32, used: Use) {
        let checked = self.checked;
        for op in checked.ops(ops) {
            if let Op::Load(symbol) | Op::LoadAt(symbol, _) | Op::Element(symbol) = *op {
                self.add(symbol, file, line, used);
            }
        }
    }
}
