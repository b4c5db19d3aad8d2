//! Every operation on every type at the edges of its values: the IR interpreter and native code of
//! both levels against `plcc_ir::eval`, with operands from memory and as constants.
#![allow(clippy::unwrap_used, clippy::panic)]

use plcc_abi::engine::NoHost;
use plcc_abi::pmi::PmiTables;
use plcc_abi::{Engine, Outcome, Program, Region, Scan, Tables, image};
use plcc_codegen::{CodegenOptions, Target, compile};
use plcc_ir::interp::Interpreter;
use plcc_ir::{
    Address, BinaryOp, ChunkBuilder, ConvertOp, ExtractOp, Field, FloatCond, FuncBuilder,
    InstBuilder, IntCond, Type, UnaryOp, Value, eval,
};
use plcc_runtime::NativeEngine;

const INTEGERS: [Type; 4] = [Type::I8, Type::I16, Type::I32, Type::I64];
const A: u32 = 0;
const B: u32 = 8;
const RESULT: u32 = 16;
/// The offset of the region for truth values. The offsets of operands and result are the same in it
/// as in the region for all other types.
const BITS: u32 = 32;
const IMAGE: u32 = 2 * BITS + 2048;

fn values(ty: Type) -> Vec<i64> {
    let width = ty.bits();
    let mut values = match ty {
        Type::I1 => return vec![0, 1],
        Type::F64 => return floats(),
        _ => vec![0, 1, -1, 2, -2, 3, 7, -7, 10, 16, 25, 100],
    };
    let top = 1_i64 << (width - 2) << 1;
    values.extend([top, top.wrapping_sub(1), top.wrapping_add(1), top >> 1, i64::from(width)]);
    values.extend([i64::from(width) - 1, i64::from(width) + 1, 0x5555_5555_5555_5555]);
    for value in &mut values {
        *value = ty.wrap(*value);
    }
    values.sort_unstable();
    values.dedup();
    values
}

fn floats() -> Vec<i64> {
    let two_31 = 2_147_483_648.0;
    let two_63 = 9_223_372_036_854_775_808.0;
    let values = [
        0.0,
        0.5,
        1.0,
        1.5,
        2.5,
        3.0,
        1e-310,
        f64::MIN_POSITIVE,
        f64::MAX,
        f64::INFINITY,
        two_31,
        two_31 - 0.5,
        two_31 - 1.0,
        two_31 + 1.0,
        two_63,
        two_63 - 1024.0,
        two_63 + 2048.0,
        4_503_599_627_370_497.5,
        f64::NAN,
    ];
    values.iter().flat_map(|&v| [v, -v]).map(|v: f64| v.to_bits() as i64).collect()
}

fn write(image: &mut [u8], offset: u32, ty: Type, value: i64) {
    match ty.bytes() {
        1 => image::write_u8(image, offset, value as u8),
        2 => image::write_i16(image, offset, value as i16),
        4 => image::write_i32(image, offset, value as i32),
        _ => image::write_i64(image, offset, value),
    }
}

fn read(image: &[u8], offset: u32, ty: Type) -> i64 {
    match ty.bytes() {
        1 => ty.wrap(image::read_u8(image, offset).into()),
        2 => image::read_i16(image, offset).into(),
        4 => image::read_i32(image, offset).into(),
        _ => image::read_i64(image, offset),
    }
}

fn regions() -> Vec<Region> {
    let region = |name: &str, offset, size, bits| Region { name: name.into(), offset, size, bits };
    vec![
        region("vars", 0, BITS, false),
        region("bits", BITS, BITS, true),
        region("ports", 2 * BITS, 2048, false),
    ]
}

/// The operations with one integer, and its types.
const INTEGER_UNARY: [(UnaryOp, &[Type]); 2] =
    [(UnaryOp::Not, &INTEGERS), (UnaryOp::Neg, &INTEGERS)];

