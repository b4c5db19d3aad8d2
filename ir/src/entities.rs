//! References to the parts of a module; what they display is the text format's name of them.

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
    /// A value of a function: an instruction's result or a block's parameter.
    Value "v";
    /// An instruction of a function.
    Inst "inst";
    /// A basic block of a function.
    Block "block";
    /// A function of a module.
    Func "fn";
    /// A region of the process image.
    Region "region";
    /// A place of the module that control can pass to from anywhere.
    Label "L";
    /// A statement of the source, an index into the module's list of them.
    SourceLoc "@";
}

impl SourceLoc {
    /// For instructions that belong to no statement.
    pub const NONE: Self = Self(u32::MAX);
}
