//! Quotients by constants. A quotient, and the product that a pass makes of it, become the same circuit here, so that no solver has to
//! find out that they are equal.

use plcc_ir::BinaryOp;
use rustc_hash::FxHashMap;

use super::terms::{Function, Terms};
use crate::logic::{FALSE, Graph, Lit};
use crate::scan::instruction::number;

/// A number times a constant, plus a constant.
#[derive(Clone, Debug)]
pub(super) struct Product {
    /// The number, in its shortest form.
    of: Vec<Lit>,
    factor: i64,
    plus: i64,
}

/// A number that is divided by a constant above 0, and rounded down.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Quotient {
    /// The dividend, in its shortest form.
    of: Vec<Lit>,
    by: i64,
}

/// What is known of integers: products and quotients by their bits, those of quotients in their shortest form.
#[derive(Debug, Default)]
pub(super) struct Integers {
    products: FxHashMap<Vec<Lit>, Product>,
    quotients: FxHashMap<Vec<Lit>, Quotient>,
    /// The least and the greatest number that a sum may be, by its shortest form.
    ranges: FxHashMap<Vec<Lit>, (i128, i128)>,
}

impl Integers {
    /// The least and the greatest number that some bits, in their shortest form, may be.
    fn range_of(&self, bits: &[Lit]) -> (i128, i128) {
        if let Some(&known) = self.ranges.get(bits) {
            return known;
        }
        if let Some(number) = number(bits) {
            return (number.into(), number.into());
        }
        let half = 1_i128 << (bits.len().clamp(1, 65) - 1);
        (if last(bits) == FALSE { 0 } else { -half }, half - 1)
    }
}

fn last(bits: &[Lit]) -> Lit {
    bits.last().copied().unwrap_or(FALSE)
}

/// The shortest form of a number in two's complement.
pub(super) fn trimmed(bits: &[Lit]) -> Vec<Lit> {
    let mut bits = bits.to_vec();
    while let [.., below, last] = bits.as_slice()
        && below == last
    {
        bits.pop();
    }
    bits
}

/// The product of two numbers that are not known, as wide as both together.
fn product(graph: &mut Graph, terms: &mut Terms, x: &[Lit], y: &[Lit]) -> Option<Vec<Lit>> {
    let (mut a, mut b) = (trimmed(x), trimmed(y));
    if a > b {
        std::mem::swap(&mut a, &mut b);
    }
    let width = a.len() + b.len();
    if terms.exact || width > 64 || a.len().min(b.len()) < 4 {
        return None;
    }
    let function = Function::Multiply(a.len() as u8, b.len() as u8);
    Some(terms.apply(graph, function, [a, b].concat(), width).0)
}

/// The quotient rounded towards 0 by a constant above 0, as wide as `a` and a bit more.
fn towards_zero(graph: &mut Graph, terms: &mut Terms, a: &[Lit], by: i64) -> Vec<Lit> {
    let bits = 65 - by.leading_zeros() as usize;
    let width = (a.len() + 1).max(bits + 1);
    let wide = graph.resize_signed(a, width);
    if by & (by - 1) == 0 {
        let shift = by.trailing_zeros() as usize;
        let bias = (0..width).map(|bit| if bit < shift { last(a) } else { FALSE });
        let sum = graph.add(&wide, &bias.collect::<Vec<_>>());
        let moved: Vec<Lit> = sum.iter().copied().skip(shift).collect();
        return graph.resize_signed(&moved, width);
    }
    if !terms.exact && a.len() <= 63 {
        // A quotient has fewer bits, and is not negative where the dividend is not.
        let narrow = (a.len() + 1).saturating_sub(by.ilog2() as usize).max(2);
        let function = Function::Quotient(a.len() as u8, by);
        let mut raw = terms.apply(graph, function, a.to_vec(), narrow).0;
        if let Some(sign) = raw.last_mut() {
            *sign = graph.and(*sign, last(a));
        }
        return graph.resize_signed(&raw, width);
    }
    let divisor = graph.number(width, by);
    graph.divide_signed(&wide, &divisor).0
}

/// The quotient rounded down by a constant above 0.
fn rounded_down(graph: &mut Graph, terms: &mut Terms, a: &[Lit], by: i64) -> Vec<Lit> {
    let quotient = down_of(graph, terms, a, by);
    // It has fewer bits than the dividend.
    let mut narrow = quotient.clone();
    narrow.truncate((a.len() + 1).saturating_sub(by.ilog2() as usize).max(2));
    let quotient = graph.resize_signed(&narrow, quotient.len());
    let known = Quotient { of: trimmed(a), by };
    terms.integers.quotients.insert(trimmed(&quotient), known);
    quotient
}

