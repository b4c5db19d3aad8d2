//! A function: one chunk of a program, as tables.
//!
//! ```text
//! blocks   [ params [v0]  insts [inst0, inst2]  terminator jump block1 ] [ … ]
//!                                  │      └──────────────┐
//! insts    [ inst0: add v0, v0 ] [ inst1: … ] [ inst2: store … ]      what is done
//! locs     [ @0                ] [ @0       ] [ @1             ]      for which statement
//! results  [ v1                ] [ v2       ] [ none           ]      with which result
//! values   [ v0: i32, param 0 of block0 ] [ v1: i32, result of inst0 ] …
//! entries  [ (L0, block0) ]
//! ```
//!
//! Instructions, values and blocks are numbered ([entities](crate::entities)) and kept in tables
//! by number. A block lists the numbers of its instructions in the order of execution; so an
//! instruction is moved or dropped by changing a list, and is replaced in place without its uses
//! noticing. What is dropped from the lists stays in the tables until the pass `compact` numbers
//! the rest again.
//!
//! Values are in static single assignment form: each is defined once, by an instruction or as a
//! parameter of a block. Where control flow joins, a block has parameters, and each jump to it
//! passes them as arguments (other compilers have phi instructions there). Entry blocks have no
//! parameters, since control reaches them from outside.
//!
//! The order of the blocks means nothing but the order in which they are printed.

use plcc_abi::TrapCode;

use crate::{Block, Inst, InstData, Label, PrimaryMap, SecondaryMap, StatementId, Type, Value};

/// The name under which accesses name local bits in text.
pub(crate) const LOCAL_BITS_NAME: &str = "local_bits";

/// A function has no more local bits than this, so that its stack frame stays smaller than a page.
pub(crate) const MAX_LOCAL_BITS: u32 = 2048;

/// How a value is defined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ValueDef {
    /// The result of an instruction.
    Result(Inst),
    /// The parameter of a block with this number, from 0.
    Param(Block, u32),
}

/// The type of a value, and how it is defined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ValueData {
    /// Its type.
    pub ty: Type,
    /// How it is defined.
    pub def: ValueDef,
}

/// A block that control goes to, with the values for its parameters.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BlockCall {
    /// The block.
    pub block: Block,
    /// One value for each parameter, in their order.
    pub args: Vec<Value>,
}

impl BlockCall {
    /// To a block without parameters.
    pub fn plain(block: Block) -> Self {
        Self { block, args: vec![] }
    }
}

/// The end of a block: where control goes from there.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Terminator {
    /// To a block.
    Jump(BlockCall),
    /// To one of two blocks ("branch if").
    Brif {
        /// The condition, an `i1`.
        cond: Value,
        /// Where control goes if it is true.
        then: BlockCall,
        /// Where control goes if it is false.
        otherwise: BlockCall,
    },
    /// To the block in a table that has the index `arg`.
    Switch {
        /// The index, an `i32` that is taken as unsigned.
        arg: Value,
        /// The blocks for 0, 1, 2 and so on; they have no parameters.
        targets: Vec<Block>,
        /// The block for all other numbers, without parameters too.
        default: Block,
    },
    /// To a label, in this function or another.
    Goto(Label),
    /// To the label whose number is this value, an `i32`. If no label has the number, the program
    /// is stopped with the trap [`TrapCode::Internal`].
    GotoIndirect(Value),
    /// The scan ends, suspended; the next scan of the task goes on at the label.
    Suspend(Label),
    /// The scan ends; the next scan of the task starts at its entry.
    Return,
    /// The program is stopped with a code. No statement is to blame.
    Trap(TrapCode),
    /// The program is stopped as a [trap site](crate::Module::trap_sites) of the module says.
    TrapAt {
        /// The number of the site, an `i32`. If there is no such site, the trap is
        /// [`TrapCode::Internal`].
        site: Value,
        /// The index with which the site's array was accessed, an `i32` of which the low 16 bits
        /// count. Sites without an array do not use it.
        index: Value,
    },
}

impl Terminator {
    /// The successor with this number, from 0: one of the blocks that control may go to. `None` if
    /// there are fewer.
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

