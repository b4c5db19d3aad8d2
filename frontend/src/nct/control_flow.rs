//! Where control can go: labels, modules, calls, and the statements at which a module can be
//! suspended (NCT 3, 4.11).

use std::ops::RangeInclusive;

use plcc_abi::{
    image::{read_u16, read_u32},
    nct::context,
};

use crate::common::Ways;
use crate::nct::{
    ast::{Op, Program, Stmt},
    layout::Layout,
};

/// The labels to which an indirect jump or call can lead (NCT 4.11).
pub(crate) const INDIRECT_LABELS: RangeInclusive<u16> = 3..=196;

impl Op {
    /// Whether it is a call.
    pub(crate) fn is_call(&self) -> bool {
        matches!(self, Self::Call(_) | Self::CallIndirect(_))
    }
}

impl Program {
    /// The index of a label's statement.
    #[inline]
    pub(crate) fn target(&self, label: u16) -> Option<usize> {
        Some(self.labels.get(usize::from(label)).copied().flatten()? as usize)
    }

    /// The indices of the statements to which an indirect jump or call can lead.
    pub(crate) fn indirect_targets(&self) -> impl Iterator<Item = usize> {
        INDIRECT_LABELS.filter_map(|label| self.target(label))
    }

    /// Where control can go behind each statement. A subroutine returns behind the statement that called it.
    pub(crate) fn ways(&self) -> Vec<Ways> {
        let label = |label: u16| self.target(label).map(|to| to as u32);
        let indirect = || self.indirect_targets().map(|to| to as u32);
        let ways = |(at, stmt): (u32, &Stmt)| match stmt.op {
            Op::If { otherwise, .. } => Ways::to([at + 1, otherwise + 1]),
            Op::Else { end } => Ways::to([end + 1]),
            Op::Goto(to) => Ways::to(Vec::from_iter(label(to))),
            Op::GotoIndirect(_) => Ways::to(Vec::from_iter(indirect().chain([at + 1]))),
            Op::Call(to) => Ways { to: vec![at + 1], calls: Vec::from_iter(label(to)) },
            Op::CallIndirect(_) => Ways { to: vec![at + 1], calls: indirect().collect() },
            Op::Return | Op::End(_) => Ways::default(),
            Op::Set(_)
            | Op::Clear(_)
            | Op::Count { .. }
            | Op::Load(_)
            | Op::Store { .. }
            | Op::Arith { .. }
            | Op::Update { .. }
            | Op::Shift { .. }
            | Op::Bin
            | Op::Bcd
            | Op::Push(_)
            | Op::Apply { .. }
            | Op::EndIf
            | Op::Label(_)
            | Op::Area { .. }
            | Op::Text
            | Op::Bad { .. } => Ways::to([at + 1]),
        };
        (0..).zip(&self.stmts).map(ways).collect()
    }

    /// The modules that the program has, in the order of their tasks: number, and index of the first
    /// statement.
    pub(crate) fn modules(&self) -> impl Iterator<Item = (u16, usize)> {
        (0..3).filter_map(|module| Some((module, self.target(module)?)))
    }

    /// The indices of the statements that call, in the source's order. The index in this list is the
    /// call's number, which is the return address in the image.
    pub(crate) fn calls(&self) -> impl Iterator<Item = usize> {
        let calls = self.stmts.iter().enumerate().filter(|(_, stmt)| stmt.op.is_call());
        calls.map(|(at, _)| at)
    }

    /// The indices of the statements of the calls that have not returned yet in the module that ran
    /// last, the outermost first.
    pub(crate) fn open_calls(&self, layout: &Layout, image: &[u8]) -> Vec<u32> {
        let calls: Vec<usize> = self.calls().collect();
        let depth = read_u16(image, layout.context + context::DEPTH).min(context::MAX_DEPTH);
        let number = |level: u16| {
            read_u32(image, layout.context + context::SITES + u32::from(level) * 4) as usize
        };
        (0..depth).filter_map(|level| Some(*calls.get(number(level))? as u32)).collect()
    }

    /// The statements at which a task can be suspended: those with a safepoint before them, which
    /// are the labels that something jumps back to or calls.
    pub(crate) fn resume_points(&self) -> Vec<usize> {
        let mut points = vec![];
        for (from, stmt) in self.stmts.iter().enumerate() {
            let back = |to: &usize| *to <= from;
            match stmt.op {
                Op::Goto(label) => points.extend(self.target(label).filter(back)),
                Op::Call(label) => points.extend(self.target(label)),
                Op::GotoIndirect(_) => points.extend(self.indirect_targets().filter(back)),
                Op::CallIndirect(_) => points.extend(self.indirect_targets()),
                Op::Set(_)
                | Op::Clear(_)
                | Op::Count { .. }
                | Op::Load(_)
                | Op::Store { .. }
                | Op::Arith { .. }
                | Op::Update { .. }
                | Op::Shift { .. }
                | Op::Bin
                | Op::Bcd
                | Op::Push(_)
                | Op::Apply { .. }
                | Op::If { .. }
                | Op::Else { .. }
                | Op::EndIf
                | Op::Label(_)
                | Op::Return
                | Op::End(_)
                | Op::Area { .. }
                | Op::Text
                | Op::Bad { .. } => {}
            }
        }
        points.sort_unstable();
        points.dedup();
        points
    }
}