fn down_of(graph: &mut Graph, terms: &mut Terms, a: &[Lit], by: i64) -> Vec<Lit> {
    let quotient = towards_zero(graph, terms, a, by);
    if last(a) == FALSE {
        return quotient;
    }
    let wide = graph.resize_signed(a, quotient.len());
    let divisor = graph.number(quotient.len(), by);
    let product = graph.multiply(&quotient, &divisor);
    let is_whole = graph.equal(&product, &wide);
    let less = graph.and(last(a), !is_whole);
    let all = vec![less; quotient.len()];
    graph.add(&quotient, &all)
}

/// The remainder of the quotient rounded down, by a number above 0.
pub(super) fn modulo(graph: &mut Graph, terms: &mut Terms, a: &[Lit], by: &[Lit]) -> Vec<Lit> {
    if let Some(by) = number(by).filter(|&by| by > 0) {
        return remainder(graph, terms, a, by, true);
    }
    let (_, rest) = graph.divide_signed(a, by);
    let is_rest = graph.is_not_zero(&rest);
    let is_below = graph.and(last(&rest), is_rest);
    let sum = graph.add(&rest, by);
    graph.choose_bits(is_below, &sum, &rest)
}

/// The remainder of the quotient rounded down, or towards 0, by a constant above 0.
fn remainder(graph: &mut Graph, terms: &mut Terms, a: &[Lit], by: i64, down: bool) -> Vec<Lit> {
    if by & (by - 1) == 0 && down {
        let below = graph.number(a.len(), by - 1);
        return a.iter().zip(&below).map(|(&a, &b)| graph.and(a, b)).collect();
    }
    let of = trimmed(a);
    let quotient = match down {
        true => rounded_down(graph, terms, &of, by),
        false => towards_zero(graph, terms, &of, by),
    };
    let quotient = graph.resize_signed(&quotient, a.len());
    let divisor = graph.number(a.len(), by);
    let product = graph.multiply(&quotient, &divisor);
    let rest = graph.subtract(a, &product).0;
    if down { below(&rest, by) } else { rest }
}

/// A number from 0 to `by` - 1 without what its other bits say.
fn below(bits: &[Lit], by: i64) -> Vec<Lit> {
    let width = 64 - (by - 1).leading_zeros() as usize;
    bits.iter().enumerate().map(|(at, &bit)| if at < width { bit } else { FALSE }).collect()
}

/// An operation on integers that divides by a constant, or that a pass makes of such a division; `None` for others.
pub(super) fn binary(
    graph: &mut Graph,
    terms: &mut Terms,
    op: BinaryOp,
    x: &[Lit],
    y: &[Lit],
) -> Option<Vec<Lit>> {
    let width = x.len();
    if number(x).is_some() {
        return None;
    }
    if op == BinaryOp::Mul && number(y).is_none() {
        let product = product(graph, terms, x, y)?;
        return Some(graph.resize_signed(&product, width));
    }
    if let BinaryOp::Add | BinaryOp::Sub = op {
        return Some(sum(graph, terms, op, x, y));
    }
    let constant = number(y)?;
    let unsigned = if width == 64 { constant } else { constant & ((1 << width) - 1) };
    let sized = |graph: &Graph, bits: Vec<Lit>| Some(graph.resize_signed(&bits, width));
    let mut positive = x.to_vec();
    positive.push(FALSE);
    match op {
        BinaryOp::Mul => {
            let product = graph.multiply(x, y);
            let of = trimmed(x);
            terms.integers.products.entry(product.clone()).or_insert(Product {
                of,
                factor: constant,
                plus: 0,
            });
            Some(product)
        }
        BinaryOp::Umulh if width == 64 && last(x) == FALSE => {
            let of = trimmed(x);
            let factor = i128::from(constant as u64);
            let by = divisor(64, factor)?;
            let range = terms.integers.range_of(&of);
            rounds_down(range, factor, 0, 64, by).then_some(())?;
            let quotient = rounded_down(graph, terms, &of, by);
            sized(graph, quotient)
        }
        BinaryOp::Ashr | BinaryOp::Lshr => {
            let product = terms.integers.products.get(x)?.clone();
            let shift =
                u32::try_from(constant).ok().filter(|&it| it > 0 && (it as usize) < width)?;
            let quotient = of_product(graph, terms, op, width as u32, &product, shift)?;
            sized(graph, quotient)
        }
        BinaryOp::Smod if constant > 0 => Some(remainder(graph, terms, x, constant, true)),
        BinaryOp::Sdiv | BinaryOp::Srem if constant != 0 && constant > -(1 << 40) => {
            let size = constant.checked_abs()?;
            if op == BinaryOp::Srem {
                return Some(remainder(graph, terms, x, size, false));
            }
            let quotient = towards_zero(graph, terms, &trimmed(x), size);
            let quotient = graph.resize_signed(&quotient, width);
            Some(if constant < 0 { graph.negate(&quotient) } else { quotient })
        }
        BinaryOp::Udiv | BinaryOp::Urem if unsigned > 0 => {
            let quotient = towards_zero(graph, terms, &trimmed(&positive), unsigned);
            let quotient = graph.resize_signed(&quotient, width);
            if op == BinaryOp::Udiv {
                return Some(quotient);
            }
            let product = graph.multiply(&quotient, y);
            Some(graph.subtract(x, &product).0)
        }
        _ => None,
    }
}

