//! Folds constants and simplifies instructions by algebraic identities.
//!
//! ```text
//! v2: i32 = mul v0, 1                       (v2 is replaced by v0)
//! v3: i1 = icmp slt v1, 0             ==>
//! v4: i1 = not v3                           v4: i1 = icmp sge v1, 0
//! ```
//!
//! Instructions are visited once, definitions before uses. Each is simplified until nothing more is
//! found: to a value that exists already, to a constant, or to another instruction ([`Rewrite`]),
//! possibly with new instructions before it. The rules are grouped in files: `fold_binary`
//! (arithmetic), `fold_bits` (single bits of words), `fold_compare`, `fold_convert`, `fold_divide`,
//! `fold_select` and `fold_toggle` (bits that become their opposite). They may ask for the operands' definitions, for their [value
//! ranges](super::value_range), and whether a value is used once.
//!
//! Constants are computed by [`eval`]. A double that is NaN is not folded, and most
//! identities of real numbers must not be used for doubles: `x + 0` is not `x` where `x` is -0.

use super::graph::Graph;
use super::substitution::Substitution;
use super::value_range::{PassedBounds, ValueRanges};
use crate::InstBuilder;
use crate::{
    BinaryOp, ConvertOp, FuncData, InstData, IntCond, RegionId, SecondaryMap, StatementId, Type,
    UnaryOp, Value, eval,
};

/// An instruction is simplified at most this many times in a row.
const MAX_ROUNDS: usize = 8;

/// What an instruction can be replaced by.
pub(super) enum Rewrite {
    /// A value that exists already.
    Value(Value),
    /// A constant: an integer, or the bits of a double.
    Const(i64),
    /// Another instruction.
    Inst(InstData),
}

impl Rewrite {
    pub(super) fn unary(op: UnaryOp, arg: Value) -> Self {
        Self::Inst(InstData::Unary { op, arg })
    }

    pub(super) fn not(arg: Value) -> Self {
        Self::unary(UnaryOp::Not, arg)
    }

    pub(super) fn binary(op: BinaryOp, a: Value, b: Value) -> Self {
        Self::Inst(InstData::Binary { op, args: [a, b] })
    }

    pub(super) fn icmp(cond: IntCond, a: Value, b: Value) -> Self {
        Self::Inst(InstData::Icmp { cond, args: [a, b] })
    }

    pub(super) fn convert(op: ConvertOp, to: Type, arg: Value) -> Self {
        Self::Inst(InstData::Convert { op, to, arg })
    }

    pub(super) fn truth(truth: bool) -> Self {
        Self::Const(i64::from(truth))
    }
}

/// What an instruction has been simplified to.
enum Simplified {
    /// A value that exists already.
    Value(Value),
    /// This instruction.
    Inst(InstData),
}

/// A function being simplified.
pub(super) struct Fold<'a> {
    pub(super) func: &'a mut FuncData,
    pub(super) ranges: ValueRanges,
    /// How often each value was used before the pass.
    uses: SecondaryMap<Value, u32>,
    /// The instructions of the current block that have been visited and stay, and new ones.
    out: Vec<crate::Inst>,
    /// The statement of the current instruction.
    loc: StatementId,
    /// Whether truth values that are bits of words are combined as words.
    pub(super) combine_bits: bool,
}

/// Runs the pass. Words of `word_regions` have a highest byte that is 0. With `combine_bits`, truth values that are
/// bits of words are combined as words.
pub(super) fn run(func: &mut FuncData, word_regions: &[RegionId], combine_bits: bool) {
    let graph = Graph::new(func);
    let mut values = Substitution::new(func);
    let ranges = ValueRanges::new(func);
    let uses = func.use_counts();
    let loc = StatementId::NONE;
    let mut fold = Fold { func, ranges, uses, out: vec![], loc, combine_bits };
    let mut passed = PassedBounds::new(&graph);
    for &block in &graph.order {
        passed.enter(fold.func, block, &mut fold.ranges);
        let insts = std::mem::take(&mut fold.func.blocks[block].insts);
        fold.out.reserve(insts.len());
        for inst in insts {
            fold.loc = fold.func.loc(inst);
            let mut data = *fold.func.inst(inst);
            values.inst(&mut data);
            let Some(result) = fold.func.result(inst) else {
                fold.fix_constant_index(&mut data);
                fold.store_double(&mut data);
                fold.func.insts[inst] = data;
                fold.out.push(inst);
                continue;
            };
            let ty = fold.func.ty(result);
            match fold.simplified(data, ty) {
                Simplified::Value(value) => {
                    fold.move_uses(&values, inst, result, value);
                    values.replace(result, value);
                    continue;
                }
                Simplified::Inst(simpler) => data = simpler,
            }
            fold.ranges.note(fold.func, result, &data);
            if let InstData::Load { ty: Type::I32, at } = data
                && word_regions.contains(&at.region)
            {
                fold.ranges.note_word(result, &at);
            }
            fold.func.insts[inst] = data;
            fold.out.push(inst);
        }
        let data = &mut fold.func.blocks[block];
        data.insts = std::mem::take(&mut fold.out);
        if let Some(terminator) = &mut data.terminator {
            values.terminator(terminator);
        }
        if let Some(terminator) = &fold.func.block(block).terminator {
            passed.note(fold.func, terminator, &fold.ranges);
        }
    }
}

