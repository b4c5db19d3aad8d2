//! The ways through a task: its blocks, each once for every state of the subroutines that are open, and where control goes
//! from them.
//!
//! NCT keeps in the region `context` how many calls are open and where they return to, and in another region the number of an
//! indirect call. These are numbers on each way, so that they are followed here, and code is seen as if subroutines were
//! written where they are called.

use std::cell::RefCell;
use std::rc::Rc;

use plcc_abi::nct::{context, layout::region};
use plcc_frontend::common::ReturnStack;
use plcc_ir::{
    Address, Block, Func, InstData, Label, Module, PrimaryMap, RegionId, StatementId, Terminator,
    Value, eval,
};
use rustc_hash::FxHashMap;

/// How many blocks there may be on all ways of a task.
const MOST_NODES: usize = 100_000;

/// The subroutines that are open.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub(crate) struct Control {
    /// How many calls are open; `None` where that is not followed.
    pub(super) depth: i64,
    /// Where they return to.
    pub(super) sites: Vec<i64>,
    /// The number of an indirect call.
    pub(super) pending: Option<i64>,
}

/// What a followed address is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Followed {
    Depth,
    Fuel,
    OnEmpty,
    Site(Option<i64>),
    Pending,
}

/// An edge between blocks.
#[derive(Clone, Debug)]
pub(super) struct Edge {
    /// The node to which it leads.
    pub(super) to: usize,
    /// Which of the terminator's successors it is.
    pub(super) which: usize,
    pub(super) args: Vec<Value>,
    pub(super) params: Vec<Value>,
    pub(super) leaves_function: bool,
    /// Whether it closes a round.
    pub(super) is_back: bool,
}

/// A block on the way.
#[derive(Clone, Debug)]
pub(super) struct PathNode {
    pub(super) func: Func,
    pub(super) block: Block,
    /// What is open when control comes to it.
    pub(super) control: Control,
    pub(super) edges: Vec<Edge>,
    /// Whether it is known which way the branch at its end takes.
    pub(super) is_decided: bool,
    /// Whether it is not known where control goes.
    pub(super) is_lost: bool,
}

/// The ways through a task.
#[derive(Debug, Default)]
pub(super) struct TaskPaths {
    /// The node at which it begins, and those at which it goes on after it was suspended.
    pub(super) starts: Vec<Option<usize>>,
    pub(super) nodes: Vec<PathNode>,
    /// The nodes, each after all that lead to it but by edges that close a round.
    pub(super) order: Vec<usize>,
}

/// The ways through the tasks of a module.
#[derive(Debug, Default)]
pub struct Paths {
    targets: PrimaryMap<Label, Option<(Func, Block)>>,
    /// The region `context`, if there is one.
    context: Option<RegionId>,
    returns: Option<ReturnStack>,
    tasks: RefCell<FxHashMap<usize, Rc<TaskPaths>>>,
}

impl Paths {
    pub(super) fn new(module: &Module, returns: Option<ReturnStack>) -> Self {
        let context = module.regions.iter().position(|it| it.name == region::CONTEXT);
        Self {
            targets: module.label_targets(),
            context: context.map(|index| RegionId(index as u32)),
            returns,
            tasks: RefCell::default(),
        }
    }

    /// What of the control's own an address is, if it is followed. `index` gives the value of an index, where it is known.
    pub(super) fn followed(
        &self,
        at: &Address,
        index: impl Fn(Value) -> Option<i64>,
    ) -> Option<Followed> {
        if let Some(pending) = self.returns.and_then(|returns| returns.pending)
            && pending == (at.region, at.offset)
            && at.index.is_none()
        {
            return Some(Followed::Pending);
        }
        if Some(at.region) != self.context {
            return None;
        }
        match at.offset {
            context::DEPTH => Some(Followed::Depth),
            context::FUEL => Some(Followed::Fuel),
            context::ON_EMPTY => Some(Followed::OnEmpty),
            context::SITES => Some(Followed::Site(match at.index {
                None => Some(0),
                Some(it) => index(it.value),
            })),
            _ => None,
        }
    }

    /// The ways through a task.
    pub(super) fn of_task(&self, module: &Module, task: usize) -> Rc<TaskPaths> {
        if let Some(known) = self.tasks.borrow().get(&task) {
            return Rc::clone(known);
        }
        let paths = Rc::new(self.find(module, task));
        self.tasks.borrow_mut().insert(task, Rc::clone(&paths));
        paths
    }

