//! The pass that replaces divisions by constants: the results stay the same, and no division is left.
#![allow(clippy::unwrap_used)]

use plcc_abi::engine::NoHost;
use plcc_abi::{Engine, Scan};
use plcc_ir::interp::Interpreter;
use plcc_ir::passes::{OptLevel, optimize};
use plcc_ir::text::{parse, print};
use plcc_ir::{BinaryOp, ConvertOp, Type, eval};
use plcc_random::Rng;

const OPS: [BinaryOp; 5] =
    [BinaryOp::Sdiv, BinaryOp::Srem, BinaryOp::Udiv, BinaryOp::Urem, BinaryOp::Smod];

/// A module, optimised, whose scan loads `x` at offset 0 and stores `x op by` at offset 8. If `widen` is a
/// conversion, the operation is one of 32 bits, on `x` extended by it.
fn module(op: BinaryOp, ty: Type, by: i64, widen: Option<ConvertOp>) -> plcc_ir::Module {
    let (widen, of, value) = match widen {
        Some(widen) => (format!("    v1: i32 = {} v0\n", widen.name()), "i32", "v1"),
        None => (String::new(), ty.name(), "v0"),
    };
    let name = op.name();
    let text = format!(
        "image 16\nregion data at 0 size 16\ntask \"scan\" L0\n\nfn \"f\" {{\nblock0 (L0):\n    \
         v0: {ty} = load data:0\n{widen}    v2: {of} = iconst {by}\n    v3: {of} = {name} {value}, v2\n    \
         store data:8, v3\n    return\n}}\n"
    );
    let mut module = parse(&text).unwrap();
    optimize(&mut module, OptLevel::Speed);
    module
}

/// Dividends to try: around multiples of the divisor, at the limits of the type, and random ones.
fn dividends(ty: Type, by: i64, rng: &mut Rng) -> Vec<i64> {
    let least = -1i64 << (ty.bits() - 1);
    let mut all = vec![0, 1, -1, least, least + 1, -1 - least, -2 - least];
    for _ in 0..40 {
        let any = rng.bits() as i64;
        let multiple = if by == 0 { any } else { any / by * by };
        let small = (rng.below(64) as i64 - 32).wrapping_mul(by);
        all.extend([any, multiple, multiple - 1, multiple + 1, small, small - 1, small + 1]);
    }
    let last = least / by.abs().max(1) * by;
    all.extend([last, last - 1, last + 1, -last, -last - 1, -last + 1]);
    all.into_iter().map(|x| ty.wrap(x)).collect()
}

#[test]
fn division_by_a_constant_is_replaced_and_gives_the_same() {
    let mut rng = Rng::new(7);
    for ty in [Type::I8, Type::I16, Type::I32] {
        let least = -1i64 << (ty.bits() - 1);
        let mut divisors = vec![0, 1, -1, 2, -2, 3, 5, 7, 10, 100, -100, 641, 1000, 65535, 65537];
        divisors.extend([least, least + 1, -1 - least, -2 - least, -1 - least / 2, -least / 2]);
        divisors.extend((0..60).map(|_| rng.bits() as i64 >> rng.below(64)));
        for by in divisors.into_iter().map(|by| ty.wrap(by)) {
            for op in OPS {
                check(op, ty, by, None, &mut rng);
                if ty != Type::I32 {
                    check(op, ty, by, Some(ConvertOp::Zext), &mut rng);
                    check(op, ty, by, Some(ConvertOp::Sext), &mut rng);
                }
            }
        }
    }
}

fn check(op: BinaryOp, ty: Type, by: i64, widen: Option<ConvertOp>, rng: &mut Rng) {
    let module = module(op, ty, by, widen);
    let wide = widen == Some(ConvertOp::Zext);
    let (of, mask) = match widen {
        Some(ConvertOp::Zext) => (Type::I32, (1i64 << ty.bits()) - 1),
        Some(_) => (Type::I32, -1),
        None => (ty, -1),
    };
    let by_least = by == -1i64 << (ty.bits() - 1);
    let never_divides = match op {
        BinaryOp::Sdiv | BinaryOp::Srem => wide || !by_least,
        BinaryOp::Smod => by >= -1,
        _ => wide,
    };
    if never_divides {
        let text = print(&module);
        let divides = OPS.iter().any(|op| text.contains(&format!("= {} ", op.name())));
        assert!(!divides, "{} by {by} still divides:\n{text}", op.name());
    }
    let mut engine = Interpreter::new(module);
    for x in dividends(ty, by, rng) {
        let mut image = [0; 16];
        image[..8].copy_from_slice(&x.to_le_bytes());
        engine.call(0, None, &mut Scan::new(&mut image, &mut NoHost));
        let found = of.wrap(i64::from_le_bytes(image[8..].try_into().unwrap()));
        let wanted = eval::binary(op, of, x & mask, by);
        assert_eq!(found, wanted, "{} {ty} {x} by {by}, {widen:?}", op.name());
    }
}

