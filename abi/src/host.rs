//! The functions that program code may call.

/// A type of a host function's argument or result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HostType {
    /// 32 bits.
    I32,
    /// 64 bits.
    I64,
    /// An IEEE double.
    F64,
}

macro_rules! host_fns {
    ($($(#[$doc:meta])* $name:ident = $number:literal, $text:literal, $pure:ident,
        ($($arg:ident),*) $(-> $result:ident)?;)*) => {
        /// A function of the host.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        #[repr(u32)]
        pub enum HostFn {
            $($(#[$doc])* $name = $number,)*
        }

        impl HostFn {
            /// Every host function.
            pub const ALL: &[Self] = &[$(Self::$name,)*];

            /// The function's word in the IR's text form.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$name => $text,)*
                }
            }

            /// The function of a number, as compiled code passes it.
            pub fn from_number(number: u32) -> Option<Self> {
                match number {
                    $($number => Some(Self::$name),)*
                    _ => None,
                }
            }

            /// Argument types (four at most) and the result's type.
            pub fn signature(self) -> (&'static [HostType], Option<HostType>) {
                match self {
                    $(Self::$name => (&[$(HostType::$arg),*], host_fns!(@result $($result)?)),)*
                }
            }

            /// Whether the result depends on nothing but the arguments and nothing else happens:
            /// such calls may be merged, moved and dropped. Any other may read and write the
            /// whole image.
            pub fn is_pure(self) -> bool {
                match self {
                    $(Self::$name => host_fns!(@pure $pure),)*
                }
            }
        }
    };
    (@result) => { None };
    (@result $result:ident) => { Some(HostType::$result) };
    (@pure pure) => { true };
    (@pure effect) => { false };
}

host_fns! {
    /// The exact floating-point remainder with the dividend's sign, 0 where there is none.
    Fmod = 0, "fmod", pure, (F64, F64) -> F64;
    /// NCT 4.14, HF: searches OP in a table. Like all of NCT's with the number of the local
    /// variable where the statement's register area begins, and OP, which none changes.
    NctHf = 200, "nct_hf", effect, (I32, I32);
    /// NCT 4.14, PF: searches a free tool pot of OP's width.
    NctPf = 201, "nct_pf", effect, (I32, I32);
    /// NCT 4.15, MR: reads a macro variable or parameter.
    NctMr = 202, "nct_mr", effect, (I32, I32);
    /// NCT 4.15, MW: writes a macro variable or parameter.
    NctMw = 203, "nct_mw", effect, (I32, I32);
    /// NCT 4.16, ADD.
    NctAdd = 204, "nct_add", effect, (I32, I32);
    /// NCT 4.16, SUB.
    NctSub = 205, "nct_sub", effect, (I32, I32);
    /// NCT 4.16, MUL.
    NctMul = 206, "nct_mul", effect, (I32, I32);
    /// NCT 4.16, DIV.
    NctDiv = 207, "nct_div", effect, (I32, I32);
    /// NCT 4.16, CMP.
    NctCmp = 208, "nct_cmp", effect, (I32, I32);
}

impl HostFn {
    /// Finds a function by its word in the IR's text form.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|function| function.name() == name)
    }
}
