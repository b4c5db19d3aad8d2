//! Builds one function, instruction by instruction.
//!
//! [`FuncBuilder`] has a current block, and each method appends an instruction or terminator to
//! it and gives the result. Front ends get one from
//! [`ChunkBuilder::func`](crate::ChunkBuilder::func).

use plcc_abi::{HostFn, TrapCode};

use crate::func::ValueData;
use crate::{
    Args, BitGroups, Block, BlockCall, BlockData, FuncData, InstBuilder, InstData, Label,
    StatementId, Terminator, Type, Value, ValueDef,
};

/// A function under construction and the block that instructions are appended to.
///
/// If something is appended after a terminator, a new block is made for it. No branch leads to
/// that block, and a pass drops it. So front ends need not treat statements after a jump
/// specially.
#[derive(Clone, Debug)]
pub struct FuncBuilder {
    func: FuncData,
    block: Block,
    loc: StatementId,
    /// Whether blocks that become the current one are marked as cold.
    cold: bool,
    /// Whether blocks that become the current one are to be optimised for size.
    optimize_for_size: bool,
    /// How many host calls the function has.
    host_calls: usize,
    /// The [length](InstData::length) of its instructions.
    length: usize,
}

impl FuncBuilder {
    /// An empty function with one block, `block0`, which is the current one.
    pub fn new(name: impl Into<String>) -> Self {
        let func = FuncData {
            name: name.into(),
            blocks: vec![BlockData::default()].into(),
            ..FuncData::default()
        };
        let loc = StatementId::NONE;
        Self {
            func,
            block: Block(0),
            loc,
            cold: false,
            optimize_for_size: false,
            host_calls: 0,
            length: 0,
        }
    }

    /// The same, with room for a number of instructions, so that the tables need not grow.
    pub(crate) fn with_room(name: impl Into<String>, insts: usize) -> Self {
        let mut builder = Self::new(name);
        builder.func.make_room(insts);
        builder
    }

    /// How many instructions the function has.
    pub(crate) fn inst_count(&self) -> usize {
        self.func.inst_count()
    }

    /// The finished function. A block without terminator gets [`Terminator::Return`].
    pub fn finish(mut self) -> FuncData {
        for block in self.func.blocks.values_mut() {
            block.terminator.get_or_insert(Terminator::Return);
        }
        self.func
    }

    /// The current block.
    pub fn current(&self) -> Block {
        self.block
    }

    /// Whether the current block has a terminator.
    pub fn is_terminated(&self) -> bool {
        self.func.block(self.block).terminator.is_some()
    }

    /// Sets the statement that further instructions belong to.
    pub fn set_loc(&mut self, loc: StatementId) {
        self.loc = loc;
    }

    /// The statement that further instructions belong to.
    pub fn loc(&self) -> StatementId {
        self.loc
    }

    /// Adds an empty block; the current block stays.
    pub fn create_block(&mut self) -> Block {
        self.func.blocks.push(BlockData::default())
    }

    /// Adds a parameter to a block and returns its value.
    pub fn block_param(&mut self, block: Block, ty: Type) -> Value {
        let number = self.func.block(block).params.len() as u32;
        let value = self.value(ty, ValueDef::Param(block, number));
        self.func.blocks[block].params.push(value);
        value
    }

    /// Makes a block the current one.
    pub fn switch_to(&mut self, block: Block) {
        self.block = block;
        self.mark();
    }

    /// Says whether the code from here on seldom runs. If so, the current block and each block that
    /// becomes the current one are marked as [cold](BlockData::cold), until this is called with
    /// `false`; marks that are made stay. Returns what was said before.
    pub fn set_cold(&mut self, cold: bool) -> bool {
        let before = std::mem::replace(&mut self.cold, cold);
        self.mark();
        before
    }

    /// Says whether the code from here on is to be
    /// [optimised for size](BlockData::optimize_for_size). If so, the current block and each block
    /// that becomes the current one are marked, until this is called with `false`; marks that are
    /// made stay.
    pub fn set_optimize_for_size(&mut self, optimize_for_size: bool) {
        self.optimize_for_size = optimize_for_size;
        self.mark();
    }

    /// Whether the code from here on is to be [optimised for size](BlockData::optimize_for_size).
    pub(crate) fn optimizes_for_size(&self) -> bool {
        self.optimize_for_size
    }

    fn mark(&mut self) {
        let data = &mut self.func.blocks[self.block];
        data.cold |= self.cold;
        data.optimize_for_size |= self.optimize_for_size;
    }

    /// Puts a label at a block, which makes it an entry.
    pub fn add_entry(&mut self, label: Label, block: Block) {
        self.func.entries.push((label, block));
    }

    fn value(&mut self, ty: Type, def: ValueDef) -> Value {
        self.func.values.push(ValueData { ty, def })
    }

