//! Conditions as logic, over the process image at the end of a tick.

use plcc_abi::place::{Place, Type};
use plcc_frontend::CheckedProgram;
use plcc_frontend::common::ExpressionCode;
use plcc_plctest::{Comparison, Condition, Relation};
use plcc_runtime::Names;

use crate::logic::{FALSE, Lit, Memory, TRUE};
use crate::scan::{Builder, Code, Reason};

/// The width in which a variable is compared with a number.
const WIDTH: usize = 40;

/// The literal that a condition holds in an image.
pub(crate) fn literal(
    builder: &mut Builder,
    memory: &Memory,
    condition: &Condition,
    checked: &dyn CheckedProgram,
    names: &dyn Names,
) -> Lit {
    let unknown = |builder: &mut Builder, text: &str| {
        let text = format!("the condition `{}` {text}", condition.text);
        builder.unknown(1, Reason { text, place: None }).first().copied().unwrap_or(FALSE)
    };
    if condition.expression().is_none() {
        let value = condition.comparison().and_then(|comparison| {
            let place = names.properties(comparison.key).value;
            let found = place.and_then(|place| compare(builder, memory, comparison, place));
            found.or_else(|| {
                compare_double(builder, memory, comparison, &names.canonical(comparison.key))
            })
        });
        return match value {
            Some(value) => value,
            None => unknown(builder, "compares something that does not lie in the process image"),
        };
    }
    match checked.expression_code(&condition.canonical) {
        Ok(Some(code)) => evaluate(builder, memory, &code, &condition.text),
        _ => unknown(builder, "can't be taken as logic"),
    }
}

/// The literal that an expression is not 0.
fn evaluate(builder: &mut Builder, memory: &Memory, code: &ExpressionCode, text: &str) -> Lit {
    let mut memory = memory.clone();
    memory.grow(code.module.image_size as usize);
    let before = builder.escapes.len();
    let ends = Code::new(&code.module, None).scan(builder, 0, TRUE, &memory, u32::MAX);
    for (_, reason) in builder.escapes.iter().skip(before) {
        if let Some(reason) = builder.reasons.get_mut(*reason as usize) {
            reason.text = format!("the condition `{text}` {}", reason.text);
            reason.place = None;
        }
    }
    if let Some((cond, _)) = ends.trap {
        let text = format!("the condition `{text}` has no value: an index is outside its array");
        let reason = builder.reason(Reason { text, place: None });
        builder.escapes.push((cond, reason));
    }
    let Some((_, memory)) = ends.end else { return FALSE };
    let value = memory.load(code.result as usize, code.ty.bytes() as usize);
    builder.graph.is_not_zero(&value)
}

/// The literal that a variable of a PMAC, as a double, compares with a number as is asked; `None` where its value is not known.
fn compare_double(
    builder: &mut Builder,
    memory: &Memory,
    comparison: Comparison,
    name: &str,
) -> Option<Lit> {
    let pmac = builder.pmac.clone()?;
    let graph = &mut builder.graph;
    let value = pmac.value(graph, memory, name)?;
    let number = graph.number(64, comparison.number.to_bits() as i64);
    let (equal, less, _) = graph.compare_floats(&value, &number);
    let at_most = graph.or(equal, less);
    Some(match comparison.relation {
        Relation::Equal => equal,
        Relation::Different => !equal,
        Relation::Less => less,
        Relation::AtMost => at_most,
        Relation::Greater => !at_most,
        Relation::AtLeast => !less,
    })
}

/// The literal that a variable compares with a number as is asked; `None` where its form is not known here.
fn compare(
    builder: &mut Builder,
    memory: &Memory,
    comparison: Comparison,
    place: Place,
) -> Option<Lit> {
    let graph = &mut builder.graph;
    let all = memory.load(place.offset as usize, (usize::from(place.bit) + 64).div_ceil(8));
    let bits: Vec<Lit> = all.into_iter().skip(place.bit.into()).take(place.width.into()).collect();
    let value = match place.ty {
        Type::Logical => graph.resize(bits.get(..1)?, WIDTH, FALSE),
        Type::Word | Type::Bits => graph.resize(&bits, WIDTH, FALSE),
        Type::Integer | Type::Long | Type::SignedBits => graph.resize_signed(&bits, WIDTH),
        Type::Double | Type::Bcd => return None,
    };
    let limit = 2_f64.powi(WIDTH as i32 - 2);
    let number = comparison.number.clamp(-limit, limit);
    let is_whole = number.fract() == 0.0;
    let (below, above) = (number.floor() as i64, number.ceil() as i64);
    let (below, above) = (graph.number(WIDTH, below), graph.number(WIDTH, above));
    Some(match comparison.relation {
        Relation::Equal if !is_whole => FALSE,
        Relation::Different if !is_whole => TRUE,
        Relation::Equal => graph.equal(&value, &below),
        Relation::Different => !graph.equal(&value, &below),
        Relation::Less => graph.less_signed(&value, &above),
        Relation::AtMost => !graph.less_signed(&below, &value),
        Relation::Greater => graph.less_signed(&below, &value),
        Relation::AtLeast => !graph.less_signed(&value, &above),
    })
}
