//! How much work a scan can be at most: the largest number of operations that one scan of a task can
//! execute, and the way on which it does.
//!
//! An operation is an instruction or the end of a block, as the [interpreter](plcc_ir::interp) counts
//! them. The functions' blocks and the gotos between them make one graph, and the answer is its longest
//! path. Which way a branch takes is not considered, so the real scans of a program may all be shorter.
//!
//! A scan begins at the task's entry, or goes on at a resume point at which the task can have been
//! suspended, and ends where the code returns, suspends or traps. If control can go round in a loop,
//! there is no bound.
//!
//! # Calls
//! In a language with subroutines (NCT) code pushes the label to return to on a stack in the process
//! image, and returns by a jump to the label that it takes from there. Seen as mere jumps, a subroutine
//! that is called twice would be a loop: into it by the first call, out of it after the second, and
//! round. So a call is taken as one step, whose length is that of the longest way through the
//! subroutine. [`ReturnStack`] says by which stores calls are recognised.
//!
//! | block | longest way to the end of the scan | longest way to the return |
//! | --- | --- | --- |
//! | ends the scan | its own length | none |
//! | returns | none | its own length |
//! | jumps or branches | its length, and the longest of its successors' | the same |
//! | calls `s`, which returns to `r` | its length, and the longer of `s` to the end and `s` to the return with `r` to the end | its length, `s` to the return, `r` to the return |
//!
//! A scan that goes on inside a subroutine may return to any call: to as many as can be open.
//!
//! The time that the analysis takes is in proportion to the size of the program.

mod calls;

use std::collections::{HashMap, HashSet};

use plcc_frontend::common::ReturnStack;
use plcc_ir::{Block, Func, Label, Module, PrimaryMap, StatementId, Terminator};

/// The bound of a task.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Bound {
    /// The largest number of operations of one scan; `None` if there is a loop.
    pub operations: Option<u64>,
    /// The statements on the way, in the order in which they are executed; those of a subroutine only
    /// where it is called for the first time. If there is a loop, the statement that closes it.
    pub path: Vec<StatementId>,
}

/// The bound of each task of a verified module, in the tasks' order. `returns` says where its subroutines find out
/// where to return to; in a module without such a stack a jump to a label by number counts as a loop.
pub fn bounds(module: &Module, returns: Option<ReturnStack>) -> Vec<Bound> {
    let mut analysis = Analysis::new(module, returns);
    let tasks = module.tasks.iter();
    tasks.map(|task| analysis.task(task.entry, &task.resume_points)).collect()
}

/// A block of the module, and the pending label with which control comes to it, if code from this block
/// on may push that label.
type Node = (Func, Block, Option<u32>);

/// A longest way from a node: its length, and the next node on it.
#[derive(Clone, Copy, Debug, Default)]
struct LongestPath {
    length: u64,
    next: Next,
}

/// How a way goes on.
#[derive(Clone, Copy, Debug, Default)]
enum Next {
    /// It is over.
    #[default]
    Over,
    /// At a node, by that node's own way of the same kind.
    Same(usize),
    /// Into a subroutine that does not come back.
    Into(usize),
    /// Through a subroutine and on after the call: the first node of each.
    Through(usize, usize),
}

/// The longest ways from a node.
#[derive(Clone, Copy, Debug, Default)]
struct Ways {
    /// The one to the end of the scan, if one leads there.
    to_end: Option<LongestPath>,
    /// The one to the return of the subroutine in which the node is, if one leads there.
    to_return: Option<LongestPath>,
    /// The statement that closes a loop, where the node can reach one.
    looping: Option<StatementId>,
}

/// Where control goes from a node.
#[derive(Clone, Debug, Default)]
struct Edges {
    /// The nodes that control may go to from the end of the block.
    successors: Vec<Node>,
    /// If the block calls a subroutine, where that returns to; the successors are then the beginning of
    /// the subroutine.
    returns_to: Vec<Node>,
}

/// A module being analysed. Nodes are numbered when they are first met.
struct Analysis<'a> {
    module: &'a Module,
    /// For each label the function and the block at which it stands.
    targets: PrimaryMap<Label, Option<(Func, Block)>>,
    returns: Option<ReturnStack>,
    /// Whether the code from a block on may push a pending label, by function and block.
    wants_pending: PrimaryMap<Func, PrimaryMap<Block, bool>>,
    /// The number of each node.
    numbers: HashMap<Node, usize>,
    /// The nodes by their numbers; the tables below have the same order.
    nodes: Vec<Node>,
    ways: Vec<Ways>,
    edges: Vec<Edges>,
    states: Vec<State>,
}

/// How far a node has been visited.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    /// Not at all.
    New,
    /// It is on the way down to the node that is visited now.
    Open,
    /// Its longest ways are known.
    Done,
}

/// Which of the two ways of a node is meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum To {
    /// The one to the end of the scan.
    End,
    /// The one to the return.
    Return,
}

/// A node on the way down the graph.
struct Visit {
    node: usize,
    /// How many of its edges have been followed.
    followed: usize,
    /// The statement that closes a loop, where one of its edges does.
    looping: Option<StatementId>,
}

