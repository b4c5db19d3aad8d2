//! Rearranges AND, OR and NOT of truth values so that they take fewer bytes of code.
//!
//! ```text
//! v4: i1 = and v0, v1
//! v5: i1 = not v2                  v9: i1 = or v2, v3
//! v6: i1 = and v4, v5        ==>   v10: i1 = not v9
//! v7: i1 = not v3                  v11: i1 = and v10, v0
//! v8: i1 = and v6, v7              v8: i1 = and v11, v1
//! ```
//!
//! Operations of one kind whose results are used once form a *gate* with many inputs. An input is
//! the result of another gate, a load, or anything else, each as it is or inverted. For each gate
//! the pass computes what it costs to have its result, and what it costs to have the opposite:
//! inputs that are cheaper inverted are joined by the dual gate, whose result is inverted once (De
//! Morgan's laws). Then the gate is written again, with what takes the most code first and loads
//! last, since a load can be part of the instruction that combines it with what was computed before.
//!
//! Costs are bytes of x86-64 code, roughly. Where there are two costs, or two ways to compute something,
//! the index 0 is for the value as it is and 1 for its opposite. The pass runs last, when nothing else
//! depends on the order of operands. It must keep the number of loads as it is, and where they stand.

use super::graph::Graph;
use super::thresholds::gates::{LOAD, NOT, OPERATION, OPERATION_WITH_LOAD};
use crate::{
    BinaryOp, Block, FuncData, Inst, InstData, PrimaryMap, StatementId, Type, UnaryOp, Value,
};

/// Gates are rearranged together with the gates that are their inputs, and with the inputs of those, down
/// to this depth; what is deeper is rearranged by itself.
const MAX_DEPTH: usize = 32;

/// A gate, or an input of gates that is not a gate.
struct Node {
    kind: Kind,
    /// The cost of having the value in a register, and that of having its opposite there.
    cost: [u32; 2],
    /// The cost of combining another value with it, or with its opposite.
    operand: [u32; 2],
}

/// What a node is.
enum Kind {
    /// A value that is not computed by a gate, and whether the input is its opposite.
    Leaf(Value, bool),
    /// An AND (or, if `or`, an OR) of inputs, by their numbers in the list of nodes.
    Gate { or: bool, inputs: Vec<usize> },
}

/// What the pass knows of the function.
struct Gates<'a> {
    func: &'a mut FuncData,
    /// For each value how often it is used, and the block of its last use.
    uses: PrimaryMap<Value, (u32, Block)>,
    /// For each instruction the block in which it stands.
    places: PrimaryMap<Inst, Block>,
    /// For each instruction whether it is part of a gate that will be written again.
    absorbed: PrimaryMap<Inst, bool>,
    /// The nodes of the outermost gate that is examined or written, each after its inputs.
    nodes: Vec<Node>,
    /// The block that is visited.
    block: Block,
}

/// Runs the pass.
pub(super) fn run(func: &mut FuncData) {
    let graph = Graph::new(func);
    let mut uses = PrimaryMap::from(vec![(0, Block(0)); func.value_count()]);
    let mut places = PrimaryMap::from(vec![Block(0); func.inst_count()]);
    for &block in &graph.order {
        let mut note = |value: Value| {
            let (count, place) = &mut uses[value];
            *count += 1;
            *place = block;
        };
        let data = &func.blocks[block];
        for &inst in &data.insts {
            places[inst] = block;
            func.insts[inst].for_each_arg(&mut note);
        }
        if let Some(terminator) = &data.terminator {
            terminator.for_each_arg(note);
        }
    }
    let absorbed = PrimaryMap::from(vec![false; func.inst_count()]);
    let mut gates = Gates { func, uses, places, absorbed, nodes: vec![], block: Block(0) };
    for &block in &graph.order {
        gates.block = block;
        gates.block();
    }
}