    /// Calls `f` for each block that control may go to, with the arguments for its parameters.
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
            | Self::Trap(_)
            | Self::TrapAt { .. } => {}
        }
    }

    /// Calls `f` for each block that control may go to and that may have parameters, with its arguments.
    pub(crate) fn for_each_call_mut(&mut self, mut f: impl FnMut(&mut BlockCall)) {
        match self {
            Self::Jump(call) => f(call),
            Self::Brif { cond: _, then, otherwise } => {
                f(then);
                f(otherwise);
            }
            // The blocks of a switch have no parameters.
            Self::Switch { .. }
            | Self::Goto(_)
            | Self::GotoIndirect(_)
            | Self::Suspend(_)
            | Self::Return
            | Self::Trap(_)
            | Self::TrapAt { .. } => {}
        }
    }

    /// Calls `f` for each block that control may go to; `f` may replace it.
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
            | Self::Trap(_)
            | Self::TrapAt { .. } => {}
        }
    }

    /// Calls `f` for each operand, arguments of blocks included; `f` may replace it.
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
            Self::TrapAt { site, index } => {
                f(site);
                f(index);
            }
            Self::Goto(_) | Self::Suspend(_) | Self::Return | Self::Trap(_) => {}
        }
    }

    /// Calls `f` for the operand that decides where control goes, if there is one.
    pub fn for_each_operand(&self, mut f: impl FnMut(Value)) {
        match self {
            Self::Brif { cond, .. } => f(*cond),
            Self::Switch { arg, .. } => f(*arg),
            Self::GotoIndirect(value) => f(*value),
            Self::TrapAt { site, index } => {
                f(*site);
                f(*index);
            }
            Self::Jump(_) | Self::Goto(_) | Self::Suspend(_) | Self::Return | Self::Trap(_) => {}
        }
    }

    /// Calls `f` for each operand, arguments of blocks included.
    pub fn for_each_arg(&self, mut f: impl FnMut(Value)) {
        self.for_each_operand(&mut f);
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
    /// Whether it seldom runs. Code generation places its code after that of the other blocks, and
    /// does not keep base registers over its calls. What the block computes is not changed by it.
    pub cold: bool,
    /// Whether its code should be small rather than fast. It seldom runs, like that of a cold
    /// block, but there is so much of it that placing it apart does not pay.
    pub optimize_for_size: bool,
    /// Its end; absent only while the block is being built.
    pub terminator: Option<Terminator>,
}

/// A function. It is built by a [`FuncBuilder`](crate::FuncBuilder) and changed by the passes of
/// this crate only; the head of this file draws its tables.
#[derive(Clone, Debug, Default)]
pub struct FuncData {
    pub(crate) name: String,
    pub(crate) local_bits: u32,
    pub(crate) entries: Vec<(Label, Block)>,
    pub(crate) blocks: PrimaryMap<Block, BlockData>,
    pub(crate) insts: PrimaryMap<Inst, InstData>,
    pub(crate) locs: PrimaryMap<Inst, StatementId>,
    pub(crate) results: PrimaryMap<Inst, Option<Value>>,
    pub(crate) values: PrimaryMap<Value, ValueData>,
}

impl FuncData {
    /// Its name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Its labels, each with the entry block at which it stands.
    pub fn entries(&self) -> &[(Label, Block)] {
        &self.entries
    }

    /// Its blocks with their numbers.
    pub fn blocks(&self) -> impl ExactSizeIterator<Item = (Block, &BlockData)> {
        self.blocks.iter()
    }

    /// The number of blocks.
    pub fn block_count(&self) -> usize {
        self.blocks.len()
    }

    /// The number of values, unused ones included.
    pub fn value_count(&self) -> usize {
        self.values.len()
    }

    /// How often instructions and terminators use each value.
    pub fn use_counts(&self) -> SecondaryMap<Value, u32> {
        let mut counts = SecondaryMap::from(vec![0; self.value_count()]);
        let mut note = |value: Value| {
            if let Some(count) = counts.get_mut(value) {
                *count += 1;
            }
        };
        for (_, data) in self.blocks() {
            data.insts.iter().for_each(|&inst| self.inst(inst).for_each_arg(&mut note));
            if let Some(terminator) = &data.terminator {
                terminator.for_each_arg(&mut note);
            }
        }
        counts
    }

    /// How many local bits it has: truth values in a byte each, which lie in its stack frame and not in the process image. They
    /// mean nothing when the function is entered, and are lost when it is left. Loads and stores reach one as an
    /// address in [`RegionId::LOCAL_BITS`](crate::RegionId::LOCAL_BITS), [`Pack`](InstData::Pack) and [`Unpack`](InstData::Unpack) all of a word. Only
    /// passes make them (`byte-bits`).
    pub fn local_bits(&self) -> u32 {
        self.local_bits
    }

    /// The number of instructions, those that are in no block included.
    pub fn inst_count(&self) -> usize {
        self.insts.len()
    }

    /// The [length](InstData::length) of the instructions in its blocks.
    pub fn length(&self) -> usize {
        let insts = self.blocks().flat_map(|(_, block)| &block.insts);
        insts.map(|&inst| self.inst(inst).length()).sum()
    }

