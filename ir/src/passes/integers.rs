//! Computes with integers where doubles are known to be integers, and drops operations that change
//! no double which can occur.
//!
//! ```text
//! v1: f64 = itof v0                                (v0 is from 0 to 7)
//! v2: f64 = fconst 3.0                             v2: i32 = iconst 3
//! v3: f64 = fadd v1, v2                     ==>    v3: i32 = add v0, v2
//! v4: f64 = ffinite v3                             v4: f64 = itof v3
//! store p:0, v4                                    store p:0, v4
//! ```
//!
//! What can occur is found by range analysis ([`float_range`](super::float_range)). An operation is
//! computed with integers if its operands and its result are integers whose magnitude is at most
//! 2^53: then both arithmetics give the same, but for the sign of a zero. Where a double may be -0,
//! the instruction that computes it as a double stays, for uses that need the sign of the zero, and the
//! one on integers is added for the others.

mod params;

use plcc_abi::{HostFn, IntegerForm};

use super::float_range::{FloatRange, FloatRanges};
use super::graph::Graph;
use super::substitution::Substitution;
use super::value_range::{PassedBounds, ValueRanges};
use crate::InstBuilder;
use crate::{
    BinaryOp, Block, ConvertOp, FloatCond, FuncData, Inst, InstData, IntCond, PrimaryMap, RegionId,
    SecondaryMap, StatementId, Terminator, Type, UnaryOp, Value,
};

/// A function being changed.
struct Integers<'a> {
    func: &'a mut FuncData,
    integers: ValueRanges,
    floats: FloatRanges<'a>,
    /// For each double the integer value that is equal to it (-0 and 0 are equal), if there is one.
    integer_of: SecondaryMap<Value, Option<Value>>,
    /// The instructions of the current block that have been visited and stay, and new ones.
    out: Vec<Inst>,
    /// The statement of the current instruction.
    loc: StatementId,
}

/// What an instruction becomes.
enum Change {
    /// Its result is another value.
    Value(Value),
    /// It becomes another instruction.
    Inst(InstData),
}

/// Runs the pass; returns false if the function has no doubles. `finite_regions` are those of the module.
pub(super) fn run(func: &mut FuncData, finite_regions: &[RegionId]) -> bool {
    if !has_doubles(func) {
        return false;
    }
    let graph = Graph::new(func);
    let mut values = Substitution::new(func);
    let integers = ValueRanges::new(func);
    let floats = FloatRanges::new(func, finite_regions);
    let integer_of = vec![None; func.value_count()].into();
    let mut this =
        Integers { func, integers, floats, integer_of, out: vec![], loc: StatementId::NONE };
    let mut passed = PassedRanges::new(&graph);
    let mut passed_bounds = PassedBounds::new(&graph);
    let before = graph.predecessors(this.func);
    for &block in &graph.order {
        for (at, &param) in this.func.blocks[block].params.iter().enumerate() {
            this.floats.set(param, passed.param(block, at));
        }
        passed_bounds.enter(this.func, block, &mut this.integers);
        this.params(block, &before[block], &mut values);
        let insts = std::mem::take(&mut this.func.blocks[block].insts);
        this.out.reserve(insts.len());
        for inst in insts {
            this.loc = this.func.loc(inst);
            let mut data = *this.func.inst(inst);
            values.inst(&mut data);
            if let Some(result) = this.func.result(inst) {
                match this.change(&data, result) {
                    Some(Change::Value(value)) => {
                        values.replace(result, value);
                        continue;
                    }
                    Some(Change::Inst(changed)) => data = changed,
                    None => {}
                }
                this.note(result, &data);
            }
            this.func.insts[inst] = data;
            this.out.push(inst);
        }
        let data = &mut this.func.blocks[block];
        data.insts = std::mem::take(&mut this.out);
        if let Some(terminator) = &mut data.terminator {
            values.terminator(terminator);
            passed.note(terminator, &this.floats);
        }
        if let Some(terminator) = &this.func.blocks[block].terminator {
            passed_bounds.note(this.func, terminator, &this.integers);
        }
    }
    true
}

/// Whether a function computes with doubles at all.
fn has_doubles(func: &FuncData) -> bool {
    func.values.values().any(|value| value.ty == Type::F64)
}

