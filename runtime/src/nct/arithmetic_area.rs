//! The register areas of ADD, SUB, MUL, DIV and CMP (NCT 4.16): where a statement's operands and
//! its result lie among the local variables.

use plcc_abi::nct::arithmetic::Operation;

use super::operand::{Fault, Locals, flag};

/// Executes a statement whose register area starts at a local variable: the format (bytes of a
/// number), then the addresses of A, B and, but for CMP, C.
pub(super) fn execute(locals: &mut Locals<'_>, statement: Operation, area: u16) {
    let has_result = statement != Operation::Cmp;
    let mut fault = Fault::of_area(area, if has_result { 8 } else { 6 });
    if fault.any() {
        return fault.write(locals);
    }
    let format = locals.word(area);
    if !matches!(format, 1 | 2 | 4) {
        fault.syntax = true;
    }
    let size = format.min(4);
    let a_size = statement.first_operand_size(size);
    let a = fault.address(locals.word(area + 2), a_size);
    let b = fault.address(locals.word(area + 4), size);
    let c = statement
        .result_size(size)
        .map(|c_size| (fault.address(locals.word(area + 6), c_size), c_size));
    if fault.any() {
        return fault.write(locals);
    }
    let (a, b) = (locals.number(a, a_size), locals.number(b, size));
    let Some(computed) = statement.compute(a, b, size) else {
        return Fault { syntax: true, not_bcd: false }.write(locals);
    };
    if let Some((c, c_size)) = c {
        locals.set_number(c, c_size, computed.result);
    }
    locals.set_flag(flag::ZERO, computed.zero);
    locals.set_flag(flag::SIGN, computed.sign);
    if let Some(overflow) = computed.overflow {
        locals.set_flag(flag::OVERFLOW, overflow);
    }
    fault.write(locals);
}
