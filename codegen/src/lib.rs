//! Verified IR to machine code, by Cranelift.
//!
//! There is one lowering. What comes out is a [`Code`](plcc_abi::Code): position-independent,
//! without relocations, calling nothing but the host through its context, so it can be mapped at
//! once (the JIT) or put into an artifact (ahead of time); only the [`Target`] differs.
//!
//! Nothing in it can fault: divisors are guarded, indices are clamped, and
//! a program that is stopped returns its trap code.

mod compile;
pub mod emit;
mod error;
mod jit_memory;
#[allow(
    clippy::indexing_slicing,
    reason = "functions are verified, and tables have a place for each of their blocks and values"
)]
mod lower;
mod target;
mod unwind;

pub use compile::{compile, compile_function};
pub use error::{CodegenError, InternalError};
pub use jit_memory::JitMemory;
pub use plcc_ir::passes::OptLevel;
pub use target::Target;