/// Every dividend of 8 bits by every divisor, and every dividend of 16 bits by some.
#[test]
fn floored_remainders_by_constants_are_right_for_every_dividend() {
    let every = |ty: Type, divisors: &[i64]| {
        let most = i64::MAX >> (64 - ty.bits());
        for &by in divisors {
            let mut engine = Interpreter::new(module(BinaryOp::Smod, ty, by, None));
            for x in -1 - most..=most {
                let mut image = [0; 16];
                image[..8].copy_from_slice(&x.to_le_bytes());
                engine.call(0, None, &mut Scan::new(&mut image, &mut NoHost));
                let found = ty.wrap(i64::from_le_bytes(image[8..].try_into().unwrap()));
                assert_eq!(found, x.rem_euclid(by), "{x} by {by} in {ty}");
            }
        }
    };
    every(Type::I8, &(1..128).collect::<Vec<_>>());
    every(Type::I16, &[3, 10, 641, 16_383, 16_385, 16_387, 24_575, 32_765, 32_767]);
}

/// A dividend whose bounds are known from how it is made: a field with a sign, a sum, a product
/// and a magnitude.
#[test]
fn known_bounds_of_the_dividend_make_the_factors_smaller() {
    let text = |made: &str, by: i64| {
        format!(
            "image 16\nregion data at 0 size 16\ntask \"scan\" L0\n\nfn \"f\" {{\nblock0 (L0):\n\
             v0: i32 = load data:0\nv1: i32 = iconst 24\nv2: i32 = ashr v0, v1\n\
             v3: i32 = iconst 128\n{made}\nv8: i32 = iconst {by}\nv9: i32 = smod v7, v8\n\
             store data:8, v9\nreturn\n}}\n"
        )
    };
    for (made, value, most_factor) in [
        ("v7: i32 = add v2, v3", (|x| x + 128) as fn(i64) -> i64, 1 << 9),
        ("v7: i32 = sub v2, v3", |x| x - 128, 1 << 10),
        ("v7: i32 = mul v2, v3", |x| x * 128, 1 << 16),
        ("v6: i32 = neg v2\nv7: i32 = smax v2, v6", |x: i64| x.abs(), 1 << 9),
    ] {
        for by in [3, 5, 7, 10, 11, 100, 127] {
            let mut module = parse(&text(made, by)).unwrap();
            optimize(&mut module, OptLevel::Speed);
            for inst in module.funcs().flat_map(|(_, func)| {
                func.blocks().flat_map(move |(_, block)| block.insts.iter().map(|&i| *func.inst(i)))
            }) {
                if let plcc_ir::InstData::Iconst { ty: Type::I64, value } = inst {
                    assert!(value <= most_factor, "{made} by {by}: {value}");
                }
            }
            let mut engine = Interpreter::new(module);
            for x in -128..128 {
                let mut image = [0; 16];
                image[..4].copy_from_slice(&((x as i32) << 24).to_le_bytes());
                engine.call(0, None, &mut Scan::new(&mut image, &mut NoHost));
                let found = i32::from_le_bytes(image[8..12].try_into().unwrap());
                assert_eq!(i64::from(found), value(x).rem_euclid(by), "{made}, {x} by {by}");
            }
        }
    }
}

