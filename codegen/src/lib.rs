//! IR to machine code, by Cranelift.
//!
//! [`compile`] takes a [`Module`](plcc_ir::Module) and a [`Target`] and gives a
//! [`Code`](plcc_abi::Code): machine code that works at any address, has no relocations and calls
//! nothing but the one entry for host functions in its scan context. It can be copied into memory and run
//! at once ([`JitMemory`]) or put into an artifact. [`emit`] makes listings and objects of the same code.
//! The same lowering makes the code for all of these; only the target differs. Start reading at
//! `compile.rs`, then `lower/mod.rs`.
//!
//! The code can't fault: divisors are guarded, an index outside its range is taken as 0, and a
//! program that is stopped returns its trap code. IR that breaks a rule of the
//! [verifier](plcc_ir::verify) is an [`InternalError`], never code.
//!
//! In this example `plcc_abi::Region` is a region of the image, and `plcc_ir::RegionId` is the number of
//! one in a module:
//!
//! ```
//! use plcc_codegen::{CodegenOptions, Target, compile};
//! use plcc_ir::{Address, ChunkBuilder, InstBuilder, Type};
//!
//! let region = plcc_abi::Region { name: "vars".into(), offset: 0, size: 8, bits: false };
//! let mut builder = ChunkBuilder::new(8, vec![region]);
//! let start = builder.place();
//! builder.bind(start);
//! builder.task("scan", start);
//! let seven = builder.func().constant(Type::I32, 7);
//! builder.func().store(Address::fixed(plcc_ir::RegionId(0), 4), seven);
//! builder.ret();
//! let code = compile(&builder.finish(), &Target::host()?, CodegenOptions::NONE)?;
//! assert_eq!(code.functions.len(), 1);
//! # Ok::<(), plcc_codegen::CodegenError>(())
//! ```

mod compile;
pub mod emit;
mod error;
mod jit_memory;
#[allow(
    clippy::indexing_slicing,
    reason = "functions are verified, and tables have a place for each of their blocks and values"
)]
mod lower;
mod optimization;
mod target;
mod unwind;

pub use compile::{compile, compile_function};
pub use error::{CodegenError, InternalError, MAX_CODE, panic_text};
pub use jit_memory::JitMemory;
pub use optimization::{CodegenOptions, Optimization};
pub use plcc_ir::passes::OptLevel;
pub use target::Target;
