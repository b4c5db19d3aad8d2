//! ADD, SUB, MUL, DIV and CMP on numbers of 1, 2 or 4 bytes (NCT 4.16).

use super::operand::{Fault, Locals, flag};

/// One of the statements.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Arithmetic {
    Add,
    Sub,
    Mul,
    Div,
    Cmp,
}

/// Executes a statement whose register area starts at a local variable: the format (bytes of a
/// number), then the addresses of A, B and, but for CMP, C.
///
/// The product and the dividend have twice the format's bytes; the remainder stands right behind
/// the quotient.
pub(super) fn execute(locals: &mut Locals<'_>, statement: Arithmetic, area: u16) {
    let is_cmp = statement == Arithmetic::Cmp;
    let mut fault = Fault::of_area(area, if is_cmp { 6 } else { 8 });
    if fault.any() {
        return fault.write(locals);
    }
    let format = locals.word(area);
    if !matches!(format, 1 | 2 | 4) {
        fault.syntax = true;
    }
    let size = format.min(4);
    let (a_size, c_size) = match statement {
        Arithmetic::Add | Arithmetic::Sub | Arithmetic::Cmp => (size, size),
        Arithmetic::Mul => (size, size * 2),
        Arithmetic::Div => (size * 2, size * 2),
    };
    let a = fault.address(locals.word(area + 2), a_size);
    let b = fault.address(locals.word(area + 4), size);
    let c = if is_cmp { 0 } else { fault.address(locals.word(area + 6), c_size) };
    if fault.any() {
        return fault.write(locals);
    }
    let (a, b) = (locals.number(a, a_size), locals.number(b, size));
    let fits = |value: i64| value == sign_extended(value, size);
    match statement {
        Arithmetic::Add | Arithmetic::Sub => {
            let exact = if statement == Arithmetic::Add { a + b } else { a - b };
            locals.set_number(c, size, exact);
            result_flags(locals, sign_extended(exact, size));
            locals.set_flag(flag::OVERFLOW, !fits(exact));
        }
        Arithmetic::Cmp => {
            result_flags(locals, a - b);
            locals.set_flag(flag::OVERFLOW, !fits(a - b));
        }
        Arithmetic::Mul => {
            let exact = a * b;
            locals.set_number(c, c_size, exact);
            result_flags(locals, exact);
            locals.set_flag(flag::OVERFLOW, !fits(exact));
        }
        Arithmetic::Div => {
            if b == 0 {
                return Fault { syntax: true, not_bcd: false }.write(locals);
            }
            let quotient = a.wrapping_div(b);
            locals.set_number(c, size, quotient);
            locals.set_number(c + size, size, a.wrapping_rem(b));
            result_flags(locals, sign_extended(quotient, size));
        }
    }
    fault.write(locals);
}

/// F0046 and F0047.
fn result_flags(locals: &mut Locals<'_>, result: i64) {
    locals.set_flag(flag::ZERO, result == 0);
    locals.set_flag(flag::SIGN, result < 0);
}

/// What the low bytes of a value mean.
fn sign_extended(value: i64, size: u16) -> i64 {
    let unused = 64_u32.saturating_sub(u32::from(size) * 8);
    value.wrapping_shl(unused).wrapping_shr(unused)
}
