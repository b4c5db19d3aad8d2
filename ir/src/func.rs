//! A function: one chunk of a program.

use plcc_abi::TrapCode;

use crate::{Block, Inst, InstData, Label, SourceLoc, Type, Value};

/// Where a value comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ValueDef {
    /// The result of an instruction.
    Result(Inst),
    /// A parameter of a block, by number.
    Param(Block, u32),
}

/// A value's type and origin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ValueData {
    /// Its type.
    pub ty: Type,
    /// Its origin.
    pub def: ValueDef,
}

/// A block to go to and the values for its parameters.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BlockCall {
    /// The block.
    pub block: Block,
    /// One value a parameter.
    pub args: Vec<Value>,
}

impl BlockCall {
    /// A call of a block without parameters.
    pub fn plain(block: Block) -> Self {
        Self { block, args: vec![] }
    }
}

/// How a block ends.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Terminator {
    /// On to a block.
    Jump(BlockCall),
    /// On to one of two blocks.
    Brif {
        /// An i1.
        cond: Value,
        /// Where it is true.
        then: BlockCall,
        /// Where it is false.
        otherwise: BlockCall,
    },
    /// On to the block of a number.
    Switch {
        /// An i32, taken as unsigned.
        arg: Value,
        /// Blocks without parameters for 0, 1, 2…
        targets: Vec<Block>,
        /// The block for all other numbers.
        default: Block,
    },
    /// On to a label, in this function or another.
    Goto(Label),
    /// On to the label of a number, an i32; one that does not exist is a trap.
    GotoIndirect(Value),
    /// The scan ends; the task's next starts at the label.
    Suspend(Label),
    /// The scan ends; the task's next starts at the top.
    Return,
    /// The program is stopped.
    Trap(TrapCode),
}

impl Terminator {
    /// The block that it may go to by a number, from 0; `None` behind the last.
    pub fn successor(&self, number: usize) -> Option<Block> {
        match (self, number) {
            (Self::Jump(call), 0) => Some(call.block),
            (Self::Brif { then, .. }, 0) => Some(then.block),
            (Self::Brif { otherwise, .. }, 1) => Some(otherwise.block),
            (Self::Switch { arg: _, targets, default }, _) => match targets.get(number) {
                Some(target) => Some(*target),
                None => (number == targets.len()).then_some(*default),
            },
            _ => None,
        }
    }

    /// The blocks it may go to, with their arguments where they have some.
    pub fn for_each_block(&self, mut f: impl FnMut(Block, &[Value])) {
        match self {
            Self::Jump(call) => f(call.block, &call.args),
            Self::Brif { cond: _, then, otherwise } => {
                f(then.block, &then.args);
                f(otherwise.block, &otherwise.args);
            }
            Self::Switch { arg: _, targets, default } => {
                targets.iter().for_each(|&block| f(block, &[]));
                f(*default, &[]);
            }
            Self::Goto(_)
            | Self::GotoIndirect(_)
            | Self::Suspend(_)
            | Self::Return
            | Self::Trap(_) => {}
        }
    }

    /// The blocks it may go to, to change.
    pub fn for_each_block_mut(&mut self, mut f: impl FnMut(&mut Block)) {
        match self {
            Self::Jump(call) => f(&mut call.block),
            Self::Brif { cond: _, then, otherwise } => {
                f(&mut then.block);
                f(&mut otherwise.block);
            }
            Self::Switch { arg: _, targets, default } => {
                targets.iter_mut().for_each(&mut f);
                f(default);
            }
            Self::Goto(_)
            | Self::GotoIndirect(_)
            | Self::Suspend(_)
            | Self::Return
            | Self::Trap(_) => {}
        }
    }

    /// Calls `f` for each operand, block arguments included, to change it.
    pub fn for_each_arg_mut(&mut self, mut f: impl FnMut(&mut Value)) {
        match self {
            Self::Jump(call) => call.args.iter_mut().for_each(f),
            Self::Brif { cond, then, otherwise } => {
                f(cond);
                then.args.iter_mut().for_each(&mut f);
                otherwise.args.iter_mut().for_each(f);
            }
            Self::Switch { arg, targets: _, default: _ } => f(arg),
            Self::GotoIndirect(value) => f(value),
            Self::Goto(_) | Self::Suspend(_) | Self::Return | Self::Trap(_) => {}
        }
    }

    /// Calls `f` for each operand, block arguments included.
    pub fn for_each_arg(&self, mut f: impl FnMut(Value)) {
        match self {
            Self::Brif { cond, .. } => f(*cond),
            Self::Switch { arg, .. } => f(*arg),
            Self::GotoIndirect(value) => f(*value),
            Self::Jump(_) | Self::Goto(_) | Self::Suspend(_) | Self::Return | Self::Trap(_) => {}
        }
        self.for_each_block(|_, args| args.iter().for_each(|&v| f(v)));
    }
}

