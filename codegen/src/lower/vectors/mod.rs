//! Vectors: rows of statements that do the same with neighbouring variables (the technique `vectors`).
//!
//! ```text
//! store words:0, add(load words:100, 1)
//! store words:2, add(load words:102, 1)     ==>     one load, one addition and one store
//! …                                                 of eight words
//! store words:14, add(load words:114, 1)
//! ```
//!
//! Each such statement is a *lane* of a *row*. Processors compute 16 bytes at once, so a row has 16
//! truth values or integers of 8 bits, 8 integers of 16 bits, or 4 of 32 bits; it may also have 8 truth
//! values. The IR stays as it is. Before a function is lowered, [`plan`] looks for stores to neighbouring
//! bytes, whose values are computed by the same operations in all lanes (`nodes`). `emit` writes a row's
//! instructions where its last store stands; the instructions that nothing else uses are left out.
//!
//! Operands of the lanes that are neighbours in the image, too, are loaded at once. Others are *gathered*:
//! each is loaded into its place in the vector, which takes one instruction.

mod chains;
mod cost;
mod emit;
mod nodes;
mod plan;
mod row;

pub(super) use plan::plan;
pub(super) use row::Vectors;
