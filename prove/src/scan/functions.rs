//! Functions of a PMAC that depend on nothing but their arguments (`plcc_abi::pmac::pure_functions`), as far as they are
//! followed.

use plcc_abi::HostFn;

use super::instruction::number;
use crate::logic::{FALSE, Graph, Lit, TRUE};

/// What a function gives, and the literal that this is known; `None` for functions that are not followed.
pub(crate) fn pure(
    graph: &mut Graph,
    function: HostFn,
    args: &[Vec<Lit>],
) -> Option<(Vec<Lit>, Lit)> {
    match (function, args) {
        (HostFn::PmacBits, [x]) => Some((graph.bits_of_float(x), TRUE)),
        (HostFn::PmacAnd | HostFn::PmacOr | HostFn::PmacXor | HostFn::PmacMod, [a, b]) => {
            let (x, y) = (graph.int_of_float(a), graph.int_of_float(b));
            let (whole_a, whole_b) = (graph.is_integer(a).0, graph.is_integer(b).0);
            let mut known = graph.and(whole_a, whole_b);
            let result = match function {
                HostFn::PmacMod => {
                    // The remainder of a number above 0 is not negative.
                    let sign = y.last().copied().unwrap_or(FALSE);
                    let is_positive = graph.is_not_zero(&y);
                    known = graph.all([known, is_positive, !sign]);
                    let (_, rest) = graph.divide_signed(&x, &y);
                    let is_negative = rest.last().copied().unwrap_or(FALSE);
                    let moved = graph.add(&rest, &y);
                    graph.choose_bits(is_negative, &moved, &rest)
                }
                _ => {
                    let bits = x.iter().zip(&y);
                    bits.map(|(&a, &b)| match function {
                        HostFn::PmacAnd => graph.and(a, b),
                        HostFn::PmacOr => graph.or(a, b),
                        _ => graph.xor(a, b),
                    })
                    .collect()
                }
            };
            Some((graph.float_of_int(&result), known))
        }
        (HostFn::PmacRange, [value, low, high]) => {
            let bound = |bits: &[Lit]| number(bits).map(|bits| f64::from_bits(bits as u64) as i64);
            Some(range(graph, value, bound(low)?, bound(high)?))
        }
        _ => None,
    }
}

/// A double brought into a range of integers, as an I-variable takes it (`plcc_abi::pmac::range`), and the literal that this is
/// known.
pub(crate) fn range(graph: &mut Graph, value: &[Lit], low: i64, high: i64) -> (Vec<Lit>, Lit) {
    let length = high - low + 1;
    let bits = graph.bits_of_float(value);
    if length.count_ones() == 1 && (low == 0 || low == -length / 2) {
        // All multiples of the length are 0 in the lowest bits.
        let mut number: Vec<Lit> = bits.into_iter().take(length.ilog2() as usize).collect();
        if low == 0 {
            number.push(FALSE);
        }
        return (graph.float_of_int(&number), TRUE);
    }
    const WIDTH: usize = 40;
    let number: Vec<Lit> = bits.into_iter().take(WIDTH).collect();
    let mut size = value.to_vec();
    if let Some(sign) = size.last_mut() {
        *sign = FALSE;
    }
    let limit = graph.number(64, 2_f64.powi(WIDTH as i32 - 2).to_bits() as i64);
    let (_, known, _) = graph.compare_floats(&size, &limit);
    let (lowest, highest) = (graph.number(WIDTH, low), graph.number(WIDTH, high));
    let all = graph.number(WIDTH, length);
    let below = graph.less_signed(&number, &lowest);
    let above = graph.less_signed(&highest, &number);
    let (_, rest) = graph.divide_signed(&number, &all);
    let (more, less) = (graph.add(&rest, &all), graph.subtract(&rest, &all).0);
    let is_less = graph.less_signed(&rest, &lowest);
    let is_more = graph.less_signed(&highest, &rest);
    let wrapped = graph.choose_bits(is_more, &less, &rest);
    let wrapped = graph.choose_bits(is_less, &more, &wrapped);
    let outside = graph.or(below, above);
    let number = graph.choose_bits(outside, &wrapped, &number);
    (graph.float_of_int(&number), known)
}
