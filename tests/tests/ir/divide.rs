//! Quotients and remainders by constants are those of the division, which is gone.
#![allow(clippy::unwrap_used)]

use plcc_abi::engine::NoHost;
use plcc_abi::{Engine, Scan};
use plcc_ir::interp::Interpreter;
use plcc_ir::passes::{OptLevel, optimize};
use plcc_ir::text::{parse, print};
use plcc_ir::{BinaryOp, Type, eval};
use plcc_random::Rng;

const OPS: [BinaryOp; 4] = [BinaryOp::Sdiv, BinaryOp::Srem, BinaryOp::Udiv, BinaryOp::Urem];

/// A scan that leaves `x op by` at 8, optimised; with `wide`, of an i32 that holds `x` unsigned.
fn module(op: BinaryOp, ty: Type, by: i64, wide: bool) -> plcc_ir::Module {
    let (widen, of, value) = match wide {
        true => ("    v1: i32 = zext v0\n", "i32", "v1"),
        false => ("", ty.name(), "v0"),
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

/// Numbers around multiples of a divisor and at the edges, and any.
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
fn constants_divide_without_dividing() {
    let mut rng = Rng::new(7);
    for ty in [Type::I8, Type::I16, Type::I32] {
        let least = -1i64 << (ty.bits() - 1);
        let mut divisors = vec![0, 1, -1, 2, -2, 3, 5, 7, 10, 100, -100, 641, 1000, 65535, 65537];
        divisors.extend([least, least + 1, -1 - least, -2 - least, -1 - least / 2, -least / 2]);
        divisors.extend((0..60).map(|_| rng.bits() as i64 >> rng.below(64)));
        for by in divisors.into_iter().map(|by| ty.wrap(by)) {
            for op in OPS {
                for wide in [false, ty != Type::I32] {
                    check(op, ty, by, wide, &mut rng);
                }
            }
        }
    }
}

fn check(op: BinaryOp, ty: Type, by: i64, wide: bool, rng: &mut Rng) {
    let module = module(op, ty, by, wide);
    let (of, mask) = match wide {
        true => (Type::I32, (1i64 << ty.bits()) - 1),
        false => (ty, -1),
    };
    let signed = matches!(op, BinaryOp::Sdiv | BinaryOp::Srem);
    let by_least = by == -1i64 << (ty.bits() - 1);
    if wide || signed && !by_least {
        let text = print(&module);
        let divides = OPS.iter().any(|op| text.contains(&format!("= {} ", op.name())));
        assert!(!divides, "{} by {by} still divides:\n{text}", op.name());
    }
    let mut engine = Interpreter::new(module);
    for x in dividends(ty, by, rng) {
        let mut image = [0; 16];
        image[..8].copy_from_slice(&x.to_le_bytes());
        engine.call(0, None, &mut Scan { image: &mut image, host: &mut NoHost });
        let found = of.wrap(i64::from_le_bytes(image[8..].try_into().unwrap()));
        let wanted = eval::binary(op, of, x & mask, by);
        assert_eq!(found, wanted, "{} {ty} {x} by {by}, wide {wide}", op.name());
    }
}
