//! Skips tests whose result is known from the edge on which control reaches them (jump threading).
//!
//! Programs with the number of their state in a variable have rows of conditions like `IF (S=1) …
//! ENDIF IF (S=2) … ENDIF`. After the statements of the first condition S is 1, or a constant that
//! they have assigned. So the jump from there can go directly to the statements of the condition that then
//! holds, or to what follows the row.
//!
//! ```text
//! block1: v1: i16 = load vars:0
//!         v2: i1 = icmp eq v1, 2
//!         brif v2, block2, block3
//! block5: store vars:0, 2                   block5: store vars:0, 2
//!         jump block1              ==>              jump block2
//! ```
//!
//! When no jump leads into the middle of a row of tests any more, each test has the one before as its
//! sole predecessor, and the pass `switches` can make one switch of the row.
//!
//! A test is a block that does nothing but load a variable, compare it for equality with a constant
//! and branch. What a variable holds at the end of a block is known from the last store to it, or
//! from a test that every path to the block has passed with the same result. A store through an index, a volatile access and
//! a host function that is not pure make that unknown.

use super::graph::Graph;
use super::image_bytes::ImageBytes;
use super::switches::compared_field;
use crate::{
    Address, Block, BlockCall, FloatCond, FuncData, InstData, IntCond, Terminator, Type, Value,
    eval,
};

/// How many tests one edge skips at most in one run of the pass.
const MAX_SKIPPED: usize = 256;
/// How many blocks are searched at most for the value of a variable.
const MAX_BLOCKS: usize = 12;

/// A variable as tests read it: its address, its type, and the number of bits by which it is shifted left
/// before it is compared (0 unless a field of a word is compared; see [`compared_field`]).
type Variable = (Address, Type, u32);

/// A block that tests a variable and does nothing else.
struct Test {
    variable: Variable,
    /// The constant, in the form of [`FuncData::constant`].
    number: i64,
    equal: Block,
    otherwise: Block,
}

/// Runs the pass; gives whether it changed anything.
pub(super) fn run(func: &mut FuncData, bytes: &ImageBytes) -> bool {
    let graph = Graph::new(func);
    let users = users_of_values(func);
    let tests: Vec<Option<Test>> =
        (0..func.block_count()).map(|index| test(func, Block(index as u32), &users)).collect();
    let mut predecessors = vec![vec![]; func.block_count()];
    for &block in &graph.order {
        if let Some(terminator) = &func.block(block).terminator {
            terminator.for_each_block(|next, _| predecessors[next.index()].push(block));
        }
    }
    let mut changed = false;
    for &block in &graph.order {
        let Some(mut terminator) = func.block(block).terminator.clone() else { continue };
        let finder =
            Finder { func, graph: &graph, predecessors: &predecessors, tests: &tests, bytes };
        // The values of variables at the end of this block, as far as they were asked for.
        let mut known: Vec<(Variable, Option<i64>)> = vec![];
        let moved = match &mut terminator {
            Terminator::Jump(call) => finder.thread(block, call, &mut known),
            Terminator::Brif { cond: _, then, otherwise } => {
                let first = finder.thread(block, then, &mut known);
                finder.thread(block, otherwise, &mut known) || first
            }
            _ => false,
        };
        if moved {
            func.blocks[block.index()].terminator = Some(terminator);
            changed = true;
        }
    }
    changed
}

/// Whether a value of this type is equal to a constant.
fn is_equal(ty: Type, value: i64, number: i64) -> bool {
    match ty {
        Type::F64 => eval::fcmp(FloatCond::Eq, value, number),
        ty => eval::icmp(IntCond::Eq, ty, value, number),
    }
}

/// The test of a block; `None` if the block does anything else. `users` says which blocks use each value.
fn test(func: &FuncData, block: Block, users: &[Users]) -> Option<Test> {
    let data = func.block(block);
    let Some(Terminator::Brif { cond, then, otherwise }) = &data.terminator else { return None };
    let (args, is_equality) = match *func.def_inst(*cond)? {
        InstData::Icmp { cond: IntCond::Eq, args } => (args, true),
        InstData::Icmp { cond: IntCond::Ne, args } => (args, false),
        InstData::Fcmp { cond: FloatCond::Eq, args } => (args, true),
        _ => return None,
    };
    let (loaded, shift, number) = compared_field(func, args[0], func.constant(args[1])?);
    let InstData::Load { ty, at } = *func.def_inst(loaded)? else { return None };
    let is_own = |inst: &crate::Inst| {
        let used_here = |value: Value| match users[value.index()] {
            Users::None => true,
            Users::In(user) => user == block,
            Users::Several => false,
        };
        !func.inst(*inst).has_effect() && func.result(*inst).is_none_or(used_here)
    };
    let holds_load = data.insts.iter().any(|&inst| func.result(inst) == Some(loaded));
    let is_plain = data.params.is_empty() && then.args.is_empty() && otherwise.args.is_empty();
    if at.index.is_some()
        || at.volatile
        || !is_plain
        || !holds_load
        || !data.insts.iter().all(is_own)
    {
        return None;
    }
    let (equal, otherwise) = match is_equality {
        true => (then.block, otherwise.block),
        false => (otherwise.block, then.block),
    };
    Some(Test { variable: (at, ty, shift), number, equal, otherwise })
}

