//! Functions of a PMAC that depend on nothing but their arguments (`plcc_abi::pmac::pure_functions`), as far as they are
//! followed.

use plcc_abi::HostFn;

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
        _ => None,
    }
}
