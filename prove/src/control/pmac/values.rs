//! Which doubles have few values, or are always integers of a known range, so that a few bits are enough to keep them.
//!
//! What a program stores is looked at without the ways that lead to it: constants, fields of words, and what operators and functions
//! make of those.

use std::collections::BTreeMap;

use plcc_abi::HostFn;
use plcc_abi::pmac::pure_functions;
use plcc_ir::{BinaryOp, ConvertOp, ExtractOp, Func, InstData, Module, Type, UnaryOp, Value, eval};

/// The integers from the first to the last.
pub(super) type Interval = (i64, i64);

/// The values of a double.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Values {
    /// One of these, by their bits, in rising order.
    Few(Vec<u64>),
    /// An integer.
    Integer(Interval),
}

/// The most values that are kept one by one.
const FEW: usize = 16;

/// The largest number of an interval.
const LIMIT: i64 = (1 << 31) - 1;

/// The rounds after which a variable that still gets further values may be anything.
const ROUNDS: usize = 24;

/// How deep expressions are looked into.
const DEPTH: u32 = 24;

/// What is stored in a double.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stored {
    /// A value of a function.
    Value(Func, Value),
    /// An integer.
    Integer(Interval),
    /// Anything.
    Any,
}

fn bounded((low, high): Interval) -> Option<Values> {
    match high - low {
        _ if low < -LIMIT || high > LIMIT => None,
        distance if distance < FEW as i64 => {
            Some(few((low..=high).map(|value| (value as f64).to_bits())))
        }
        _ => Some(Values::Integer((low, high))),
    }
}

fn few(values: impl Iterator<Item = u64>) -> Values {
    let mut values: Vec<u64> = values.collect();
    values.sort_unstable();
    values.dedup();
    Values::Few(values)
}

impl Values {
    pub(super) fn one(bits: u64) -> Self {
        Self::Few(vec![bits])
    }

    /// The interval of the values, if all are integers.
    fn interval(&self) -> Option<Interval> {
        match self {
            Self::Integer(interval) => Some(*interval),
            Self::Few(values) => {
                let mut all: Option<Interval> = None;
                for &bits in values {
                    let value = f64::from_bits(bits);
                    if value.fract() != 0.0 || value.abs() > LIMIT as f64 {
                        return None;
                    }
                    let value = value as i64;
                    all =
                        Some(all.map_or((value, value), |(low, high)| {
                            (low.min(value), high.max(value))
                        }));
                }
                all
            }
        }
    }

    fn join(self, other: Self) -> Option<Self> {
        if let (Self::Few(a), Self::Few(b)) = (&self, &other)
            && let Self::Few(all) = few(a.iter().chain(b).copied())
            && all.len() <= FEW
        {
            return Some(Self::Few(all));
        }
        let ((low, high), (l, h)) = (self.interval()?, other.interval()?);
        bounded((low.min(l), high.max(h)))
    }
}

/// What an operation makes of few values; `None` where these are too many.
fn of_few(operands: &[&Values], result: impl Fn(&[u64]) -> Option<u64>) -> Option<Values> {
    let mut rows: Vec<Vec<u64>> = vec![vec![]];
    for operand in operands {
        let Values::Few(values) = operand else { return None };
        rows = rows
            .iter()
            .flat_map(|row| values.iter().map(|&value| [row.as_slice(), &[value]].concat()))
            .collect();
    }
    let found: Option<Vec<u64>> = rows.iter().map(|row| result(row)).collect();
    let Values::Few(found) = few(found?.into_iter()) else { return None };
    (found.len() <= FEW).then_some(Values::Few(found))
}

/// Looks at the values of a program.
struct Looker<'p> {
    module: &'p Module,
    func: Func,
    /// The values of the double at an offset.
    double: &'p dyn Fn(u32) -> Option<Values>,
}

