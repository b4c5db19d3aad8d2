//! What each operation of the PMI language gives (PMI 2.3.3.7 and the rulings).
//!
//! All operations work on 32-bit values and have a result for all operands; truth is 1, and
//! falsehood is 0. The compiler's constant folding, the statement interpreter and conditions of
//! breakpoints and watches compute by these functions; code generation has the same rules in the IR.

use super::Type;

/// A binary operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Binary {
    /// Sum.
    Add {
        /// Whether it keeps 32 bits; otherwise it keeps 16.
        long: bool,
    },
    /// Difference.
    Sub {
        /// Whether it keeps 32 bits; otherwise it keeps 16.
        long: bool,
    },
    /// Product.
    Mul {
        /// Whether it keeps 32 bits, as the dividend of a division does; otherwise it keeps 16.
        wide: bool,
    },
    /// Quotient, of 16 bits, truncated toward 0; the left operand where the right one is 0.
    Div,
    /// Remainder, of 16 bits; the left operand where the right one is 0.
    Rem,
    /// Whether the left operand equals the right one.
    Eq,
    /// Whether it differs.
    Ne,
    /// Whether it is less.
    Lt,
    /// Whether it is less or equal.
    Le,
    /// Whether it is greater.
    Gt,
    /// Whether it is greater or equal.
    Ge,
    /// Whether neither operand is 0.
    And,
    /// Whether one of the operands is not 0.
    Or,
}

/// The low 16 bits, as a signed number.
fn low16(value: i32) -> i32 {
    i32::from(value as i16)
}

/// A result as a LONG, or as an INTEGER, which keeps its low 16 bits.
fn long_or_integer(value: i32, long: bool) -> i32 {
    if long { value } else { low16(value) }
}

/// A binary operation's result.
pub fn binary(op: Binary, a: i32, b: i32) -> i32 {
    match op {
        Binary::Add { long } => long_or_integer(a.wrapping_add(b), long),
        Binary::Sub { long } => long_or_integer(a.wrapping_sub(b), long),
        Binary::Mul { wide } => long_or_integer(a.wrapping_mul(b), wide),
        Binary::Div if b == 0 => low16(a),
        Binary::Div => low16(a.wrapping_div(b)),
        Binary::Rem if b == 0 => low16(a),
        Binary::Rem => low16(a.wrapping_rem(b)),
        Binary::Eq => i32::from(a == b),
        Binary::Ne => i32::from(a != b),
        Binary::Lt => i32::from(a < b),
        Binary::Le => i32::from(a <= b),
        Binary::Gt => i32::from(a > b),
        Binary::Ge => i32::from(a >= b),
        Binary::And => i32::from(a != 0) & i32::from(b != 0),
        Binary::Or => i32::from(a != 0) | i32::from(b != 0),
    }
}

/// A negation's result, of 32 bits where it is `long`, and of 16 otherwise.
pub fn negate(value: i32, long: bool) -> i32 {
    long_or_integer(value.wrapping_neg(), long)
}

/// A value as a variable of the type takes it: truth for LOGICALs, the low 16 bits for INTEGERs.
pub fn convert(value: i32, ty: Type) -> i32 {
    match ty {
        Type::Logical => i32::from(value != 0),
        Type::Integer => low16(value),
        Type::Long => value,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// PMI 2.3.3.5: the quotient is truncated; 2.3.3.6: 11 % 5 is 1; 2.3.7: no operation by zero.
    #[test]
    fn division_truncates_and_division_by_zero_leaves_the_dividend() {
        for (a, b, quotient, remainder) in [
            (11, 5, 2, 1),
            (-11, 5, -2, -1),
            (11, -5, -2, 1),
            (-11, -5, 2, -1),
            (7, 0, 7, 7),
            (70_000, 0, 4_464, 4_464),
            (100_000, 1, -31_072, 0),
            (i32::MIN, -1, 0, 0),
            (9_000_000, 1000, 9000, 0),
        ] {
            assert_eq!(binary(Binary::Div, a, b), quotient, "{a} / {b}");
            assert_eq!(binary(Binary::Rem, a, b), remainder, "{a} % {b}");
        }
    }

    /// PMI 2.3.3.7: INTEGER results keep 16 bits, LONG ones 32.
    #[test]
    fn integer_results_keep_16_bits_and_long_results_32() {
        for (op, a, b, result) in [
            (Binary::Add { long: false }, 32_767, 1, -32_768),
            (Binary::Add { long: true }, 32_767, 1, 32_768),
            (Binary::Add { long: true }, i32::MAX, 1, i32::MIN),
            (Binary::Sub { long: false }, -32_768, 1, 32_767),
            (Binary::Mul { wide: false }, 300, 300, 24_464),
            (Binary::Mul { wide: true }, 300, 300, 90_000),
            (Binary::Mul { wide: true }, -32_768, -32_768, 1_073_741_824),
        ] {
            assert_eq!(binary(op, a, b), result, "{op:?} {a} {b}");
        }
        assert_eq!(negate(-32_768, false), -32_768);
        assert_eq!(negate(-32_768, true), 32_768);
        assert_eq!(negate(i32::MIN, true), i32::MIN);
    }

    /// PMI 2.3.1: operands other than LOGICAL are true where they are not zero.
    #[test]
    fn logic_and_relations() {
        for (op, a, b, result) in [
            (Binary::And, 2, -1, 1),
            (Binary::And, 2, 0, 0),
            (Binary::Or, 0, 256, 1),
            (Binary::Eq, 1, 1, 1),
            (Binary::Ne, 1, 1, 0),
            (Binary::Lt, -1, 0, 1),
            (Binary::Le, 0, 0, 1),
            (Binary::Gt, -1, 0, 0),
            (Binary::Ge, -1, 0, 0),
        ] {
            assert_eq!(binary(op, a, b), result, "{op:?} {a} {b}");
        }
    }

    /// PMI 2.3.3.7: an assignment converts last.
    #[test]
    fn an_assignment_converts_to_the_type_of_its_target() {
        assert_eq!(convert(65_536, Type::Logical), 1);
        assert_eq!(convert(65_536, Type::Integer), 0);
        assert_eq!(convert(-32_769, Type::Integer), 32_767);
        assert_eq!(convert(-1, Type::Long), -1);
    }
}
