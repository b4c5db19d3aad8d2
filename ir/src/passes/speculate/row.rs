//! Rows of statements for the pass [`speculate`](super::speculate): where an integrality check fails, control
//! goes on in the slow copy of the statement, and from there in the slow copy of those that follow.
//! It does not come back to the fast copy before the row ends.
//!
//! ```text
//!     statement 1, fast copy ────────┐ a check fails
//!     │                              ▼
//!     │                     statement 1, slow copy (cold)
//!     ▼                              │
//!     statement 2, fast copy ──────┐ │
//!     │                            ▼ ▼
//!     │                     statement 2, slow copy (cold)
//!     ▼                              │
//!     what follows the row ◄─────────┘
//! ```
//!
//! So the fast copy of a statement is reached only if all checks of the row before it have succeeded, and
//! what they have found is known there: a variable that was checked or that got an integer holds an integer
//! until something else is stored in it, and is not checked again ([`KnownInteger`]).
//!
//! A row is made of statements that stand one after the other in a block, of which
//! [`stretch`](super::stretch) has written each as a whole twice.

use super::super::float_range::FloatRange;
use super::super::index_bounds::index_bounds;
use super::checks::{Check, Checks, KnownInteger, MAX_STRETCH};
use super::{OutputTail, Speculate};
use crate::{Address, Block, BlockCall, Inst, InstData, Terminator, Type, Value};

/// Of at most this many variables it is recorded that they hold integers, so that the pass takes linear time.
const MAX_KNOWN: usize = 64;

/// To find the range of a value after checks, its definition is followed back through at most this many instructions.
const MAX_STEPS: u32 = 6;

/// The bytes of a double.
const SIZE: u64 = 8;

/// A row of statements that goes on.
pub(super) struct Row {
    /// The slow copy of its last statement, which jumps to `join`.
    cold: Block,
    /// The empty block, without parameters, that gets what follows the row.
    join: Block,
    /// What is known in the fast copy after the last statement.
    pub(super) known: Vec<KnownInteger>,
}

impl Speculate<'_> {
    /// The row that a statement may go on, if there is one. `is_last` says that the statement's block ends with it.
    pub(super) fn row_before(
        &mut self,
        insts: &[Inst],
        is_last: bool,
        rest: &OutputTail,
    ) -> Option<Row> {
        let row = self.row.take()?;
        if row.join != rest.block || !rest.out.is_empty() || insts.len() > MAX_STRETCH {
            return None;
        }
        // The slow copy of a row can use no value of its fast copy: a statement of a row uses only
        // values that it computes itself.
        let end = rest.terminator.as_ref().filter(|_| is_last);
        self.is_closed(insts, end).then_some(row)
    }

    /// Whether a statement, and the end of its block if that belongs to it, use only values that the statement computes.
    fn is_closed(&self, insts: &[Inst], end: Option<&Terminator>) -> bool {
        let mut is_closed = true;
        let mut check_use = |value: Value| {
            is_closed &= insts.iter().any(|&inst| self.func.result(inst) == Some(value));
        };
        insts.iter().for_each(|&inst| self.func.inst(inst).for_each_arg(&mut check_use));
        if let Some(end) = end {
            end.for_each_arg(&mut check_use);
        }
        is_closed
    }

    /// Adds a statement to a row, or begins one with it. `cold` is its slow copy and `join` the block after
    /// it. `copied` are the statement's instructions as they were; `copies` are their results, each with the value that
    /// has its place in the fast copy.
    pub(super) fn add_to_row(
        &mut self,
        row: Option<Row>,
        checks: &Checks<'_>,
        copied: &[Inst],
        copies: &[(Value, Value)],
        [cold, join]: [Block; 2],
    ) {
        let known = self.known_behind(row.map_or(vec![], |row| row.known), checks, copied, copies);
        self.row = Some(Row { cold, join, known });
    }

    /// Lets the slow copy of a row go on with that of its next statement.
    pub(super) fn link(&mut self, row: &Row, cold: Block) {
        self.func.blocks[row.cold].terminator = Some(Terminator::Jump(BlockCall::plain(cold)));
    }

    /// What is known after the fast copy of a statement.
    fn known_behind(
        &self,
        mut known: Vec<KnownInteger>,
        checks: &Checks<'_>,
        copied: &[Inst],
        copies: &[(Value, Value)],
    ) -> Vec<KnownInteger> {
        let copy = |value: Value| {
            copies.iter().rev().find(|(old, _)| *old == value).map_or(value, |&(_, copy)| copy)
        };
        for &(value, check) in &checks.values {
            if let Some(&InstData::Load { ty: Type::F64, at }) = self.func.def_inst(value)
                && check == Check::Narrow
                && at.index.is_none()
                && !at.volatile
            {
                known.push(KnownInteger { at, double: copy(value), range: FloatRange::INT32 });
            }
        }
        for &inst in copied {
            match *self.func.inst(inst) {
                InstData::Store { at, value } if !at.volatile => {
                    let bytes = self.written_bytes(&at, value, checks);
                    known.retain(|variable| {
                        let start = u64::from(variable.at.offset);
                        let overlaps = start < bytes.end && bytes.start < start + SIZE;
                        variable.at.region != at.region || !overlaps
                    });
                    let range = self.range_after_checks(value, checks, MAX_STEPS);
                    if at.index.is_none() && self.func.ty(value) == Type::F64 && range.is_int32() {
                        // The range of all integers of 32 bits is recorded, also for a remainder, whose range is
                        // narrower: later passes do not know the narrower range of a variable. With it a sum of
                        // two such variables would get no check here, and be divided there as a number of 33 bits.
                        known.push(KnownInteger {
                            at,
                            double: copy(value),
                            range: FloatRange::INT32,
                        });
                    }
                }
                ref data if data.has_effect() => known.clear(),
                _ => {}
            }
        }
        let surplus = known.len().saturating_sub(MAX_KNOWN);
        known.drain(..surplus);
        known
    }

    /// The bytes of its region that a store may write, as offsets.
    fn written_bytes(
        &self,
        at: &Address,
        value: Value,
        checks: &Checks<'_>,
    ) -> std::ops::Range<u64> {
        let ty = self.func.ty(value);
        if let Some(index) = at.index
            && let Some((low, high)) = index_bounds(self.func, index.value, |double| {
                self.range_after_checks(double, checks, MAX_STEPS)
            })
            && low >= 0
            && high < i64::from(index.count)
        {
            let of = |number: i64| u64::from(at.offset) + number as u64 * u64::from(index.scale);
            return of(low)..of(high) + u64::from(ty.bytes());
        }
        at.extent(ty)
    }
}