/// The ranges that branches pass to the parameters of blocks.
pub(super) struct PassedRanges {
    /// For each block the number of edges to it that have not been visited, and what those pass that
    /// have.
    blocks: PrimaryMap<Block, (u32, Vec<FloatRange>)>,
}

impl PassedRanges {
    /// Nothing is visited yet.
    pub(super) fn new(graph: &Graph) -> Self {
        Self { blocks: graph.edges.values().map(|&edges| (edges, vec![])).collect() }
    }

    /// What all branches to a block pass to its parameter with a number. If one of them was not
    /// visited yet, nothing is known.
    pub(super) fn param(&self, block: Block, number: usize) -> FloatRange {
        match &self.blocks[block] {
            (0, ranges) => ranges.get(number).copied().unwrap_or(FloatRange::ANY),
            _ => FloatRange::ANY,
        }
    }

    /// Visits a terminator.
    pub(super) fn note(&mut self, terminator: &Terminator, floats: &FloatRanges<'_>) {
        terminator.for_each_block(|block, args| {
            let (missing, ranges) = &mut self.blocks[block];
            *missing = missing.saturating_sub(1);
            let passed = args.iter().map(|&arg| floats.get(arg));
            if ranges.is_empty() {
                ranges.extend(passed);
            } else {
                for (range, passed) in ranges.iter_mut().zip(passed) {
                    *range = range.join(passed);
                }
            }
        });
    }
}

/// The integer type that has room for all numbers between two.
fn type_for(low: i64, high: i64) -> Type {
    let fits = i32::try_from(low).is_ok() && i32::try_from(high).is_ok();
    if fits { Type::I32 } else { Type::I64 }
}

impl InstBuilder for Integers<'_> {
    fn func(&self) -> &FuncData {
        self.func
    }

    /// Inserts an instruction before the current one.
    fn build(&mut self, data: InstData) -> Value {
        let (inst, value) = self.func.append(data, self.loc);
        self.out.push(inst);
        self.note(value, &data);
        value
    }
}

