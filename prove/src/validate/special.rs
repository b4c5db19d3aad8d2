//! Which results of operations on doubles are special, an infinity or not a number or -0: what follows from the operands.
//!
//! Passes drop what makes a double finite, and the 0 that makes 0 of -0, where they know that nothing changes. So both versions
//! have the same literals where the same is known here.

use plcc_ir::BinaryOp;

use super::terms::Terms;
use super::window::Window;
use crate::logic::{FALSE, Graph, Lit};
use crate::scan::instruction::number;
use crate::solve::{Answer, Deadline, Sat};

/// How many gates are looked at to show that a double is not special, and in how many steps.
const NEAR: usize = 64;
const STEPS: u32 = 500;

/// What a double may be besides a finite number that is not -0.
#[derive(Clone, Copy, Debug)]
pub(super) struct Special {
    full: bool,
    minus_zero: bool,
    /// How far from 0 it is at most, unless it is special.
    most: f64,
}

fn magnitude(graph: &mut Graph, x: &[Lit]) -> Lit {
    graph.any(x.iter().copied().take(63))
}

fn sign(x: &[Lit]) -> Lit {
    x.get(63).copied().unwrap_or(FALSE)
}

/// Whether the gates near a literal allow it to be true.
fn may_be(graph: &Graph, lit: Lit) -> bool {
    if let Some(value) = lit.value() {
        return value;
    }
    let window = Window::new(graph, lit, NEAR);
    if window.values().is_some() {
        return true;
    }
    let mut sat = Sat::new(Deadline::default());
    sat.set_steps(Some(STEPS));
    window.ask(&mut sat).0 != Answer::No
}

impl Terms {
    /// Notes that a double is an integer of some bits that is not -0, or another one.
    pub(super) fn note_special(
        &mut self,
        graph: &mut Graph,
        bits: &[Lit],
        int: &[Lit],
        otherwise: &[Lit],
    ) {
        let mut special = self.special_of(graph, otherwise);
        special.most = special.most.max(2_f64.powi(int.len() as i32));
        self.special.insert(bits.to_vec(), special);
    }

    fn special_of(&mut self, graph: &mut Graph, x: &[Lit]) -> Special {
        if let Some(&known) = self.special.get(x) {
            return known;
        }
        let (full, size) = (full(graph, x), magnitude(graph, x));
        let minus_zero = graph.and(sign(x), !size);
        let most = number(x).map_or(f64::MAX, |x| f64::from_bits(x as u64).abs());
        let special =
            Special { full: may_be(graph, full), minus_zero: may_be(graph, minus_zero), most };
        self.special.insert(x.to_vec(), special);
        special
    }

    /// Whether a double is an infinity or not a number.
    pub(super) fn full_exponent(&mut self, graph: &mut Graph, x: &[Lit]) -> Lit {
        match self.special_of(graph, x).full {
            true => full(graph, x),
            false => FALSE,
        }
    }

    fn minus_zero(&mut self, graph: &mut Graph, x: &[Lit]) -> Lit {
        if !self.special_of(graph, x).minus_zero {
            return FALSE;
        }
        let size = magnitude(graph, x);
        graph.and(sign(x), !size)
    }

    /// A double made finite.
    pub(super) fn made_finite(&mut self, graph: &mut Graph, x: &[Lit]) -> Vec<Lit> {
        let special = self.special_of(graph, x);
        if !special.full {
            return x.to_vec();
        }
        // An infinity becomes the largest number.
        let finite = graph.finite(x);
        let special = Special { full: false, most: f64::MAX, ..special };
        self.special.insert(finite.clone(), special);
        finite
    }

    /// The result of adding 0, of subtracting 0, and of multiplying with 1; `None` for other operations.
    pub(super) fn unchanged(
        &mut self,
        graph: &mut Graph,
        op: BinaryOp,
        x: &[Lit],
        y: &[Lit],
    ) -> Option<Vec<Lit>> {
        let y = f64::from_bits(number(y)? as u64).to_bits();
        let adds = op == BinaryOp::Fadd && y == 0.0_f64.to_bits();
        let is_same = op == BinaryOp::Fsub && y == 0.0_f64.to_bits()
            || op == BinaryOp::Fmul && y == 1.0_f64.to_bits();
        if !adds && !is_same {
            return None;
        }
        let mut bits = x.to_vec();
        // What is not a number becomes quiet.
        let is_full = self.full_exponent(graph, x);
        let fraction = graph.any(x.iter().copied().take(52));
        let is_nan = graph.and(is_full, fraction);
        if let Some(quiet) = bits.get_mut(51) {
            *quiet = graph.or(*quiet, is_nan);
        }
        if adds {
            let is_minus_zero = self.minus_zero(graph, x);
            if let Some(sign) = bits.last_mut() {
                *sign = graph.and(*sign, !is_minus_zero);
            }
        }
        Some(bits)
    }