/// Where a value of a type lies: its address in the IR, and its offset in the image.
fn place(ty: Type, offset: u32) -> (Address, u32) {
    match ty {
        Type::I1 => (Address::fixed(plcc_ir::RegionId(1), offset), BITS + offset),
        _ => (Address::fixed(plcc_ir::RegionId(0), offset), offset),
    }
}

/// The engines for a module, each with its name.
fn engines(module: plcc_ir::Module) -> Vec<(&'static str, Box<dyn Engine>)> {
    let program = Program {
        files: vec!["ops".into()],
        image_size: IMAGE,
        regions: regions(),
        tasks: module.tasks.clone(),
        tables: Tables::Pmi(PmiTables::default()),
        names: vec![],
    };
    let native = |target: Target| -> Box<dyn Engine> {
        let code = compile(&module, &target, CodegenOptions::NONE).unwrap();
        Box::new(NativeEngine::new(&code, &program).unwrap())
    };
    vec![
        ("host", native(Target::host().unwrap())),
        ("baseline", native(Target::host_baseline().unwrap())),
        ("interpreter", Box::new(Interpreter::new(module))),
    ]
}

/// An operand: in memory, or this constant.
type Operand = Option<i64>;

/// Adds a task that computes `make(a, b)`.
fn task(
    b: &mut ChunkBuilder,
    types: [Type; 2],
    operands: [Operand; 2],
    make: &dyn Fn(&mut FuncBuilder, Value, Value) -> Value,
) {
    let start = b.place();
    b.bind(start);
    b.task("t", start);
    let [x, y] = [(A, 0), (B, 1)].map(|(offset, i)| match operands[i] {
        None => b.func().load(types[i], place(types[i], offset).0),
        Some(bits) if types[i] == Type::F64 => b.func().fconst(f64::from_bits(bits as u64)),
        Some(value) => b.func().constant(types[i], value),
    });
    let result = make(b.func(), x, y);
    let ty = b.func().func().ty(result);
    b.func().store(place(ty, RESULT).0, result);
    b.ret();
}

/// Computes `make` for all pairs of values, memory and constants mixed, in all engines.
fn check(
    what: &str,
    types: [Type; 2],
    result: Type,
    make: impl Fn(&mut FuncBuilder, Value, Value) -> Value,
    expected: impl Fn(i64, i64) -> i64,
) {
    let (left, right) = (values(types[0]), values(types[1]));
    let mut b = ChunkBuilder::new(IMAGE, regions());
    // The first task is the only one for both from memory, so each task has its pairs.
    let mut tasks: Vec<[Operand; 2]> = vec![[None, None]];
    tasks.extend(left.iter().map(|&x| [Some(x), None]));
    tasks.extend(right.iter().map(|&y| [None, Some(y)]));
    for &operands in &tasks {
        task(&mut b, types, operands, &make);
    }
    for (name, mut engine) in engines(b.finish()) {
        let mut image = vec![0; IMAGE as usize];
        for (number, operands) in tasks.iter().enumerate() {
            for &x in left.iter().filter(|&&x| operands[0].is_none_or(|only| only == x)) {
                for &y in right.iter().filter(|&&y| operands[1].is_none_or(|only| only == y)) {
                    write(&mut image, place(types[0], A).1, types[0], x);
                    write(&mut image, place(types[1], B).1, types[1], y);
                    let at = place(result, RESULT).1;
                    image[at as usize..(at + BITS - RESULT) as usize].fill(0x77);
                    let mut host = NoHost;
                    let mut scan = Scan::new(&mut image, &mut host);
                    assert_eq!(engine.call(number, None, &mut scan), Outcome::End);
                    let (got, wanted) = (read(&image, at, result), expected(x, y));
                    let nan = |bits| result == Type::F64 && f64::from_bits(bits as u64).is_nan();
                    assert!(
                        got == wanted || (nan(got) && nan(wanted)),
                        "{what} of {x:#x}, {y:#x} ({operands:?}) in {name}: {got:#x}, not {wanted:#x}"
                    );
                    let behind = read(&image, at + result.bytes(), Type::I8);
                    assert_eq!(behind, 0x77, "{what} in {name} writes too far");
                    if result == Type::I1 {
                        assert!(image[at as usize] <= 1, "{what} in {name} is not a truth value");
                    }
                }
            }
        }
    }
}

