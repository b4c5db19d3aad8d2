//! What the comments of the source say of its variables.

use plcc_abi::GivenName;

use super::Program;
use super::language::COMMENT_SIGNS;
use crate::common::trailing_comment;

impl Program {
    /// The comments behind the declarations, in the order of the symbols.
    pub(super) fn names_in_source(&self) -> Vec<GivenName> {
        let symbols = self.checked.symbols.iter();
        symbols
            .filter_map(|symbol| {
                let text = trailing_comment(&self.sources, symbol.declared?, COMMENT_SIGNS)?;
                Some(GivenName { name: symbol.name.clone(), text, ..GivenName::default() })
            })
            .collect()
    }
}