    /// The result of an operation on doubles, of which what the operands say is known. Each result that is possible stays as it is.
    pub(super) fn ranged(
        &mut self,
        graph: &mut Graph,
        op: BinaryOp,
        x: &[Lit],
        y: &[Lit],
        raw: &[Lit],
    ) -> Vec<Lit> {
        let mut bits = raw.to_vec();
        let (full_x, full_y) = (self.full_exponent(graph, x), self.full_exponent(graph, y));
        let (size_x, size_y) = (magnitude(graph, x), magnitude(graph, y));
        let are_finite = graph.and(!full_x, !full_y);
        let constant = number(y).map(|y| f64::from_bits(y as u64).abs());
        let is_number = match op {
            BinaryOp::Fdiv => graph.and(are_finite, size_y),
            _ => are_finite,
        };
        // Neither NaN nor, where the operands are small enough, an infinity.
        let [a, b] = [x, y].map(|it| self.special_of(graph, it).most);
        let most = match op {
            BinaryOp::Fmul => a * b,
            BinaryOp::Fdiv => constant.map_or(f64::INFINITY, |c| a / c),
            _ => a + b,
        };
        let stays_finite = most.is_finite();
        // What is not finite stays so, but for a quotient by an infinity.
        let fills = match op {
            BinaryOp::Fdiv => full_x,
            _ => graph.or(full_x, full_y),
        };
        for bit in bits.iter_mut().skip(52).take(11) {
            *bit = graph.or(*bit, fills);
        }
        let is_full = self.full_exponent(graph, &bits);
        let clears = graph.and(is_number, is_full);
        for bit in bits.iter_mut().take(52) {
            *bit = graph.and(*bit, !clears);
        }
        if stays_finite && let Some(lowest) = bits.get_mut(52) {
            *lowest = graph.and(*lowest, !clears);
        }
        let size = magnitude(graph, &bits);
        let (sign_x, mut sign_y) = (sign(x), sign(y));
        if op == BinaryOp::Fsub {
            sign_y = !sign_y;
        }
        let own = sign(&bits);
        let new_sign = match op {
            BinaryOp::Fmul | BinaryOp::Fdiv => {
                let product = graph.xor(sign_x, sign_y);
                graph.choose(is_number, product, own)
            }
            _ => {
                // A sum that is 0 is -0 only where both are.
                let (zero_x, mut zero_y) = (self.minus_zero(graph, x), self.minus_zero(graph, y));
                if op == BinaryOp::Fsub {
                    // What is taken away is +0.
                    zero_y = graph.and(sign_y, !size_y);
                }
                let both = graph.and(zero_x, zero_y);
                let clears = graph.and(is_number, !size);
                graph.choose(clears, both, own)
            }
        };
        // A product with 0 is 0, and one with a number that is not below 1 is not.
        let zeroes = match op {
            BinaryOp::Fmul => {
                let both = graph.and(size_x, size_y);
                graph.and(is_number, !both)
            }
            BinaryOp::Fdiv => graph.and(is_number, !size_x),
            _ => FALSE,
        };
        let grows = constant.is_some_and(|c| match op {
            BinaryOp::Fmul => c >= 1.0,
            BinaryOp::Fdiv => c > 0.0 && c <= 1.0,
            _ => false,
        });
        for bit in bits.iter_mut().take(63) {
            *bit = graph.and(*bit, !zeroes);
        }
        if grows {
            let is_zero = graph.all([is_number, size_x, !size]);
            if let Some(lowest) = bits.first_mut() {
                *lowest = graph.or(*lowest, is_zero);
            }
        }
        if let Some(last) = bits.last_mut() {
            *last = new_sign;
        }
        if stays_finite {
            let special = self.special_of(graph, &bits);
            self.special.insert(bits.clone(), Special { most, ..special });
        }
        bits
    }
}