    fn find(&self, module: &Module, task: usize) -> TaskPaths {
        let mut paths = TaskPaths::default();
        let Some(task) = module.tasks.get(task) else { return paths };
        let mut known: FxHashMap<(Func, Block, Control), usize> = FxHashMap::default();
        let mut node = |paths: &mut TaskPaths, func, block, control: Control| {
            *known.entry((func, block, control.clone())).or_insert_with(|| {
                paths.nodes.push(PathNode {
                    func,
                    block,
                    control,
                    edges: vec![],
                    is_decided: false,
                    is_lost: false,
                });
                paths.nodes.len() - 1
            })
        };
        for &label in std::iter::once(&task.entry).chain(&task.resume_points) {
            let target = self.targets.get(Label(label)).copied().flatten();
            let start =
                target.map(|(func, block)| node(&mut paths, func, block, Control::default()));
            paths.starts.push(start);
        }
        let mut at = 0;
        while at < paths.nodes.len() {
            let Some(PathNode { func, block, control, .. }) = paths.nodes.get(at).cloned() else {
                break;
            };
            let leaving = self.leaving(module, func, block, control);
            let is_lost = leaving.is_lost || paths.nodes.len() > MOST_NODES;
            let mut edges = vec![];
            for way in leaving.ways {
                if is_lost {
                    break;
                }
                let to = node(&mut paths, way.func, way.block, leaving.control.clone());
                edges.push(Edge {
                    to,
                    which: way.which,
                    args: way.args,
                    params: way.params,
                    leaves_function: way.leaves_function,
                    is_back: false,
                });
            }
            if let Some(node) = paths.nodes.get_mut(at) {
                node.edges = edges;
                node.is_decided = leaving.is_decided;
                node.is_lost = is_lost;
            }
            at += 1;
        }
        order(&mut paths);
        paths
    }

    /// Where control goes from a block, and what is open then.
    fn leaving(&self, module: &Module, func: Func, block: Block, control: Control) -> Leaving {
        let mut leaving = Leaving { control, ways: vec![], is_decided: false, is_lost: false };
        let Some(data) = module.funcs.get(func.index()) else { return leaving };
        let mut known: FxHashMap<Value, i64> = FxHashMap::default();
        for &inst in &data.block(block).insts {
            let get = |value: Value| known.get(&value).copied();
            let value = match *data.inst(inst) {
                InstData::Iconst { value, .. } => Some(value),
                InstData::Unary { op, arg } => get(arg).map(|x| eval::unary(op, data.ty(arg), x)),
                InstData::Binary { op, args: [a, b] } => {
                    get(a).zip(get(b)).map(|(x, y)| eval::binary(op, data.ty(a), x, y))
                }
                InstData::Icmp { cond, args: [a, b] } => {
                    get(a).zip(get(b)).map(|(x, y)| i64::from(eval::icmp(cond, data.ty(a), x, y)))
                }
                InstData::Convert { op, to, arg } => {
                    get(arg).map(|x| eval::convert(op, data.ty(arg), to, x))
                }
                InstData::IsLate => Some(0),
                InstData::Load { at, ty } => match self.followed(&at, get) {
                    Some(Followed::Depth) => Some(leaving.control.depth),
                    Some(Followed::Fuel) => Some(FUEL),
                    Some(Followed::Site(index)) => {
                        let site = index.and_then(|index| usize::try_from(index).ok());
                        site.and_then(|index| leaving.control.sites.get(index).copied())
                    }
                    Some(Followed::Pending) => leaving.control.pending,
                    Some(Followed::OnEmpty) | None => None,
                }
                .map(|value| ty.wrap(value)),
                InstData::Store { at, value } => {
                    let value = get(value);
                    match (self.followed(&at, get), value) {
                        (Some(Followed::Depth), Some(value)) => leaving.control.depth = value,
                        (Some(Followed::Site(Some(index))), Some(value)) => {
                            let index = usize::try_from(index).unwrap_or(0);
                            if leaving.control.sites.len() <= index {
                                leaving.control.sites.resize(index.min(1000) + 1, -1);
                            }
                            if let Some(slot) = leaving.control.sites.get_mut(index) {
                                *slot = value;
                            }
                        }
                        (Some(Followed::Depth | Followed::Site(_)), _) => leaving.is_lost = true,
                        (Some(Followed::Pending), value) => leaving.control.pending = value,
                        (Some(Followed::Fuel | Followed::OnEmpty) | None, _) => {}
                    }
                    None
                }
                _ => None,
            };
            if let (Some(result), Some(value)) = (data.result(inst), value) {
                known.insert(result, value);
            }
        }
        let open = usize::try_from(leaving.control.depth).unwrap_or(0);
        let in_function = |which, block: Block, args: &[Value]| Way {
            func,
            block,
            which,
            args: args.to_vec(),
            params: data.block(block).params.clone(),
            leaves_function: false,
        };
        let to_label = |label: i64, leaving: &mut Leaving| {
            let target = u32::try_from(label).ok();
            let target = target.and_then(|label| self.targets.get(Label(label)).copied().flatten());
            match target {
                Some((func, block)) => leaving.ways.push(Way {
                    func,
                    block,
                    which: 0,
                    args: vec![],
                    params: vec![],
                    leaves_function: true,
                }),
                None => leaving.is_lost = true,
            }
        };
        match &data.block(block).terminator {
            Some(Terminator::Goto(label)) => to_label(label.0.into(), &mut leaving),
            Some(Terminator::GotoIndirect(value)) => match known.get(value) {
                Some(&label) => to_label(label, &mut leaving),
                None => leaving.is_lost = true,
            },
            Some(Terminator::Brif { cond, then, otherwise }) => match known.get(cond) {
                Some(&value) => {
                    leaving.is_decided = true;
                    let (which, call) = if value != 0 { (0, then) } else { (1, otherwise) };
                    leaving.ways.push(in_function(which, call.block, &call.args));
                }
                None => {
                    leaving.ways.push(in_function(0, then.block, &then.args));
                    leaving.ways.push(in_function(1, otherwise.block, &otherwise.args));
                }
            },
            Some(Terminator::Jump(call)) => {
                leaving.ways.push(in_function(0, call.block, &call.args));
            }
            Some(Terminator::Switch { targets, default, .. }) => {
                for (which, &block) in targets.iter().chain([default]).enumerate() {
                    leaving.ways.push(in_function(which, block, &[]));
                }
            }
            _ => {}
        }
        leaving.control.sites.truncate(open);
        leaving
    }
}