    /// Ends the current block with a terminator.
    pub fn terminate(&mut self, terminator: Terminator) {
        self.begin_block_behind_end();
        self.func.blocks[self.block].terminator = Some(terminator);
    }

    /// Switches to a new block if the current one has ended.
    fn begin_block_behind_end(&mut self) {
        if self.is_terminated() {
            let block = self.create_block();
            self.switch_to(block);
        }
    }

    /// Gives the function local bits, at least as many.
    pub fn local_bits(&mut self, count: u32) {
        self.func.local_bits = self.func.local_bits.max(count);
    }

    /// Puts groups of bits of a word, an `i32`, into local bits.
    pub fn unpack(&mut self, word: Value, to: BitGroups) {
        self.build(InstData::Unpack { word, to });
    }

    /// A word, an `i32`, with the bits of groups of local bits.
    pub fn pack(&mut self, from: BitGroups) -> Value {
        self.build(InstData::Pack { from })
    }

    /// Appends the question whether the scan has taken longer than it may; gives an `i1`.
    pub fn is_late(&mut self) -> Value {
        self.build(InstData::IsLate)
    }

    /// Appends a call of a host function with the arguments of its signature; returns its result if
    /// it has one. No host function takes more than four arguments. If there are more, what is appended is a call
    /// that the verifier refuses.
    pub fn host_call(&mut self, function: HostFn, args: &[Value]) -> Option<Value> {
        let args = Args::new(args).unwrap_or(Args::WRONG);
        self.host_calls += 1;
        Some(self.build(InstData::HostCall { function, args }))
            .filter(|&result| result != Value::NONE)
    }

    /// The [length](InstData::length) of the function's instructions.
    pub fn length(&self) -> usize {
        self.length
    }

    /// How many host calls the function has.
    pub fn host_call_count(&self) -> usize {
        self.host_calls
    }

    /// Ends the current block with a jump, which passes these values for the block's parameters.
    pub fn jump(&mut self, block: Block, args: &[Value]) {
        self.terminate(Terminator::Jump(BlockCall { block, args: args.to_vec() }));
    }

    /// Ends the current block with a branch to one of two blocks without parameters: to `then` if
    /// `cond`, an `i1`, is true.
    pub fn brif(&mut self, cond: Value, then: Block, otherwise: Block) {
        self.terminate(Terminator::Brif {
            cond,
            then: BlockCall::plain(then),
            otherwise: BlockCall::plain(otherwise),
        });
    }

    /// Ends the current block with the end of the scan.
    pub fn ret(&mut self) {
        self.terminate(Terminator::Return);
    }

    /// Ends the current block with a trap, which stops the program.
    pub fn trap(&mut self, code: TrapCode) {
        self.terminate(Terminator::Trap(code));
    }

    /// Ends the current block with a trap at the [trap site](crate::Module::trap_sites) with the
    /// number `site`. `index` is the index with which the site's array was accessed; both are
    /// `i32`s.
    pub fn trap_at(&mut self, site: Value, index: Value) {
        self.terminate(Terminator::TrapAt { site, index });
    }

    /// Replaces the terminator of a block.
    pub(crate) fn set_terminator(&mut self, block: Block, terminator: Terminator) {
        self.func.blocks[block].terminator = Some(terminator);
    }
}

impl InstBuilder for FuncBuilder {
    fn func(&self) -> &FuncData {
        &self.func
    }

    fn build(&mut self, data: InstData) -> Value {
        self.begin_block_behind_end();
        self.length += data.length();
        let (inst, result) = self.func.append(data, self.loc);
        self.func.blocks[self.block].insts.push(inst);
        result
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_call_with_a_fifth_argument_is_refused_by_the_verifier() {
        let mut b = FuncBuilder::new("f");
        let value = b.constant(Type::I32, 1);
        b.host_call(HostFn::ALL[0], &[value; 5]);
        b.ret();
        let errors = crate::verify::function(&crate::Module::default(), &b.finish());
        assert!(errors.iter().any(|error| error.message.contains("is not there")), "{errors:?}");
    }

    #[test]
    fn blocks_are_cold_that_are_switched_to_while_code_is_cold() {
        let mut b = FuncBuilder::new("f");
        let [cold, nested, join] = [(); 3].map(|()| b.create_block());
        b.switch_to(cold);
        assert!(!b.set_cold(true));
        b.switch_to(nested);
        assert!(b.set_cold(true));
        b.ret();
        // A new block begins after the end of `nested`.
        b.jump(join, &[]);
        assert!(b.set_cold(false));
        b.switch_to(join);
        let marks: Vec<bool> = b.finish().blocks().map(|(_, data)| data.cold).collect();
        assert_eq!(marks, [false, true, true, false, true]);
    }
}
