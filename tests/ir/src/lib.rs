//! What tests of the IR share: random modules ([`gen_ir`]), and the passes as they are for long
//! programs ([`as_if_long`]). The tests are in `tests/ir/`, the programs in `filetests/`.
//!
//! They are a package of their own, so that after a change of a pass the compiler alone is built
//! again before they run, and not all that is made with it.
//!
//! ```
//! use plcc_ir::interp::Interpreter;
//! use plcc_ir_tests::gen_ir::{generate, trace};
//!
//! // A random module, and what its scans do, which no pass may change.
//! let wanted = trace(&mut Interpreter::new(generate(7)), 7);
//! let mut optimised = generate(7);
//! plcc_ir_tests::as_if_long().run(&mut optimised);
//! assert_eq!(trace(&mut Interpreter::new(optimised), 7), wanted);
//! ```
#![allow(clippy::indexing_slicing)]

use plcc_abi::{Program, Tables};
use plcc_codegen::Optimization;
use plcc_ir::Module;

pub mod gen_ir;

/// What an engine needs to know of a module's program.
pub fn program_of(module: &Module) -> Program {
    Program {
        image_size: module.image_size,
        regions: module.regions.clone(),
        tasks: module.tasks.clone(),
        tables: Tables::Pmi(Default::default()),
        files: vec![],
        names: vec![],
    }
}

/// What is done in long programs, also in short ones.
pub fn as_if_long() -> Optimization {
    let mut as_if_long = Optimization::ALL;
    as_if_long.passes.by_length = false;
    as_if_long
}