#[test]
fn integer_operations_give_what_eval_gives() {
    for &op in BinaryOp::ALL.iter().filter(|op| op.operands().include(Type::I32)) {
        for ty in INTEGERS {
            let what = format!("{}.{ty}", op.name());
            check(
                &what,
                [ty, ty],
                ty,
                |b, x, y| b.binary(op, x, y),
                |x, y| eval::binary(op, ty, x, y),
            );
        }
    }
}

#[test]
fn operations_on_truth_values_give_what_eval_gives() {
    let ty = Type::I1;
    for op in [BinaryOp::And, BinaryOp::Or, BinaryOp::Xor] {
        check(
            op.name(),
            [ty, ty],
            ty,
            |b, x, y| b.binary(op, x, y),
            |x, y| eval::binary(op, ty, x, y),
        );
    }
    check("not", [ty, ty], ty, |b, x, _| b.unary(UnaryOp::Not, x), |x, _| 1 - x);
    for cond in [IntCond::Eq, IntCond::Ne] {
        let expected = |x, y| i64::from(eval::icmp(cond, ty, x, y));
        check(cond.name(), [ty, ty], ty, |b, x, y| b.icmp(cond, x, y), expected);
    }
}

#[test]
fn unary_integer_operations_give_what_eval_gives() {
    for (op, types) in INTEGER_UNARY {
        for &ty in types {
            let what = format!("{}.{ty}", op.name());
            check(
                &what,
                [ty, Type::I1],
                ty,
                |b, x, _| b.unary(op, x),
                |x, _| eval::unary(op, ty, x),
            );
        }
    }
}

#[test]
fn comparisons_give_what_eval_gives() {
    for &cond in IntCond::ALL {
        for ty in INTEGERS {
            let what = format!("{}.{ty}", cond.name());
            let expected = |x, y| i64::from(eval::icmp(cond, ty, x, y));
            check(&what, [ty, ty], Type::I1, |b, x, y| b.icmp(cond, x, y), expected);
        }
    }
    let ty = Type::F64;
    for &cond in FloatCond::ALL {
        let expected = |x, y| i64::from(eval::fcmp(cond, x, y));
        check(cond.name(), [ty, ty], Type::I1, |b, x, y| b.fcmp(cond, x, y), expected);
    }
}

#[test]
fn operations_on_doubles_give_what_eval_gives() {
    let ty = Type::F64;
    for &op in BinaryOp::ALL.iter().filter(|op| op.operands().include(ty)) {
        check(
            op.name(),
            [ty, ty],
            ty,
            |b, x, y| b.binary(op, x, y),
            |x, y| eval::binary(op, ty, x, y),
        );
    }
    for &op in UnaryOp::ALL.iter().filter(|op| !INTEGER_UNARY.iter().any(|(of, _)| of == *op)) {
        check(
            op.name(),
            [ty, Type::I1],
            ty,
            |b, x, _| b.unary(op, x),
            |x, _| eval::unary(op, ty, x),
        );
    }
}

/// A sign is inverted or cleared of a NaN too.
#[test]
fn negation_and_magnitude_of_nan_change_only_the_sign_bit() {
    let bits = Type::I64;
    for (op, expected) in
        [(UnaryOp::Fneg, (|x| x ^ i64::MIN) as fn(i64) -> i64), (UnaryOp::Fabs, |x| x & i64::MAX)]
    {
        let make = |b: &mut FuncBuilder, x, _| {
            let x = b.convert(ConvertOp::Bitcast, Type::F64, x);
            let x = b.unary(op, x);
            b.convert(ConvertOp::Bitcast, bits, x)
        };
        check(op.name(), [bits, Type::I1], bits, make, |x, _| expected(x));
        let make = |b: &mut FuncBuilder, x, _| {
            let x = b.unary(op, x);
            b.convert(ConvertOp::Bitcast, bits, x)
        };
        check(op.name(), [Type::F64, Type::I1], bits, make, |x, _| expected(x));
    }
}

