//! Truth values in 32 bits, for logic on bytes of the image (the technique `wide-bits`).
//!
//! A truth value in the image is a byte that is 0 or 1. On x86-64, Cranelift makes a load part of
//! the instruction that uses it only from 32 bits up: `and eax, [rbx+5]` instead of a load of a
//! byte and an instruction on registers. So AND, OR, XOR and NOT of truth values are computed in
//! 32 bits. What is in the upper 24 bits is of no meaning: a load of 32 bits brings the three bytes
//! after the truth value along. It does no harm, since only the lowest byte is stored or tested,
//! and that stays 0 or 1.
//!
//! A load that is used once, in its own block, waits until the instruction that uses it is lowered.
//! Cranelift can then join the two. It must not wait beyond a store to its byte or beyond a call of
//! the host.
//!
//! A load of 32 bits takes long when one of its bytes has just been stored: the processor can't
//! take the value from the store, and waits until it is in the cache. Such a byte is loaded alone.

use cranelift_codegen::ir::{BlockArg, InstBuilder, Value as ClifValue, types};
use plcc_ir::passes::thresholds::STORED_RECENTLY;
use plcc_ir::tables::FastMap;
use plcc_ir::{Address, BinaryOp, Block, FuncData, SecondaryMap, Type, Value};

use super::memory::{LOCAL_PLACES, flags};
use super::{LowerResult, Lowering};
use crate::CodegenOptions;

/// The number of bytes of the widest store without an index.
const WIDEST_STORE: i64 = 16;

/// What the lowering knows of the truth values of a function.
pub(super) struct TruthValues {
    /// Whether 32 bits are used at all.
    enabled: bool,
    /// For each value the one in 32 bits, if it has one.
    wide: SecondaryMap<Value, Option<ClifValue>>,
    /// For each value the number of its uses, and the block of the last one.
    uses: SecondaryMap<Value, (u32, Block)>,
    /// The loads that wait for their use, each with its offset in the image.
    waiting: Vec<(Value, Address, i64)>,
    /// For each byte of the image that was stored, by its offset, the number of the instruction that stored it last.
    last_stores: FastMap<i64, u32>,
    /// The number of the current instruction of the IR, counted over the function.
    current: u32,
}

impl TruthValues {
    /// For a function of a module.
    pub(super) fn new(func: &FuncData, options: CodegenOptions) -> Self {
        let enabled = options.wide_bits;
        let mut uses = SecondaryMap::with_default((0, Block(0)));
        let mut wide = SecondaryMap::new();
        if enabled {
            uses.resize(func.value_count());
            wide.resize(func.value_count());
            for (block, data) in func.blocks() {
                let mut note = |value: Value| {
                    if let Some((count, place)) = uses.get_mut(value) {
                        *count += 1;
                        *place = block;
                    }
                };
                data.insts.iter().for_each(|&inst| func.inst(inst).for_each_arg(&mut note));
                if let Some(terminator) = &data.terminator {
                    terminator.for_each_arg(note);
                }
            }
        }
        Self { enabled, wide, uses, waiting: vec![], last_stores: FastMap::default(), current: 0 }
    }

    /// Whether a value is in 32 bits, or can be loaded so.
    pub(super) fn is_wide(&self, value: Value) -> bool {
        self.wide[value].is_some() || self.is_waiting(value)
    }

    /// Whether a value is a load that waits for its use.
    fn is_waiting(&self, value: Value) -> bool {
        self.waiting.iter().any(|&(waiting, ..)| waiting == value)
    }
}

