//! Writes one function, instruction by instruction.

use plcc_abi::{HostFn, TrapCode};

use crate::func::ValueData;
use crate::{
    Address, Args, BinaryOp, Block, BlockCall, BlockData, ConvertOp, FloatCond, FuncData, InstData,
    IntCond, Label, SourceLoc, Terminator, Type, UnaryOp, Value, ValueDef,
};

/// A function under construction and the block that instructions are appended to.
///
/// Behind a terminator a new block begins by itself, which nothing reaches until it is
/// [entered](Self::switch_to) by name; so code that can't be reached needs no care.
#[derive(Clone, Debug)]
pub struct FuncBuilder {
    func: FuncData,
    block: Block,
    loc: SourceLoc,
}

impl FuncBuilder {
    /// An empty function with one block, which is the current one.
    pub fn new(name: impl Into<String>) -> Self {
        let func = FuncData {
            name: name.into(),
            blocks: vec![BlockData::default()],
            ..FuncData::default()
        };
        Self { func, block: Block(0), loc: SourceLoc::NONE }
    }

    /// The finished function; a block left open returns.
    pub fn finish(mut self) -> FuncData {
        for block in &mut self.func.blocks {
            block.terminator.get_or_insert(Terminator::Return);
        }
        self.func
    }

    /// The function so far.
    pub fn func(&self) -> &FuncData {
        &self.func
    }

    /// The current block.
    pub fn current(&self) -> Block {
        self.block
    }

    /// Whether the current block has been ended.
    pub fn is_terminated(&self) -> bool {
        self.func.block(self.block).terminator.is_some()
    }

    /// The statement that further instructions belong to.
    pub fn set_loc(&mut self, loc: SourceLoc) {
        self.loc = loc;
    }

    /// The statement that further instructions belong to.
    pub fn loc(&self) -> SourceLoc {
        self.loc
    }

    /// Makes a block, without going there.
    pub fn create_block(&mut self) -> Block {
        let block = Block(self.func.blocks.len() as u32);
        self.func.blocks.push(BlockData::default());
        block
    }

    /// Gives a block one more parameter.
    pub fn block_param(&mut self, block: Block, ty: Type) -> Value {
        let number = self.func.block(block).params.len() as u32;
        let value = self.value(ty, ValueDef::Param(block, number));
        self.func.blocks[block.index()].params.push(value);
        value
    }

    /// Appends to this block from now on.
    pub fn switch_to(&mut self, block: Block) {
        self.block = block;
    }

    /// Makes a block an entry.
    pub fn entry(&mut self, label: Label, block: Block) {
        self.func.entries.push((label, block));
    }

    fn value(&mut self, ty: Type, def: ValueDef) -> Value {
        let value = Value(self.func.values.len() as u32);
        self.func.values.push(ValueData { ty, def });
        value
    }

    /// Appends an instruction.
    pub fn push(&mut self, data: InstData) -> Option<Value> {
        if self.is_terminated() {
            self.block = self.create_block();
        }
        let inst = self.func.append(data, self.loc);
        self.func.blocks[self.block.index()].insts.push(inst);
        self.func.result(inst)
    }

    fn push_valued(&mut self, data: InstData) -> Value {
        // Only stores and calls without result have none, and they do not come here.
        self.push(data).unwrap_or(Value(u32::MAX))
    }

    /// Ends the current block.
    pub fn terminate(&mut self, terminator: Terminator) {
        if self.is_terminated() {
            self.block = self.create_block();
        }
        self.func.blocks[self.block.index()].terminator = Some(terminator);
    }

    /// An integer constant; wraps to the type.
    pub fn iconst(&mut self, ty: Type, value: i64) -> Value {
        self.push_valued(InstData::Iconst { ty, value: ty.wrap(value) })
    }

    /// A double.
    pub fn fconst(&mut self, value: f64) -> Value {
        self.push_valued(InstData::Fconst { bits: value.to_bits() })
    }

