//! Doubles bit by bit: each operation gives what `plcc_ir::eval` computes, for random and for special operands.

#![allow(clippy::unwrap_used, clippy::panic, clippy::indexing_slicing, reason = "tests")]

use std::collections::HashMap;

use fastrand::Rng;
use plcc_ir::{BinaryOp, ConvertOp, FloatCond, Type, UnaryOp, eval};
use plcc_prove::logic::{FALSE, Graph, Lit, Node};

/// A graph with some outputs, run for many operands.
struct Circuit {
    graph: Graph,
    inputs: Vec<Lit>,
    outputs: Vec<Lit>,
}

impl Circuit {
    fn new(width: usize, make: impl Fn(&mut Graph, &[Lit]) -> Vec<Lit>) -> Self {
        let mut graph = Graph::default();
        let inputs = graph.inputs(width);
        let outputs = make(&mut graph, &inputs);
        Self { graph, inputs, outputs }
    }

    /// Runs 64 operands at once; each is a list of bits, 64 a number.
    fn run(&self, operands: &[Vec<u64>]) -> Vec<i64> {
        let mut values = vec![0_u64; self.graph.len()];
        let inputs: HashMap<u32, usize> =
            self.inputs.iter().enumerate().map(|(at, lit)| (lit.node(), at)).collect();
        let get = |values: &[u64], lit: Lit| {
            let value = values[lit.node() as usize];
            if lit.is_complement() { !value } else { value }
        };
        for node in 0..self.graph.len() as u32 {
            values[node as usize] = match self.graph.node(node) {
                Node::False => 0,
                Node::Input => {
                    let at = inputs[&node];
                    let bits = operands.iter().enumerate();
                    bits.fold(0, |all, (lane, words)| {
                        all | (words[at / 64] >> (at % 64) & 1) << lane
                    })
                }
                Node::And(a, b) => get(&values, a) & get(&values, b),
            };
        }
        let result = |lane: usize| {
            self.outputs
                .iter()
                .enumerate()
                .fold(0_u64, |all, (at, &lit)| all | (get(&values, lit) >> lane & 1) << at)
                as i64
        };
        (0..operands.len()).map(result).collect()
    }
}

/// Doubles with something special about them.
fn special() -> Vec<f64> {
    let mut all = vec![];
    for x in [
        0.0,
        f64::MIN_POSITIVE,
        f64::from_bits(1),
        f64::from_bits(0x000F_FFFF_FFFF_FFFF),
        f64::MAX,
        f64::INFINITY,
        f64::NAN,
        f64::EPSILON,
        0.5,
        1.0,
        1.5,
        2.5,
        0.1,
        1.0 - f64::EPSILON / 2.0,
        1.0 + f64::EPSILON,
        3.0,
        7.25,
        32768.0,
        8_388_607.0,
        8_388_607.5,
        2_147_483_647.0,
        2_147_483_647.5,
        2_147_483_648.0,
        4_294_967_296.0,
        4_503_599_627_370_495.5,
        4_503_599_627_370_496.0,
        9_007_199_254_740_993.0,
        1e300,
        1e-300,
    ] {
        all.extend([x, -x]);
    }
    all
}

/// A random double: of any bits, of few bits, near another one, or whole.
fn random(rng: &mut Rng, near: f64) -> f64 {
    match rng.u8(..6) {
        0 => f64::from_bits(rng.u64(..)),
        1 => f64::from(rng.i32(..)) / f64::from(1 << rng.u32(..12)),
        2 => f64::from_bits(near.to_bits().wrapping_add(rng.u64(..5)).wrapping_sub(2)),
        3 => f64::from_bits(rng.u64(..) & !(u64::MAX >> rng.u32(12..60))),
        4 => f64::from_bits(rng.u64(..1 << 53) | u64::from(rng.bool()) << 63),
        _ => {
            let special = special();
            special[rng.usize(..special.len())]
        }
    }
}

/// Pairs of operands: all pairs of special ones, and random ones.
fn pairs(random_pairs: usize) -> Vec<Vec<u64>> {
    let special = special();
    let mut all = vec![];
    for &a in &special {
        all.extend(special.iter().map(|b| vec![a.to_bits(), b.to_bits()]));
    }
    let mut rng = Rng::with_seed(7);
    for _ in 0..random_pairs {
        let a = random(&mut rng, 1.0);
        let near = if rng.bool() { a } else { -a };
        all.push(vec![a.to_bits(), random(&mut rng, near).to_bits()]);
    }
    all
}

