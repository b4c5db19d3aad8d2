//! Auxiliary axes: requests, their answers, movements (PMI 3.2.2; cnc-side 2.16).

use serde::{Deserialize, Serialize};

use super::Pmi;
use super::state::State;
use crate::access::Access;
use crate::context::Context;
use crate::history::History;
use crate::length::ticks;
use crate::setup::Setup;

/// How many nanoseconds a speed of one count counts for: 128 ms.
const UNIT_NS: i128 = 128_000_000;
/// @AUVEL goes to this, if the table says nothing else.
const FASTEST: i64 = 32_767;

/// What an auxiliary axis does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
enum Kind {
    /// Request 1: until something ends it.
    Jog,
    /// Request 3: for a time, after which the position is 0. How many ticks are done.
    Home(u64),
    /// Request 6: to this position.
    Position(i64),
}

/// A movement of an auxiliary axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Movement {
    kind: Kind,
    start: i64,
    /// The sum of velocities times nanoseconds.
    done: i128,
}

/// An auxiliary axis. Positions are counts.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Auxiliary {
    ready: bool,
    pub(super) homed: bool,
    /// @AUACK.
    pub(super) acknowledge: i64,
    /// Whether a movement was begun and has not come to its end, so that @AUCMP is 0.
    pub(super) incomplete: bool,
    /// @AUVER.
    pub(super) velocity_error: bool,
    pub(super) command: i64,
    pub(super) actual: i64,
    movement: Option<Movement>,
    history: History,
}

/// What a step sees of an auxiliary axis.
struct Asked {
    request: i64,
    velocity: i64,
    position: i64,
    cancels: bool,
    /// Whether the loop is closed.
    closed: bool,
}

impl Auxiliary {
    pub(super) fn new(setup: &Setup, tick_ns: u64) -> Self {
        let history = History::new(&[0], ticks(setup.lag_ns, tick_ns));
        Self { history, ..Self::default() }
    }

    pub(super) fn fits(&self, own: &Self) -> bool {
        self.history.fits(&own.history)
    }

    /// Drops its movement, which leaves @AUCMP as it is.
    pub(super) fn drop_movement(&mut self) {
        self.movement = None;
    }

    /// Answers a request. Returns whether a movement began from rest.
    fn answer(&mut self, asked: &Asked) -> bool {
        if asked.request == 0 {
            self.acknowledge = 0;
            return false;
        }
        if self.acknowledge != 0 {
            return false;
        }
        let can_move = asked.closed && asked.velocity != 0;
        let is_possible = match asked.request {
            8 => true,
            1 | 3 => can_move,
            6 => can_move && asked.velocity > 0 && self.homed,
            _ => false,
        };
        self.acknowledge = if is_possible { 1 } else { -1 };
        let kind = match asked.request {
            _ if !is_possible => return false,
            1 => Kind::Jog,
            3 => Kind::Home(0),
            6 => Kind::Position(asked.position),
            _ => {
                self.velocity_error = false;
                return false;
            }
        };
        let fulfils = |movement: Movement| match (movement.kind, kind) {
            (Kind::Home(_), Kind::Home(_)) => true,
            (own, asked) => own == asked,
        };
        if self.movement.is_some_and(fulfils) {
            return false;
        }
        if kind == Kind::Position(self.command) {
            self.end();
            return false;
        }
        let moved = self.movement.is_some();
        self.movement = Some(Movement { kind, start: self.command, done: 0 });
        self.incomplete = true;
        !moved
    }

    fn end(&mut self) {
        self.movement = None;
        self.incomplete = false;
    }

    /// Goes on for a tick.
    fn advance(&mut self, velocity: i64, tick_ns: u64, home_ticks: u64) {
        let Some(movement) = &mut self.movement else { return };
        let goal = match movement.kind {
            Kind::Position(goal) => Some(goal),
            _ => None,
        };
        let velocity = match goal {
            Some(goal) if goal < movement.start => -velocity.saturating_abs(),
            Some(_) => velocity.saturating_abs(),
            None => velocity,
        };
        let added = i128::from(velocity) * i128::from(tick_ns);
        movement.done = movement.done.saturating_add(added);
        let way = movement.done / UNIT_NS;
        let way = i64::try_from(way).unwrap_or(if way < 0 { i64::MIN } else { i64::MAX });
        let position = movement.start.saturating_add(way);
        // Registers are LONG.
        self.command = position.clamp(i32::MIN.into(), i32::MAX.into());
        if let Kind::Home(done) = &mut movement.kind {
            *done = done.saturating_add(1);
            if *done >= home_ticks {
                (self.command, self.homed) = (0, true);
                self.end();
            }
        } else if let Some(goal) = goal {
            let is_there =
                if goal < movement.start { self.command <= goal } else { self.command >= goal };
            if is_there {
                self.command = goal;
                self.end();
            }
        }
    }
}

impl Pmi {
    /// Does a step of all auxiliary axes.
    pub(super) fn auxiliary(&self, state: &mut State, now: &mut Context<'_>) {
        let is_on = state.is_on();
        let home_ticks = ticks(self.setup.home_ns, now.tick_ns);
        let holds = self.variables.aux_feed_hold.is_on(now.access);
        for (at, axis) in state.auxiliary.iter_mut().enumerate() {
            let Some(asked) = self.asked(at, axis, is_on, now.access) else { continue };
            if !asked.closed {
                axis.drop_movement();
            }
            let began = axis.answer(&asked);
            if asked.cancels && axis.movement.is_some() {
                axis.end();
            }
            let fastest = self.setup.table.aux.get(at).and_then(|entry| entry.max);
            axis.velocity_error |= asked.velocity.saturating_abs() > fastest.unwrap_or(FASTEST);
            if !began && !holds && !axis.velocity_error {
                axis.advance(asked.velocity, now.tick_ns, home_ticks);
            }
        }
    }

    /// What a step sees of an axis, after its mode was taken.
    fn asked(
        &self,
        at: usize,
        axis: &mut Auxiliary,
        is_on: bool,
        access: &dyn Access,
    ) -> Option<Asked> {
        let own = self.variables.aux.get(at)?;
        let mode = own.mode.read(access);
        match mode {
            2 | 3 => axis.ready = true,
            0 | 4 => (axis.ready, axis.homed) = (false, false),
            _ => {}
        }
        Some(Asked {
            request: own.request.read(access),
            velocity: own.given_velocity.read(access),
            position: own.given_position.read(access),
            cancels: own.cancel.is_on(access),
            closed: mode == 1 && axis.ready && is_on,
        })
    }

    /// Writes what an auxiliary axis shows.
    pub(super) fn show_auxiliary(&self, state: &mut State, now: &mut Context<'_>) {
        for (axis, own) in state.auxiliary.iter_mut().zip(&self.variables.aux) {
            let mut delayed = [i128::from(axis.command)];
            axis.history.delay(&mut delayed);
            axis.actual = i64::try_from(delayed[0]).unwrap_or(axis.command);
            own.acknowledge.write(now.access, axis.acknowledge);
            own.complete.write(now.access, (!axis.incomplete).into());
            own.homed.write(now.access, axis.homed.into());
            own.velocity_error.write(now.access, axis.velocity_error.into());
            own.command.write(now.access, axis.command);
            own.actual.write(now.access, axis.actual);
        }
    }
}
