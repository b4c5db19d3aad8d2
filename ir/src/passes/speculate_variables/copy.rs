//! The copy of a function in which its variables hold integers.

use super::super::float_range::{FloatRange, FloatRanges};
use super::super::graph::Graph;
use super::super::index_bounds::index_bounds;
use super::super::value_range::ValueRanges;
use super::guard::GuardBlock;
use super::operations::is_faster_on_integers;
use crate::InstBuilder;
use crate::func::ValueData;
use crate::tables::FastMap;
use crate::{
    Address, Block, BlockCall, BlockData, ConvertOp, FloatCond, FuncData, Inst, InstData, IntCond,
    PrimaryMap, SecondaryMap, StatementId, Terminator, Type, Value, ValueDef,
};

/// The bytes of a double.
const SIZE: u64 = 8;

/// What is known of each variable at a place of the copy: the double that it holds.
type Known = Vec<Option<Value>>;

/// A function whose blocks are being copied.
pub(super) struct Copy<'a> {
    pub(super) func: &'a mut FuncData,
    pub(super) integers: ValueRanges,
    pub(super) floats: FloatRanges<'a>,
    /// For each value of the original its copy.
    pub(super) values: SecondaryMap<Value, Option<Value>>,
    /// For each block of the original its copy.
    pub(super) blocks: PrimaryMap<Block, Option<Block>>,
    /// The variables that are checked.
    pub(super) variables: Vec<Address>,
    /// For values of the copy that are the bits of a variable, as an `i64`, the double.
    pub(super) bits: FastMap<Value, Value>,
    /// How many operations of the copy are faster on integers, and how many of these have operands that are
    /// not known to be integers.
    pub(super) gaining: usize,
    pub(super) other_operands: usize,
    /// The instructions of the block that is being written, and the statement of the current one.
    pub(super) out: Vec<Inst>,
    pub(super) loc: StatementId,
}

impl InstBuilder for Copy<'_> {
    fn func(&self) -> &FuncData {
        self.func
    }

    fn build(&mut self, data: InstData) -> Value {
        let (inst, result) = self.func.append(data, self.loc);
        self.out.push(inst);
        if result != Value::NONE {
            match self.func.ty(result) {
                Type::F64 => self.floats.note(self.func, &self.integers, result, &data),
                _ => self.integers.note(self.func, result, &data),
            }
        }
        result
    }
}