    /// One operand.
    pub fn unary(&mut self, op: UnaryOp, arg: Value) -> Value {
        self.push_valued(InstData::Unary { op, arg })
    }

    /// Two operands of one type.
    pub fn binary(&mut self, op: BinaryOp, a: Value, b: Value) -> Value {
        self.push_valued(InstData::Binary { op, args: [a, b] })
    }

    /// An operand and a constant of its type.
    pub fn binary_imm(&mut self, op: BinaryOp, a: Value, b: i64) -> Value {
        let ty = self.func.ty(a);
        let b = self.iconst(ty, b);
        self.binary(op, a, b)
    }

    /// Two integers compared.
    pub fn icmp(&mut self, cond: IntCond, a: Value, b: Value) -> Value {
        self.push_valued(InstData::Icmp { cond, args: [a, b] })
    }

    /// An integer compared with a constant.
    pub fn icmp_imm(&mut self, cond: IntCond, a: Value, b: i64) -> Value {
        let ty = self.func.ty(a);
        let b = self.iconst(ty, b);
        self.icmp(cond, a, b)
    }

    /// Two doubles compared.
    pub fn fcmp(&mut self, cond: FloatCond, a: Value, b: Value) -> Value {
        self.push_valued(InstData::Fcmp { cond, args: [a, b] })
    }

    /// `a` where `cond`, else `b`.
    pub fn select(&mut self, cond: Value, a: Value, b: Value) -> Value {
        self.push_valued(InstData::Select { cond, args: [a, b] })
    }

    /// Another type.
    pub fn convert(&mut self, op: ConvertOp, to: Type, arg: Value) -> Value {
        self.push_valued(InstData::Convert { op, to, arg })
    }

    /// A signed integer brought to a wider, narrower or the same type.
    pub fn sextend_or_trunc(&mut self, to: Type, arg: Value) -> Value {
        self.resize(ConvertOp::Sext, to, arg)
    }

    /// An unsigned integer, or truth value, brought to a wider, narrower or the same type.
    pub fn zextend_or_trunc(&mut self, to: Type, arg: Value) -> Value {
        self.resize(ConvertOp::Zext, to, arg)
    }

    fn resize(&mut self, extend: ConvertOp, to: Type, arg: Value) -> Value {
        match to.bits().cmp(&self.func.ty(arg).bits()) {
            std::cmp::Ordering::Equal => arg,
            std::cmp::Ordering::Less => self.convert(ConvertOp::Trunc, to, arg),
            std::cmp::Ordering::Greater => self.convert(extend, to, arg),
        }
    }

    /// What stands in the image.
    pub fn load(&mut self, ty: Type, at: Address) -> Value {
        self.push_valued(InstData::Load { ty, at })
    }

    /// Puts a value into the image.
    pub fn store(&mut self, at: Address, value: Value) {
        self.push(InstData::Store { at, value });
    }

    /// Calls the host; arguments as in the function's signature.
    pub fn host_call(&mut self, function: HostFn, args: &[Value]) -> Option<Value> {
        let args = Args::new(args)?;
        self.push(InstData::HostCall { function, args })
    }

    /// On to a block.
    pub fn jump(&mut self, block: Block, args: &[Value]) {
        self.terminate(Terminator::Jump(BlockCall { block, args: args.to_vec() }));
    }

    /// On to one of two blocks without parameters.
    pub fn brif(&mut self, cond: Value, then: Block, otherwise: Block) {
        self.terminate(Terminator::Brif {
            cond,
            then: BlockCall::plain(then),
            otherwise: BlockCall::plain(otherwise),
        });
    }

    /// Ends the scan.
    pub fn ret(&mut self) {
        self.terminate(Terminator::Return);
    }

    /// Stops the program.
    pub fn trap(&mut self, code: TrapCode) {
        self.terminate(Terminator::Trap(code));
    }

    /// Gives a block a terminator, whatever it had.
    pub(crate) fn set_terminator(&mut self, block: Block, terminator: Terminator) {
        self.func.blocks[block.index()].terminator = Some(terminator);
    }
}
