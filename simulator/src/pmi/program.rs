//! The part program: fetching, prompt codes, movement, delayed codes, the end of a block (cnc-side 2.10 to 2.12).

use serde::{Deserialize, Serialize};

use super::state::State;
use super::{Pmi, Seen};
use crate::context::Context;
use crate::event::{Awaited, Told};
use crate::modal::Modal;
use crate::part_program::{AuxMove, Block};
use crate::setup::Setup;
use crate::way::Way;

/// After how many ticks it is told that a block waits.
const PATIENCE: u64 = 500;

/// Where a block is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
enum Phase {
    /// Codes that come before the movement wait to be reset.
    #[default]
    Prompt,
    /// The axes move, or G4 counts the ticks that are left.
    Moving { dwell: Option<u64> },
    /// Codes that come after the movement wait.
    Delayed,
    /// Nothing is left to do.
    Done,
}

/// A code that was raised, or (`None`) @NEWSC.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Raised {
    code: Option<u16>,
    tick: u64,
    /// Whether it was told that the block waits for it.
    told: bool,
}

/// The part program and its block.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct BlockState {
    /// The index of the block that is executed.
    executed: Option<u32>,
    /// The index of the block that is fetched next.
    next: u32,
    modal: Modal,
    began: u64,
    phase: Phase,
    /// Whether the block was fetched with @PSIM, so that nothing is raised.
    simulated: bool,
    raised: Vec<Raised>,
    way: Way,
    /// The end of the way.
    end: Vec<i128>,
}

impl BlockState {
    pub(super) fn new(axes: usize, codes: usize) -> Self {
        let mut new = Self { way: Way::new(axes), end: vec![0; axes], ..Self::default() };
        new.reserve(codes);
        new
    }

    pub(super) fn reserve(&mut self, codes: usize) {
        self.raised.reserve(codes + 1);
    }

    pub(super) fn fits(&self, own: &Self) -> bool {
        self.way.fits(own.end.len()) && self.end.len() == own.end.len()
    }

    pub(super) fn is_executed(&self) -> bool {
        self.executed.is_some()
    }

    /// The line of the block that is executed, 0 without.
    pub(super) fn line(&self, setup: &Setup) -> i64 {
        self.executed.and_then(|at| block(setup, at)).map_or(0, |block| block.line.into())
    }

    /// @INTRP.
    pub(super) fn interpolation(&self) -> i64 {
        if self.is_executed() { self.way.interpolation() } else { 0 }
    }

    /// The codes that were raised for the block.
    pub(super) fn raised(&self) -> impl Iterator<Item = usize> + '_ {
        self.raised.iter().filter_map(|raised| raised.code).map(usize::from)
    }

    /// What it waits for.
    pub(super) fn waits(&self) -> Option<Awaited> {
        self.executed?;
        let first = self.raised.first()?;
        Some(first.code.map_or(Awaited::SpindleSpeed, Awaited::Code))
    }

    /// Drops the block; the program stands at its first one, and nothing modal is left.
    pub(super) fn stand_at_first(&mut self) {
        self.executed = None;
        self.next = 0;
        self.modal = Modal::default();
        self.raised.clear();
    }
}

fn block(setup: &Setup, at: u32) -> Option<&Block> {
    setup.program.as_ref()?.blocks.get(at as usize)
}

impl Pmi {
    pub(super) fn block(&self, state: &mut State, seen: &Seen, now: &mut Context<'_>) {
        state.active.fill(false);
        if state.block.executed.is_none() && !self.fetch(state, seen, now) {
            return;
        }
        while self.go_on(state, seen, now) {}
        self.tell_waits(state, now);
    }

    /// Does what the present phase does in this step. Returns whether the next one begins in the same step.
    fn go_on(&self, state: &mut State, seen: &Seen, now: &mut Context<'_>) -> bool {
        match state.block.phase {
            Phase::Prompt => {
                if self.waits_for_codes(&mut state.block, now) {
                    return false;
                }
                self.begin_movement(state, now);
                // A way of no length is done at once; others only show in this step which axes they move.
                let done = self.is_moved(state);
                self.show_movement(state, seen);
                done && self.raise_delayed(state, now)
            }
            Phase::Moving { .. } => {
                self.advance(state, seen, now);
                let done = self.is_moved(state);
                self.show_movement(state, seen);
                done && self.raise_delayed(state, now)
            }
            Phase::Delayed => {
                if self.waits_for_codes(&mut state.block, now) {
                    return false;
                }
                state.block.phase = Phase::Done;
                true
            }
            Phase::Done => {
                // A block lasts at least one tick (cnc-side 1.21).
                state.block.began != now.tick && self.end(state, seen, now)
            }
        }
    }