impl<'a> Analysis<'a> {
    fn new(module: &'a Module, returns: Option<ReturnStack>) -> Self {
        let mut analysis = Self {
            module,
            targets: module.label_targets(),
            returns,
            wants_pending: PrimaryMap::new(),
            numbers: HashMap::new(),
            nodes: vec![],
            ways: vec![],
            edges: vec![],
            states: vec![],
        };
        if returns.is_some_and(|returns| returns.pending.is_some()) {
            analysis.find_pending();
        }
        analysis
    }

    /// The bound of the task that begins at the label `entry` or goes on at others.
    fn task(&mut self, entry: u32, resume_points: &[u32]) -> Bound {
        let starts = self.starts(entry, resume_points);
        let ways = |node: &usize| self.ways[*node];
        if let Some(closing) = starts.iter().find_map(|node| ways(node).looping) {
            return Bound { operations: None, path: vec![closing] };
        }
        let to_end = |node: &usize| ways(node).to_end.map_or(0, |way| way.length);
        let mut longest =
            starts.iter().copied().max_by_key(|node| (to_end(node), usize::MAX - node));
        let mut length = longest.map_or(0, |node| to_end(&node));
        // A scan that goes on in a subroutine returns to calls that earlier scans have made.
        let resumed = starts.iter().skip(1).filter_map(|&n| Some((n, self.ways[n].to_return?)));
        if let Some((node, way)) = resumed.max_by_key(|(_, way)| way.length) {
            let (mut open, mut last) = (0, 0);
            for place in self.behind_calls() {
                self.visit(place);
                let ways = self.ways[place];
                if let Some(closing) = ways.looping {
                    return Bound { operations: None, path: vec![closing] };
                }
                open = open.max(ways.to_return.map_or(0, |way| way.length));
                last = last.max(ways.to_end.map_or(0, |way| way.length));
            }
            let depth = self.returns.map_or(0, |returns| returns.depth);
            let most = u64::from(depth.saturating_sub(1)).saturating_mul(open);
            let through = way.length.saturating_add(most).saturating_add(last);
            if through > length {
                (length, longest) = (through, Some(node));
            }
        }
        Bound { operations: Some(length), path: longest.map_or(vec![], |node| self.path(node)) }
    }

    /// Where scans of a task begin: at its entry, and at those of its resume points at which it can
    /// have been suspended. All ways from there are found.
    fn starts(&mut self, entry: u32, resume_points: &[u32]) -> Vec<usize> {
        let mut starts: Vec<usize> = self.start(Label(entry)).into_iter().collect();
        let mut seen: HashSet<usize> = starts.iter().copied().collect();
        let mut work = starts.clone();
        while let Some(node) = work.pop() {
            self.visit(node);
            let (func, block, _) = self.nodes[node];
            let data = self.module.funcs.get(func.index()).map(|func| func.block(block));
            if let Some(Some(Terminator::Suspend(label))) = data.map(|data| &data.terminator)
                && resume_points.contains(&label.0)
                && let Some(start) = self.start(*label)
            {
                starts.push(start);
                if seen.insert(start) {
                    work.push(start);
                }
            }
            let Edges { successors, returns_to } = self.edges[node].clone();
            for next in successors.into_iter().chain(returns_to) {
                let next = self.number(next);
                if seen.insert(next) {
                    work.push(next);
                }
            }
        }
        let mut known = HashSet::new();
        starts.retain(|&start| known.insert(start));
        starts
    }

    /// The node at a label.
    fn start(&mut self, label: Label) -> Option<usize> {
        let (func, block) = self.targets.get(label).copied().flatten()?;
        Some(self.number((func, block, None)))
    }

    /// Where control goes from the end of a block, but for returns.
    fn successors(&self, func: Func, block: Block) -> Vec<(Func, Block)> {
        let data = self.module.funcs.get(func.index()).map(|data| data.block(block));
        let Some(terminator) = data.and_then(|data| data.terminator.as_ref()) else {
            return vec![];
        };
        if let Terminator::Goto(label) = terminator {
            return self.targets.get(*label).copied().flatten().into_iter().collect();
        }
        let mut next: Vec<(Func, Block)> = vec![];
        terminator.for_each_block(|block, _| next.push((func, block)));
        next.dedup();
        next
    }

    /// A node's number.
    fn number(&mut self, node: Node) -> usize {
        let next = self.nodes.len();
        let number = *self.numbers.entry(node).or_insert(next);
        if number == next {
            let edges = self.edges_of(node);
            self.nodes.push(node);
            self.edges.push(edges);
            self.ways.push(Ways::default());
            self.states.push(State::New);
        }
        number
    }

