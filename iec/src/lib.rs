//! Programs of IEC 61131-3 as data, and how they are written: as Structured Text, and as PLCopen XML (TC6, version 2.01).
//!
//! A front end fills a [`Project`]: the variables, the statements and the [`Function`]s that these call. The other modules
//! help it: [`Names`] makes identifiers, [`Expression`] puts operators and parentheses, [`Flow`] makes IFs of jumps, or where
//! there are none, a CASE in a loop.
//!
//! Architecture Invariant: nothing here knows a language or a control.
//!
//! ```
//! use plcc_iec::{Expression, Level, Project, Type, Variable, structured_text};
//!
//! let value = Expression::name("START").infix("OR", Level::Or, Expression::name("PUMP"));
//! let project = Project {
//!     name: "COOLANT".into(),
//!     comments: vec![],
//!     variables: vec![Variable::local("START", Type::Bool, "the button"), Variable::local("PUMP", Type::Bool, "")],
//!     body: vec![format!("PUMP := {};", value.into_text())],
//!     interval_us: 20_000,
//! };
//! let text = structured_text(&project);
//! assert!(text.contains("START : BOOL; (* the button *)") && text.contains("PUMP := START OR PUMP;"));
//! ```
//!
//! What is written rests only on what all compilers of the standard agree on: no conversion rounds, shortens or reinterprets,
//! no arithmetic overflows, no index is outside its array, and no literal has a sign of its own.

mod expression;
mod flow;
pub mod functions;
mod names;
mod plcopen;
mod project;
mod text;

pub use expression::{Expression, Level, literal};
pub use flow::{Flow, Item, NOTHING, Step};
pub use names::Names;
pub use plcopen::plcopen;
pub use project::{Function, Kind, Project, Type, Variable};
pub use text::{comment, structured_text};
