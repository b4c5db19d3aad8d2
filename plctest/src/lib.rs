//! Test scripts for PLC programs (`*.plctest`).
//!
//! ```
//! use plcc_diag::SourceMap;
//! use plcc_plctest::parse;
//!
//! let mut sources = SourceMap::new();
//! let script = b"program \"pump.pmi\"\ntest \"the pump starts\"\n  set START = 1\n  wait until PUMP within 1 s\nend\n";
//! let file = sources.add("pump.plctest", script);
//! let (script, mistakes) = parse(&sources, file);
//! assert!(mistakes.is_empty());
//! assert_eq!(script.tests.first().map(|test| test.statements.len()), Some(2));
//! ```

mod claim;
mod condition;
pub mod coverage;
mod grammar;
mod parse;
mod plan;
pub mod report;
mod run;
pub mod script;
mod told;

pub use claim::{Breach, Claim, Progress};
pub use condition::{Comparison, Condition, Relation, Surroundings};
pub use grammar::{KEYWORDS, form};
pub use parse::parse;
pub use plan::{Act, Invariant, Plan, PlannedStatement, PlannedTest, Step};
pub use run::{Failure, Outcome, Station, run_test, run_through};
pub use told::Told;