#[test]
fn conversions_give_what_eval_gives() {
    let with_i1: Vec<Type> = std::iter::once(Type::I1).chain(INTEGERS).collect();
    let mut pairs = vec![];
    for &from in &with_i1 {
        for &to in &with_i1 {
            if from.bits() < to.bits() {
                pairs.extend([(ConvertOp::Sext, from, to), (ConvertOp::Zext, from, to)]);
                if from != Type::I1 {
                    pairs.push((ConvertOp::Trunc, to, from));
                }
            }
        }
    }
    for int in [Type::I32, Type::I64] {
        pairs.push((ConvertOp::IntToFloat, int, Type::F64));
    }
    pairs.push((ConvertOp::FloatToInt, Type::F64, Type::I32));
    pairs.push((ConvertOp::IsInteger, Type::F64, Type::I1));
    pairs.push((ConvertOp::IsIntegerOrNan, Type::F64, Type::I1));
    pairs.push((ConvertOp::Bitcast, Type::I64, Type::F64));
    pairs.push((ConvertOp::Bitcast, Type::F64, Type::I64));
    for (op, from, to) in pairs {
        let what = format!("{}.{from}.{to}", op.name());
        let expected = |x, _| eval::convert(op, from, to, x);
        check(&what, [from, Type::I1], to, |b, x, _| b.convert(op, to, x), expected);
    }
}

/// The fields of an integer of some bits: single bits at its ends and in the middle, and wider ones up to all of it.
fn fields(bits: u8) -> Vec<Field> {
    let single = [0, 5, 7, bits / 2 + 1, bits - 1].map(Field::bit);
    let wider = [(0, 3), (2, 4), (bits / 2, bits / 2), (1, bits - 1), (0, bits - 1), (0, bits)];
    single.into_iter().chain(wider.map(|(first, width)| Field { first, width })).collect()
}

#[test]
fn bits_and_fields_give_what_eval_gives() {
    for ty in INTEGERS {
        for field in fields(ty.bits() as u8) {
            let what = format!("{field:?}.{ty}");
            for &op in ExtractOp::ALL {
                let expected = |x, _| eval::extract(op, ty, field, x);
                check(&what, [ty, Type::I1], ty, |b, x, _| b.extract(op, x, field), expected);
            }
            let expected = |x, y| eval::insert(ty, field, x, y);
            check(&what, [ty, ty], ty, |b, x, y| b.insert(x, y, field), expected);
            if field.width > 1 {
                continue;
            }
            check(&what, [ty, Type::I1], ty, |b, x, y| b.insert(x, y, field), expected);
            let number = field.first;
            let expected = |x, _| eval::bit(x, number);
            check(&what, [ty, Type::I1], Type::I1, |b, x, _| b.bit(x, number), expected);
            // The same where a branch is taken by the bit.
            let make = |b: &mut FuncBuilder, x, _| {
                let [set, clear, join] = [(); 3].map(|()| b.create_block());
                let param = b.block_param(join, Type::I1);
                let bit = b.bit(x, number);
                b.brif(bit, set, clear);
                for (block, result) in [(set, 1), (clear, 0)] {
                    b.switch_to(block);
                    let result = b.constant(Type::I1, result);
                    b.jump(join, &[result]);
                }
                b.switch_to(join);
                param
            };
            check(&what, [ty, Type::I1], Type::I1, make, expected);
        }
    }
}

