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
//! Before that, conditions that have more than a test get a branch for the test ([`split_tests`]). And where ways meet
//! in a short block before a test, those ways on which the variable is known get a copy of the block, for example
//! after `IF (I3) S=2 ELSEIF (I4) S=7 ENDIF Q1=T`.
//!
//! When no jump leads into the middle of a row of tests any more, each test has the one before as its
//! sole predecessor, and the pass `switches` can make one switch of the row.
//!
//! A test that stands alone, with no test of the same variable before or after it, is skipped only in the run after
//! `if-convert`. A way around it would keep the branch before it from becoming a select. That is how counters are
//! written: `IF (I3) C=C+1 ELSE C=0 ENDIF IF (C=9) …`.
//!
//! A test is a block that does nothing but load a variable, compare it for equality with a constant
//! and branch. What a variable holds at the end of a block is known from the last store to it, or
//! from a test that every path to the block has passed with the same result. A store through an index, a volatile access and
//! a host function that is not pure make that unknown.

use super::graph::Graph;
use super::image_bytes::ImageBytes;
use super::split_tests;
use super::switches::compared_field;
use super::thresholds::thread_tests::{MAX_BLOCKS, MAX_COPIED, MAX_WAYS};
use crate::{
    Address, Block, BlockCall, ExtractOp, Field, FloatCond, FuncData, InstData, IntCond,
    PrimaryMap, Terminator, Type, Value, eval,
};

/// How many tests one edge skips at most in one run of the pass.
const MAX_SKIPPED: usize = 256;
/// A variable as tests read it: its address, its type, and the field of it that is compared (see [`compared_field`]).
type Variable = (Address, Type, Field);

/// A block that tests a variable and does nothing else.
struct Test {
    variable: Variable,
    /// The constant, in the form of [`FuncData::constant`].
    number: i64,
    equal: Block,
    otherwise: Block,
}

/// Runs the pass; returns whether it changed anything. `skips_lone` says whether tests that stand alone are skipped.
pub(super) fn run(func: &mut FuncData, bytes: &ImageBytes, skips_lone: bool) -> bool {
    // A branch and the two blocks to which it leads.
    if func.block_count() < 3 {
        return false;
    }
    let mut changed = split_tests::run(func);
    let mut graph = Graph::new(func);
    let mut users = users_of_values(func);
    let mut tests = tests_of_blocks(func, &users);
    let mut predecessors = predecessors_of_blocks(func, &graph);
    let finder = Finder {
        func,
        graph: &graph,
        predecessors: &predecessors,
        tests: &tests,
        bytes,
        skips_lone,
    };
    let copies = finder.copies(&users);
    if !copies.is_empty() {
        copies.into_iter().for_each(|copy| copy_block(func, copy));
        graph = Graph::new(func);
        users = users_of_values(func);
        tests = tests_of_blocks(func, &users);
        predecessors = predecessors_of_blocks(func, &graph);
        changed = true;
    }
    for &block in &graph.order {
        let Some(mut terminator) = func.block(block).terminator.clone() else { continue };
        let finder = Finder {
            func,
            graph: &graph,
            predecessors: &predecessors,
            tests: &tests,
            bytes,
            skips_lone,
        };
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
            func.blocks[block].terminator = Some(terminator);
            changed = true;
        }
    }
    changed
}

/// For each block the test that it is, if it is one.
fn tests_of_blocks(
    func: &FuncData,
    users: &PrimaryMap<Value, Users>,
) -> PrimaryMap<Block, Option<Test>> {
    func.blocks.keys().map(|block| test(func, block, users)).collect()
}

/// For each block those that lead to it, once for each edge.
fn predecessors_of_blocks(func: &FuncData, graph: &Graph) -> PrimaryMap<Block, Vec<Block>> {
    let mut predecessors = PrimaryMap::from(vec![vec![]; func.block_count()]);
    for &block in &graph.order {
        if let Some(terminator) = &func.block(block).terminator {
            terminator.for_each_block(|next, _| predecessors[next].push(block));
        }
    }
    predecessors
}