impl InstBuilder for Fold<'_> {
    fn func(&self) -> &FuncData {
        self.func
    }

    /// Inserts an instruction before the current one.
    fn build(&mut self, data: InstData) -> Value {
        let (inst, value) = self.func.append(data, self.loc);
        self.out.push(inst);
        self.ranges.note(self.func, value, &data);
        value
    }
}

impl Fold<'_> {
    /// Simplifies an instruction until nothing more is found.
    fn simplified(&mut self, mut data: InstData, ty: Type) -> Simplified {
        for _ in 0..MAX_ROUNDS {
            match self.simplify(&data, ty) {
                None => break,
                Some(Rewrite::Inst(next)) => data = next,
                Some(Rewrite::Const(value)) => {
                    return Simplified::Inst(InstData::constant(ty, value));
                }
                Some(Rewrite::Value(value)) => return Simplified::Value(value),
            }
        }
        Simplified::Inst(data)
    }

    /// Inserts what an instruction that gives a result of type `ty` can be simplified to.
    pub(super) fn insert_simplified(&mut self, data: InstData, ty: Type) -> Value {
        match self.simplified(data, ty) {
            Simplified::Value(value) => value,
            Simplified::Inst(data) => self.build(data),
        }
    }

    fn simplify(&mut self, data: &InstData, ty: Type) -> Option<Rewrite> {
        match *data {
            InstData::Iconst { .. } | InstData::Fconst { .. } => None,
            InstData::Unary { op, arg } => self.fold_unary(op, ty, arg),
            InstData::Binary { op, args } => self.fold_binary(op, ty, args),
            InstData::Icmp { cond, args } => self.fold_icmp(cond, args),
            InstData::Fcmp { cond, args: [a, b] } => {
                if self.is_same_integer(a, b) {
                    return Some(Rewrite::truth(eval::fcmp(cond, 0, 0)));
                }
                let (a, b) = (self.func.constant(a)?, self.func.constant(b)?);
                Some(Rewrite::truth(eval::fcmp(cond, a, b)))
            }
            InstData::Select { cond, args } => self.fold_select(cond, ty, args),
            InstData::Convert { op, to, arg } => self.fold_convert(op, to, arg),
            InstData::Bit { arg, number } => self.fold_bit(arg, number),
            InstData::Extract { op, arg, field } => self.fold_extract(op, ty, arg, field),
            InstData::Insert { args, field } => Some(self.replace_field(ty, args, field)),
            InstData::Load { .. } => {
                let mut fixed = *data;
                self.fix_constant_index(&mut fixed).then_some(Rewrite::Inst(fixed))
            }
            InstData::Store { .. }
            | InstData::Unpack { .. }
            | InstData::Pack { .. }
            | InstData::HostCall { .. }
            | InstData::IsLate => None,
        }
    }

    /// Whether two doubles are conversions of the same integer, so that they are equal and no NaN.
    fn is_same_integer(&self, a: Value, b: Value) -> bool {
        let integer = |value| match self.func.def_inst(value) {
            Some(&InstData::Convert { op: ConvertOp::IntToFloat, to: _, arg }) => Some(arg),
            _ => None,
        };
        integer(a).is_some_and(|arg| integer(b) == Some(arg))
    }

    /// Turns an address whose index is a constant into one without index; returns whether it did.
    fn fix_constant_index(&self, data: &mut InstData) -> bool {
        let (InstData::Load { ty: _, at } | InstData::Store { at, value: _ }) = data else {
            return false;
        };
        let Some(index) = at.index else { return false };
        let Some(number) = self.func.constant(index.value) else { return false };
        let number = number as u32;
        if number < index.count {
            at.offset = at.offset.wrapping_add(number.wrapping_mul(index.scale));
        }
        at.index = None;
        true
    }

    /// Whether a value is used at most once, so that its definition becomes dead when that use
    /// goes.
    pub(super) fn is_used_once(&self, value: Value) -> bool {
        self.uses[value] < 2
    }

    /// Counts the uses of an instruction's result as uses of the value that replaces it.
    fn move_uses(&mut self, values: &Substitution, inst: crate::Inst, result: Value, by: Value) {
        let moved = self.uses[result];
        let mut gone = 0;
        self.func.inst(inst).for_each_arg(|arg| gone += u32::from(values.get(arg) == by));
        if let Some(uses) = self.uses.get_mut(by) {
            *uses = (*uses + moved).saturating_sub(gone);
        }
    }

    /// The operand of the NOT that defines a value; `None` if it is defined by something else.
    pub(super) fn not_of(&self, value: Value) -> Option<Value> {
        match self.func.def_inst(value) {
            Some(&InstData::Unary { op: UnaryOp::Not, arg }) => Some(arg),
            _ => None,
        }
    }

    /// The operands of the operation that defines a value; `None` if that is not `wanted`.
    pub(super) fn operands(&self, value: Value, wanted: BinaryOp) -> Option<[Value; 2]> {
        match self.func.def_inst(value) {
            Some(&InstData::Binary { op, args }) if op == wanted => Some(args),
            _ => None,
        }
    }

    fn fold_unary(&mut self, op: UnaryOp, ty: Type, arg: Value) -> Option<Rewrite> {
        if let Some(x) = self.func.constant(arg) {
            let result = eval::unary(op, ty, x);
            return eval::may_become_constant(ty, result).then_some(Rewrite::Const(result));
        }
        let inner = *self.func.def_inst(arg)?;
        match (op, inner) {
            (UnaryOp::Not | UnaryOp::Neg | UnaryOp::Fneg, InstData::Unary { op: same, arg })
                if op == same =>
            {
                Some(Rewrite::Value(arg))
            }
            (UnaryOp::Fabs, InstData::Unary { op: UnaryOp::Fabs, arg: _ }) => {
                Some(Rewrite::Value(arg))
            }
            (UnaryOp::Fabs, InstData::Unary { op: UnaryOp::Fneg, arg }) => {
                Some(Rewrite::unary(op, arg))
            }
            (UnaryOp::Not, InstData::Icmp { cond, args: [a, b] }) => {
                Some(Rewrite::icmp(cond.inverted(), a, b))
            }
            _ => None,
        }
    }

    fn fold_select(&mut self, cond: Value, ty: Type, [a, b]: [Value; 2]) -> Option<Rewrite> {
        if let Some(cond) = self.func.constant(cond) {
            return Some(Rewrite::Value(if cond != 0 { a } else { b }));
        }
        let known = (self.func.constant(a), self.func.constant(b));
        if a == b || known.0.is_some() && known.0 == known.1 {
            return Some(Rewrite::Value(a));
        }
        let chosen = |cond, a, b| Some(Rewrite::Inst(InstData::Select { cond, args: [a, b] }));
        if let Some(opposite) = self.not_of(cond) {
            return chosen(opposite, b, a);
        }
        if let Some(&InstData::Select { cond: inner, args: [first, _] }) = self.func.def_inst(a)
            && inner == cond
        {
            return chosen(cond, first, b);
        }
        if let Some(&InstData::Select { cond: inner, args: [_, second] }) = self.func.def_inst(b)
            && inner == cond
        {
            return chosen(cond, a, second);
        }
        if let Some(simpler) = self.select_converted(cond, ty, [a, b]) {
            return Some(simpler);
        }
        if ty == Type::I1 {
            return self.select_truth(cond, [a, b], known);
        }
        if !ty.is_int() {
            return None;
        }
        if let Some(simpler) = self.select_bit_of_word(cond, ty, [a, b]) {
            return Some(simpler);
        }
        if let Some(simpler) = self.select_latched(cond, ty, [a, b]) {
            return Some(simpler);
        }
        if let Some(simpler) = self.select_opposite(cond, ty, [a, b]) {
            return Some(simpler);
        }
        match known {
            (Some(1), Some(0)) => Some(Rewrite::convert(ConvertOp::Zext, ty, cond)),
            (Some(-1), Some(0)) => Some(Rewrite::convert(ConvertOp::Sext, ty, cond)),
            _ => None,
        }
    }

    /// A select between truth values becomes AND, OR or NOT. `known` are the constants that `a` and
    /// `b` are.
    fn select_truth(
        &mut self,
        cond: Value,
        [a, b]: [Value; 2],
        known: (Option<i64>, Option<i64>),
    ) -> Option<Rewrite> {
        match known {
            (Some(0), Some(_)) => Some(Rewrite::not(cond)),
            (Some(_), Some(_)) => Some(Rewrite::Value(cond)),
            (Some(0), None) => {
                let fails = self.not(cond);
                Some(Rewrite::binary(BinaryOp::And, fails, b))
            }
            (Some(_), None) => Some(Rewrite::binary(BinaryOp::Or, cond, b)),
            (None, Some(0)) => Some(Rewrite::binary(BinaryOp::And, cond, a)),
            (None, Some(_)) => {
                let fails = self.not(cond);
                Some(Rewrite::binary(BinaryOp::Or, fails, a))
            }
            (None, None) if a == cond => Some(Rewrite::binary(BinaryOp::Or, cond, b)),
            (None, None) if b == cond => Some(Rewrite::binary(BinaryOp::And, cond, a)),
            (None, None) => self.select_opposite(cond, Type::I1, [a, b]),
        }
    }
}