/// Comparisons of a field with constants that it can hold or not; each is a bit of the result. Nothing else uses the field,
/// or something does.
#[test]
fn comparisons_of_fields_give_what_eval_gives() {
    let conds = [IntCond::Eq, IntCond::Ne, IntCond::Slt, IntCond::Sge, IntCond::Ugt];
    let compared = || conds.into_iter().flat_map(|cond| [0, 3, -2].map(|number| (cond, number)));
    for ty in [Type::I8, Type::I32] {
        for (field, &op) in fields(ty.bits() as u8)
            .into_iter()
            .flat_map(|field| ExtractOp::ALL.iter().map(move |op| (field, op)))
        {
            for is_used in [false, true] {
                let make = |b: &mut FuncBuilder, x, _| {
                    let value = b.extract(op, x, field);
                    let mut bits = match is_used {
                        true => b.sextend_or_trunc(Type::I64, value),
                        false => b.constant(Type::I64, 0),
                    };
                    for (cond, number) in compared() {
                        let holds = b.icmp_imm(cond, value, number);
                        let holds = b.zextend_or_trunc(Type::I64, holds);
                        let doubled = b.binary(BinaryOp::Add, bits, bits);
                        bits = b.binary(BinaryOp::Add, doubled, holds);
                    }
                    bits
                };
                let expected = |x, _| {
                    let value = eval::extract(op, ty, field, x);
                    compared().fold(if is_used { value } else { 0 }, |bits, (cond, number)| {
                        2 * bits + i64::from(eval::icmp(cond, ty, value, ty.wrap(number)))
                    })
                };
                check(&format!("{field:?}.{ty}"), [ty, Type::I1], Type::I64, make, expected);
            }
        }
    }
}

#[test]
fn selections_give_what_eval_gives() {
    for ty in Type::ALL {
        // The condition is whether the second operand is the first.
        let make = |b: &mut FuncBuilder, x, y| match ty {
            Type::F64 => {
                let same = b.fcmp(FloatCond::Le, x, y);
                b.select(same, x, y)
            }
            _ => {
                let same = b.icmp(IntCond::Ne, x, y);
                b.select(same, y, x)
            }
        };
        let expected = |x, y| match ty {
            Type::F64 if eval::fcmp(FloatCond::Le, x, y) => x,
            _ => y,
        };
        check(&format!("select.{ty}"), [ty, ty], ty, make, expected);
    }
}

/// A chosen element; an index that is not below the count is taken as 0.
#[test]
fn an_index_outside_its_count_is_taken_as_zero() {
    for (scale, count) in [(1_u32, 1_u32), (1, 8), (2, 3), (3, 5), (4, 4), (16, 1)] {
        let make = |b: &mut FuncBuilder, x: Value, _| {
            let at = Address::indexed(plcc_ir::RegionId(0), A, x, scale, count);
            b.load(Type::I8, at)
        };
        let expected = |x: i64, y: i64| {
            let number = x as u32;
            let offset = if number < count { number * scale } else { 0 };
            let [low, high] = [x as i32, y as i32].map(i32::to_le_bytes);
            let bytes = [&low[..], &[0; 4], &high, &[0; 4]].concat();
            i64::from(bytes[offset as usize] as i8)
        };
        // Whether the index is a constant or a value that was narrow makes other code.
        check(&format!("{scale} x {count}"), [Type::I32, Type::I32], Type::I8, make, expected);
        for (narrow, extend) in [(Type::I8, ConvertOp::Zext), (Type::I16, ConvertOp::Sext)] {
            let make = |b: &mut FuncBuilder, x: Value, _| {
                let cut = b.convert(ConvertOp::Trunc, narrow, x);
                let wide = b.convert(extend, Type::I32, cut);
                let at = Address::indexed(plcc_ir::RegionId(0), A, wide, scale, count);
                b.load(Type::I8, at)
            };
            let expected = |x: i64, y: i64| {
                let cut = narrow.wrap(x);
                let number = if extend == ConvertOp::Zext { cut as u8 as u32 } else { cut as u32 };
                let offset = if number < count { number * scale } else { 0 };
                let [low, high] = [x as i32, y as i32].map(i32::to_le_bytes);
                let bytes = [&low[..], &[0; 4], &high, &[0; 4]].concat();
                i64::from(bytes[offset as usize] as i8)
            };
            check(&format!("{scale} x {count}"), [Type::I32, Type::I32], Type::I8, make, expected);
        }
    }
}
