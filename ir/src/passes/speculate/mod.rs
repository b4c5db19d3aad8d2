//! Speculates that doubles are integers: computes with integers after an integrality check, and
//! with doubles where the check fails.
//!
//! ```text
//! v0: f64 = load p:0                        v0: f64 = load p:0
//! v1: f64 = fconst 7.0                      v1: f64 = fconst 7.0
//! v2: f64 = hostcall pmac_and(v0, v1)       v3: i32 = ftoi v0          (the integrality check)
//! store p:8, v2                             v5: i1 = is_integer_or_nan v0
//!                                           v4: f64 = itof v3
//!                                ==>        brif v5, block1, block2
//!                                       block1:
//!                                           v6: f64 = hostcall pmac_and(v4, v1)
//!                                           store p:8, v6
//!                                           jump block3
//!                                       block2 cold:
//!                                           v7: f64 = load p:0
//!                                           v8: f64 = fconst 7.0
//!                                           v9: f64 = hostcall pmac_and(v7, v8)
//!                                           store p:8, v9
//!                                           jump block3
//! ```
//!
//! Variables of some controls are doubles that nearly always hold integers, and their bit operators
//! and remainders are host functions that are simple for integers only
//! ([`HostFn::integer_form`](plcc_abi::HostFn::integer_form)). The pass writes [stretches](stretch) of statements that have such
//! operations twice. In the first copy the checked doubles are conversions of integers, from which the pass
//! [`integers`](super::integers) makes integer arithmetic of the whole copy. The second is as it was, in a cold block that
//! all checks of the stretch share, and from which control may go on in the cold block of the next stretch ([`row`]).
//! Blocks that are cold or optimised for size stay as they are.

mod checks;
mod row;
mod stretch;
mod uses;

use plcc_abi::IntegerForm;

use super::cursor::Cursor;
use super::float_range::FloatRanges;
use super::graph::Graph;
use super::integers::PassedRanges;
use crate::{InstBuilder, ROUNDING};

use super::value_range::ValueRanges;
use crate::{
    BinaryOp, Block, BlockData, ConvertOp, ExtractOp, Field, FloatCond, FuncData, Inst, InstData,
    RegionId, StatementId, Terminator, Type, UnaryOp, Value,
};
use checks::{Check, MAX_STRETCH};
use row::Row;
use uses::Uses;

/// The bits of a sum with [`ROUNDING`] that are the rounded integer: all but the sign, the exponent, and the highest bit of the
/// fraction.
const ROUNDED: Field = Field { first: 0, width: 51 };

/// Runs the pass; returns whether it changed anything. `finite_regions` are those of the module.
pub(super) fn run(func: &mut FuncData, finite_regions: &[RegionId]) -> bool {
    let is_faster_on_integers =
        |inst: &InstData| inst.integer_form().is_some_and(|form| form != IntegerForm::Range);
    if !func
        .blocks
        .values()
        .any(|block| block.insts.iter().any(|&i| is_faster_on_integers(func.inst(i))))
    {
        return false;
    }
    let graph = Graph::new(func);
    let (integers, floats) = analyse(func, &graph, finite_regions);
    let uses = Uses::new(func);
    let mut this = Speculate { func, integers, floats, uses, changed: false, row: None };
    for &block in &graph.order {
        let data = this.func.block(block);
        if !data.cold && !data.optimize_for_size {
            this.block(block);
        }
    }
    this.changed
}

/// What is known of each integer and double of a function.
fn analyse<'a>(
    func: &FuncData,
    graph: &Graph,
    finite_regions: &'a [RegionId],
) -> (ValueRanges, FloatRanges<'a>) {
    let mut integers = ValueRanges::new(func);
    let mut floats = FloatRanges::new(func, finite_regions);
    let mut passed = PassedRanges::new(graph);
    for &block in &graph.order {
        let data = func.block(block);
        for (at, &param) in data.params.iter().enumerate() {
            floats.set(param, passed.param(block, at));
        }
        for &inst in &data.insts {
            let Some(result) = func.result(inst) else { continue };
            match func.ty(result) {
                Type::F64 => floats.note(func, &integers, result, func.inst(inst)),
                _ => integers.note(func, result, func.inst(inst)),
            }
        }
        if let Some(terminator) = &data.terminator {
            passed.note(terminator, &floats);
        }
    }
    (integers, floats)
}

/// A function being changed.
struct Speculate<'a> {
    func: &'a mut FuncData,
    integers: ValueRanges,
    floats: FloatRanges<'a>,
    uses: Uses,
    changed: bool,
    /// The row of statements that ends at the current place, if there is one.
    row: Option<Row>,
}

