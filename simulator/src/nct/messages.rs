//! Which message is shown (cnc-side 3.19).

use super::flags::MESSAGES;
use super::state::{AXES, Fault, Return, State};
use super::{Nct, Step};

/// The codes of limit switches: the first axis in the positive and in the negative direction.
const LIMITS: [(usize, u16); 2] = [(56, 1340), (57, 1360)];
/// The question of the return from an interruption.
const RETURN: u16 = 3549;
/// The codes of the program's messages: of Y700 and of Y710.
const INDEXED: u16 = 2500;
const OTHERS: u16 = 2000;
/// How many messages are indexed.
const INDEXED_COUNT: usize = 8;

fn flag(step: &Step<'_, '_>, at: usize) -> bool {
    step.y(MESSAGES.start() + at / 8, at % 8)
}

impl Nct {
    pub(super) fn messages(&self, state: &mut State, step: &Step<'_, '_>) {
        // The active one stays until the program takes it away.
        if state.active.is_none_or(|active| !flag(step, active)) {
            let count = MESSAGES.count() * 8;
            let bytes = MESSAGES.map(|byte| step.y.byte(byte));
            let any = bytes.fold(0, |all, byte| all | byte) != 0;
            state.active = if any { (0..count).find(|at| flag(step, *at)) } else { None };
        }
        let own = state.active.map(|at| match at.checked_sub(INDEXED_COUNT) {
            None => INDEXED + at as u16,
            Some(at) => OTHERS + at as u16,
        });
        let of_control = self.message_of_control(state, step);
        state.message = of_control.or(own);
        state.shown_before = state.shown;
        state.shown = if of_control.is_none() { state.active } else { None };
    }

    /// The control's own message: a fault of a drive, a limit switch.
    fn message_of_control(&self, state: &State, step: &Step<'_, '_>) -> Option<u16> {
        if let Some(fault) = state.fault {
            let (first, axis) = match fault {
                Fault::Servo(axis) => (0, axis),
                Fault::Encoder(axis) => (20, axis),
                Fault::Feedback(axis) => (40, axis),
            };
            return Some(first + u16::from(axis.saturating_sub(1)));
        }
        let limit = LIMITS.into_iter().find_map(|(byte, code)| {
            let axis = (0..AXES).find(|axis| step.y(byte, *axis))?;
            Some(code + axis as u16)
        });
        limit.or((state.returns == Return::Message).then_some(RETURN))
    }
}
