//! Machine on, E-stop and control reset (PMI 3.4; cnc-side 2.3 to 2.5).

use super::auxiliary::Auxiliary;
use super::state::{Machine, State};
use super::{Pmi, Seen};
use crate::context::Context;

impl Pmi {
    pub(super) fn machine(&self, state: &mut State, seen: &Seen, now: &mut Context<'_>) {
        match state.machine {
            Machine::Off => {
                // An edge, so that unlatching the button starts nothing.
                let rises = seen.machine_on_request && !state.before.machine_on_request;
                if rises && !seen.estop_button {
                    state.machine = Machine::Starting(now.tick);
                }
            }
            Machine::Starting(since) => {
                if seen.estop_button || !seen.machine_on_request {
                    state.machine = Machine::Off;
                } else if seen.machine_ready {
                    state.machine = Machine::On;
                } else if now.tick.saturating_sub(since) >= self.machine_on_ticks {
                    state.machine = Machine::Off;
                }
            }
            Machine::On => {
                if seen.estop_button || !seen.machine_ready {
                    state.machine = Machine::Off;
                    self.abort(state, now);
                }
            }
        }
    }

    /// Drops the block, and what was asked of the program for it; the part program stands at its first block.
    fn abort(&self, state: &mut State, now: &mut Context<'_>) {
        for code in state.block.raised() {
            let variable = self.variables.codes.get(code).copied().unwrap_or_default();
            if variable.is_on(now.access) {
                variable.write(now.access, 0);
            }
        }
        if self.variables.new_s_code.is_on(now.access) {
            self.variables.new_s_code.write(now.access, 0);
        }
        state.hold = false;
        state.jogs = Default::default();
        state.auxiliary.iter_mut().for_each(Auxiliary::drop_movement);
        state.started = false;
        state.block.stand_at_first();
    }

    /// @CRRQ in manual mode. A request that is held gives one pulse.
    pub(super) fn control_reset(&self, state: &mut State, seen: &Seen, now: &mut Context<'_>) {
        if !seen.control_reset || state.before.control_reset || state.mode != 0 {
            return;
        }
        self.abort(state, now);
        state.program_end = 0;
        self.variables.reset_pulse.write(now.access, 1);
        for fault in &self.variables.faults {
            if fault.is_on(now.access) {
                fault.write(now.access, 0);
            }
        }
    }
}
