//! Doubles in two versions of a function.
//!
//! Sums and products of doubles take many gates, and the passes leave most of them as they are. So a result is at first any
//! double that equal operands give alike, of which what follows from the operands' ranges is known: that it is finite, or not -0.
//! Where operands are integers, it is the double of what the integers give, by which code that computes with integers is compared.

use plcc_abi::{DoubleRange, HostFn, HostType, IntegerForm};
use plcc_ir::{BinaryOp, ConvertOp, FloatCond, Type, UnaryOp, eval};

use super::terms::{Function, Terms};
use super::universe::finite;
use crate::logic::{FALSE, Graph, Lit, TRUE};
use crate::scan::functions;
use crate::scan::instruction::number;

/// Integers of this many bits are doubles exactly.
const MOST_BITS: usize = 54;

/// When a double is an integer, and which: where `cond` is true it is the double of `int`, in two's complement.
#[derive(Clone, Debug)]
pub(super) struct View {
    cond: Lit,
    int: Vec<Lit>,
}

/// What a function gives.
enum Outcome {
    /// The double of an integer.
    Integer(Vec<Lit>),
    Bits(Vec<Lit>),
}

/// Operands that count on a condition, and otherwise are 0: so nothing hangs on what a function gives where its result is known.
fn masked(graph: &mut Graph, cond: Lit, bits: &[Lit]) -> Vec<Lit> {
    bits.iter().map(|&bit| graph.and(cond, bit)).collect()
}

/// The number that a double is, if it is an integer that is not -0 and not large.
fn integer(bits: i64) -> Option<i64> {
    let value = f64::from_bits(bits as u64);
    let int = value as i64;
    let is_exact = (int as f64).to_bits() == value.to_bits() && int.unsigned_abs() < 1 << 52;
    is_exact.then_some(int)
}

/// How many bits a number takes in two's complement.
fn width_of(value: i64) -> usize {
    65 - (if value < 0 { !value } else { value }).leading_zeros() as usize
}

/// The shortest form of a number in two's complement.
fn trimmed(bits: &[Lit]) -> Vec<Lit> {
    let mut bits = bits.to_vec();
    while let [.., below, last] = bits.as_slice()
        && below == last
    {
        bits.pop();
    }
    bits
}

impl Terms {
    /// When a double is an integer of some bits, and which.
    fn view(&mut self, graph: &mut Graph, x: &[Lit]) -> View {
        if let Some(known) = self.views.get(x) {
            return known.clone();
        }
        let view = match number(x) {
            Some(bits) => match integer(bits) {
                Some(int) => View { cond: TRUE, int: graph.number(width_of(int), int) },
                None => View { cond: FALSE, int: vec![FALSE] },
            },
            None => {
                let int = graph.int_of_float(x);
                let back = graph.float_of_int(&int);
                View { cond: graph.equal(&back, x), int }
            }
        };
        self.views.insert(x.to_vec(), view.clone());
        view
    }

    /// The double that is an integer on a condition, and otherwise another one.
    fn double(&mut self, graph: &mut Graph, view: View, otherwise: &[Lit]) -> Vec<Lit> {
        if view.cond == FALSE {
            return otherwise.to_vec();
        }
        let int = trimmed(&view.int);
        let whole = graph.float_of_int(&int);
        let bits = graph.choose_bits(view.cond, &whole, otherwise);
        self.note_special(graph, &bits, &int, otherwise);
        self.views.entry(bits.clone()).or_insert(View { cond: view.cond, int });
        bits
    }

    /// An operation on two doubles.
    pub(super) fn binary(
        &mut self,
        graph: &mut Graph,
        op: BinaryOp,
        x: &[Lit],
        y: &[Lit],
    ) -> Vec<Lit> {
        if let (Some(a), Some(b)) = (number(x), number(y)) {
            return graph.number(64, eval::binary(op, Type::F64, a, b));
        }
        // A quotient by a power of two is a product.
        if let (BinaryOp::Fdiv, Some(by)) = (op, number(y)) {
            let by = f64::from_bits(by as u64);
            let reciprocal = 1.0 / by;
            if by.is_normal() && reciprocal.is_normal() && by.to_bits() << 12 == 0 {
                let factor = graph.number(64, reciprocal.to_bits() as i64);
                return self.binary(graph, BinaryOp::Fmul, x, &factor);
            }
        }
        if let Some(same) = self.unchanged(graph, op, x, y) {
            return same;
        }
        let view = self.of_integers(graph, op, x, y);
        let otherwise = !view.cond;
        let general = match (self.exact, op) {
            (true, BinaryOp::Fadd) => graph.add_floats(x, y),
            (true, BinaryOp::Fsub) => graph.subtract_floats(x, y),
            (true, BinaryOp::Fmul) => graph.multiply_floats(x, y),
            (true, _) => graph.divide_floats(x, y),
            (false, _) => {
                let operands = masked(graph, otherwise, &[x, y].concat());
                let raw = self.apply(graph, Function::Binary(op), operands, 64).0;
                self.ranged(graph, op, x, y, &raw)
            }
        };
        self.double(graph, view, &general)
    }

