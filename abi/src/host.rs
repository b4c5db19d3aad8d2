//! The functions that program code may call: [`HostFn`], their numbers and signatures.
//!
//! The numbers are in compiled code, also in artifacts and objects, so they stay what they are.
//! Each language has a range of a hundred.

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
        ($($arg:ident),*) $(-> $result:ident)? $(as $form:ident)? $(in $range:ident)?;)*) => {
        /// A function that program code may call. Which one, with which arguments and result, is
        /// said by [`name`](Self::name) and [`signature`](Self::signature); an executive implements
        /// those of its language by [`Host`](crate::Host).
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        #[repr(u32)]
        pub enum HostFn {
            $($(#[$doc])* $name = $number,)*
        }

        impl HostFn {
            /// Every host function.
            pub const ALL: &[Self] = &[$(Self::$name,)*];

            /// The function's name in the IR's text form.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$name => $text,)*
                }
            }

            /// The function with a number, as compiled code passes it; `None` if there is none.
            pub fn from_number(number: u32) -> Option<Self> {
                match number {
                    $($number => Some(Self::$name),)*
                    _ => None,
                }
            }

            /// The types of the arguments, four at most, and that of the result, if it has one.
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

            /// What the function gives for integers; `None` if it is none of the forms.
            pub fn integer_form(self) -> Option<IntegerForm> {
                match self {
                    $(Self::$name => host_fns!(@form $($form)?),)*
                }
            }

            /// What is known of the double that it returns.
            pub fn double_range(self) -> DoubleRange {
                match self {
                    $(Self::$name => host_fns!(@range $($range)?),)*
                }
            }
        }
    };
    (@result) => { None };
    (@result $result:ident) => { Some(HostType::$result) };
    (@pure pure) => { true };
    (@pure effect) => { false };
    (@form) => { None };
    (@form $form:ident) => { Some(IntegerForm::$form) };
    (@range) => { DoubleRange::Any };
    (@range $range:ident) => { DoubleRange::$range };
}

