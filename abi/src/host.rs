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

    /// PMAC: reads an M-variable (its number wraps) by its definition as it is now.
    PmacMRead = 100, "pmac_m_read", effect, (I32) -> F64;
    /// PMAC: writes an M-variable (its number wraps) by its definition as it is now.
    PmacMWrite = 101, "pmac_m_write", effect, (I32, F64);
    /// PMAC: reads a word: space (0 X, 1 Y) and address.
    PmacWordRead = 102, "pmac_word_read", effect, (I32, I32) -> I32;
    /// PMAC: writes a word: space (0 X, 1 Y), address, value.
    PmacWordWrite = 103, "pmac_word_write", effect, (I32, I32, I32);
    /// PMAC: assigns to an I-variable (its number wraps), which takes the value into its range.
    PmacIWrite = 104, "pmac_i_write", effect, (I32, F64);
    /// PMAC: enables, disables, pauses or resumes: [operation](crate::pmac::PlcOp), whether
    /// PLCCs are meant, first and last number.
    PmacPlc = 105, "pmac_plc", effect, (I32, I32, I32, I32);
    /// PMAC: SEND, DISPLAY, COMMAND or a write to the MACRO ring: the index of the
    /// [text](crate::pmac::Text), and the value to display.
    PmacEvent = 106, "pmac_event", effect, (I32, F64);
    /// PMAC: makes the [definitions](crate::pmac::Define) of an index.
    PmacDefine = 107, "pmac_define", effect, (I32);
    /// PMAC: SAVE.
    PmacSave = 108, "pmac_save", effect, ();
    /// PMAC: `%`.
    PmacMod = 110, "pmac_mod", pure, (F64, F64) -> F64;
    /// PMAC: `&`.
    PmacAnd = 111, "pmac_and", pure, (F64, F64) -> F64;
    /// PMAC: `|`.
    PmacOr = 112, "pmac_or", pure, (F64, F64) -> F64;
    /// PMAC: `^`.
    PmacXor = 113, "pmac_xor", pure, (F64, F64) -> F64;
    /// PMAC: SIN, in radians where the second is not 0; so are all that follow with two.
    PmacSin = 114, "pmac_sin", pure, (F64, I32) -> F64;
    /// PMAC: COS.
    PmacCos = 115, "pmac_cos", pure, (F64, I32) -> F64;
    /// PMAC: TAN.
    PmacTan = 116, "pmac_tan", pure, (F64, I32) -> F64;
    /// PMAC: ASIN.
    PmacAsin = 117, "pmac_asin", pure, (F64, I32) -> F64;
    /// PMAC: ACOS.
    PmacAcos = 118, "pmac_acos", pure, (F64, I32) -> F64;
    /// PMAC: ATAN.
    PmacAtan = 119, "pmac_atan", pure, (F64, I32) -> F64;
    /// PMAC: ATAN2 of a sine and a cosine.
    PmacAtan2 = 120, "pmac_atan2", pure, (F64, F64, I32) -> F64;
    /// PMAC: SQRT.
    PmacSqrt = 121, "pmac_sqrt", pure, (F64) -> F64;
    /// PMAC: LN.
    PmacLn = 122, "pmac_ln", pure, (F64) -> F64;
    /// PMAC: EXP.
    PmacExp = 123, "pmac_exp", pure, (F64) -> F64;
    /// PMAC: a value rounded to an integer, the low 64 bits of it.
    PmacBits = 124, "pmac_bits", pure, (F64) -> I64;
    /// PMAC: the bits of a value as BCD, six digits.
    PmacBcd = 125, "pmac_bcd", pure, (F64) -> I32;
    /// PMAC: a value taken into an integer range, its ends included.
    PmacRange = 126, "pmac_range", pure, (F64, F64, F64) -> F64;
}

impl HostFn {
    /// Finds a function by its word in the IR's text form.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|function| function.name() == name)
    }
}