/// Which blocks use a value.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Users {
    /// No block does; `dce` will drop it.
    None,
    /// One does.
    In(Block),
    /// More than one do.
    Several,
}

/// Which blocks use each value.
fn users_of_values(func: &FuncData) -> Vec<Users> {
    let mut users = vec![Users::None; func.value_count()];
    for (block, data) in func.blocks() {
        let mut note = |value: Value| {
            let user = &mut users[value.index()];
            *user = match *user {
                Users::None => Users::In(block),
                Users::In(other) if other == block => Users::In(block),
                _ => Users::Several,
            };
        };
        data.insts.iter().for_each(|&inst| func.inst(inst).for_each_arg(&mut note));
        if let Some(terminator) = &data.terminator {
            terminator.for_each_arg(note);
        }
    }
    users
}

/// Finds out what variables hold.
struct Finder<'a> {
    func: &'a FuncData,
    graph: &'a Graph,
    /// For each block the blocks from which edges lead to it.
    predecessors: &'a [Vec<Block>],
    tests: &'a [Option<Test>],
    bytes: &'a ImageBytes,
}

impl Finder<'_> {
    /// Lets an edge that begins at a block skip the tests whose results are known on it. `known` holds what variables
    /// are known to hold at the end of the block. Gives whether the edge leads to another block now.
    fn thread(
        &self,
        block: Block,
        call: &mut BlockCall,
        known: &mut Vec<(Variable, Option<i64>)>,
    ) -> bool {
        let first = call.block;
        if !call.args.is_empty() {
            return false;
        }
        let mut to = first;
        for _ in 0..MAX_SKIPPED {
            let Some(test) = self.tests.get(to.index()).and_then(Option::as_ref) else { break };
            let variable = test.variable;
            // On the edge that a test takes if its variable is equal to the constant, the value is that constant. On
            // the other edge nothing follows.
            let value = match self.along_edge(block, first, &variable) {
                Some(value) => Some(value),
                None => match known.iter().find(|(asked, _)| *asked == variable) {
                    Some((_, value)) => *value,
                    None => {
                        let value = self.at_end(block, &variable);
                        known.push((variable, value));
                        value
                    }
                },
            };
            let Some(value) = value else { break };
            let holds = is_equal(variable.1, value, test.number);
            to = if holds { test.equal } else { test.otherwise };
            if to == first {
                // The tests form a loop that control never leaves; it stays as it is.
                return false;
            }
        }
        call.block = to;
        to != first
    }

    /// What a variable holds on the edge from one block to another, if the first block tests that variable
    /// and this is its edge for equality.
    fn along_edge(&self, from: Block, to: Block, variable: &Variable) -> Option<i64> {
        let test = self.tests.get(from.index())?.as_ref()?;
        let is_equal_edge = test.equal == to && test.otherwise != to;
        (is_equal_edge && test.variable == *variable).then_some(test.number)
    }

    /// What a variable holds at the end of a block; `None` if that is not known.
    fn at_end(&self, block: Block, variable: &Variable) -> Option<i64> {
        let mut blocks = MAX_BLOCKS;
        self.search(block, variable, &mut blocks)
    }

    /// The same, searching no more than `blocks` blocks.
    fn search(&self, block: Block, variable: &Variable, blocks: &mut usize) -> Option<i64> {
        *blocks = blocks.checked_sub(1)?;
        let (at, ty, shift) = variable;
        let bytes = self.bytes.bytes(at, *ty);
        let insts = self.func.block(block).insts.iter().rev();
        for data in insts.map(|&inst| self.func.inst(inst)) {
            match data {
                InstData::Store { at: to, value } if to == at && self.func.ty(*value) == *ty => {
                    let stored = self.func.constant(*value)?;
                    let by = i64::from(*shift);
                    return Some(if by == 0 { stored } else { ty.wrap(stored << by) });
                }
                InstData::Store { at: to, value } => {
                    let written = self.bytes.bytes(to, self.func.ty(*value));
                    if written.start < bytes.end && bytes.start < written.end {
                        return None;
                    }
                }
                data if data.has_effect() => return None,
                _ => {}
            }
        }
        // It is known at the beginning if it is the same on all edges that lead here.
        let before = self.predecessors.get(block.index())?;
        if self.graph.edges.get(block.index()).copied() != u32::try_from(before.len()).ok() {
            return None;
        }
        let mut found = None;
        for &other in before {
            let value = match self.along_edge(other, block, variable) {
                Some(value) => value,
                None => self.search(other, variable, blocks)?,
            };
            if found.is_some_and(|found| found != value) {
                return None;
            }
            found = Some(value);
        }
        found
    }
}