    /// Fetches the next block, if nothing is against it. Returns whether one begins.
    fn fetch(&self, state: &mut State, seen: &Seen, now: &mut Context<'_>) -> bool {
        if !state.started || state.hold || seen.block_inhibit {
            return false;
        }
        let mut at = state.block.next;
        let found = loop {
            match block(&self.setup, at) {
                Some(block) if block.skip > 0 && state.block_delete => at = at.saturating_add(1),
                found => break found,
            }
        };
        let Some(block) = found else {
            self.end_program(state, now);
            return false;
        };
        let BlockState { executed, next, modal, began, phase, simulated, raised, .. } =
            &mut state.block;
        (*executed, *next, *began) = (Some(at), at.saturating_add(1), now.tick);
        (*phase, *simulated) = (Phase::Prompt, seen.simulation);
        raised.clear();
        modal.take(block);
        now.tell(Told::Block(block.line));
        self.begin_way(state, block);
        let own = &self.variables;
        if let Some(t) = block.t {
            state.t_code = t.into();
            own.next_tool.write(now.access, i64::from(t as u16 as i16));
        }
        if let Some(s) = block.s {
            state.s_code = s.into();
            if !seen.simulation {
                own.new_s_code.write(now.access, 1);
                state.block.raise(None, now.tick);
            }
        }
        self.raise(state, block, false, now);
        true
    }

    /// Raises the codes of a block that come before its movement, or after it.
    fn raise(&self, state: &mut State, block: &Block, delayed: bool, now: &mut Context<'_>) {
        if state.block.simulated {
            return;
        }
        for &code in &block.codes {
            let declared = self.setup.rules.codes.get(usize::from(code));
            if declared.is_some_and(|declared| declared.delayed == delayed) {
                let variable = self.variables.codes.get(usize::from(code)).copied();
                variable.unwrap_or_default().write(now.access, 1);
                state.block.raise(Some(code), now.tick);
                if let Some(aux) = block.aux.filter(|aux| declared.is_some_and(|it| aux.is_of(it)))
                {
                    self.aux_move(aux, now);
                }
            }
        }
    }

    fn raise_delayed(&self, state: &mut State, now: &mut Context<'_>) -> bool {
        if let Some(block) = state.block.executed.and_then(|at| block(&self.setup, at)) {
            self.raise(state, block, true, now);
        }
        state.block.phase = Phase::Delayed;
        true
    }

    /// Whether a code that was raised is not reset yet, as a later step sees it. Those that are no longer count.
    fn waits_for_codes(&self, block: &mut BlockState, now: &Context<'_>) -> bool {
        let is_on = |raised: &Raised| {
            let variable = match raised.code {
                Some(code) => self.variables.codes.get(usize::from(code)).copied(),
                None => Some(self.variables.new_s_code),
            };
            variable.unwrap_or_default().is_on(now.access)
        };
        let waits = block.raised.iter().any(|raised| raised.tick == now.tick || is_on(raised));
        if !waits {
            block.raised.clear();
        }
        waits
    }

    fn tell_waits(&self, state: &mut State, now: &mut Context<'_>) {
        for at in 0..state.block.raised.len() {
            let Some(raised) = state.block.raised.get(at).copied() else { return };
            if raised.told || now.tick.saturating_sub(raised.tick) < PATIENCE {
                continue;
            }
            let variable = match raised.code {
                Some(code) => self.variables.codes.get(usize::from(code)).copied(),
                None => Some(self.variables.new_s_code),
            };
            if variable.unwrap_or_default().is_on(now.access) {
                let awaited = raised.code.map_or(Awaited::SpindleSpeed, Awaited::Code);
                now.tell(Told::Waits(awaited));
                if let Some(raised) = state.block.raised.get_mut(at) {
                    raised.told = true;
                }
            }
        }
    }

