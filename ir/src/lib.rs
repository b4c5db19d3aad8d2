//! The SSA intermediate representation.
//!
//! A [`Module`] is what a front end makes of a program: [regions](plcc_abi::Region) of the
//! process image, functions, and tasks that start at labels. Every operation is total: it has
//! one result for all operands, and nothing can fault. What stops a program is a terminator with
//! a code.
//!
//! # Shape
//! - A function is a chunk of a program: basic blocks with parameters, some of them entries with
//!   a [`Label`]. Labels are numbered through the module, and control passes between functions by
//!   label only, without values; whatever outlives a block that ends so lives in the image.
//! - Types are `i1 i8 i16 i32 i64 f64`. Integers wrap. [`inst`] gives each operation's result,
//!   the corner cases too.
//! - An access names its region and offset, so two accesses overlap or they do not; nothing else
//!   needs to be asked. One that is `volatile` is never moved, merged or dropped.
//!
//! # Use
//! A front end writes through [`chunk::ChunkBuilder`], which cuts long programs into functions.
//! [`passes::optimize`] makes a module faster, [`verify::verify`] says what is wrong with one,
//! [`text`] prints and reads it, and [`interp::Interpreter`] runs it as it stands.

pub mod builder;
pub mod chunk;
pub mod entities;
pub mod eval;
pub mod func;
pub mod inst;
pub mod interp;
pub mod module;
pub mod passes;
pub mod text;
pub mod types;
pub mod verify;

pub use builder::FuncBuilder;
pub use chunk::{ChunkBuilder, Place};
pub use entities::{Block, Func, Inst, Label, Region, SourceLoc, Value};
pub use func::{BlockCall, BlockData, FuncData, Terminator, ValueDef};
pub use inst::{Address, Args, BinaryOp, ConvertOp, FloatCond, Index, InstData, IntCond, UnaryOp};
pub use interp::Interpreter;
pub use module::{Module, SourceFile, Statement};
pub use types::Type;