// Each has its number, its name, whether it is pure, and its signature; then, where there is one, its form on
// integers after `as`, and what is known of its result after `in`.
host_fns! {
    /// The exact floating-point remainder with the dividend's sign; 0 where it is not defined (the
    /// divisor is 0, the dividend infinite, or one of them NaN).
    Fmod = 0, "fmod", pure, (F64, F64) -> F64;
    /// NCT 4.14, HF: searches OP in a table. The arguments of all of NCT's functions are the number
    /// of the local variable at which the statement's register area begins, and the value of the
    /// register OP.
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

    /// PMAC: reads an M-variable by its definition as it is now. Its number is taken modulo the
    /// number of M-variables.
    PmacMRead = 100, "pmac_m_read", effect, (I32) -> F64 in Finite;
    /// PMAC: writes an M-variable by its definition as it is now; its number is taken as for
    /// reading.
    PmacMWrite = 101, "pmac_m_write", effect, (I32, F64);
    /// PMAC: reads a word: space (0 X, 1 Y) and address.
    PmacWordRead = 102, "pmac_word_read", effect, (I32, I32) -> I32;
    /// PMAC: writes a word: space (0 X, 1 Y), address, value.
    PmacWordWrite = 103, "pmac_word_write", effect, (I32, I32, I32);
    /// PMAC: assigns to an I-variable, which brings the value into its range. Its number is taken
    /// modulo the number of I-variables.
    PmacIWrite = 104, "pmac_i_write", effect, (I32, F64);
    /// PMAC: enables, disables, pauses or resumes PLC programs: the
    /// [operation](crate::pmac::PlcOp), 1 for PLCCs and 0 for PLCs, the first and the last number.
    PmacPlc = 105, "pmac_plc", effect, (I32, I32, I32, I32);
    /// PMAC: SEND, DISPLAY, COMMAND or a write to the MACRO ring: the index of the
    /// [text](crate::pmac::Text), and the value to display.
    PmacEvent = 106, "pmac_event", effect, (I32, F64);
    /// PMAC: defines M-variables: the index of the [definitions](crate::pmac::Define).
    PmacDefine = 107, "pmac_define", effect, (I32);
    /// PMAC: the command SAVE.
    PmacSave = 108, "pmac_save", effect, ();
    /// PMAC: assigns one value to a range of variables: the [number of their
    /// kind](crate::pmac::Kind::number), the number of the first (of a Q among those of all
    /// coordinate systems), how many there are in the low 16 bits and the difference between the
    /// numbers of two neighbours in the high 16 bits, and the value.
    PmacRangeWrite = 109, "pmac_range_write", effect, (I32, I32, I32, F64);
    /// PMAC: the operator `%`.
    PmacMod = 110, "pmac_mod", pure, (F64, F64) -> F64 as Modulo in Finite;
    /// PMAC: the operator `&`.
    PmacAnd = 111, "pmac_and", pure, (F64, F64) -> F64 as And in Finite;
    /// PMAC: the operator `|`.
    PmacOr = 112, "pmac_or", pure, (F64, F64) -> F64 as Or in Finite;
    /// PMAC: the operator `^`.
    PmacXor = 113, "pmac_xor", pure, (F64, F64) -> F64 as Xor in Finite;
    /// PMAC: SIN. The last argument of this and the other trigonometric functions is 0 for degrees,
    /// anything else for radians.
    PmacSin = 114, "pmac_sin", pure, (F64, I32) -> F64 in FiniteOrMinusZero;
    /// PMAC: COS.
    PmacCos = 115, "pmac_cos", pure, (F64, I32) -> F64 in FiniteOrMinusZero;
    /// PMAC: TAN.
    PmacTan = 116, "pmac_tan", pure, (F64, I32) -> F64 in FiniteOrMinusZero;
    /// PMAC: ASIN.
    PmacAsin = 117, "pmac_asin", pure, (F64, I32) -> F64 in FiniteOrMinusZero;
    /// PMAC: ACOS.
    PmacAcos = 118, "pmac_acos", pure, (F64, I32) -> F64 in FiniteOrMinusZero;
    /// PMAC: ATAN.
    PmacAtan = 119, "pmac_atan", pure, (F64, I32) -> F64 in FiniteOrMinusZero;
    /// PMAC: ATAN2 of a sine and a cosine.
    PmacAtan2 = 120, "pmac_atan2", pure, (F64, F64, I32) -> F64 in FiniteOrMinusZero;
    /// PMAC: SQRT.
    PmacSqrt = 121, "pmac_sqrt", pure, (F64) -> F64 in Finite;
    /// PMAC: LN.
    PmacLn = 122, "pmac_ln", pure, (F64) -> F64 in Finite;
    /// PMAC: EXP.
    PmacExp = 123, "pmac_exp", pure, (F64) -> F64 in Finite;
    /// PMAC: the low 64 bits of a value rounded to an integer.
    PmacBits = 124, "pmac_bits", pure, (F64) -> I64 as Bits;
    /// PMAC: a value as six BCD digits, in 24 bits.
    PmacBcd = 125, "pmac_bcd", pure, (F64) -> I32;
    /// PMAC: a value brought into an integer range: the value, the range's first and its last
    /// number.
    PmacRange = 126, "pmac_range", pure, (F64, F64, F64) -> F64 as Range;
    /// PMAC: executes a statement by the definitions of M-variables as they are now: its index among the
    /// [statements](crate::pmac::Statement). Of a condition it gives whether that holds, 1 or 0; of an
    /// assignment 0.
    PmacStatement = 127, "pmac_statement", effect, (I32) -> I32;
    /// PMAC: whether a [statement of motion](crate::pmac::motion::MotionStatement), by its index, can be calculated
    /// now. If it gives 0 the program is suspended in front of the statement.
    PmacMotionReady = 128, "pmac_motion_ready", effect, (I32) -> I32;
    /// PMAC: a value of the statement of motion that comes next.
    PmacMotionValue = 129, "pmac_motion_value", effect, (F64);
    /// PMAC: carries out a statement of motion, by its index, with the values that were given. If it does not give
    /// 0 the program is suspended behind the statement.
    PmacMotion = 130, "pmac_motion", effect, (I32) -> I32;
    /// PMAC: the number of the motor that a context addresses: the context and the number. Numbers that no motor
    /// has change nothing.
    PmacAddressMotor = 131, "pmac_address_motor", effect, (I32, F64);
}

/// What is known of the double that a host function returns, whatever its operands are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DoubleRange {
    /// Nothing.
    Any,
    /// It is finite, and not -0.
    Finite,
    /// It is finite.
    FiniteOrMinusZero,
}

/// What a pure function on doubles gives where all its operands are integers; -0 is one, and counts as 0.
/// For such operands a compiler may compute with integers instead of calling the function. The result is
/// a double that is not -0, but for [`Bits`](Self::Bits).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum IntegerForm {
    /// The bits that are 1 in both operands, in two's complement, if both are from -2^39 to
    /// 2^39 - 1.
    And,
    /// The bits that are 1 in at least one operand, for operands as for [`And`](Self::And).
    Or,
    /// The bits that differ between the operands, for operands as for [`And`](Self::And).
    Xor,
    /// The remainder by the second operand `x`, from 0 to `x - 1` if that is above 0, and from `x`
    /// to `-x - 1` if it is below 0; for operands from -2^53 to 2^53.
    Modulo,
    /// The operand as an `i64`, which is the function's result type.
    Bits,
    /// The first operand, if it is from the second to the third.
    Range,
}

impl HostFn {
    /// The function with a name of the IR's text form; `None` if there is none.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|function| function.name() == name)
    }
}
