//! Two versions of a program run from a label with an image, to see whether what a proof says of them comes about.

use std::collections::BTreeMap;

use plcc_abi::{Trap, TrapCode};
use plcc_ir::memory::{pack, read, unpack, write};
use plcc_ir::{
    Address, Block, Func, FuncData, InstData, Label, Module, PrimaryMap, RegionId, StatementId,
    Terminator, Value, eval,
};

use super::terms::Function;

/// How many instructions a run takes at most.
const MOST_STEPS: usize = 400_000;

/// What happens at most.
const MOST_EVENTS: usize = 400;

/// What the host answers to something that happens: a result, and bytes that are in the image afterwards.
#[derive(Clone, Debug, Default)]
pub(super) struct Reply {
    pub(super) result: i64,
    pub(super) image: Vec<(usize, u8)>,
}

/// Something that happened.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Event {
    pub(super) function: Function,
    pub(super) args: Vec<u64>,
    /// The image then, summed up.
    pub(super) image: u64,
    pub(super) loc: StatementId,
}

/// How a run ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum End {
    Return,
    Suspended(Label),
    Trap(Trap),
    /// Control went to a label that does not exist.
    Lost,
    /// It took too long.
    Open,
}

/// A run.
pub(super) struct Run<'m> {
    module: &'m Module,
    pub(super) image: Vec<u8>,
    replies: &'m [Reply],
    pub(super) events: Vec<Event>,
    /// The statement that wrote a byte last.
    pub(super) writers: BTreeMap<usize, StatementId>,
    /// The bytes that were read before they were written.
    pub(super) reads: Vec<usize>,
    /// The statement that was executed last.
    pub(super) loc: StatementId,
    values: Vec<i64>,
    local: Vec<u8>,
    steps: usize,
}

enum Left {
    To(u32),
    End(End),
}

impl<'m> Run<'m> {
    /// A run from a label to its end.
    pub(super) fn of(
        module: &'m Module,
        labels: &'m PrimaryMap<Label, Option<(Func, Block)>>,
        label: Label,
        image: Vec<u8>,
        replies: &'m [Reply],
    ) -> (Self, End) {
        let mut run = Self {
            module,
            image,
            replies,
            events: vec![],
            writers: BTreeMap::new(),
            reads: vec![],
            loc: StatementId::NONE,
            values: vec![],
            local: vec![],
            steps: 0,
        };
        let mut next = label;
        let end = loop {
            let Some((func, block)) = labels.get(next).copied().flatten() else { break End::Lost };
            let Some(data) = module.funcs.get(func.index()) else { break End::Lost };
            match run.function(data, block) {
                Left::To(label) => next = Label(label),
                Left::End(end) => break end,
            }
        };
        (run, end)
    }

    fn function(&mut self, func: &FuncData, mut block: Block) -> Left {
        self.values = vec![0; func.value_count()];
        self.local = vec![0x55; func.local_bits() as usize + 64];
        loop {
            let data = func.block(block);
            for &inst in &data.insts {
                self.steps += 1;
                if self.steps > MOST_STEPS || self.events.len() > MOST_EVENTS {
                    return Left::End(End::Open);
                }
                let loc = func.loc(inst);
                if loc != StatementId::NONE {
                    self.loc = loc;
                }
                let result = self.execute(func, func.inst(inst));
                if let Some(value) = func.result(inst) {
                    self.set(value, result);
                }
            }
            self.steps += 1;
            let call = match &data.terminator {
                Some(Terminator::Jump(call)) => call,
                Some(Terminator::Brif { cond, then, otherwise }) => match self.get(*cond) {
                    0 => otherwise,
                    _ => then,
                },
                Some(Terminator::Switch { arg, targets, default }) => {
                    let number = self.get(*arg) as u32 as usize;
                    block = targets.get(number).copied().unwrap_or(*default);
                    continue;
                }
                Some(Terminator::Goto(label)) => return Left::To(label.0),
                Some(Terminator::GotoIndirect(label)) => {
                    return Left::To(self.get(*label) as u32);
                }
                Some(Terminator::Suspend(label)) => return Left::End(End::Suspended(*label)),
                Some(Terminator::Return) | None => return Left::End(End::Return),
                Some(Terminator::Trap(code)) => return Left::End(End::Trap(Trap::new(*code))),
                Some(Terminator::TrapAt { site, index }) => {
                    let site = self.module.trap_sites.get(self.get(*site) as u32 as usize);
                    let trap = site.map(|site| site.trap(self.get(*index) as u32));
                    return Left::End(End::Trap(trap.unwrap_or(Trap::new(TrapCode::Internal))));
                }
            };
            if self.steps > MOST_STEPS {
                return Left::End(End::Open);
            }
            let args: Vec<i64> = call.args.iter().map(|&arg| self.get(arg)).collect();
            for (&param, arg) in func.block(call.block).params.iter().zip(args) {
                self.set(param, arg);
            }
            block = call.block;
        }
    }