/// A dividend of little more than 32 bits: the sum of an `i32` and a constant, or a small multiple.
#[test]
fn sums_of_32_bits_are_divided_without_a_division() {
    let mut rng = Rng::new(11);
    for made in ["v3: i64 = add v1, v2", "v3: i64 = sub v1, v2", "v3: i64 = mul v1, v2"] {
        for constant in [1, 3, 44, 1000, 5_000_000] {
            for by in [3, 7, 33, 47, 63, 127, 641, 1000, 65_537, 8_388_609, 1_000_000_007] {
                let text = format!(
                    "image 16\nregion data at 0 size 16\ntask \"scan\" L0\n\nfn \"f\" {{\n\
                     block0 (L0):\nv0: i32 = load data:0\nv1: i64 = sext v0\n\
                     v2: i64 = iconst {constant}\n{made}\nv4: i64 = iconst {by}\n\
                     v5: i64 = smod v3, v4\nstore data:8, v5\nreturn\n}}\n"
                );
                let mut module = parse(&text).unwrap();
                let plain = module.clone();
                optimize(&mut module, OptLevel::Speed);
                if by <= 1000 || by < 10_000_000 && constant <= 44 {
                    assert!(!print(&module).contains("smod"), "{}", print(&module));
                }
                let mut engines = [plain, module].map(Interpreter::new);
                for x in dividends(Type::I32, by, &mut rng) {
                    let results = engines.each_mut().map(|engine| {
                        let mut image = [0; 16];
                        image[..4].copy_from_slice(&(x as i32).to_le_bytes());
                        engine.call(0, None, &mut Scan::new(&mut image, &mut NoHost));
                        i64::from_le_bytes(image[8..].try_into().unwrap())
                    });
                    assert_eq!(results[0], results[1], "{made}, {x}, {constant}, by {by}");
                }
            }
        }
    }
}

/// A division of doubles by a power of two becomes a multiplication with the same result.
#[test]
fn division_by_a_power_of_two_becomes_a_multiplication() {
    let powers = [2.0, 0.5, -8.0, 2f64.powi(1000)];
    let others = [3.0, 0.1, 2f64.powi(-1030), 2f64.powi(1023), 0.0, f64::INFINITY, f64::NAN];
    let numbers = [0.0, -0.0, 1.0, -3.5, f64::MAX, f64::MIN_POSITIVE, 5e-324, f64::INFINITY];
    for by in powers.into_iter().chain(others) {
        let text = format!(
            "image 16\nregion data at 0 size 16\ntask \"scan\" L0\n\nfn \"f\" {{\nblock0 (L0):\n\
             v0: f64 = load data:0\nv1: f64 = fconst {:#x}\nv2: f64 = fdiv v0, v1\n\
             store data:8, v2\nreturn\n}}\n",
            by.to_bits()
        );
        let mut module = parse(&text).unwrap();
        optimize(&mut module, OptLevel::Speed);
        assert_eq!(print(&module).contains("fmul"), powers.contains(&by), "{by}");
        let mut engine = Interpreter::new(module);
        for x in numbers {
            let mut image = [0; 16];
            image[..8].copy_from_slice(&x.to_le_bytes());
            engine.call(0, None, &mut Scan::new(&mut image, &mut NoHost));
            let found = f64::from_le_bytes(image[8..].try_into().unwrap());
            let wanted = x / by;
            assert!(found.to_bits() == wanted.to_bits() || found.is_nan() && wanted.is_nan());
        }
    }
}

/// Every dividend of 16 bits, extended with its sign, by some divisors: the product has 32 bits.
#[test]
fn signed_quotients_of_16_bits_are_computed_in_32_and_right_for_every_dividend() {
    for by in [2, 3, 7, 10, 64, 641, 862, 999, 16_383, 16_384, 16_385, 24_575, 32_767] {
        for op in [BinaryOp::Sdiv, BinaryOp::Srem] {
            let module = module(op, Type::I16, by, Some(ConvertOp::Sext));
            let text = print(&module);
            assert!(!text.contains("i64"), "{text}");
            let mut engine = Interpreter::new(module);
            for x in i64::from(i16::MIN)..=i64::from(i16::MAX) {
                let mut image = [0; 16];
                image[..8].copy_from_slice(&x.to_le_bytes());
                engine.call(0, None, &mut Scan::new(&mut image, &mut NoHost));
                let found = Type::I32.wrap(i64::from_le_bytes(image[8..].try_into().unwrap()));
                let wanted = if op == BinaryOp::Sdiv { x / by } else { x % by };
                assert_eq!(found, wanted, "{} {x} by {by}", op.name());
            }
        }
    }
}
