//! Doubles bit by bit: each operation gives what `plcc_ir::eval` computes, for random and for special operands.

#![allow(clippy::unwrap_used, clippy::panic, clippy::indexing_slicing, reason = "tests")]

mod support;

use std::collections::HashMap;

use fastrand::Rng;
use plcc_abi::pmac::pure_functions;
use plcc_abi::{Dialect, HostFn};
use plcc_ir::{BinaryOp, ConvertOp, FloatCond, Type, UnaryOp, eval};
use plcc_prove::Station;
use plcc_prove::logic::{FALSE, Graph, Lit, Memory, Node, TRUE};
use plcc_prove::scan::{Builder, Code};
use plcc_runtime::{Purpose, Setting};
use support::Bench;

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
fn the_bits_of_doubles_are_those_that_a_pmac_takes() {
    let circuit = Circuit::new(64, |graph, x| graph.bits_of_float(x));
    let mut operands = pairs(20_000);
    let mut rng = Rng::with_seed(11);
    operands.extend((0..10_000).map(|_| {
        let exponent = rng.u64(1010..1160) << 52;
        vec![rng.u64(..) & 0x800F_FFFF_FFFF_FFFF | exponent]
    }));
    compare("bits", &circuit, &operands, false, &|words| {
        pure_functions::call(HostFn::PmacBits, [words[0], 0, 0, 0]).unwrap() as i64
    });
}

/// What a PLC computes in a scan is what the interpreter does, bit for bit, from random states.
#[test]
fn a_scan_of_a_plc_is_what_the_interpreter_does() {
    let text = "I5=2\nOPEN PLC 1 CLEAR\nP1=P2*P3+P4/3-INT(P5)\nIF (P2>P3 AND P4!<P5)\nP6=P6+0.1\nELSE\n\
                P7=P2%7\nENDIF\nP8=(P2&P3)|4^P5\nIF (P5=P2 OR P3!=P4)\nP9=ABS(P4)-1000000.5\nENDIF\nP10=-P2/P3\nCLOSE\n";
    let bench = Bench::new(Dialect::Pmac, text);
    let mut executive = bench.executive();
    let mut engine = bench.engine();
    let names = executive.names();
    let key = |number: u32| names.find(&format!("P{number}"), Purpose::Stimulus).unwrap();
    let place = |number| names.properties(key(number)).value.unwrap().offset as usize;
    let code = Code::new(&bench.lowered.module, None);
    let mut builder = Builder::default();
    let mut memory = Memory::of_bytes(&bench.image);
    let mut inputs = vec![];
    for number in 2..10 {
        let bits = builder.graph.inputs(64);
        memory.store(place(number), &bits);
        inputs.extend(bits);
    }
    let ends = code.scan(&mut builder, 0, TRUE, &memory, u32::MAX);
    let (_, after) = ends.end.unwrap();
    assert!(builder.escapes.is_empty(), "{:?}", builder.reasons);
    let mut rng = Rng::with_seed(5);
    let (mut compared, mut open) = (0, 0);
    let read = |image: &[u8], number| {
        u64::from_le_bytes(image[place(number)..place(number) + 8].try_into().unwrap())
    };
    for _ in 0..400 {
        let whole = rng.bool();
        for number in 2..10 {
            let value = match whole {
                true => f64::from(rng.i32(-40..40)),
                false => random(&mut rng, 3.0),
            };
            let value = if value.is_finite() { value } else { 0.0 };
            executive.write(key(number), Setting::Float(value));
        }
        let mut values = HashMap::new();
        for (at, lit) in inputs.iter().enumerate() {
            let word = read(executive.image(), 2 + at as u32 / 64);
            values.insert(lit.node(), word >> (at % 64) & 1 == 1);
        }
        executive.tick(engine.as_mut(), &mut vec![]).unwrap();
        // What is not computed is 0 and something else: where both give the same it did not matter.
        let mut found = vec![];
        for unknown in [false, true] {
            values.extend(builder.unknown.keys().map(|node| (*node, unknown && node % 2 == 0)));
            found.push(support::values(&builder.graph, &values));
        }
        for number in 1..11 {
            let word = |values: &[bool]| {
                after.load(place(number), 8).iter().enumerate().fold(0, |all, (at, lit)| {
                    let on = values[lit.node() as usize] != lit.is_complement();
                    all | u64::from(on) << at
                })
            };
            let (ours, other) = (word(&found[0]), word(&found[1]));
            if ours != other {
                open += 1;
                continue;
            }
            compared += 1;
            let expected = read(executive.image(), number);
            let shown = [f64::from_bits(ours), f64::from_bits(expected)];
            assert_eq!(ours, expected, "P{number}: {shown:?}");
        }
    }
    assert!(compared > 3_000 && open < 600, "{compared} compared, {open} open");
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