impl Copy<'_> {
    /// Makes the check of a variable.
    pub(super) fn check(&mut self, at: Address, loc: StatementId) -> GuardBlock {
        self.loc = loc;
        let load = self.load(Type::F64, at);
        let (integer, holds) = self.integrality_check(load, true);
        let double = self.convert(ConvertOp::IntToFloat, Type::F64, integer);
        GuardBlock { insts: std::mem::take(&mut self.out), double, holds }
    }

    /// Copies all blocks.
    pub(super) fn blocks(&mut self, graph: &Graph, entry: Block, checks: &[GuardBlock]) {
        let before = graph.predecessors(self.func);
        let mut ends = PrimaryMap::from(vec![Known::new(); self.func.block_count()]);
        for &block in &graph.order {
            let cold = self.func.block(block).cold;
            let copy = self.func.blocks.push(BlockData { cold, ..BlockData::default() });
            self.blocks[block] = Some(copy);
        }
        for &block in &graph.order {
            let Some(copy) = self.blocks[block] else { continue };
            let params = self.func.block(block).params.clone();
            for param in params {
                let ty = self.func.ty(param);
                let value = self.add_param(copy, ty);
                self.values[param] = Some(value);
            }
            let mut known: Known = match block == entry {
                true => checks.iter().map(|check| Some(check.double)).collect(),
                false => self.known_at(copy, &before[block], &ends),
            };
            for inst in self.func.block(block).insts.clone() {
                self.inst(inst, &mut known);
            }
            let mut terminator = self.func.block(block).terminator.clone();
            if let Some(terminator) = &mut terminator {
                terminator.for_each_arg_mut(|value| *value = self.copied(*value));
                terminator.for_each_block_mut(|block| {
                    if let Some(copy) = self.blocks[*block] {
                        *block = copy;
                    }
                });
            }
            let data = &mut self.func.blocks[copy];
            (data.insts, data.terminator) = (std::mem::take(&mut self.out), terminator);
            ends[block] = known;
        }
    }

    /// Adds a parameter to a block.
    fn add_param(&mut self, block: Block, ty: Type) -> Value {
        let number = self.func.block(block).params.len() as u32;
        let def = ValueDef::Param(block, number);
        let value = self.func.values.push(ValueData { ty, def });
        self.func.blocks[block].params.push(value);
        value
    }

    /// What is known at the beginning of a copied block. `before` are the blocks of the original from which
    /// control comes; `ends` says what is known at their ends. A variable of which they say different
    /// things becomes a parameter.
    fn known_at(
        &mut self,
        copy: Block,
        before: &[Block],
        ends: &PrimaryMap<Block, Known>,
    ) -> Known {
        let mut known: Known = vec![None; self.variables.len()];
        let is_switch = |block: &Block| {
            matches!(self.func.block(*block).terminator, Some(Terminator::Switch { .. }))
        };
        let takes_params = !before.iter().any(is_switch);
        for (number, known) in known.iter_mut().enumerate() {
            let values = before.iter().map(|&block| ends[block].get(number).copied()?);
            let Some(values) = values.collect::<Option<Vec<Value>>>() else { continue };
            let Some(&first) = values.first() else { continue };
            if values.iter().all(|&value| value == first) {
                *known = Some(first);
            } else if takes_params {
                let param = self.add_param(copy, Type::F64);
                let range = values.iter().map(|&value| self.floats.get(value));
                if let Some(range) = range.reduce(FloatRange::join) {
                    self.floats.set(param, range);
                }
                for (block, value) in before.iter().zip(values) {
                    self.pass(*block, copy, value);
                }
                *known = Some(param);
            }
        }
        known
    }

    /// Lets the copy of a block pass one more value to another copy.
    fn pass(&mut self, from: Block, to: Block, value: Value) {
        let Some(from) = self.blocks[from] else { return };
        let add = |call: &mut BlockCall| {
            if call.block == to {
                call.args.push(value);
            }
        };
        if let Some(terminator) = &mut self.func.blocks[from].terminator {
            terminator.for_each_call_mut(add);
        }
    }

    /// The copy of a value of the original. Definitions are copied before their uses.
    fn copied(&self, value: Value) -> Value {
        self.values[value].unwrap_or(Value::NONE)
    }

    /// The number of the variable that an access of 8 bytes reads or writes.
    fn variable(&self, at: &Address) -> Option<usize> {
        let key = |at: &Address| (at.region.index(), at.offset);
        let fixed = at.index.is_none() && !at.volatile;
        fixed.then(|| self.variables.binary_search_by_key(&key(at), key).ok()).flatten()
    }

    /// Copies an instruction.
    fn inst(&mut self, inst: Inst, known: &mut Known) {
        let mut data = *self.func.inst(inst);
        data.for_each_arg_mut(|value| *value = self.copied(*value));
        self.loc = self.func.loc(inst);
        let result = self.func.result(inst);
        let mut double = None;
        match data {
            InstData::Load { ty: Type::F64, at } => {
                let value = self.variable(&at).and_then(|number| known[number]);
                if let (Some(result), Some(value)) = (result, value) {
                    self.values[result] = Some(value);
                    return;
                }
            }
            InstData::Load { ty: Type::I64, at } => {
                double = self.variable(&at).and_then(|number| known[number]);
            }
            InstData::Icmp { cond, args } => {
                if let Some(compared) = self.compare(cond, args) {
                    data = compared;
                }
            }
            InstData::Store { at, value } => self.copy_store(&at, value, known),
            InstData::HostCall { function, args: _ } if !function.is_pure() => known.fill(None),
            _ => {}
        }
        if is_faster_on_integers(self.func, &data) {
            self.gaining += 1;
            let mut all = true;
            data.for_each_arg(|arg| all &= self.floats.get(arg).integers().is_some());
            self.other_operands += usize::from(!all);
        }
        let new = self.build(data);
        if let Some(result) = result {
            self.values[result] = Some(new);
            self.bits.extend(double.map(|double| (new, double)));
        }
    }

    /// Enters what is known of the variables after a store.
    fn copy_store(&mut self, at: &Address, value: Value, known: &mut Known) {
        let ty = self.func.ty(value);
        let mut written = at.extent(ty);
        if let Some(index) = at.index
            && let Some((low, high)) =
                index_bounds(self.func, index.value, |double| self.floats.get(double))
            && low >= 0
            && high < i64::from(index.count)
        {
            let of = |number: i64| u64::from(at.offset) + number as u64 * u64::from(index.scale);
            written = of(low)..of(high) + u64::from(ty.bytes());
        }
        for (variable, known) in self.variables.iter().zip(known.iter_mut()) {
            let start = u64::from(variable.offset);
            let overlaps = start < written.end && written.start < start + SIZE;
            if variable.region == at.region && overlaps {
                *known = None;
            }
        }
        if let Some(number) = self.variable(at) {
            known[number] = match ty {
                Type::F64 => Some(value),
                Type::I64 => self.double_of(value),
                _ => None,
            };
        }
    }

    /// The double whose bits an `i64` is, if it is known.
    fn double_of(&mut self, bits: Value) -> Option<Value> {
        match self.func.constant(bits) {
            Some(bits) => Some(self.constant(Type::F64, bits)),
            None => self.bits.get(&bits).copied(),
        }
    }

    /// A comparison of the bits of variables, or of those of a variable with a constant, as one of the
    /// doubles: the order of the bits of doubles that are finite and not -0 is that of the
    /// doubles, if they are not negative; if they are, it is the reverse.
    fn compare(&mut self, cond: IntCond, args: [Value; 2]) -> Option<InstData> {
        if !args.iter().any(|arg| self.bits.contains_key(arg)) {
            return None;
        }
        let number = args.iter().find_map(|&arg| self.func.constant(arg));
        let negative = number.map(|bits| f64::from_bits(bits as u64).is_sign_negative());
        let cond = match (cond, negative) {
            (IntCond::Eq, _) => FloatCond::Eq,
            (IntCond::Ne, _) => FloatCond::Ne,
            (IntCond::Sgt, Some(false)) | (IntCond::Ult, Some(true)) => FloatCond::Gt,
            (IntCond::Sge, Some(false)) | (IntCond::Ule, Some(true)) => FloatCond::Ge,
            (IntCond::Slt, Some(false)) | (IntCond::Ugt, Some(true)) => FloatCond::Lt,
            (IntCond::Sle, Some(false)) | (IntCond::Uge, Some(true)) => FloatCond::Le,
            _ => return None,
        };
        let is_plain = |bits: i64| f64::from_bits(bits as u64).is_finite() && bits != i64::MIN;
        if !number.is_none_or(is_plain) {
            return None;
        }
        let [a, b] = args.map(|arg| self.double_of(arg));
        let args = [a?, b?];
        let has_order = |arg: &Value| {
            let range = self.floats.get(*arg);
            range.is_finite() && !range.may_be_minus_zero()
        };
        args.iter().all(has_order).then_some(InstData::Fcmp { cond, args })
    }
}
