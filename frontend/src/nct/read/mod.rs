//! Makes statements of NCT's text: the cursor, numbers, operands, conditions, what is in
//! parentheses and brackets, statements with a register area, text modules, operations, the parser.

mod area;
mod condition;
pub(crate) mod cursor;
pub(crate) mod diagnostic;
pub(crate) mod group;
pub(crate) mod number;
pub(crate) mod operand;
mod operation;
pub(crate) mod parser;
pub(crate) mod text;