/// A sum or difference, of no more gates than the operands' shortest forms need.
fn sum(graph: &mut Graph, terms: &mut Terms, op: BinaryOp, x: &[Lit], y: &[Lit]) -> Vec<Lit> {
    let (a, b) = (trimmed(x), trimmed(y));
    let width = (a.len().max(b.len()) + 1).min(x.len());
    let known = &terms.integers;
    let (of_a, of_b) = (known.range_of(&a), known.range_of(&b));
    let range = match op {
        BinaryOp::Sub => (of_a.0 - of_b.1, of_a.1 - of_b.0),
        _ => (of_a.0 + of_b.0, of_a.1 + of_b.1),
    };
    let half = 1_i128 << (width.max(1) - 1);
    let fits = -half <= range.0 && range.1 < half;
    let (a, b) = (graph.resize_signed(&a, width), graph.resize_signed(&b, width));
    let sum = match op {
        BinaryOp::Sub => graph.subtract(&a, &b).0,
        _ => graph.add(&a, &b),
    };
    let sum = graph.resize_signed(&sum, x.len());
    let known = &mut terms.integers;
    if fits {
        known.ranges.insert(trimmed(&sum), range);
    }
    match (op, number(y)) {
        (BinaryOp::Add, Some(plus)) => {
            if let Some(product) = known.products.get(x).filter(|product| product.plus == 0) {
                let product = Product { plus, ..product.clone() };
                known.products.entry(sum.clone()).or_insert(product);
            }
        }
        (BinaryOp::Sub, _) => {
            // A number less its quotient times the divisor.
            let product = known.products.get(y).filter(|product| product.plus == 0);
            let quotient = product.and_then(|it| Some((known.quotients.get(&it.of)?, it.factor)));
            if let Some((quotient, factor)) = quotient
                && quotient.by == factor
                && quotient.of == trimmed(x)
            {
                return below(&sum, factor);
            }
        }
        _ => {}
    }
    sum
}

/// The divisor whose quotient a product with a factor may be, after a shift.
fn divisor(shift: u32, factor: i128) -> Option<i64> {
    let one = 1_i128 << shift;
    let by = (one + factor / 2).checked_div(factor)?;
    i64::try_from(by).ok().filter(|&by| by > 1)
}

/// Whether a product with a factor, plus a number, shifted to the right, is the quotient rounded down.
fn rounds_down(range: (i128, i128), factor: i128, plus: i128, shift: u32, by: i64) -> bool {
    let by = i128::from(by);
    let (one, off) = (1_i128 << shift, factor * by - (1_i128 << shift));
    // x is q * by + r. The product is q * 2^shift, plus what must be from 0 to 2^shift - 1.
    let quotients = [range.0.div_euclid(by), range.1.div_euclid(by)];
    quotients.iter().all(|q| {
        q.checked_mul(off)
            .is_some_and(|moved| moved + plus >= 0 && moved + (by - 1) * factor + plus < one)
    })
}

/// Whether a product with a factor, shifted to the right, is the quotient rounded towards 0, less 1 for numbers below 0.
fn rounds_to_zero_and_less(range: (i128, i128), factor: i128, shift: u32, by: i64) -> bool {
    let (divisor, one) = (i128::from(by), 1_i128 << shift);
    let off = factor * divisor - one;
    let most = (-range.0).div_euclid(divisor);
    let below = most.checked_mul(off).is_some_and(|moved| moved + (divisor - 1) * factor <= one);
    off > 0 && below && rounds_down((0, range.1), factor, 0, shift, by)
}