fn full(graph: &mut Graph, x: &[Lit]) -> Lit {
    graph.all(x.iter().copied().skip(52).take(11))
}

#[cfg(test)]
mod tests {
    use plcc_ir::{Type, UnaryOp, eval};

    use super::*;
    use crate::validate::terms::tests::value;

    const NUMBERS: [f64; 16] = [
        0.0,
        -0.0,
        1.0,
        -1.0,
        0.5,
        -3.25,
        7.0,
        5e-324,
        -5e-324,
        2e-308,
        1e300,
        f64::MAX,
        -f64::MAX,
        f64::INFINITY,
        f64::NEG_INFINITY,
        f64::NAN,
    ];

    /// Also of what is not finite, and where the operands were made finite or not.
    #[test]
    fn what_is_known_of_results_leaves_each_result_as_it_is() {
        for op in [BinaryOp::Fadd, BinaryOp::Fsub, BinaryOp::Fmul, BinaryOp::Fdiv] {
            for finite in [[false, false], [false, true], [true, true]] {
                let mut graph = Graph::default();
                let mut terms = Terms::new(false);
                let [x, y] = [0, 1].map(|_| graph.inputs(64));
                let [zero, half] = [0.0_f64, 0.5].map(|it| graph.number(64, it.to_bits() as i64));
                // Halves, so that their sum is known to be finite where they are.
                let mut halved = |x: &[Lit], finite: bool| {
                    let half = terms.binary(&mut graph, BinaryOp::Fmul, x, &half);
                    if finite { terms.made_finite(&mut graph, &half) } else { half }
                };
                let (a, b) = (halved(&x, finite[0]), halved(&y, finite[1]));
                let result = terms.binary(&mut graph, op, &a, &b);
                let result = terms.made_finite(&mut graph, &result);
                let result = terms.binary(&mut graph, BinaryOp::Fadd, &result, &zero);
                for p in NUMBERS {
                    for q in NUMBERS {
                        let run = |op, a: f64, b: f64| {
                            let [a, b] = [a, b].map(|it| it.to_bits() as i64);
                            f64::from_bits(eval::binary(op, Type::F64, a, b) as u64)
                        };
                        let made_finite = |x: f64| {
                            let bits = x.to_bits() as i64;
                            f64::from_bits(eval::unary(UnaryOp::Ffinite, Type::F64, bits) as u64)
                        };
                        let halved = |x: f64, finite: bool| {
                            let half = run(BinaryOp::Fmul, x, 0.5);
                            if finite { made_finite(half) } else { half }
                        };
                        let expected = run(op, halved(p, finite[0]), halved(q, finite[1]));
                        let expected = run(BinaryOp::Fadd, made_finite(expected), 0.0);
                        let inputs: [(&[Lit], u64); 2] = [(&x, p.to_bits()), (&y, q.to_bits())];
                        let found = f64::from_bits(value(&graph, &terms, &inputs, &result));
                        assert_eq!(
                            found.to_bits(),
                            expected.to_bits(),
                            "{op:?} {p} {q} {finite:?}: {found}, not {expected}"
                        );
                    }
                }
            }
        }
    }

    /// What passes rely on: a sum with an integer needs nothing to be finite, and is not -0 where both operands are not.
    #[test]
    fn sums_that_are_known_to_be_finite_stay_as_they_are() {
        let mut graph = Graph::default();
        let mut terms = Terms::new(false);
        let raw = graph.inputs(64);
        let x = super::super::universe::finite(&mut graph, &raw, false);
        let int = graph.inputs(24);
        let int = terms.of_int(&mut graph, &int);
        let sum = terms.binary(&mut graph, BinaryOp::Fadd, &x, &int);
        assert_eq!(terms.made_finite(&mut graph, &sum), sum);
        let zero = graph.number(64, 0);
        assert_eq!(terms.binary(&mut graph, BinaryOp::Fadd, &sum, &zero), sum);
        let product = terms.binary(&mut graph, BinaryOp::Fmul, &x, &int);
        assert_ne!(terms.made_finite(&mut graph, &product), product);
    }
}