    /// A block of this function.
    ///
    /// # Panics
    /// If the block is not of this function; [`verify`](crate::verify) finds such references.
    #[inline]
    pub fn block(&self, block: Block) -> &BlockData {
        &self.blocks[block]
    }

    /// An instruction of this function.
    ///
    /// # Panics
    /// If it is not of this function.
    #[inline]
    pub fn inst(&self, inst: Inst) -> &InstData {
        &self.insts[inst]
    }

    /// The statement that an instruction belongs to, or [`StatementId::NONE`].
    #[inline]
    pub fn loc(&self, inst: Inst) -> StatementId {
        self.locs.get(inst).copied().unwrap_or(StatementId::NONE)
    }

    /// The result of an instruction; `None` if it has none, or is not of this function.
    #[inline]
    pub fn result(&self, inst: Inst) -> Option<Value> {
        self.results.get(inst).copied().flatten()
    }

    /// The type of a value.
    ///
    /// # Panics
    /// If the value is not of this function.
    #[inline]
    pub fn ty(&self, value: Value) -> Type {
        self.values[value].ty
    }

    /// How a value is defined.
    ///
    /// # Panics
    /// If the value is not of this function.
    pub fn def(&self, value: Value) -> ValueDef {
        self.values[value].def
    }

    /// The instruction whose result a value is; `None` for a parameter of a block.
    #[inline]
    pub fn def_inst(&self, value: Value) -> Option<&InstData> {
        match self.values.get(value)?.def {
            ValueDef::Result(inst) => self.insts.get(inst),
            ValueDef::Param(..) => None,
        }
    }

    /// The instruction that defines a value; `None` for a parameter of a block.
    pub fn definition(&self, value: Value) -> Option<Inst> {
        match self.values.get(value)?.def {
            ValueDef::Result(inst) => Some(inst),
            ValueDef::Param(..) => None,
        }
    }

    /// The constant that a value is: an integer in the form of [`Type::wrap`], or the bits of a
    /// double. `None` if the value is not defined by a constant.
    #[inline]
    pub fn constant(&self, value: Value) -> Option<i64> {
        match self.def_inst(value)? {
            InstData::Iconst { ty: _, value } => Some(*value),
            InstData::Fconst { bits } => Some(*bits as i64),
            _ => None,
        }
    }

    /// Whether all of the function's code is [optimised for size](BlockData::optimize_for_size), since it
    /// seldom runs.
    pub fn is_optimized_for_size(&self) -> bool {
        let mut blocks = self.blocks.values().filter(|data| !data.insts.is_empty());
        blocks.all(|data| data.optimize_for_size)
    }

    /// Makes room in the tables for a number of further instructions, each with a result.
    pub(crate) fn make_room(&mut self, insts: usize) {
        self.insts.reserve(insts);
        self.locs.reserve(insts);
        self.results.reserve(insts);
        self.values.reserve(insts);
    }

    /// Adds an instruction to the tables, which is in no block yet. Returns it and its result, which is
    /// [`Value::NONE`] if it has none.
    pub(crate) fn append(&mut self, data: InstData, loc: StatementId) -> (Inst, Value) {
        let inst = self.insts.next_key();
        let result = self
            .result_type(&data)
            .map(|ty| self.values.push(ValueData { ty, def: ValueDef::Result(inst) }));
        self.insts.push(data);
        self.locs.push(loc);
        self.results.push(result);
        (inst, result.unwrap_or(Value::NONE))
    }

    /// The type of an instruction's result as it follows from the types of its operands; `None` if
    /// it has no result.
    pub(crate) fn result_type(&self, data: &InstData) -> Option<Type> {
        use plcc_abi::HostType;
        match data {
            InstData::Iconst { ty, .. } | InstData::Load { ty, .. } => Some(*ty),
            InstData::Fconst { .. } => Some(Type::F64),
            InstData::Unary { arg, .. } => Some(self.ty(*arg)),
            InstData::Extract { arg, .. } => Some(self.ty(*arg)),
            InstData::Binary { args, .. }
            | InstData::Select { args, .. }
            | InstData::Insert { args, .. } => Some(self.ty(args[0])),
            InstData::Icmp { .. }
            | InstData::Fcmp { .. }
            | InstData::IsLate
            | InstData::Bit { .. } => Some(Type::I1),
            InstData::Convert { to, .. } => Some(*to),
            InstData::Pack { .. } => Some(Type::I32),
            InstData::Store { .. } | InstData::Unpack { .. } => None,
            InstData::HostCall { function, .. } => function.signature().1.map(|ty| match ty {
                HostType::I32 => Type::I32,
                HostType::I64 => Type::I64,
                HostType::F64 => Type::F64,
            }),
        }
    }
}