    /// Finds the longest ways from a node, and those from all that it leads to.
    fn visit(&mut self, start: usize) {
        if self.states[start] != State::New {
            return;
        }
        self.states[start] = State::Open;
        let mut open = vec![Visit { node: start, followed: 0, looping: None }];
        while let Some(visit) = open.last_mut() {
            let (node, which) = (visit.node, visit.followed);
            visit.followed += 1;
            let Edges { successors, returns_to } = &self.edges[node];
            let Some(&next) = successors.iter().chain(returns_to).nth(which) else {
                let looping = visit.looping;
                open.pop();
                self.ways[node] = self.longest(node, looping);
                self.states[node] = State::Done;
                continue;
            };
            let next = self.number(next);
            match self.states[next] {
                State::Done => {}
                State::New => {
                    self.states[next] = State::Open;
                    open.push(Visit { node: next, followed: 0, looping: None });
                }
                State::Open => {
                    let statement = open.iter().rev().find_map(|visit| self.statement(visit.node));
                    if let Some(visit) = open.last_mut() {
                        visit.looping.get_or_insert(statement.unwrap_or(StatementId::NONE));
                    }
                }
            }
        }
    }

    /// The statement to which the end of a node's block belongs; `None` if there is no instruction.
    fn statement(&self, node: usize) -> Option<StatementId> {
        let (func, block, _) = self.nodes[node];
        let data = self.module.funcs.get(func.index())?;
        let locs = data.block(block).insts.iter().rev().map(|&inst| data.loc(inst));
        locs.into_iter().find(|&loc| loc != StatementId::NONE)
    }

    /// The longest ways from a node, given those of all that it leads to; `looping` is the statement
    /// that closes a loop, if one of the node's own edges does.
    fn longest(&mut self, node: usize, looping: Option<StatementId>) -> Ways {
        let (func, block, _) = self.nodes[node];
        let edges = self.edges[node].clone();
        let successors: Vec<usize> = edges.successors.iter().map(|&n| self.number(n)).collect();
        let returns_to: Vec<usize> = edges.returns_to.iter().map(|&n| self.number(n)).collect();
        let all = successors.iter().chain(&returns_to);
        let mut ways = Ways {
            looping: looping.or_else(|| all.clone().find_map(|&next| self.ways[next].looping)),
            ..Ways::default()
        };
        let Some(data) = self.module.funcs.get(func.index()).map(|data| data.block(block)) else {
            return ways;
        };
        let own = data.insts.len() as u64 + 1;
        let mut offer = |to: To, length: u64, next: Next| {
            let slot = if to == To::End { &mut ways.to_end } else { &mut ways.to_return };
            let length = length.saturating_add(own);
            if slot.is_none_or(|best| best.length < length) {
                *slot = Some(LongestPath { length, next });
            }
        };
        match &data.terminator {
            Some(Terminator::GotoIndirect(_)) => match self.returns {
                Some(_) => offer(To::Return, 0, Next::Over),
                None => {
                    ways.looping.get_or_insert(self.statement(node).unwrap_or(StatementId::NONE));
                }
            },
            Some(
                Terminator::Jump(_)
                | Terminator::Brif { .. }
                | Terminator::Switch { .. }
                | Terminator::Goto(_),
            ) => {
                for &next in &successors {
                    let Ways { to_end, to_return, looping: _ } = self.ways[next];
                    if let Some(way) = to_end {
                        let next =
                            if returns_to.is_empty() { Next::Same } else { Next::Into }(next);
                        offer(To::End, way.length, next);
                    }
                    let Some(through) = to_return else { continue };
                    if returns_to.is_empty() {
                        offer(To::Return, through.length, Next::Same(next));
                    }
                    for &behind in &returns_to {
                        let Ways { to_end, to_return, looping: _ } = self.ways[behind];
                        for (to, way) in [(To::End, to_end), (To::Return, to_return)] {
                            let Some(way) = way else { continue };
                            let length = through.length.saturating_add(way.length);
                            offer(to, length, Next::Through(next, behind));
                        }
                    }
                }
            }
            _ => offer(To::End, 0, Next::Over),
        }
        ways
    }

    /// The statements on the longest way from a node to the end of the scan, or to the return if it
    /// does not come to the end.
    fn path(&self, start: usize) -> Vec<StatementId> {
        let mut path: Vec<StatementId> = vec![];
        let mut seen = vec![false; self.nodes.len()];
        let to = if self.ways[start].to_end.is_some() { To::End } else { To::Return };
        let mut rest = vec![(start, to)];
        while let Some((node, to)) = rest.pop() {
            let (func, block, _) = self.nodes[node];
            if let Some(data) = self.module.funcs.get(func.index()) {
                for &inst in &data.block(block).insts {
                    let loc = data.loc(inst);
                    if loc != StatementId::NONE && path.last() != Some(&loc) {
                        path.push(loc);
                    }
                }
            }
            let ways = &self.ways[node];
            let way = if to == To::End { ways.to_end } else { ways.to_return };
            match way.map_or(Next::Over, |way| way.next) {
                Next::Over => {}
                Next::Same(next) => rest.push((next, to)),
                Next::Into(next) => rest.push((next, To::End)),
                Next::Through(subroutine, behind) => {
                    rest.push((behind, to));
                    if !std::mem::replace(&mut seen[subroutine], true) {
                        rest.push((subroutine, To::Return));
                    }
                }
            }
        }
        path
    }
}
