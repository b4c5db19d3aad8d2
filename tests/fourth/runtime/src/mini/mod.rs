//! The control of MINI: every 10 ms a scan.

mod executive;
mod names;

use std::sync::Arc;

use plcc_abi::mini::{Kind, MiniTables};
use plcc_abi::{Program, Tables};

use crate::control::Control;
use crate::names::Names;
use crate::online_change::{Comparison, Plan, Row};
use crate::table_check::Image;

pub use executive::MiniExecutive;

/// What an online change copies: offsets in the old image and in the new one, and a length.
type Copies = Vec<(u32, u32, u32)>;

/// The bytes of a variable.
fn size(kind: Kind) -> u32 {
    if kind == Kind::Number { 4 } else { 1 }
}

impl Control for MiniTables {
    fn validate(&self, program: &Program) -> Result<(), String> {
        let image = Image::new(program.image_size);
        self.symbols.iter().try_for_each(|one| image.check(one.offset, size(one.kind), &one.name))
    }

    fn names(&self, _: &Program) -> Arc<dyn Names> {
        Arc::new(names::MiniNames::new(self))
    }

    fn compare(&self, _: &Program, new: &Program) -> Option<Result<Comparison, String>> {
        let Tables::Mini(new) = &new.tables else { return None };
        let mut copies = Copies::new();
        let mut rows = vec![];
        for symbol in &new.symbols {
            let was = self.symbols.iter().find(|was| was.name == symbol.name);
            let text = |kind: Kind| format!("{kind:?}");
            rows.extend(Row::of(&symbol.name, was.map(|was| text(was.kind)), Some(text(symbol.kind))));
            if let Some(was) = was.filter(|was| was.kind == symbol.kind) {
                copies.push((was.offset, symbol.offset, size(symbol.kind)));
            }
        }
        Some(Ok(Comparison { kept: copies.len(), rows, plan: Plan::new(copies) }))
    }
}
