//! References to the parts of a module.
//!
//! Each is the index of what it refers to in a table, as a type of its own, so that a value
//! cannot be taken for a block. They are small, can be copied, and mean something only together
//! with the function or module they belong to. Displayed, they are the names of the text form.
//!
//! | type | table | in text |
//! | --- | --- | --- |
//! | [`Value`] | values of a function | `v3` |
//! | [`Inst`] | instructions of a function | only in messages |
//! | [`Block`] | blocks of a function | `block3` |
//! | [`Func`] | functions of a module | only in messages |
//! | [`RegionId`] | regions of a module | its name |
//! | [`Label`] | labels of a module | `L3` |
//! | [`StatementId`] | statements of a module | `@3` |
//!
//! Such tables are of two kinds, both from `cranelift-entity`:
//!
//! - A [`PrimaryMap`] has an entry for each entity that may be asked for: the tables of a function, and what a pass or the
//!   lowering notes about blocks and values of a function that it does not add any to. To read past its end is a mistake of
//!   the compiler, and panics.
//! - A [`SecondaryMap`] has a default for what it holds no entry for. It is for passes that add values while they run, which
//!   then need not care whether their notes are older than a value. Writing past its end makes it longer, so
//!   [`Value::NONE`] must not be written.

use cranelift_entity::entity_impl;
pub use cranelift_entity::{PrimaryMap, SecondaryMap};

macro_rules! entities {
    ($($(#[$doc:meta])* $name:ident $prefix:literal;)*) => {
        $(
            $(#[$doc])*
            #[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
            pub struct $name(pub u32);

            entity_impl!($name, $prefix);

            impl $name {
                /// The number as an index.
                pub fn index(self) -> usize {
                    self.0 as usize
                }
            }
        )*
    };
}

entities! {
    /// A value of a function: the result of an instruction or a parameter of a block.
    Value "v";
    /// An instruction of a function.
    Inst "inst";
    /// A basic block of a function.
    Block "block";
    /// A function of a module.
    Func "fn";
    /// A region of the process image, or the local bits.
    RegionId "region";
    /// A number that is at a block, through which control can pass to the block from any
    /// function of the module.
    Label "L";
    /// A statement of the source: an index into [`Module::statements`](crate::Module::statements).
    StatementId "@";
}

impl Value {
    /// A value that no function has. The [verifier](crate::verify) refuses it wherever it is used, so that what should
    /// have been computed and was not can't be mistaken for another value.
    pub const NONE: Self = Self(u32::MAX);
}

impl RegionId {
    /// The region of [local bits](crate::FuncData::local_bits), which is not one of the process image.
    pub const LOCAL_BITS: Self = Self(u32::MAX);
}

impl StatementId {
    /// The location of instructions that belong to no statement.
    pub const NONE: Self = Self(u32::MAX);
}