impl Speculate<'_> {
    /// Examines the statements of a block.
    fn block(&mut self, block: Block) {
        let insts = std::mem::take(&mut self.func.blocks[block].insts);
        let terminator = self.func.blocks[block].terminator.take();
        let mut rest = OutputTail { block, out: Vec::with_capacity(insts.len()), terminator };
        let mut from = 0;
        while let Some(&first) = insts.get(from) {
            let loc = self.func.loc(first);
            let same = insts.iter().skip(from).take_while(|&&inst| self.func.loc(inst) == loc);
            let end = from + same.count();
            let statement = insts.get(from..end).unwrap_or_default();
            self.statement(statement, insts.get(end..).unwrap_or_default(), end, &mut rest);
            from = end;
        }
        let data = &mut self.func.blocks[rest.block];
        data.insts = rest.out;
        data.terminator = rest.terminator;
    }

    /// Examines a statement: each of its stretches that gains is written twice. `end` is the place after the statement among
    /// the instructions of its block, and `after` are those that are there.
    fn statement(&mut self, mut insts: &[Inst], after: &[Inst], end: usize, rest: &mut OutputTail) {
        while !insts.is_empty() {
            let done = self.stretch(insts, after, end, rest).unwrap_or_else(|| {
                // The next stretch begins after an effect, or where this one would have become too long.
                let short = insts.get(..MAX_STRETCH).unwrap_or(insts);
                let effect = short.iter().position(|&inst| self.func.inst(inst).has_effect());
                let done = effect.map_or(short.len(), |at| at + 1);
                rest.out.extend(insts.iter().take(done));
                done
            });
            insts = insts.get(done..).unwrap_or_default();
        }
    }

    /// The results of copied instructions that later instructions use, also in other blocks.
    /// `next` is the place of the next instruction among those of the block.
    fn used_later(&self, copied: &[Inst], next: usize) -> Vec<Value> {
        // Uses in other blocks count as uses elsewhere.
        let is_used = |value: &Value| {
            self.uses.elsewhere[*value]
                || self.uses.last.get(*value).is_some_and(|&last| last >= next)
        };
        copied.iter().filter_map(|&inst| self.func.result(inst)).filter(is_used).collect()
    }

    /// Those results, and the ones that the block's terminator uses.
    fn with_terminator(&self, copied: &[Inst], passed: Vec<Value>) -> Vec<Value> {
        let is_passed = |value: &Value| passed.contains(value) || self.uses.by_terminator[*value];
        copied.iter().filter_map(|&inst| self.func.result(inst)).filter(is_passed).collect()
    }

    /// Adds a block without instructions.
    fn new_block(&mut self, cold: bool) -> Block {
        self.func.blocks.push(BlockData { cold, ..BlockData::default() })
    }

    /// The end of a list of instructions, for a statement.
    fn cursor<'b>(&'b mut self, out: &'b mut Vec<Inst>, loc: StatementId) -> Cursor<'b> {
        Cursor { func: self.func, out, loc }
    }

    /// Appends a copy of an instruction whose operands are replaced by theirs, and adds its result to the copies.
    fn copy_inst(&mut self, inst: Inst, copies: &mut Vec<(Value, Value)>, out: &mut Vec<Inst>) {
        let mut data = *self.func.inst(inst);
        replace_all(copies, |f| data.for_each_arg_mut(f));
        let (new, copy) = self.func.append(data, self.func.loc(inst));
        out.push(new);
        copies.extend(self.func.result(inst).map(|old| (old, copy)));
    }
}

impl Check {
    /// Inserts the check of a double, which is never NaN with `never_nan`. Returns the double that takes its place, a
    /// conversion of an integer, and whether the check succeeds.
    fn insert(self, out: &mut Cursor<'_>, value: Value, never_nan: bool) -> (Value, Value) {
        if self == Self::Narrow {
            let (integer, holds) = out.integrality_check(value, never_nan);
            return (out.convert(ConvertOp::IntToFloat, Type::F64, integer), holds);
        }
        // The sum is an integer whose low bits are those of the rounded double. If the double
        // is too large for that, the number made of the low bits is far from the double, and
        // the comparison below finds that.
        let sum = out.binary_imm(BinaryOp::Fadd, value, ROUNDING.to_bits() as i64);
        let word = out.convert(ConvertOp::Bitcast, Type::I64, sum);
        let field = ROUNDED;
        let integer = out.build(InstData::Extract { op: ExtractOp::Signed, arg: word, field });
        let back = out.convert(ConvertOp::IntToFloat, Type::F64, integer);
        let (cond, args) = if self == Self::Rounded {
            let apart = out.binary(BinaryOp::Fsub, value, back);
            let apart = out.unary(UnaryOp::Fabs, apart);
            (FloatCond::Lt, [apart, out.constant(Type::F64, 0.5f64.to_bits() as i64)])
        } else {
            let cond = if never_nan { FloatCond::EqOrNan } else { FloatCond::Eq };
            (cond, [back, value])
        };
        (back, out.build(InstData::Fcmp { cond, args }))
    }
}

/// The last part of the block that is examined, after the copies that were made so far.
struct OutputTail {
    /// The block that gets the instructions.
    block: Block,
    /// Its instructions so far.
    out: Vec<Inst>,
    /// Its terminator.
    terminator: Option<Terminator>,
}

/// Replaces operands by their copies. `visit` calls what it is given for each operand.
fn replace_all(copies: &[(Value, Value)], visit: impl FnOnce(&mut dyn FnMut(&mut Value))) {
    visit(&mut |value: &mut Value| {
        if let Some(&(_, copy)) = copies.iter().rev().find(|(old, _)| old == value) {
            *value = copy;
        }
    });
}
