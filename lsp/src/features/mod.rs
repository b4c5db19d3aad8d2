//! What editors ask, a file for each.

pub(crate) mod call_hierarchy;
pub(crate) mod code_actions;
pub(crate) mod code_lens;
pub(crate) mod completion;
pub(crate) mod diagnostics;
pub(crate) mod folding;
pub(crate) mod formatting;
pub(crate) mod hover;
pub(crate) mod inlay_hints;
pub(crate) mod inline_values;
pub(crate) mod links;
pub(crate) mod machine_file;
pub(crate) mod navigation;
mod open_text;
pub(crate) mod rename;
pub(crate) mod script;
pub(crate) mod selection;
pub(crate) mod semantic_tokens;
pub(crate) mod signature;
pub(crate) mod symbols;
pub(crate) mod values;