/// What a product is after a shift, if it is a quotient.
fn of_product(
    graph: &mut Graph,
    terms: &mut Terms,
    op: BinaryOp,
    width: u32,
    product: &Product,
    shift: u32,
) -> Option<Vec<Lit>> {
    let range = terms.integers.range_of(&product.of);
    let mask = (1_i128 << width) - 1;
    let (factor, plus, most) = match op {
        BinaryOp::Lshr if range.0 >= 0 => {
            (i128::from(product.factor) & mask, i128::from(product.plus) & mask, mask)
        }
        BinaryOp::Ashr => (product.factor.into(), product.plus.into(), mask >> 1),
        _ => return None,
    };
    let size = (-range.0).max(range.1);
    let fits = size.checked_mul(factor)?.checked_add(plus)? <= most;
    if factor <= 0 || plus < 0 || !fits {
        return None;
    }
    let by = divisor(shift, factor)?;
    if rounds_down(range, factor, plus, shift, by) {
        return Some(rounded_down(graph, terms, &product.of, by));
    }
    if plus == 0 && rounds_to_zero_and_less(range, factor, shift, by) {
        let quotient = towards_zero(graph, terms, &product.of, by);
        let all = vec![last(&product.of); quotient.len()];
        return Some(graph.add(&quotient, &all));
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::validate::terms::tests::value;

    /// A remainder, and what a pass makes of it: both are right for each dividend, and the same literals.
    #[test]
    fn remainders_are_those_of_the_products_that_take_their_place() {
        // By which number, and the factor, what is added, and the shift of the quotient rounded down.
        for (by, factor, plus, shift) in
            [(3, 2_863_311_531, 1_431_655_765, 33), (5, 3_435_973_837, 858_993_459, 34)]
        {
            for added in [0, 1, -7] {
                let mut graph = Graph::default();
                let mut terms = Terms::new(false);
                let input = graph.inputs(9);
                let x = graph.resize_signed(&input, 64);
                let mut apply = |op, x: &[Lit], y: i64| {
                    let y = graph.number(64, y);
                    binary(&mut graph, &mut terms, op, x, &y).unwrap()
                };
                let x = apply(BinaryOp::Add, &x, added);
                let rest = apply(BinaryOp::Smod, &x, by);
                let product = apply(BinaryOp::Mul, &x, factor);
                let sum = apply(BinaryOp::Add, &product, plus);
                let quotient = apply(BinaryOp::Ashr, &sum, shift);
                let back = apply(BinaryOp::Mul, &quotient, by);
                let other = binary(&mut graph, &mut terms, BinaryOp::Sub, &x, &back).unwrap();
                assert_eq!(rest, other, "by {by} of x + {added}");
                for number in -256..256_i64 {
                    let inputs: [(&[Lit], u64); 1] = [(&input, number as u64)];
                    let of = |lits: &[Lit]| value(&graph, &terms, &inputs, lits) as i64;
                    let expected = number + added;
                    assert_eq!(of(&quotient), expected.div_euclid(by), "{expected} by {by}");
                    assert_eq!(of(&rest), expected.rem_euclid(by), "{expected} by {by}");
                }
            }
        }
    }

    /// A sum that does not fit wraps, and nothing is known of its range then.
    #[test]
    fn sums_of_few_bits_are_those_of_all() {
        for op in [BinaryOp::Add, BinaryOp::Sub] {
            for widths in [(3, 5), (8, 8), (5, 1)] {
                let mut graph = Graph::default();
                let mut terms = Terms::new(false);
                let (p, q) = (graph.inputs(widths.0), graph.inputs(widths.1));
                let [x, y] = [&p, &q].map(|it| graph.resize_signed(it, 8));
                let sum = binary(&mut graph, &mut terms, op, &x, &y).unwrap();
                let range = terms.integers.range_of(&trimmed(&sum));
                for a in 0..1 << widths.0 {
                    for b in 0..1 << widths.1 {
                        let inputs: [(&[Lit], u64); 2] = [(&p, a), (&q, b)];
                        let of = |lits: &[Lit]| value(&graph, &terms, &inputs, lits) as u8 as i8;
                        let expected = match op {
                            BinaryOp::Add => of(&x).wrapping_add(of(&y)),
                            _ => of(&x).wrapping_sub(of(&y)),
                        };
                        assert_eq!(of(&sum), expected);
                        assert!((range.0..=range.1).contains(&expected.into()), "{range:?}");
                    }
                }
            }
        }
    }
}
