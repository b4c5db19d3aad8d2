//! The text form of a module: what `plcc build --emit ir` prints, and what filetests are written
//! in.
//!
//! ```text
//! image 16
//! region vars at 0 size 8
//! region flags at 8 size 8 bits
//! task "scan" L0 resume [L1]
//!
//! fn "chunk0" {
//! block0 (L0):
//!     @0                                  ;; X = A[I] + 1
//!     v0: i32 = load vars:4
//!     v1: i16 = load vars:0[v0 * 2, 2]    ;; element v0 of 2, 2 bytes apart
//!     v2: i16 = iconst 1
//!     v3: i16 = add v1, v2
//!     store vars:6, v3
//!     v4: i1 = load volatile flags:0
//!     brif v4, block1(v3), block2
//! block1(v5: i16):
//!     v6: i1 = icmp eq v5, v2
//!     v7: i32 = sext v5
//!     v8: f64 = hostcall pmac_m_read(v7)
//!     jump block2
//! block2 (L1):
//!     v9: i1 = load flags:1
//!     brif v9, block3, block4
//! block3 cold:
//!     v10: i32 = iconst 0
//!     v11: i32 = iconst 7
//!     trap_at v10, v11                    ;; at trap site 0, with the index 7
//! block4:
//!     return
//! }
//!
//! trap_site array_bounds file 0 line 1 array 0
//!
//! statement file 0 line 1 from 0 to 12
//! file "x.pmi"
//! | X = A[I] + 1
//! ```
//!
//! - A `;` begins a comment, except inside quotes.
//! - Regions are above the functions. Blocks are numbered from `block0` in the order in which
//!   they stand. A value may be used above its definition.
//! - The names of labels in parentheses after a block's name make it an entry.
//! - `cold` before the colon of a block's head (`block3(v7: i32) cold:`) says that the block seldom
//!   runs, `small` (after `cold` if both are there) that it is to be optimised for size.
//! - `finite` at the end of a region's line (`region p at 0 size 8 finite`) says that the region
//!   holds only doubles that are finite and never -0.
//! - `words24` there says that it holds words of four bytes whose highest byte is 0.
//! - `local_bits 48` after a function's name says that it has that many [local bits](crate::FuncData::local_bits). An access
//!   names one as if they were a region, `local_bits:7`. `unpack v0, local_bits:24[0, 2]` and `v1: i32 = pack
//!   local_bits:24[0, 2]` reach those of groups of eight bits of a word whose bit 0 belongs to `local_bits:24`.
//! - `@N` says that the instructions that follow belong to statement N, `@none` that they belong to
//!   none. It holds until the next such line, also in the blocks that follow.
//! - A task that can be suspended lists the labels at which it goes on, in the order of its resume
//!   points: `task "scan" L0 resume [L1, L2]`.
//! - Trap sites are numbered from 0 in the order in which they stand. `array N` is left out where a
//!   site has no array.
//! - The terminators that the example does not show are `switch V, [BLOCK, …], BLOCK`, `goto L`,
//!   `goto_indirect V`, `suspend L` and `trap CODE`.
//! - A field of an integer is written as the number of its lowest bit and how many bits it has: `extract_u v0, 5, 3`,
//!   `insert v0, v1, 5, 3`. `bit v0, 5` is a single bit.
//! - A double is written as Rust writes it, or as its bits (`0x7ff…`).
//! - A `|` begins a line of a source file's text. There, and in quotes, a backslash is before
//!   `\`, `r` (carriage return), and hexadecimal digits in braces (any other character).
//!
//! The printer numbers values in the order in which they stand, so that text which is printed,
//! read and printed again stays the same.
//!
//! Text is read in three steps, a file each: `lex` cuts it into tokens, `grammar` finds its
//! structure, and `resolve` looks up what its names mean. Only tests and fuzzing read text, so all
//! of this but the printer is behind the feature `text`.

#[cfg(feature = "text")]
mod error;
#[cfg(feature = "text")]
mod grammar;
#[cfg(feature = "text")]
mod lex;
#[cfg(feature = "text")]
mod parse;
mod print;
#[cfg(feature = "text")]
mod resolve;

#[cfg(feature = "text")]
pub use error::ParseError;
#[cfg(feature = "text")]
pub use parse::parse;
pub use print::print;

#[cfg(test)]
mod tests;