impl Gates<'_> {
    /// Rearranges the gates of a block.
    fn block(&mut self) {
        let insts = std::mem::take(&mut self.func.blocks[self.block].insts);
        // The results of outermost gates, found backwards; each is written where it stood.
        let mut roots = vec![];
        for &inst in insts.iter().rev() {
            if !self.absorbed[inst] && self.gate(inst).is_some() {
                self.nodes.clear();
                let root = self.node_of(inst, 0);
                if self.nodes.len() > 2 {
                    roots.push((inst, root, std::mem::take(&mut self.nodes)));
                }
            }
        }
        let mut out = Vec::with_capacity(insts.len());
        for inst in insts {
            if let Some((_, root, nodes)) = roots.pop_if(|(root, ..)| *root == inst) {
                self.nodes = nodes;
                self.write_root(inst, root, &mut out);
            } else if !self.absorbed[inst] {
                out.push(inst);
            }
        }
        self.func.blocks[self.block].insts = out;
    }

    /// Whether an AND or OR of truth values is an OR, and its operands; `None` for other instructions.
    fn gate(&self, inst: Inst) -> Option<(bool, [Value; 2])> {
        match *self.func.inst(inst) {
            InstData::Binary { op, args } if self.func.ty(args[0]) == Type::I1 => match op {
                BinaryOp::And => Some((false, args)),
                BinaryOp::Or => Some((true, args)),
                _ => None,
            },
            _ => None,
        }
    }

    /// The instruction that defines a value, if it is in this block, and the value is used only
    /// once, in this block too.
    fn sole_definition(&self, value: Value) -> Option<Inst> {
        let crate::ValueDef::Result(inst) = self.func.def(value) else { return None };
        let is_own = self.uses[value] == (1, self.block) && self.places[inst] == self.block;
        is_own.then_some(inst)
    }

    /// Adds a node; returns its number.
    fn push(&mut self, kind: Kind, cost: [u32; 2], operand: [u32; 2]) -> usize {
        self.nodes.push(Node { kind, cost, operand });
        self.nodes.len() - 1
    }

    /// Adds the node of a gate, given its instruction, and those of its inputs. Instructions that are
    /// part of the gate are marked as absorbed, but for `inst` itself. `depth` is the number of gates
    /// around this one.
    fn node_of(&mut self, inst: Inst, depth: usize) -> usize {
        let Some((or, args)) = self.gate(inst) else {
            return self.push(Kind::Leaf(Value(0), false), [0; 2], [0; 2]);
        };
        let mut inputs = vec![];
        // The values that are inputs or parts of this gate, each with whether it is inverted.
        let mut pending = vec![(args[1], false), (args[0], false)];
        while let Some((value, inverted)) = pending.pop() {
            if let Some(inst) = self.sole_definition(value) {
                if let InstData::Unary { op: UnaryOp::Not, arg } = *self.func.inst(inst) {
                    self.absorbed[inst] = true;
                    pending.push((arg, !inverted));
                    continue;
                }
                if let Some((inner, args)) = self.gate(inst) {
                    // By De Morgan an inverted gate of the other kind is of this kind.
                    if (inner != or) == inverted {
                        self.absorbed[inst] = true;
                        pending.extend([(args[1], inverted), (args[0], inverted)]);
                        continue;
                    }
                    if depth < MAX_DEPTH {
                        self.absorbed[inst] = true;
                        let mut node = self.node_of(inst, depth + 1);
                        if inverted {
                            node = self.inverted(node);
                        }
                        inputs.push(node);
                        continue;
                    }
                }
            }
            inputs.push(self.leaf(value, inverted));
        }
        self.gate_node(or, inputs)
    }

    /// Adds the node of a value that is not computed by a gate, or of its opposite.
    fn leaf(&mut self, value: Value, inverted: bool) -> usize {
        let is_load = self.sole_definition(value).is_some_and(|inst| {
            matches!(self.func.inst(inst), InstData::Load { at, .. } if at.index.is_none() && !at.volatile)
        });
        let (mut cost, mut operand) = match is_load {
            true => ([LOAD, LOAD + NOT], [OPERATION_WITH_LOAD, LOAD + NOT + OPERATION]),
            false => ([0, NOT], [OPERATION, NOT + OPERATION]),
        };
        if inverted {
            cost.swap(0, 1);
            operand.swap(0, 1);
        }
        self.push(Kind::Leaf(value, inverted), cost, operand)
    }

    /// Adds the opposite of a gate, as a gate: the dual one of the inverted inputs.
    fn inverted(&mut self, node: usize) -> usize {
        let Node { kind: Kind::Gate { or, inputs }, .. } = &self.nodes[node] else { return node };
        let (or, inputs) = (!or, inputs.clone());
        let inputs = inputs.into_iter().map(|input| match &self.nodes[input].kind {
            &Kind::Leaf(value, inverted) => self.leaf(value, !inverted),
            Kind::Gate { .. } => self.inverted(input),
        });
        let inputs = inputs.collect();
        self.gate_node(or, inputs)
    }

    /// Adds the node of a gate with these inputs.
    fn gate_node(&mut self, or: bool, inputs: Vec<usize>) -> usize {
        let (straight, _) = self.best_cost(&inputs, 0);
        let (opposite, _) = self.best_cost(&inputs, 1);
        let cost = [straight.min(opposite + NOT), opposite.min(straight + NOT)];
        let operand = cost.map(|cost| cost + OPERATION);
        self.push(Kind::Gate { or, inputs }, cost, operand)
    }

    /// How a gate is best computed with its inputs as they are (`opposite` 0), or how its dual is with
    /// the inverted inputs (`opposite` 1).
    fn plan(&self, inputs: &[usize], opposite: usize) -> Plan {
        let (cost, is_split) = self.best_cost(inputs, opposite);
        let (apart, rest) = match is_split {
            true => inputs.iter().partition(|&&input| self.is_cheaper_inverted(input, opposite)),
            false => (vec![], inputs.to_vec()),
        };
        Plan { cost, apart, rest }
    }

    /// The cost of that, and whether the inputs that are cheaper inverted are computed apart.
    fn best_cost(&self, inputs: &[usize], opposite: usize) -> (u32, bool) {
        let inputs = inputs.iter().copied();
        let all = self.row_cost(inputs.clone(), opposite);
        let is_apart = |input: &usize| self.is_cheaper_inverted(*input, opposite);
        let apart = inputs.clone().filter(is_apart);
        if apart.clone().nth(1).is_none() {
            return (all, false);
        }
        let joined = self.row_cost(apart, 1 - opposite) + NOT;
        // The joined ones are computed first, and each of the rest is combined with it.
        let rest = inputs.filter(|input| !is_apart(input));
        let split = joined + rest.map(|input| self.nodes[input].operand[opposite]).sum::<u32>();
        (split.min(all), split < all)
    }

    /// Whether the opposite of an input costs less than what is asked of it.
    fn is_cheaper_inverted(&self, input: usize, opposite: usize) -> bool {
        self.nodes[input].operand[1 - opposite] < self.nodes[input].operand[opposite]
    }

    /// The cost of combining inputs one after the other.
    fn row_cost(&self, inputs: impl Iterator<Item = usize>, opposite: usize) -> u32 {
        let (mut sum, mut most_saved) = (0, 0);
        for input in inputs {
            let node = &self.nodes[input];
            let (operand, cost) = (node.operand[opposite], node.cost[opposite]);
            sum += operand;
            // The first one is not combined with anything.
            most_saved = most_saved.max(operand.saturating_sub(cost));
        }
        u32::saturating_sub(sum, most_saved)
    }

    /// Writes the outermost gate; its instruction keeps its result.
    fn write_root(&mut self, inst: Inst, root: usize, out: &mut Vec<Inst>) {
        let loc = self.func.loc(inst);
        let value = self.write(root, 0, loc, out);
        // The last instruction that was written computes the result; it becomes the one that stood
        // here, so that uses need not be changed.
        match out.pop().filter(|&last| self.func.result(last) == Some(value)) {
            Some(last) => self.func.insts[inst] = *self.func.inst(last),
            None => {
                // A gate has two inputs at least, so that it ends with an operation.
                let args = [value, value];
                self.func.insts[inst] = InstData::Binary { op: BinaryOp::And, args };
            }
        }
        out.push(inst);
    }

    /// Appends a new instruction to `out`; returns its result.
    fn insert(&mut self, data: InstData, loc: StatementId, out: &mut Vec<Inst>) -> Value {
        let (inst, result) = self.func.append(data, loc);
        self.absorbed.push(false);
        self.places.push(self.block);
        out.push(inst);
        result
    }

    /// Writes the instructions of a node, or of its opposite (`opposite` 1); gives the result.
    fn write(
        &mut self,
        node: usize,
        opposite: usize,
        loc: StatementId,
        out: &mut Vec<Inst>,
    ) -> Value {
        match &self.nodes[node].kind {
            &Kind::Leaf(value, inverted) => match inverted == (opposite == 1) {
                true => value,
                false => self.insert(InstData::Unary { op: UnaryOp::Not, arg: value }, loc, out),
            },
            Kind::Gate { or, inputs } => {
                let (or, inputs) = (*or, inputs.clone());
                let straight = self.plan(&inputs, opposite);
                let inverted = self.plan(&inputs, 1 - opposite);
                if inverted.cost + NOT < straight.cost {
                    let or = or != (opposite == 0);
                    let arg = self.write_plan(or, 1 - opposite, inverted, loc, out);
                    return self.insert(InstData::Unary { op: UnaryOp::Not, arg }, loc, out);
                }
                self.write_plan(or != (opposite == 1), opposite, straight, loc, out)
            }
        }
    }

    /// Writes a gate as a plan says: an OR or else an AND of its inputs, or (`opposite` 1) of their
    /// opposites.
    fn write_plan(
        &mut self,
        or: bool,
        opposite: usize,
        plan: Plan,
        loc: StatementId,
        out: &mut Vec<Inst>,
    ) -> Value {
        let mut value = None;
        if !plan.apart.is_empty() {
            let arg = self.write_row(!or, 1 - opposite, plan.apart, None, loc, out);
            value = arg.map(|arg| self.insert(InstData::Unary { op: UnaryOp::Not, arg }, loc, out));
        }
        // A gate has inputs, so there is something to combine.
        self.write_row(or, opposite, plan.rest, value, loc, out).unwrap_or(Value::NONE)
    }

    /// Combines `first`, if there is one, and inputs or their opposites by AND or OR: those that take
    /// the most code come first, and loads come last. Gives the result, `None` if there is nothing to
    /// combine.
    fn write_row(
        &mut self,
        or: bool,
        opposite: usize,
        mut inputs: Vec<usize>,
        first: Option<Value>,
        loc: StatementId,
        out: &mut Vec<Inst>,
    ) -> Option<Value> {
        inputs.sort_by_key(|&input| {
            let cost = self.nodes[input].operand[opposite];
            (cost == OPERATION_WITH_LOAD, std::cmp::Reverse(cost))
        });
        let op = if or { BinaryOp::Or } else { BinaryOp::And };
        let mut row = first;
        for input in inputs {
            let value = self.write(input, opposite, loc, out);
            row = Some(match row {
                None => value,
                Some(row) => self.insert(InstData::Binary { op, args: [row, value] }, loc, out),
            });
        }
        row
    }
}

/// How a gate is computed.
struct Plan {
    /// What it costs to have the result in a register.
    cost: u32,
    /// The inputs that are joined by the dual gate and inverted together.
    apart: Vec<usize>,
    /// The other inputs.
    rest: Vec<usize>,
}