/// Compares a circuit with what it has to give; all that are not a number are the same where `nan` says so.
fn compare(
    name: &str,
    circuit: &Circuit,
    operands: &[Vec<u64>],
    nan: bool,
    truth: &dyn Fn(&[u64]) -> i64,
) {
    for chunk in operands.chunks(64) {
        for (words, found) in chunk.iter().zip(circuit.run(chunk)) {
            let expected = truth(words);
            let is_nan = |bits: i64| f64::from_bits(bits as u64).is_nan();
            let same = found == expected || nan && is_nan(found) && is_nan(expected);
            let shown: Vec<f64> = words.iter().map(|&bits| f64::from_bits(bits)).collect();
            assert!(same, "{name} of {shown:?} ({words:x?}) is {expected:x}, not {found:x}");
        }
    }
}

#[test]
fn sums_products_and_quotients_are_rounded_as_they_are() {
    for (op, count) in [
        (BinaryOp::Fadd, 20_000),
        (BinaryOp::Fsub, 20_000),
        (BinaryOp::Fmul, 8_000),
        (BinaryOp::Fdiv, 8_000),
    ] {
        let circuit = Circuit::new(128, |graph, inputs| {
            let (a, b) = inputs.split_at(64);
            match op {
                BinaryOp::Fadd => graph.add_floats(a, b),
                BinaryOp::Fsub => graph.subtract_floats(a, b),
                BinaryOp::Fmul => graph.multiply_floats(a, b),
                _ => graph.divide_floats(a, b),
            }
        });
        eprintln!("{}: {} gates", op.name(), circuit.graph.len());
        compare(op.name(), &circuit, &pairs(count), true, &|words| {
            eval::binary(op, Type::F64, words[0] as i64, words[1] as i64)
        });
    }
}

#[test]
fn doubles_are_compared_as_they_are() {
    let circuit = Circuit::new(128, |graph, inputs| {
        let (a, b) = inputs.split_at(64);
        let (equal, less, unordered) = graph.compare_floats(a, b);
        vec![equal, less, unordered]
    });
    compare("fcmp", &circuit, &pairs(20_000), false, &|words| {
        let (a, b) = (words[0] as i64, words[1] as i64);
        let holds = |cond| i64::from(eval::fcmp(cond, a, b));
        let unordered = f64::from_bits(words[0]).is_nan() || f64::from_bits(words[1]).is_nan();
        holds(FloatCond::Eq) | holds(FloatCond::Lt) << 1 | i64::from(unordered) << 2
    });
}

#[test]
fn doubles_are_rounded_and_converted_as_they_are() {
    let operands = pairs(20_000);
    for op in [UnaryOp::Ffloor, UnaryOp::Fceil, UnaryOp::Ftrunc, UnaryOp::Ffinite] {
        let circuit = Circuit::new(64, |graph, x| match op {
            UnaryOp::Ffloor => graph.without_fraction(x, |sign| sign),
            UnaryOp::Fceil => graph.without_fraction(x, |sign| !sign),
            UnaryOp::Ftrunc => graph.without_fraction(x, |_| FALSE),
            _ => graph.finite(x),
        });
        let truth = |words: &[u64]| eval::unary(op, Type::F64, words[0] as i64);
        compare(op.name(), &circuit, &operands, true, &truth);
    }
    let circuit = Circuit::new(64, |graph, x| {
        let int = graph.int_of_float(x);
        let (is_integer, is_nan) = graph.is_integer(x);
        let mut all = int;
        all.extend([is_integer, is_nan]);
        all
    });
    compare("f64 to i32", &circuit, &operands, false, &|words| {
        let convert = |op, to| eval::convert(op, Type::F64, to, words[0] as i64);
        let int = convert(ConvertOp::FloatToInt, Type::I32) & 0xFFFF_FFFF;
        let is_nan = i64::from(f64::from_bits(words[0]).is_nan());
        let or_nan = convert(ConvertOp::IsIntegerOrNan, Type::I1);
        assert_eq!(convert(ConvertOp::IsInteger, Type::I1) | is_nan, or_nan);
        int | convert(ConvertOp::IsInteger, Type::I1) << 32 | is_nan << 33
    });
}

#[test]
fn integers_become_the_doubles_that_they_are() {
    for ty in [Type::I8, Type::I16, Type::I32, Type::I64] {
        let width = ty.bits() as usize;
        let circuit = Circuit::new(width, |graph, x| graph.float_of_int(x));
        let mut rng = Rng::with_seed(3);
        let mut operands: Vec<Vec<u64>> = vec![];
        for shift in 0..width {
            for near in [0_i64, 1, -1] {
                operands.push(vec![(1_i64 << shift).wrapping_add(near) as u64]);
                operands.push(vec![(1_i64 << shift).wrapping_neg().wrapping_add(near) as u64]);
            }
        }
        operands.extend((0..5_000).map(|_| vec![rng.u64(..) >> rng.u32(..64)]));
        compare("int to f64", &circuit, &operands, false, &|words| {
            eval::convert(ConvertOp::IntToFloat, ty, Type::F64, ty.wrap(words[0] as i64))
        });
    }
}
