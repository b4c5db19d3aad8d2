//! The intermediate representation (IR) between the three front ends and code generation, in
//! static single assignment form.
//!
//! A [`Module`] is what a front end makes of a program: [regions](plcc_abi::Region) of the
//! process image, functions, and tasks that start at labels. Every operation is total: it has
//! one result for all operands, and nothing can fault. A program is stopped by a terminator with
//! a trap code, never by an instruction.
//!
//! # Shape
//! - A function ([`FuncData`]) is one chunk of a program: basic blocks with parameters, some of
//!   them entries with a [`Label`]. Labels are numbered through the whole module. Control passes
//!   between functions by label only and takes no values along; what must outlive such a passage
//!   is in the process image.
//! - Types are `i1 i8 i16 i32 i64 f64`. Integers wrap around. [`inst`] defines the result of each
//!   operation, corner cases included, and [`eval`] computes it.
//! - A load or store names its region and its offset there, so two accesses either overlap or do
//!   not, and no pass needs any other alias analysis. A `volatile` access is never moved, merged
//!   or dropped.
//!
//! # Main types
//! [`ChunkBuilder`] is what front ends write with: it cuts long programs into functions.
//! [`FuncBuilder`] writes a single function. [`passes::optimize`] makes a module faster,
//! [`verify::verify`] reports what is wrong with one, [`text`] prints and reads it, and
//! [`Interpreter`] runs it as it is. Start reading at [`inst`], then [`func`], [`chunk`] and
//! [`passes`].
//!
//! # Example
//! A program that counts its scans:
//!
//! ```
//! use plcc_abi::{Engine, Outcome, Region, Scan, engine::NoHost};
//! use plcc_ir::{
//!     Address, BinaryOp, ChunkBuilder, InstBuilder, Interpreter, Type, passes, verify::verify,
//! };
//!
//! let regions = vec![Region { name: "vars".into(), offset: 0, size: 4, bits: false }];
//! let mut b = ChunkBuilder::new(4, regions);
//! let counter = Address::fixed(b.region("vars").unwrap(), 0);
//! let start = b.place();
//! b.bind(start);
//! b.task("scan", start);
//! let old = b.func().load(Type::I32, counter);
//! let new = b.func().binary_imm(BinaryOp::Add, old, 1);
//! b.func().store(counter, new);
//! b.ret();
//! let mut module = b.finish();
//! passes::optimize(&mut module, passes::OptLevel::Speed);
//! assert_eq!(verify(&module), []);
//!
//! let mut image = [0; 4];
//! let mut engine = Interpreter::new(module);
//! let outcome = engine.call(0, None, &mut Scan::new(&mut image, &mut NoHost));
//! assert_eq!((outcome, image[0]), (Outcome::End, 1));
//! ```

pub mod address;
#[allow(clippy::indexing_slicing, reason = "entities come from the function or builder itself")]
pub mod builder;
#[allow(clippy::indexing_slicing, reason = "entities come from the function or builder itself")]
pub mod chunk;
pub mod entities;
pub mod eval;
pub mod field;
#[allow(clippy::indexing_slicing, reason = "entities come from the function or builder itself")]
pub mod func;
pub mod inst;
mod inst_builder;
pub mod interp;
pub mod memory;
pub mod module;
pub mod operation;
mod parts;
#[allow(
    clippy::indexing_slicing,
    reason = "passes see verified functions, whose entities index tables made for them"
)]
pub mod passes;
pub mod tables;
pub mod text;
pub mod threads;
pub mod types;
pub mod verify;
mod words;

pub use address::{Address, BitGroups, Index};
pub use builder::FuncBuilder;
pub use chunk::{ChunkBuilder, Place};
pub use entities::{
    Block, Func, Inst, Label, PrimaryMap, RegionId, SecondaryMap, StatementId, Value,
};
pub use field::{ExtractOp, Field};
pub use func::{BlockCall, BlockData, FuncData, Terminator, ValueDef};
pub use inst::{Args, InstData};
pub use inst_builder::{InstBuilder, ROUNDING};
pub use interp::Interpreter;
pub use module::{Module, SourceFile, Statement};
pub use operation::{BinaryOp, ConvertOp, FloatCond, IntCond, Operands, UnaryOp};
pub use types::Type;