    fn get(&self, value: Value) -> i64 {
        self.values.get(value.index()).copied().unwrap_or(0)
    }

    fn set(&mut self, value: Value, bits: i64) {
        if let Some(slot) = self.values.get_mut(value.index()) {
            *slot = bits;
        }
    }

    /// Something happens: what is answered.
    fn happen(&mut self, function: Function, args: Vec<u64>) -> i64 {
        let image = match function {
            Function::Late => 0,
            _ => {
                use std::hash::Hasher;
                let mut hasher = rustc_hash::FxHasher::default();
                hasher.write(&self.image);
                hasher.finish()
            }
        };
        let reply = self.replies.get(self.events.len()).cloned().unwrap_or_default();
        self.events.push(Event { function, args, image, loc: self.loc });
        for (at, byte) in reply.image {
            if let Some(slot) = self.image.get_mut(at) {
                *slot = byte;
            }
        }
        reply.result
    }

    fn execute(&mut self, func: &FuncData, inst: &InstData) -> i64 {
        match *inst {
            InstData::Iconst { .. }
            | InstData::Fconst { .. }
            | InstData::Unary { .. }
            | InstData::Binary { .. }
            | InstData::Icmp { .. }
            | InstData::Fcmp { .. }
            | InstData::Select { .. }
            | InstData::Convert { .. }
            | InstData::Bit { .. }
            | InstData::Extract { .. }
            | InstData::Insert { .. } => {
                eval::instruction(func, inst, |value| self.get(value)).unwrap_or_default()
            }
            InstData::Load { ty, at } if at.region == RegionId::LOCAL_BITS => {
                read(&self.local, at.offset, ty)
            }
            InstData::Load { ty, at } if at.volatile => {
                let (read, index) = self.volatile(&at, Function::Read);
                ty.wrap(self.happen(read, index))
            }
            InstData::Load { ty, at } => {
                let offset = self.offset(&at);
                for byte in offset as usize..(offset + ty.bytes()) as usize {
                    if !self.writers.contains_key(&byte) {
                        self.reads.push(byte);
                    }
                }
                read(&self.image, offset, ty)
            }
            InstData::Store { at, value } if at.region == RegionId::LOCAL_BITS => {
                let number = self.get(value);
                write(&mut self.local, at.offset, func.ty(value), number);
                0
            }
            InstData::Store { at, value } => {
                let (ty, number, offset) = (func.ty(value), self.get(value), self.offset(&at));
                write(&mut self.image, offset, ty, number);
                for byte in offset..offset + ty.bytes() {
                    self.writers.insert(byte as usize, self.loc);
                }
                if at.volatile {
                    let (write, mut args) = self.volatile(&at, Function::Write);
                    args.push(number as u64);
                    self.happen(write, args);
                }
                0
            }
            InstData::Unpack { word, to } => {
                let word = self.get(word);
                unpack(&mut self.local, word, &to);
                0
            }
            InstData::Pack { from } => pack(&self.local, &from),
            InstData::IsLate => self.happen(Function::Late, vec![]) & 1,
            InstData::HostCall { function, args } => {
                let word = |&arg: &Value| eval::host_word(func.ty(arg), self.get(arg));
                let words: Vec<u64> = args.as_slice().iter().map(word).collect();
                let result = match Function::Pure(function).value(&words) {
                    Some(value) if function.is_pure() => value,
                    _ => self.happen(Function::Call(function), words) as u64,
                };
                eval::host_result(function, result)
            }
        }
    }

    /// A volatile access, with the value of its index.
    fn volatile(
        &self,
        at: &Address,
        make: fn(usize, u32, u32) -> Function,
    ) -> (Function, Vec<u64>) {
        let region = self.module.region(at.region).map_or(0, |region| region.offset);
        let (scale, count) = at.index.map_or((0, 0), |index| (index.scale, index.count));
        let index = at.index.map(|index| self.get(index.value) as u64);
        (make(region.wrapping_add(at.offset) as usize, scale, count), index.into_iter().collect())
    }

    fn offset(&self, at: &Address) -> u32 {
        self.module.image_offset(at, |value| self.get(value))
    }
}