    /// What a sum, difference or product is where its operands are integers.
    fn of_integers(&mut self, graph: &mut Graph, op: BinaryOp, x: &[Lit], y: &[Lit]) -> View {
        let none = View { cond: FALSE, int: vec![FALSE] };
        if op == BinaryOp::Fdiv {
            return none;
        }
        let (a, b) = (self.view(graph, x), self.view(graph, y));
        let width = match op {
            BinaryOp::Fmul => a.int.len() + b.int.len(),
            _ => a.int.len().max(b.int.len()) + 1,
        };
        let mut cond = graph.and(a.cond, b.cond);
        if width > MOST_BITS || cond == FALSE {
            return none;
        }
        let (p, q) = (graph.resize_signed(&a.int, width), graph.resize_signed(&b.int, width));
        let int = match op {
            BinaryOp::Fadd => graph.add(&p, &q),
            BinaryOp::Fsub => graph.subtract(&p, &q).0,
            _ => {
                // 0 times a negative number is -0.
                let (zero_p, zero_q) = (!graph.is_not_zero(&a.int), !graph.is_not_zero(&b.int));
                let last = |bits: &[Lit]| bits.last().copied().unwrap_or(FALSE);
                let one = graph.and(zero_p, last(&b.int));
                let other = graph.and(zero_q, last(&a.int));
                cond = graph.all([cond, !one, !other]);
                graph.multiply(&p, &q)
            }
        };
        View { cond, int }
    }

    /// The square root.
    pub(super) fn square_root(&mut self, graph: &mut Graph, x: &[Lit]) -> Vec<Lit> {
        match number(x) {
            Some(x) => graph.number(64, eval::unary(UnaryOp::Fsqrt, Type::F64, x)),
            None => self.apply(graph, Function::Unary(UnaryOp::Fsqrt), x.to_vec(), 64).0,
        }
    }

    /// The double of an integer.
    pub(super) fn of_int(&mut self, graph: &mut Graph, x: &[Lit]) -> Vec<Lit> {
        let sign = if x.len() == 1 { FALSE } else { x.last().copied().unwrap_or(FALSE) };
        let wide = trimmed(&graph.resize(x, x.len() + 1, sign));
        if wide.len() > MOST_BITS {
            return graph.float_of_int(&wide);
        }
        self.double(graph, View { cond: TRUE, int: wide }, &[FALSE; 64])
    }

    /// A double as an integer, by a conversion.
    pub(super) fn convert(
        &mut self,
        graph: &mut Graph,
        op: ConvertOp,
        to: Type,
        x: &[Lit],
    ) -> Vec<Lit> {
        let view = self.view(graph, x);
        let fits = fits(graph, &view.int, 32);
        let known = graph.and(view.cond, fits);
        match op {
            ConvertOp::FloatToInt => {
                let int = self.int_of(graph, x);
                graph.resize_signed(&int, to.bits() as usize)
            }
            ConvertOp::IsInteger | ConvertOp::IsIntegerOrNan => {
                let (is_integer, is_nan) = graph.is_integer(x);
                let holds = graph.or(is_integer, known);
                match op {
                    ConvertOp::IsInteger => vec![holds],
                    _ => vec![graph.or(holds, is_nan)],
                }
            }
            _ => vec![],
        }
    }

    /// What [`Graph::int_of_float`] gives.
    fn int_of(&mut self, graph: &mut Graph, x: &[Lit]) -> Vec<Lit> {
        let view = self.view(graph, x);
        let fits = fits(graph, &view.int, 32);
        let known = graph.and(view.cond, fits);
        let general = graph.int_of_float(x);
        let int = graph.resize_signed(&view.int, 32);
        graph.choose_bits(known, &int, &general)
    }

    /// A comparison.
    pub(super) fn compare(
        &mut self,
        graph: &mut Graph,
        cond: FloatCond,
        x: &[Lit],
        y: &[Lit],
    ) -> Lit {
        let compared = graph.compare_floats(x, y);
        let general = graph.float_condition(cond, compared);
        let (a, b) = (self.view(graph, x), self.view(graph, y));
        let both = graph.and(a.cond, b.cond);
        if both == FALSE {
            return general;
        }
        let width = a.int.len().max(b.int.len());
        let (p, q) = (graph.resize_signed(&a.int, width), graph.resize_signed(&b.int, width));
        let of_integers = match cond {
            FloatCond::Eq | FloatCond::EqOrNan => graph.equal(&p, &q),
            FloatCond::Ne => !graph.equal(&p, &q),
            FloatCond::Lt => graph.less_signed(&p, &q),
            FloatCond::Ge => !graph.less_signed(&p, &q),
            FloatCond::Gt => graph.less_signed(&q, &p),
            FloatCond::Le => !graph.less_signed(&q, &p),
        };
        graph.choose(both, of_integers, general)
    }