/// The number of safepoints that code is told to have left. Those that it passes are counted beside.
pub(super) const FUEL: i64 = 1 << 24;

struct Leaving {
    control: Control,
    ways: Vec<Way>,
    is_decided: bool,
    is_lost: bool,
}

struct Way {
    func: Func,
    block: Block,
    which: usize,
    args: Vec<Value>,
    params: Vec<Value>,
    leaves_function: bool,
}

/// The statement of a block.
pub(super) fn statement(module: &Module, node: &PathNode) -> StatementId {
    let Some(data) = module.funcs.get(node.func.index()) else { return StatementId::NONE };
    let mut locs = data.block(node.block).insts.iter().rev().map(|&inst| data.loc(inst));
    locs.find(|&loc| loc != StatementId::NONE).unwrap_or(StatementId::NONE)
}

/// Puts the nodes in order, and finds the edges that close rounds.
fn order(paths: &mut TaskPaths) {
    #[derive(Clone, Copy, PartialEq)]
    enum Seen {
        New,
        Open,
        Done,
    }
    let mut seen = vec![Seen::New; paths.nodes.len()];
    let mut starts: Vec<usize> = paths.starts.iter().copied().flatten().collect();
    let mut open: Vec<(usize, usize)> = vec![];
    loop {
        if open.is_empty() {
            let Some(start) = starts.pop() else { break };
            if seen.get(start).copied() != Some(Seen::New) {
                continue;
            }
            if let Some(slot) = seen.get_mut(start) {
                *slot = Seen::Open;
            }
            open.push((start, 0));
        }
        let Some((at, which)) = open.last_mut() else { break };
        let (node, number) = (*at, *which);
        *which += 1;
        let edge = paths.nodes.get_mut(node).and_then(|it| it.edges.get_mut(number));
        let Some(edge) = edge else {
            if let Some(slot) = seen.get_mut(node) {
                *slot = Seen::Done;
            }
            paths.order.push(node);
            open.pop();
            continue;
        };
        let to = edge.to;
        match seen.get(to).copied() {
            Some(Seen::Open) => edge.is_back = true,
            Some(Seen::New) => {
                if let Some(slot) = seen.get_mut(to) {
                    *slot = Seen::Open;
                }
                open.push((to, 0));
            }
            _ => {}
        }
    }
    paths.order.reverse();
}
