//! A block of an NCT control: its functions and strobes, its way, FIN (cnc-side 3.6 to 3.11).

use serde::{Deserialize, Serialize};

use super::parts::Parts;
use super::state::{State, Waits};
use super::{Nct, Step};
use crate::event::{Awaited, Told};
use crate::part_program::Block;
use crate::setup::Setup;

/// After how many ticks it is told that a block waits.
pub(super) const PATIENCE: u64 = 500;

/// Where a block comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) enum Source {
    /// The block of the part program with this index.
    Program(u32),
    /// The entered block with this index.
    Entered(u32),
}

/// A block that is executed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Executed {
    pub(super) source: Source,
    /// The tick in which it started.
    pub(super) began: u64,
    pub(super) parts: Parts,
    /// Whether all parts are done.
    pub(super) parts_done: bool,
    /// The first tick of the stop that lasts.
    pub(super) stop_since: Option<u64>,
    /// Whether a step saw FIN taken away.
    pub(super) fin_was_off: bool,
    /// In which tick it was dropped, if it was, and whether because automatic mode was left.
    pub(super) dropped: Option<(u64, bool)>,
}

impl Executed {
    pub(super) fn is_entered(&self) -> bool {
        matches!(self.source, Source::Entered(_))
    }

    pub(super) fn block<'s>(&self, setup: &'s Setup) -> Option<&'s Block> {
        match self.source {
            Source::Program(at) => setup.program.as_ref()?.blocks.get(at as usize),
            Source::Entered(at) => setup.entries.get(at as usize),
        }
    }
}

impl Nct {
    /// Goes on with the block, and begins others as far as they can begin in this step.
    pub(super) fn block(&self, state: &mut State, step: &mut Step<'_, '_>) {
        if state.block.as_ref().is_some_and(|block| block.dropped.is_some()) {
            self.end_drop(state, step);
            return;
        }
        loop {
            if state.block.is_some() {
                if state.block.as_ref().is_some_and(|block| block.began == step.now.tick) {
                    return;
                }
                self.go_on(state, step);
                if !self.finish(state, step) {
                    return;
                }
            }
            if !self.start(state, step) {
                return;
            }
        }
    }

    /// Starts the next block, if it can start in this step.
    fn start(&self, state: &mut State, step: &mut Step<'_, '_>) -> bool {
        let can = state.buffer_full && step.runs() && state.machine_on && !state.blocks_held;
        if !can {
            return false;
        }
        let source = if step.is_automatic() {
            if state.interrupted {
                return self.go_back(state, step);
            }
            if state.ended.is_some() {
                return false;
            }
            match self.next_block(state, step) {
                Some(at) => Source::Program(at),
                None => {
                    self.end_program(state, step);
                    return false;
                }
            }
        } else {
            match state.entered {
                Some(entry) => Source::Entered(entry),
                None => return false,
            }
        };
        self.begin(state, step, source);
        state.block.is_some()
    }

    /// The index of the next block that is not to be skipped; `None` where there is none.
    fn next_block(&self, state: &State, step: &Step<'_, '_>) -> Option<u32> {
        let blocks = &self.setup.program.as_ref()?.blocks;
        let is_skipped = |block: &Block| match block.skip {
            0 => false,
            1 => step.y(44, 6),
            n => step.y(51, usize::from(n) - 2),
        };
        let from = state.next as usize;
        let found = blocks.iter().skip(from).position(|block| !is_skipped(block))?;
        u32::try_from(from + found).ok()
    }

    fn begin(&self, state: &mut State, step: &mut Step<'_, '_>, source: Source) {
        let mut executed = Executed {
            source,
            began: step.now.tick,
            parts: Parts::default(),
            parts_done: true,
            stop_since: None,
            fin_was_off: false,
            dropped: None,
        };
        let Some(block) = executed.block(&self.setup) else { return };
        match source {
            Source::Program(at) => {
                state.next = at.saturating_add(1);
                step.now.tell(Told::Block(block.line));
            }
            Source::Entered(_) => step.now.tell(Told::Entry(block.line)),
        }
        state.modal.take(block);
        state.waits = Waits::default();
        strobe(state, step, block);
        let commands = state.positions.commands();
        let tick_ns = step.now.tick_ns;
        executed.parts = Parts::of(block, &state.modal, &self.setup, commands, tick_ns);
        executed.parts_done = executed.parts.is_empty();
        let has_parts = !executed.parts_done;
        state.block = Some(executed);
        if has_parts {
            state.begin_part(&self.setup);
        }
    }

    /// Finishes the block, if FIN is there and all its parts are done. Returns whether the next one may begin in this
    /// step.
    fn finish(&self, state: &mut State, step: &mut Step<'_, '_>) -> bool {
        let fin = step.y(54, 7);
        let Some(executed) = &mut state.block else { return false };
        executed.fin_was_off |= !fin;
        if !fin || !executed.parts_done {
            let waits = executed.parts_done.then_some(Awaited::Finished);
            if executed.parts_done {
                self.waits_for(state, step, waits);
            }
            return false;
        }
        let (is_entered, has_parts) = (executed.is_entered(), !executed.parts.is_empty());
        let (was_off, ends) =
            (executed.fin_was_off, executed.block(&self.setup).is_some_and(Block::ends_program));
        state.block = None;
        if is_entered {
            (state.entered, state.buffer_full) = (None, false);
            if ends {
                state.modal = Default::default();
            }
        } else if ends {
            self.end_program(state, step);
        }
        // Single block, but for functions alone whose FIN was never taken away (NCT 2.2.2, Y547).
        if step.y(44, 7) && (has_parts || was_off) {
            state.blocks_held = true;
        }
        true
    }

    /// Notes that the block waits, or for nothing.
    pub(super) fn waits_for(
        &self,
        state: &mut State,
        step: &mut Step<'_, '_>,
        awaited: Option<Awaited>,
    ) {
        if let Some(awaited) = state.waits.note(awaited, step.now.tick) {
            step.now.tell(Told::Waits(awaited));
        }
    }

    /// M2, M30, or the end of the text.
    fn end_program(&self, state: &mut State, step: &mut Step<'_, '_>) {
        state.ended = Some(step.now.tick);
        state.buffer_full = false;
        state.modal = Default::default();
        step.now.tell(Told::End);
    }
}

/// Hands the functions of a block over: a strobe for this slice, and a register that stays (NCT 1.4).
pub(super) fn strobe(state: &mut State, step: &mut Step<'_, '_>, block: &Block) {
    let m = block.m.iter().map(|m| u32::from(*m)).enumerate();
    let m = m.map(|(at, value)| (at, value, (52, at)));
    let [a, b, c] = block.functions;
    let others = [
        (5, block.s, (52, 5)),
        (6, block.t, (52, 6)),
        (7, a, (52, 7)),
        (8, b, (53, 0)),
        (9, c, (53, 1)),
    ];
    let others = others.into_iter().filter_map(|(at, value, flag)| Some((at, value?, flag)));
    for (register, value, (byte, bit)) in m.chain(others) {
        if let Some(slot) = state.registers.get_mut(register) {
            *slot = value as u16;
        }
        step.strobes.set(byte, bit, true);
    }
    // G81.1, and G80 after it.
    if let Some(chops) = block.chopping.filter(|chops| *chops || state.chopping) {
        state.chopping = chops;
        step.strobes.set(53, 2, true);
    }
}
