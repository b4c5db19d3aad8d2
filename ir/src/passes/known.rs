//! Which bits of an integer may be 1, from how it is made.

use crate::{BinaryOp, ConvertOp, FuncData, InstData, Type, Value};

/// All bits of a type.
pub(super) fn mask(ty: Type) -> u64 {
    match ty.bits() {
        64 => u64::MAX,
        bits => (1 << bits) - 1,
    }
}

/// All bits up to the highest of a number.
fn smear(most: u64) -> u64 {
    match most.leading_zeros() {
        0 => u64::MAX,
        zeros => (1 << (64 - zeros)) - 1,
    }
}

/// For each value the bits that may be 1; filled in as values are visited.
pub(super) struct Known(Vec<u64>);

impl Known {
    /// Nothing known.
    pub(super) fn new(func: &FuncData) -> Self {
        Self(func.values.iter().map(|value| mask(value.ty)).collect())
    }

    /// The bits of a value that may be 1; as a number, the most that it can be.
    pub(super) fn ones(&self, value: Value) -> u64 {
        self.0.get(value.index()).copied().unwrap_or(u64::MAX)
    }

    /// Notes what is known of an instruction's result.
    pub(super) fn note(&mut self, func: &FuncData, value: Value, data: &InstData) {
        let all = mask(func.ty(value));
        let ones = self.result(func, data, all) & all;
        if let Some(slot) = self.0.get_mut(value.index()) {
            *slot = ones;
        } else {
            self.0.resize(value.index(), u64::MAX);
            self.0.push(ones);
        }
    }

    fn result(&self, func: &FuncData, data: &InstData, all: u64) -> u64 {
        match *data {
            InstData::Iconst { ty: _, value } => value as u64,
            InstData::Binary { op, args: [a, b] } => {
                let by = func.constant(b).map(|by| by as u64 & all);
                self.binary(op, self.ones(a), self.ones(b), by, all)
            }
            InstData::Select { cond: _, args: [a, b] } => self.ones(a) | self.ones(b),
            InstData::Convert { op, to: _, arg } => {
                let ones = self.ones(arg);
                let sign = 1 << (func.ty(arg).bits() - 1);
                match op {
                    ConvertOp::Zext | ConvertOp::Trunc => ones,
                    ConvertOp::Sext if ones & sign == 0 => ones,
                    _ => all,
                }
            }
            _ => all,
        }
    }

    fn binary(&self, op: BinaryOp, a: u64, b: u64, by: Option<u64>, all: u64) -> u64 {
        let within = |most: Option<u64>| match most {
            Some(most) if most <= all => smear(most),
            _ => all,
        };
        match (op, by) {
            (BinaryOp::And, _) => a & b,
            (BinaryOp::Or | BinaryOp::Xor, _) => a | b,
            (BinaryOp::Shl, Some(by)) => {
                a.checked_shl(u32::try_from(by).unwrap_or(64)).unwrap_or(0)
            }
            (BinaryOp::Lshr, Some(by)) => {
                a.checked_shr(u32::try_from(by).unwrap_or(64)).unwrap_or(0)
            }
            (BinaryOp::Lshr | BinaryOp::Udiv | BinaryOp::Urem, None) => smear(a),
            (BinaryOp::Udiv, Some(by)) => smear(a.checked_div(by).unwrap_or(0)),
            (BinaryOp::Urem, Some(by)) => smear(a.min(by.saturating_sub(1))),
            (BinaryOp::Umin, _) => smear(a.min(b)),
            (BinaryOp::Umax, _) => smear(a.max(b)),
            (BinaryOp::Add, _) => within(a.checked_add(b)),
            (BinaryOp::Mul, _) => within(a.checked_mul(b)),
            _ => all,
        }
    }
}