impl Lowering<'_> {
    /// Begins with the next instruction of the IR.
    pub(super) fn count_instruction(&mut self) {
        self.truth_values.current += 1;
    }

    /// Lowers the load of a truth value; returns whether it did, since it leaves volatile loads, loads
    /// through an index and other types to others.
    pub(super) fn load_truth(
        &mut self,
        result: Value,
        ty: Type,
        at: Address,
        block: Block,
    ) -> LowerResult<bool> {
        let truths = &mut self.truth_values;
        if !truths.enabled || ty != Type::I1 || at.volatile || at.index.is_some() {
            return Ok(false);
        }
        let offset = self.place(ty, at)?;
        let truths = &mut self.truth_values;
        if truths.uses[result] == (1, block) {
            truths.waiting.push((result, at, offset));
            return Ok(true);
        }
        let (base, displacement) = self.address(ty, at)?;
        let wide = self.builder.ins().uload8(types::I32, flags(), base, displacement);
        self.define_wide(result, wide);
        Ok(true)
    }

    /// Lowers AND, OR or XOR of truth values of which at least one is in 32 bits; returns whether it
    /// did.
    pub(super) fn wide_binary(
        &mut self,
        result: Value,
        op: BinaryOp,
        [a, b]: [Value; 2],
    ) -> LowerResult<bool> {
        let truths = &self.truth_values;
        if !truths.enabled
            || self.func.ty(a) != Type::I1
            || !(truths.is_wide(a) || truths.is_wide(b))
        {
            return Ok(false);
        }
        // The load that can become part of the operation comes last.
        let (a, b) = if truths.is_waiting(a) && !truths.is_waiting(b) { (b, a) } else { (a, b) };
        let (x, y) = (self.wide(a)?, self.wide(b)?);
        let value = match op {
            BinaryOp::And => self.builder.ins().band(x, y),
            BinaryOp::Or => self.builder.ins().bor(x, y),
            BinaryOp::Xor => self.builder.ins().bxor(x, y),
            _ => return Ok(false),
        };
        let value = match self.truth_values.uses[result] {
            (2.., _) => self.through_parameter(value),
            _ => value,
        };
        self.define_wide(result, value);
        Ok(true)
    }

    /// Passes a value to a new block as its parameter, and goes on there; gives the parameter, which has
    /// the value's uses. Cranelift makes no load part of an instruction whose result has several uses;
    /// the only use of this result is now the jump, which takes no machine instruction.
    fn through_parameter(&mut self, value: ClifValue) -> ClifValue {
        let next = self.builder.create_block();
        let parameter = self.builder.append_block_param(next, types::I32);
        self.builder.ins().jump(next, &[BlockArg::Value(value)]);
        self.builder.switch_to_block(next);
        self.builder.seal_block(next);
        if self.cold {
            self.builder.set_cold_block(next);
        }
        parameter
    }

    /// Lowers NOT of a truth value that is in 32 bits; returns whether it did.
    pub(super) fn wide_not(&mut self, result: Value, arg: Value) -> LowerResult<bool> {
        if !self.truth_values.enabled || !self.truth_values.is_wide(arg) {
            return Ok(false);
        }
        let x = self.wide(arg)?;
        // The constant comes first: otherwise Cranelift would load it into a register to make the
        // load part of the instruction.
        let one = self.builder.ins().iconst(types::I32, 1);
        let value = self.builder.ins().bxor(one, x);
        self.define_wide(result, value);
        Ok(true)
    }

    /// Records the CLIF value that is a truth value in 32 bits.
    fn define_wide(&mut self, result: Value, value: ClifValue) {
        if let Some(slot) = self.truth_values.wide.get_mut(result) {
            *slot = Some(value);
        }
    }

    /// A truth value in 32 bits.
    fn wide(&mut self, value: Value) -> LowerResult<ClifValue> {
        if let Some((at, offset)) = self.take_waiting(value) {
            let (base, displacement) = self.address(Type::I1, at)?;
            let four_bytes = self.can_load_four_bytes(offset);
            let ins = self.builder.ins();
            return Ok(match four_bytes {
                true => ins.load(types::I32, flags(), base, displacement),
                false => ins.uload8(types::I32, flags(), base, displacement),
            });
        }
        match self.truth_values.wide[value] {
            Some(wide) => Ok(wide),
            None => {
                let narrow = self.value(value)?;
                Ok(self.builder.ins().uextend(types::I32, narrow))
            }
        }
    }

    /// Whether the four bytes from an offset on can be loaded at once: they lie in the image or among the local
    /// bits, after both of which more bytes follow, and none of them was stored recently.
    fn can_load_four_bytes(&self, offset: i64) -> bool {
        let truths = &self.truth_values;
        let recent = |byte| {
            truths
                .last_stores
                .get(&byte)
                .is_some_and(|&then| truths.current - then < STORED_RECENTLY)
        };
        let are_readable =
            offset + 4 <= i64::from(self.module.image_size) || offset >= LOCAL_PLACES;
        are_readable && !(offset..offset + 4).any(recent)
    }

    /// Takes a value off the loads that wait, if it is among them.
    fn take_waiting(&mut self, value: Value) -> Option<(Address, i64)> {
        let waiting = &mut self.truth_values.waiting;
        let index = waiting.iter().position(|&(waiting, ..)| waiting == value)?;
        let (_, at, offset) = waiting.swap_remove(index);
        Some((at, offset))
    }

    /// A truth value in 8 bits, if it is a load that waits or a value in 32 bits.
    pub(super) fn narrow_truth(&mut self, value: Value) -> LowerResult<Option<ClifValue>> {
        if let Some((at, _)) = self.take_waiting(value) {
            let (base, displacement) = self.address(Type::I1, at)?;
            return Ok(Some(self.builder.ins().load(types::I8, flags(), base, displacement)));
        }
        let wide = self.truth_values.wide[value];
        Ok(wide.map(|wide| self.builder.ins().ireduce(types::I8, wide)))
    }

    /// Lowers the loads that must not wait any longer, since a store to some bytes of the image
    /// follows, or a call of the host (`None`). Records the bytes of the store, but for one through an
    /// index, which may write any of very many.
    pub(super) fn lower_waiting_loads(
        &mut self,
        bytes: Option<std::ops::Range<i64>>,
    ) -> LowerResult<()> {
        let is_affected = |offset: i64| bytes.as_ref().is_none_or(|bytes| bytes.contains(&offset));
        let waiting = &self.truth_values.waiting;
        let affected: Vec<Value> =
            waiting.iter().filter(|w| is_affected(w.2)).map(|w| w.0).collect();
        for value in affected {
            let Some((at, _)) = self.take_waiting(value) else { continue };
            let (base, displacement) = self.address(Type::I1, at)?;
            let wide = self.builder.ins().uload8(types::I32, flags(), base, displacement);
            self.define_wide(value, wide);
        }
        if let Some(bytes) = bytes.filter(|bytes| bytes.end - bytes.start <= WIDEST_STORE) {
            let current = self.truth_values.current;
            self.truth_values.last_stores.extend(bytes.map(|byte| (byte, current)));
        }
        Ok(())
    }
}