impl Looker<'_> {
    fn inst(&self, value: Value) -> Option<&InstData> {
        self.module.funcs.get(self.func.index())?.def_inst(value)
    }

    /// The interval of an integer value.
    fn integer(&self, value: Value) -> Option<Interval> {
        let ty = self.module.funcs.get(self.func.index())?.ty(value);
        let signed = |bits: u32| (-(1_i64 << (bits - 1)), (1_i64 << (bits - 1)) - 1);
        match *self.inst(value)? {
            InstData::Iconst { value, .. } => (value.abs() <= LIMIT).then_some((value, value)),
            InstData::Extract { op: ExtractOp::Unsigned, field, .. } => {
                Some((0, (1 << field.width) - 1))
            }
            InstData::Extract { op: ExtractOp::Signed, field, .. } => {
                Some(signed(field.width.into()))
            }
            InstData::Convert { op: ConvertOp::Zext, arg, .. } => {
                self.integer(arg).filter(|it| it.0 >= 0)
            }
            _ if ty == Type::I1 => Some((0, 1)),
            _ if ty.bits() < 32 => Some(signed(ty.bits())),
            _ => None,
        }
    }

    /// The values of a double, if they are known.
    fn value(&self, value: Value, depth: u32) -> Option<Values> {
        let of = |value: Value| self.value(value, depth.checked_sub(1)?);
        let inst = self.inst(value)?;
        match *inst {
            InstData::Iconst { ty: Type::I64, value } => Some(Values::one(value as u64)),
            InstData::Fconst { bits } => Some(Values::one(bits)),
            InstData::Load { at, ty: Type::F64 | Type::I64 } if at.index.is_none() => {
                let base = self.module.region(at.region).map_or(0, |region| region.offset);
                (self.double)(base + at.offset)
            }
            InstData::Convert { op: ConvertOp::IntToFloat, arg, .. } => {
                self.integer(arg).and_then(bounded)
            }
            InstData::Unary { op, arg } => {
                let operand = of(arg)?;
                let unary = |x: &[u64]| Some(eval::unary(op, Type::F64, *x.first()? as i64) as u64);
                of_few(&[&operand], unary).or_else(|| {
                    let (low, high) = operand.interval()?;
                    match op {
                        UnaryOp::Ffinite | UnaryOp::Ffloor => bounded((low, high)),
                        UnaryOp::Fneg => bounded((-high, -low)),
                        UnaryOp::Fabs => bounded((0, low.abs().max(high.abs()))),
                        _ => None,
                    }
                })
            }
            InstData::Binary { op, args: [a, b] } => {
                let (a, b) = (of(a)?, of(b)?);
                let binary = |x: &[u64]| {
                    let (a, b) = (*x.first()? as i64, *x.get(1)? as i64);
                    Some(eval::binary(op, Type::F64, a, b) as u64)
                };
                of_few(&[&a, &b], binary).or_else(|| {
                    let ((low, high), (l, h)) = (a.interval()?, b.interval()?);
                    match op {
                        BinaryOp::Fadd => bounded((low + l, high + h)),
                        BinaryOp::Fsub => bounded((low - h, high - l)),
                        BinaryOp::Fmul => {
                            let all = [low * l, low * h, high * l, high * h];
                            let ends = (all.iter().min(), all.iter().max());
                            bounded((*ends.0?, *ends.1?))
                        }
                        _ => None,
                    }
                })
            }
            InstData::Select { args: [a, b], .. } => of(a)?.join(of(b)?),
            InstData::HostCall { function, .. } => {
                let mut args = vec![];
                inst.for_each_arg(|value| args.push(of(value)));
                self.call(function, &args)
            }
            _ => None,
        }
    }

    /// The values that a function gives.
    fn call(&self, function: HostFn, args: &[Option<Values>]) -> Option<Values> {
        let known: Option<Vec<&Values>> = args.iter().map(Option::as_ref).collect();
        let result = |x: &[u64]| {
            let mut args = [0; 4];
            args.iter_mut().zip(x).for_each(|(slot, &value)| *slot = value);
            pure_functions::call(function, args)
        };
        if let Some(values) = known.and_then(|known| of_few(&known, result)) {
            return Some(values);
        }
        let interval = |at: usize| args.get(at)?.as_ref()?.interval();
        match function {
            // The remainder of a number above 0 is less than that.
            HostFn::PmacMod => {
                let ((n, m), _) = (interval(1)?, interval(0)?);
                (n == m && n > 0).then(|| bounded((0, n - 1)))?
            }
            HostFn::PmacAnd => {
                let (a, b) = (interval(0)?, interval(1)?);
                (a.0 >= 0 && b.0 >= 0).then(|| bounded((0, a.1.min(b.1))))?
            }
            HostFn::PmacOr | HostFn::PmacXor => {
                let (a, b) = (interval(0)?, interval(1)?);
                let bits = 64 - ((a.1 | b.1) as u64).leading_zeros();
                (a.0 >= 0 && b.0 >= 0).then(|| bounded((0, (1_i64 << bits) - 1)))?
            }
            HostFn::PmacRange => {
                let ((low, _), (_, high)) = (interval(1)?, interval(2)?);
                bounded((low.min(0), high.max(0)))
            }
            _ => None,
        }
    }
}

/// The values of doubles, by offset, given what is stored in each. `first` are those of one at first, and of one that nothing is
/// stored in.
pub(super) fn values(
    module: &Module,
    stores: &BTreeMap<u32, Vec<Stored>>,
    first: &dyn Fn(u32) -> Option<Values>,
) -> BTreeMap<u32, Values> {
    let mut known: BTreeMap<u32, Option<Values>> =
        stores.keys().map(|&offset| (offset, first(offset))).collect();
    for round in 0.. {
        let mut changed = false;
        for (&offset, stores) in stores {
            let Some(Some(now)) = known.get(&offset).cloned() else { continue };
            let double = |offset: u32| known.get(&offset).cloned().unwrap_or_else(|| first(offset));
            let all = stores.iter().try_fold(now.clone(), |all, store| {
                let it = match *store {
                    Stored::Integer(it) => bounded(it)?,
                    Stored::Any => return None,
                    Stored::Value(func, value) => {
                        Looker { module, func, double: &double }.value(value, DEPTH)?
                    }
                };
                all.join(it)
            });
            if all.as_ref() == Some(&now) {
                continue;
            }
            changed = true;
            known.insert(offset, all.filter(|_| round < ROUNDS));
        }
        if !changed {
            break;
        }
    }
    known.into_iter().filter_map(|(offset, it)| Some((offset, it?))).collect()
}
