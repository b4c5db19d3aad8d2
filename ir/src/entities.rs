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

use std::fmt;

macro_rules! entities {
    ($($(#[$doc:meta])* $name:ident $prefix:literal;)*) => {
        $(
            $(#[$doc])*
            #[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
            pub struct $name(pub u32);

            impl $name {
                /// The number as an index.
                pub fn index(self) -> usize {
                    self.0 as usize
                }
            }

            impl fmt::Display for $name {
                fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                    write!(f, concat!($prefix, "{}"), self.0)
                }
            }

            impl fmt::Debug for $name {
                fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                    fmt::Display::fmt(self, f)
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
    /// A number that stands at a block, through which control can pass to the block from any
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
    /// The region of [local bits](crate::Module::local_bits), which is not one of the process image.
    pub const LOCAL_BITS: Self = Self(u32::MAX);
}

impl StatementId {
    /// The location of instructions that belong to no statement.
    pub const NONE: Self = Self(u32::MAX);
}