impl Integers<'_> {
    /// Enters what is known of a result.
    fn note(&mut self, result: Value, data: &InstData) {
        match self.func.ty(result) {
            Type::F64 => {
                self.floats.note(self.func, &self.integers, result, data);
                if let InstData::Convert { op: ConvertOp::IntToFloat, to: _, arg } = *data {
                    self.set_integer(result, arg);
                }
            }
            _ => self.integers.note(self.func, result, data),
        }
    }

    /// Enters the integer value that is equal to a double.
    fn set_integer(&mut self, double: Value, integer: Value) {
        self.integer_of[double] = Some(integer);
    }

    /// The low bits of a double that is an integer, as an integer of a type; `None` if no integer
    /// value equals it.
    fn operand(&mut self, double: Value, ty: Type) -> Option<Value> {
        if let Some(bits) = self.func.constant(double) {
            let (value, _) = FloatRange::constant(bits as u64).integers()?;
            return Some(self.constant(ty, value));
        }
        let integer = self.integer_of[double]?;
        let from = self.func.ty(integer);
        let op = match ty.bits().cmp(&from.bits()) {
            std::cmp::Ordering::Equal => return Some(integer),
            std::cmp::Ordering::Less => ConvertOp::Trunc,
            std::cmp::Ordering::Greater => ConvertOp::Sext,
        };
        Some(self.convert(op, ty, integer))
    }

    /// Whether an integer value equals the double, so that [`operand`](Self::operand) gives one.
    fn is_integer(&self, double: Value) -> bool {
        self.floats.get(double).integers().is_some()
            && (self.func.constant(double).is_some() || self.integer_of[double].is_some())
    }

    /// What an instruction becomes; `None` if it stays.
    fn change(&mut self, data: &InstData, result: Value) -> Option<Change> {
        match *data {
            InstData::Unary { op: UnaryOp::Ffinite, arg } if self.floats.get(arg).is_finite() => {
                Some(Change::Value(arg))
            }
            InstData::Unary { op: UnaryOp::Ffloor | UnaryOp::Fceil | UnaryOp::Ftrunc, arg }
                if self.floats.get(arg).integers().is_some() =>
            {
                Some(Change::Value(arg))
            }
            InstData::Binary { op: BinaryOp::Fadd, args: [x, zero] }
                if self.func.constant(zero) == Some(0) =>
            {
                let range = self.floats.get(x);
                if !range.may_be_nan() && !range.may_be_minus_zero() {
                    return Some(Change::Value(x));
                }
                let integer = self.integer_of[x]?;
                Some(Change::Inst(to_double(integer)))
            }
            InstData::HostCall { function, args } => self.call(function, args.as_slice(), result),
            InstData::Fcmp { cond, args } => self.compare(cond, args),
            InstData::Unary { .. } | InstData::Binary { .. } | InstData::Select { .. }
                if self.func.ty(result) == Type::F64 =>
            {
                let range = self.floats.of(self.func, &self.integers, data);
                let (low, high) = range.integers()?;
                let integer = self.arithmetic(data, low, high)?;
                if range.may_be_minus_zero() {
                    self.set_integer(result, integer);
                    return None;
                }
                Some(Change::Inst(to_double(integer)))
            }
            _ => None,
        }
    }

    /// The integer value of an operation on doubles whose result is from `low` to `high`.
    fn arithmetic(&mut self, data: &InstData, low: i64, high: i64) -> Option<Value> {
        let ty = type_for(low, high);
        match *data {
            InstData::Unary { op: UnaryOp::Fneg, arg } if self.is_integer(arg) => {
                let arg = self.operand(arg, ty)?;
                Some(self.unary(UnaryOp::Neg, arg))
            }
            InstData::Unary { op: UnaryOp::Fabs, arg } if self.is_integer(arg) => {
                let x = self.operand(arg, ty)?;
                let negative = self.unary(UnaryOp::Neg, x);
                Some(self.binary(BinaryOp::Smax, x, negative))
            }
            InstData::Binary { op, args: [a, b] } if self.is_integer(a) && self.is_integer(b) => {
                // The low bits of these results depend on the low bits of the operands only.
                let op = match op {
                    BinaryOp::Fadd => BinaryOp::Add,
                    BinaryOp::Fsub => BinaryOp::Sub,
                    BinaryOp::Fmul => BinaryOp::Mul,
                    _ => return None,
                };
                let (a, b) = (self.operand(a, ty)?, self.operand(b, ty)?);
                Some(self.binary(op, a, b))
            }
            InstData::Select { cond, args: [a, b] } if self.is_integer(a) && self.is_integer(b) => {
                let (a, b) = (self.operand(a, ty)?, self.operand(b, ty)?);
                Some(self.select(cond, a, b))
            }
            _ => None,
        }
    }

    /// A call of a pure function whose operands are integers.
    fn call(&mut self, function: HostFn, args: &[Value], result: Value) -> Option<Change> {
        let form = function.integer_form()?;
        match (form, args) {
            (IntegerForm::Bits, &[x]) if self.is_integer(x) => {
                self.operand(x, Type::I64).map(Change::Value)
            }
            (IntegerForm::Range, &[x, low, high]) => {
                let (least, most) = self.floats.get(x).integers()?;
                let (_, low) = self.floats.get(low).integers()?;
                let (high, _) = self.floats.get(high).integers()?;
                let stays = low <= least && most <= high;
                if !stays || !self.is_integer(x) {
                    return None;
                }
                if !self.floats.get(x).may_be_minus_zero() {
                    return Some(Change::Value(x));
                }
                let integer = self.operand(x, type_for(least, most))?;
                Some(Change::Inst(to_double(integer)))
            }
            (_, &[a, b]) if self.is_integer(a) && self.is_integer(b) => {
                let data = self.call_of(function, args)?;
                let range = self.floats.of(self.func, &self.integers, &data);
                let (low, high) = range.integers()?;
                let ty = type_for(low, high);
                let integer = match form {
                    IntegerForm::Modulo => {
                        let (by, _) = self.floats.get(b).integers()?;
                        self.modulo(a, by, ty)?
                    }
                    _ => {
                        let (a, b) = (self.operand(a, ty)?, self.operand(b, ty)?);
                        self.binary(bit_instruction(form)?, a, b)
                    }
                };
                debug_assert_eq!(self.func.ty(result), Type::F64);
                Some(Change::Inst(to_double(integer)))
            }
            _ => None,
        }
    }

    /// The instruction that calls a function.
    fn call_of(&self, function: HostFn, args: &[Value]) -> Option<InstData> {
        Some(InstData::HostCall { function, args: crate::Args::new(args)? })
    }

    /// The remainder of an integer by a constant that is not 0, as `ty`.
    fn modulo(&mut self, x: Value, by: i64, ty: Type) -> Option<Value> {
        let (low, high) = self.floats.get(x).integers()?;
        // By a negative divisor -y the result is from -y to y - 1: it is the remainder by 2y of the
        // dividend plus y, less y.
        let (shift, by) = if by > 0 { (0, by) } else { (-by, -2 * by) };
        let (low, high) = (low.saturating_add(shift), high.saturating_add(shift));
        let wide = type_for(low.min(by), high.max(by));
        let mut value = self.operand(x, wide)?;
        if shift != 0 {
            value = self.binary_imm(BinaryOp::Add, value, shift);
        }
        value = self.binary_imm(BinaryOp::Smod, value, by);
        if shift != 0 {
            value = self.binary_imm(BinaryOp::Sub, value, shift);
        }
        if ty == wide {
            return Some(value);
        }
        let op = if ty < wide { ConvertOp::Trunc } else { ConvertOp::Sext };
        Some(self.convert(op, ty, value))
    }

    /// A comparison of two doubles that are integers.
    fn compare(&mut self, cond: FloatCond, [a, b]: [Value; 2]) -> Option<Change> {
        if !self.is_integer(a) || !self.is_integer(b) {
            return None;
        }
        // Integers less than 1 apart are equal.
        if cond == FloatCond::Lt
            && self.floats.get(b).integers() == Some((1, 1))
            && let Some(args) = self.operands_of_distance(a)
        {
            return Some(Change::Inst(InstData::Icmp { cond: IntCond::Eq, args }));
        }
        let cond = match cond {
            FloatCond::Eq | FloatCond::EqOrNan => IntCond::Eq,
            FloatCond::Ne => IntCond::Ne,
            FloatCond::Lt => IntCond::Slt,
            FloatCond::Le => IntCond::Sle,
            FloatCond::Gt => IntCond::Sgt,
            FloatCond::Ge => IntCond::Sge,
        };
        self.compare_integers(cond, a, b)
    }

    /// The two integers whose distance a double is: the greater of their difference and the negation
    /// of that. `None` if it is something else, or if the difference may be the least number of its
    /// type, which is its own negation.
    fn operands_of_distance(&self, double: Value) -> Option<[Value; 2]> {
        let integer = self.integer_of[double]?;
        let operands = |value, wanted| match self.func.def_inst(value) {
            Some(&InstData::Binary { op, args }) if op == wanted => Some(args),
            _ => None,
        };
        let [mut difference, negated] = operands(integer, BinaryOp::Smax)?;
        let ty = self.func.ty(difference);
        let negation = InstData::Unary { op: UnaryOp::Neg, arg: difference };
        let least = ty.wrap(1 << (ty.bits() - 1));
        if self.func.def_inst(negated) != Some(&negation)
            || self.integers.bounds(difference, ty).0 == least
        {
            return None;
        }
        if let Some(&InstData::Convert { op: ConvertOp::Sext, to: _, arg }) =
            self.func.def_inst(difference)
        {
            difference = arg;
        }
        operands(difference, BinaryOp::Sub)
    }

    /// A comparison of two doubles as one of the integers that are equal to them.
    fn compare_integers(&mut self, cond: IntCond, a: Value, b: Value) -> Option<Change> {
        let (low, high) = self.floats.get(a).integers()?;
        let (least, most) = self.floats.get(b).integers()?;
        let ty = type_for(low.min(least), high.max(most));
        let args = [self.operand(a, ty)?, self.operand(b, ty)?];
        Some(Change::Inst(InstData::Icmp { cond, args }))
    }
}

/// The instruction on integers of a bit operator.
pub(super) fn bit_instruction(form: IntegerForm) -> Option<BinaryOp> {
    match form {
        IntegerForm::And => Some(BinaryOp::And),
        IntegerForm::Or => Some(BinaryOp::Or),
        IntegerForm::Xor => Some(BinaryOp::Xor),
        _ => None,
    }
}

/// The conversion of an integer to a double.
fn to_double(integer: Value) -> InstData {
    InstData::Convert { op: ConvertOp::IntToFloat, to: Type::F64, arg: integer }
}