/// A copy of a block that is to be made for some of the ways on which control reaches it.
struct BlockCopy {
    block: Block,
    /// The blocks from which those ways come, by one edge each.
    from: Vec<Block>,
}

/// Copies a block for some of its predecessors.
fn copy_block(func: &mut FuncData, copy: BlockCopy) {
    let mut data = func.block(copy.block).clone();
    // The copy of each result. Nothing but the block itself uses the results.
    let mut results: Vec<(Value, Value)> = vec![];
    for inst in &mut data.insts {
        let mut copied = *func.inst(*inst);
        copied.for_each_arg_mut(|arg| {
            if let Some((_, new)) = results.iter().find(|(old, _)| old == arg) {
                *arg = *new;
            }
        });
        let (new, result) = func.append(copied, func.loc(*inst));
        results.extend(func.result(*inst).map(|old| (old, result)));
        *inst = new;
    }
    let to = func.blocks.push(data);
    for from in copy.from {
        if let Some(terminator) = &mut func.blocks[from].terminator {
            terminator.for_each_block_mut(|next| {
                if *next == copy.block {
                    *next = to;
                }
            });
        }
    }
}

/// Whether a value of this type is equal to a constant.
fn is_equal(ty: Type, value: i64, number: i64) -> bool {
    match ty {
        Type::F64 => eval::fcmp(FloatCond::Eq, value, number),
        ty => eval::icmp(IntCond::Eq, ty, value, number),
    }
}

