//! Between which numbers a computed index lies, for the passes that copy code after integrality checks.

use plcc_abi::IntegerForm;

use super::float_range::FloatRange;
use crate::{BinaryOp, ConvertOp, FuncData, InstData, Type, Value};

/// To find the bounds of an index, its definition is followed back through at most this many instructions.
const MAX_STEPS: u32 = 6;

/// The least and the greatest number that `index` can be; `None` if nothing is known. `range_of` gives the
/// range of a double whose bits are the index.
pub(super) fn index_bounds(
    func: &FuncData,
    index: Value,
    range_of: impl Fn(Value) -> FloatRange,
) -> Option<(i64, i64)> {
    bounds(func, index, &range_of, MAX_STEPS)
}

/// The bounds of a value, which is followed back through at most `steps` instructions.
fn bounds(
    func: &FuncData,
    value: Value,
    range_of: &impl Fn(Value) -> FloatRange,
    steps: u32,
) -> Option<(i64, i64)> {
    let next = |value| bounds(func, value, range_of, steps.checked_sub(1)?);
    let data = func.def_inst(value)?;
    match *data {
        InstData::Iconst { ty: _, value } => Some((value, value)),
        InstData::HostCall { args, .. } if data.integer_form() == Some(IntegerForm::Bits) => {
            range_of(*args.as_slice().first()?).integers()
        }
        InstData::Convert { op: ConvertOp::Trunc, to: Type::I32, arg } => {
            let within = |&(low, high): &(i64, i64)| {
                i32::try_from(low).is_ok() && i32::try_from(high).is_ok()
            };
            next(arg).filter(within)
        }
        // A mask of the lower bits changes no number that has no higher ones.
        InstData::Binary { op: BinaryOp::And, args: [x, by] } => {
            let most = func.constant(by).filter(|by| *by >= 0 && by & (by + 1) == 0)?;
            next(x).filter(|&(low, high)| low >= 0 && high <= most)
        }
        _ => None,
    }
}