/// A basic block.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct BlockData {
    /// Its parameters.
    pub params: Vec<Value>,
    /// Its instructions, in order.
    pub insts: Vec<Inst>,
    /// How it ends; absent only while it is being built.
    pub terminator: Option<Terminator>,
}

/// A function. Built by a [`FuncBuilder`](crate::FuncBuilder) and changed by the passes of this
/// crate only.
#[derive(Clone, Debug, Default)]
pub struct FuncData {
    pub(crate) name: String,
    pub(crate) entries: Vec<(Label, Block)>,
    pub(crate) blocks: Vec<BlockData>,
    pub(crate) insts: Vec<InstData>,
    pub(crate) locs: Vec<SourceLoc>,
    pub(crate) results: Vec<Option<Value>>,
    pub(crate) values: Vec<ValueData>,
}

impl FuncData {
    /// Its name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Its entry blocks, which have no parameters, with their labels.
    pub fn entries(&self) -> &[(Label, Block)] {
        &self.entries
    }

    /// Its blocks, the first of them at index 0.
    pub fn blocks(&self) -> impl ExactSizeIterator<Item = (Block, &BlockData)> {
        self.blocks.iter().enumerate().map(|(i, data)| (Block(i as u32), data))
    }

    /// The number of blocks.
    pub fn block_count(&self) -> usize {
        self.blocks.len()
    }

    /// The number of values, dead ones included.
    pub fn value_count(&self) -> usize {
        self.values.len()
    }

    /// The number of instructions, dead ones included.
    pub fn inst_count(&self) -> usize {
        self.insts.len()
    }

    /// A block of this function.
    ///
    /// # Panics
    /// If the block is not of this function; [`verify`](crate::verify) finds such references.
    pub fn block(&self, block: Block) -> &BlockData {
        &self.blocks[block.index()]
    }

    /// An instruction of this function.
    ///
    /// # Panics
    /// If it is not of this function.
    pub fn inst(&self, inst: Inst) -> &InstData {
        &self.insts[inst.index()]
    }

    /// The statement an instruction belongs to, or [`SourceLoc::NONE`].
    pub fn loc(&self, inst: Inst) -> SourceLoc {
        self.locs.get(inst.index()).copied().unwrap_or(SourceLoc::NONE)
    }

    /// The result of an instruction.
    pub fn result(&self, inst: Inst) -> Option<Value> {
        self.results.get(inst.index()).copied().flatten()
    }

    /// A value's type.
    ///
    /// # Panics
    /// If the value is not of this function.
    pub fn ty(&self, value: Value) -> Type {
        self.values[value.index()].ty
    }

    /// A value's origin.
    ///
    /// # Panics
    /// If the value is not of this function.
    pub fn def(&self, value: Value) -> ValueDef {
        self.values[value.index()].def
    }

    /// The instruction whose result a value is.
    pub fn def_inst(&self, value: Value) -> Option<&InstData> {
        match self.values.get(value.index())?.def {
            ValueDef::Result(inst) => self.insts.get(inst.index()),
            ValueDef::Param(..) => None,
        }
    }

    /// The number, or a double's bits, that a value is known to be.
    pub fn constant(&self, value: Value) -> Option<i64> {
        match self.def_inst(value)? {
            InstData::Iconst { ty: _, value } => Some(*value),
            InstData::Fconst { bits } => Some(*bits as i64),
            _ => None,
        }
    }

    /// A new instruction that stands in no block yet.
    pub(crate) fn append(&mut self, data: InstData, loc: SourceLoc) -> Inst {
        let inst = Inst(self.insts.len() as u32);
        let result = self.result_type(&data).map(|ty| {
            self.values.push(ValueData { ty, def: ValueDef::Result(inst) });
            Value(self.values.len() as u32 - 1)
        });
        self.insts.push(data);
        self.locs.push(loc);
        self.results.push(result);
        inst
    }

    /// The type of an instruction's result, from its operands' types.
    pub(crate) fn result_type(&self, data: &InstData) -> Option<Type> {
        use plcc_abi::HostType;
        match data {
            InstData::Iconst { ty, .. } | InstData::Load { ty, .. } => Some(*ty),
            InstData::Fconst { .. } => Some(Type::F64),
            InstData::Unary { arg, .. } => Some(self.ty(*arg)),
            InstData::Binary { args, .. } | InstData::Select { args, .. } => Some(self.ty(args[0])),
            InstData::Icmp { .. } | InstData::Fcmp { .. } => Some(Type::I1),
            InstData::Convert { to, .. } => Some(*to),
            InstData::Store { .. } => None,
            InstData::HostCall { function, .. } => function.signature().1.map(|ty| match ty {
                HostType::I32 => Type::I32,
                HostType::I64 => Type::I64,
                HostType::F64 => Type::F64,
            }),
        }
    }
}