/// The test of a block; `None` if the block does anything else. `users` says which blocks use each value.
fn test(func: &FuncData, block: Block, users: &PrimaryMap<Value, Users>) -> Option<Test> {
    let data = func.block(block);
    let Some(Terminator::Brif { cond, then, otherwise }) = &data.terminator else { return None };
    let (args, is_equality) = match *func.def_inst(*cond)? {
        InstData::Icmp { cond: IntCond::Eq, args } => (args, true),
        InstData::Icmp { cond: IntCond::Ne, args } => (args, false),
        InstData::Fcmp { cond: FloatCond::Eq, args } => (args, true),
        _ => return None,
    };
    let (loaded, field, number) = compared_field(func, args[0], func.constant(args[1])?);
    let InstData::Load { ty, at } = *func.def_inst(loaded)? else { return None };
    let is_own = |inst: &crate::Inst| {
        let is_used_here = |value: Value| users[value].are_in(block);
        !func.inst(*inst).has_effect() && func.result(*inst).is_none_or(is_used_here)
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
    Some(Test { variable: (at, ty, field), number, equal, otherwise })
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

impl Users {
    /// Whether no other block does.
    fn are_in(self, block: Block) -> bool {
        match self {
            Self::None => true,
            Self::In(user) => user == block,
            Self::Several => false,
        }
    }
}

/// Which blocks use each value.
fn users_of_values(func: &FuncData) -> PrimaryMap<Value, Users> {
    let mut users = PrimaryMap::from(vec![Users::None; func.value_count()]);
    for (block, data) in func.blocks() {
        let mut note = |value: Value| {
            let user = &mut users[value];
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
    predecessors: &'a PrimaryMap<Block, Vec<Block>>,
    tests: &'a PrimaryMap<Block, Option<Test>>,
    bytes: &'a ImageBytes,
    /// Whether tests that stand alone are skipped.
    skips_lone: bool,
}

impl Finder<'_> {
    /// The copies that are to be made: of short blocks that jump to a row of tests of a variable which is known on
    /// some of the ways to the block. The ways with the same value share a copy.
    fn copies(&self, users: &PrimaryMap<Value, Users>) -> Vec<BlockCopy> {
        let mut copies = vec![];
        for &block in &self.graph.order {
            let Some(variable) = self.tested_after(block, users) else { continue };
            let before = &self.predecessors[block];
            let is_entered = self.graph.edges[block] as usize != before.len();
            if is_entered || !(2..=MAX_WAYS).contains(&before.len()) {
                continue;
            }
            let mut values: Vec<(i64, Vec<Block>)> = vec![];
            for &from in before {
                let has_one_edge = before.iter().filter(|&&other| other == from).count() == 1;
                let is_other = !matches!(
                    self.func.block(from).terminator,
                    Some(Terminator::Jump(_) | Terminator::Brif { .. })
                );
                let value = match self.along_edge(from, block, &variable) {
                    Some(value) => Some(value),
                    None => self.at_end(from, &variable),
                };
                let Some(value) = value.filter(|_| has_one_edge && !is_other) else { continue };
                match values.iter_mut().find(|(other, _)| *other == value) {
                    Some((_, ways)) => ways.push(from),
                    None => values.push((value, vec![from])),
                }
            }
            // Where all ways have the same value, it is known in the block itself.
            let known = values.iter().map(|(_, ways)| ways.len()).sum::<usize>();
            if values.len() < 2 && known == before.len() {
                continue;
            }
            copies.extend(values.into_iter().map(|(_, from)| BlockCopy { block, from }));
        }
        copies
    }

    /// The variable of the row of tests to which a block jumps, if the block may be copied and does not change that
    /// variable.
    fn tested_after(&self, block: Block, users: &PrimaryMap<Value, Users>) -> Option<Variable> {
        let data = self.func.block(block);
        let Some(Terminator::Jump(call)) = &data.terminator else { return None };
        if !data.params.is_empty() || !call.args.is_empty() || data.insts.len() > MAX_COPIED {
            return None;
        }
        let test = self.tests[call.block].as_ref()?;
        let next = self.tests[test.otherwise].as_ref()?;
        let bytes = self.bytes.bytes(&test.variable.0, test.variable.1);
        let may_be_copied = data.insts.iter().all(|&inst| match self.func.inst(inst) {
            InstData::Store { at, value } if at.index.is_none() && !at.volatile => {
                let written = self.bytes.bytes(at, self.func.ty(*value));
                written.end <= bytes.start || bytes.end <= written.start
            }
            data if data.has_effect() => false,
            _ => self.func.result(inst).is_none_or(|value| users[value].are_in(block)),
        });
        (next.variable == test.variable && may_be_copied).then_some(test.variable)
    }

    /// Lets an edge that begins at a block skip the tests whose results are known on it. `known` holds what variables
    /// are known to hold at the end of the block. Returns whether the edge leads to another block now.
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
            let Some(test) = &self.tests[to] else { break };
            let variable = test.variable;
            if !self.skips_lone && self.stands_alone(to, test) {
                break;
            }
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

    /// Whether neither a block before nor a block after a test tests the same variable.
    fn stands_alone(&self, block: Block, test: &Test) -> bool {
        let tests_it = |other: &Block| {
            let other = self.tests[*other].as_ref();
            other.is_some_and(|other| other.variable == test.variable)
        };
        let before = &self.predecessors[block];
        ![test.equal, test.otherwise].iter().chain(before.iter().take(MAX_WAYS)).any(tests_it)
    }

    /// What a variable holds on the edge from one block to another, if the first block tests that variable
    /// and this is its edge for equality.
    fn along_edge(&self, from: Block, to: Block, variable: &Variable) -> Option<i64> {
        let test = self.tests[from].as_ref()?;
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
        let (at, ty, field) = variable;
        let bytes = self.bytes.bytes(at, *ty);
        let insts = self.func.block(block).insts.iter().rev();
        for data in insts.map(|&inst| self.func.inst(inst)) {
            match data {
                InstData::Store { at: to, value } if to == at && self.func.ty(*value) == *ty => {
                    let stored = self.func.constant(*value)?;
                    return Some(eval::extract(ExtractOp::Unsigned, *ty, *field, stored));
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
        let before = &self.predecessors[block];
        if self.graph.edges[block] as usize != before.len() {
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