    /// G61 to G66 give an auxiliary axis its end and its speed, a count in 128 ms (PMI 3.2.2.12).
    fn aux_move(&self, AuxMove { axis, position, feed }: AuxMove, now: &mut Context<'_>) {
        let Some(variables) = self.variables.aux.get(usize::from(axis)) else { return };
        let counts = self.setup.table.aux.get(usize::from(axis)).and_then(|entry| entry.counts);
        let counts = i128::from(counts.unwrap_or(10_000));
        let unit = self.setup.rules.unit;
        if let Some(position) = position {
            let position = position.saturating_mul(counts) / unit;
            variables.position.write(now.access, position as i64);
        }
        if let Some(feed) = feed {
            let velocity = feed.saturating_mul(counts).saturating_mul(128) / (60_000 * unit);
            variables.velocity.write(now.access, velocity as i64);
        }
    }

    /// The way of a block from its fetch on, so that @INTRP is its own. Nothing moves the axes before it does.
    fn begin_way(&self, state: &mut State, block: &Block) {
        let BlockState { modal, way, end, .. } = &mut state.block;
        let commands = state.positions.commands();
        end.copy_from_slice(commands);
        modal.target(block, end);
        if modal.absolute {
            for &(axis, _) in &block.axes {
                if let (Some(end), Some(offset)) = (end.get_mut(axis), state.offsets.get(axis)) {
                    *end = end.saturating_add(*offset);
                }
            }
        }
        way.begin_for(commands, end, modal.speed(&self.setup), &self.setup);
        if let Some(circle) = modal.circle(block, &self.setup.rules.letters, commands, end) {
            way.bend(circle);
        }
    }

    fn begin_movement(&self, state: &mut State, now: &Context<'_>) {
        let executed = state.block.executed.and_then(|at| block(&self.setup, at));
        let dwell = executed.and_then(|block| block.dwell);
        let dwell = dwell.map(|time| time.div_ceil(now.tick_ns.max(1)));
        state.block.phase = Phase::Moving { dwell };
    }

    fn is_moved(&self, state: &State) -> bool {
        let dwells = matches!(state.block.phase, Phase::Moving { dwell: Some(1..) });
        !dwells && state.block.way.is_done()
    }

    /// How many per cent of its speed the way has.
    fn percent(&self, state: &State, seen: &Seen) -> i64 {
        let most = if state.block.way.rapid { 100 } else { 150 };
        let is_held = state.hold || seen.move_hold;
        if is_held { 0 } else { seen.feed_override.clamp(0, most) }
    }

    fn advance(&self, state: &mut State, seen: &Seen, now: &Context<'_>) {
        if let Phase::Moving { dwell: Some(left) } = &mut state.block.phase {
            if !state.hold {
                *left = left.saturating_sub(1);
            }
            return;
        }
        let percent = self.percent(state, seen);
        let way = &mut state.block.way;
        way.advance(way.speed, percent, now.tick_ns);
        for axis in 0..self.setup.axes.len() {
            if let Some(position) = way.position(axis) {
                state.positions.set_command(axis, position);
            }
        }
    }

    /// Which axes have way left that nothing holds.
    fn show_movement(&self, state: &mut State, seen: &Seen) {
        let moves = self.percent(state, seen) > 0 && !state.block.way.is_done();
        let way = &state.block.way;
        for (axis, active) in state.active.iter_mut().enumerate() {
            *active = moves && way.moves(axis);
        }
    }

    /// Ends a block. Returns whether another one begins in this step.
    fn end(&self, state: &mut State, seen: &Seen, now: &mut Context<'_>) -> bool {
        let ended = state.block.executed.take().and_then(|at| block(&self.setup, at));
        state.block.raised.clear();
        state.active.fill(false);
        let has =
            |codes: &[u16]| ended.is_some_and(|block| block.m.iter().any(|m| codes.contains(m)));
        if has(&[90]) {
            let next = self.variables.next_tool.read(now.access);
            self.variables.tool.write(now.access, next);
        }
        if has(&[2, 30]) {
            self.end_program(state, now);
        } else if has(&[0]) || has(&[1]) && state.optional_stop {
            state.program_end = 1;
            state.started = false;
        }
        if seen.mode_request == 0 && state.is_on() {
            state.enter_manual();
        } else if state.mode == 1 {
            state.started = false;
        }
        self.fetch(state, seen, now)
    }

    fn end_program(&self, state: &mut State, now: &mut Context<'_>) {
        state.program_end = 2;
        state.started = false;
        state.block.stand_at_first();
        now.tell(Told::End);
    }
}

impl BlockState {
    fn raise(&mut self, code: Option<u16>, tick: u64) {
        self.raised.push(Raised { code, tick, told: false });
    }
}