    /// A host function that depends on its arguments alone.
    pub(super) fn pure(
        &mut self,
        graph: &mut Graph,
        function: HostFn,
        args: &[Vec<Lit>],
    ) -> Vec<Lit> {
        let (_, result) = function.signature();
        let width = if result == Some(HostType::I32) { 32 } else { 64 };
        if let Some(words) = args.iter().map(|arg| number(arg)).collect::<Option<Vec<i64>>>() {
            let words: Vec<u64> = words.iter().map(|&word| word as u64).collect();
            if let Some(value) = Function::Pure(function).value(&words) {
                return graph.number(width, value as i64);
            }
        }
        let outcome = self.outcome(graph, function, args, width);
        let otherwise = !outcome.as_ref().map_or(FALSE, |(cond, _)| *cond);
        let operands = masked(graph, otherwise, &args.concat());
        let raw = self.apply(graph, Function::Pure(function), operands, width).0;
        let general = match function.double_range() {
            DoubleRange::Any => raw,
            DoubleRange::Finite => finite(graph, &raw, false),
            DoubleRange::FiniteOrMinusZero => finite(graph, &raw, true),
        };
        match outcome {
            Some((cond, Outcome::Integer(int))) => self.double(graph, View { cond, int }, &general),
            Some((cond, Outcome::Bits(bits))) => graph.choose_bits(cond, &bits, &general),
            None => general,
        }
    }

    /// What a function gives on a condition.
    fn outcome(
        &mut self,
        graph: &mut Graph,
        function: HostFn,
        args: &[Vec<Lit>],
        width: usize,
    ) -> Option<(Lit, Outcome)> {
        let views: Vec<View> = args.iter().map(|arg| self.view_of(graph, arg)).collect();
        let form = function.integer_form();
        match (form, views.as_slice()) {
            (Some(IntegerForm::And | IntegerForm::Or | IntegerForm::Xor), [a, b])
                if a.int.len().max(b.int.len()) <= 40 =>
            {
                let width = a.int.len().max(b.int.len());
                let p = graph.resize_signed(&a.int, width);
                let q = graph.resize_signed(&b.int, width);
                let bits = p.iter().zip(&q).map(|(&p, &q)| match form {
                    Some(IntegerForm::And) => graph.and(p, q),
                    Some(IntegerForm::Or) => graph.or(p, q),
                    _ => graph.xor(p, q),
                });
                let int = bits.collect();
                Some((graph.and(a.cond, b.cond), Outcome::Integer(int)))
            }
            (Some(IntegerForm::Bits), [a]) => {
                let exact = graph.bits_of_float(args.first().map_or(&[], Vec::as_slice));
                let int = graph.resize_signed(&a.int, width);
                Some((TRUE, Outcome::Bits(graph.choose_bits(a.cond, &int, &exact))))
            }
            (Some(IntegerForm::Modulo), [a, b]) => {
                // The remainder by a number above 0 is that of the quotient rounded down.
                let width = a.int.len().max(b.int.len()) + 1;
                let p = graph.resize_signed(&a.int, width);
                let q = graph.resize_signed(&b.int, width);
                let last = |bits: &[Lit]| bits.last().copied().unwrap_or(FALSE);
                let is_positive = graph.is_not_zero(&q);
                let cond = graph.all([a.cond, b.cond, is_positive, !last(&q)]);
                (cond != FALSE)
                    .then(|| (cond, Outcome::Integer(super::divide::modulo(graph, self, &p, &q))))
            }
            (Some(IntegerForm::Range), [a, b, c]) => {
                let width = a.int.len().max(b.int.len()).max(c.int.len());
                let [p, q, r] = [a, b, c].map(|it| graph.resize_signed(&it.int, width));
                let (below, above) = (graph.less_signed(&p, &q), graph.less_signed(&r, &p));
                let cond = graph.all([a.cond, b.cond, c.cond, !below, !above]);
                Some((cond, Outcome::Integer(p)))
            }
            _ => {
                let (result, cond) = functions::pure(graph, function, args)?;
                (cond != FALSE).then_some((cond, Outcome::Bits(result)))
            }
        }
    }

    /// The view of an argument, which is a double or an integer.
    fn view_of(&mut self, graph: &mut Graph, x: &[Lit]) -> View {
        match x.len() {
            64 => self.view(graph, x),
            _ => View { cond: FALSE, int: vec![FALSE] },
        }
    }
}

/// Whether an integer has no more bits than `width`, in two's complement.
fn fits(graph: &mut Graph, int: &[Lit], width: usize) -> Lit {
    let last = int.last().copied().unwrap_or(FALSE);
    let above = int.iter().skip(width.saturating_sub(1)).copied();
    let differs: Vec<Lit> = above.collect();
    differs.into_iter().fold(TRUE, |all, bit| {
        let differs = graph.xor(bit, last);
        graph.and(all, !differs)
    })
}
