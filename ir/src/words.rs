//! Enumerations by words.

/// Makes an enumeration whose variants each have a word in text.
macro_rules! words {
    ($(#[$doc:meta])* $name:ident { $($(#[$vdoc:meta])* $variant:ident = $text:literal,)* }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum $name {
            $($(#[$vdoc])* $variant,)*
        }

        impl $name {
            /// Every one, in the order of definition.
            pub const ALL: &[Self] = &[$(Self::$variant,)*];

            /// Its word in text.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $text,)*
                }
            }

            /// The one with this word; `None` if there is none.
            pub fn from_name(name: &str) -> Option<Self> {
                Self::ALL.iter().copied().find(|op| op.name() == name)
            }
        }
    };
}

/// Makes an enumeration of operations by [`words`], with a table of what each takes: after `on` the [`Operands`], and
/// `commutative` if they can be exchanged.
macro_rules! operations {
    ($(#[$doc:meta])* $name:ident { $($(#[$vdoc:meta])* $variant:ident = $text:literal on $operands:ident $($commutative:ident)?,)* }) => {
        words! {
            $(#[$doc])* $name { $($(#[$vdoc])* $variant = $text,)* }
        }

        impl $name {
            /// What it takes.
            pub fn operands(self) -> Operands {
                match self {
                    $(Self::$variant => Operands::$operands,)*
                }
            }

            /// Whether its operands can be exchanged. Doubles are left in their order, since the order
            /// decides which NaN comes out of two.
            pub fn is_commutative(self) -> bool {
                match self {
                    $(Self::$variant => operations!(@commutative $($commutative)?),)*
                }
            }
        }
    };
    (@commutative) => { false };
    (@commutative commutative) => { true };
}

pub(crate) use {operations, words};
