//! The touch buttons of the operator window (PMI 3.4; cnc-side 2.18).

use serde::{Deserialize, Serialize};

use super::Pmi;
use super::state::State;
use crate::context::Context;

/// How many buttons a window has.
pub(super) const BUTTONS: usize = 12;

/// Which window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Window {
    /// @OPB00 to @OPB11.
    Operator,
    /// @MPB00 to @MPB11.
    Extended,
}

impl Window {
    /// The variable of a button.
    pub(crate) fn button(self, number: usize) -> String {
        let letter = if self == Self::Operator { 'O' } else { 'M' };
        format!("@{letter}PB{number:02}")
    }
}

/// The buttons that are pressed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct TouchState {
    /// For each button the tick in which it was pressed, while it is.
    pressed: Vec<Option<u64>>,
    /// The buttons that were written as pressed in the step before.
    shown: Vec<bool>,
    /// Whether @TCHKY was written as touched.
    touched: bool,
}

impl Default for TouchState {
    fn default() -> Self {
        let count = 2 * BUTTONS;
        Self { pressed: vec![None; count], shown: vec![false; count], touched: false }
    }
}

impl TouchState {
    pub(super) fn fits(&self, own: &Self) -> bool {
        self.pressed.len() == own.pressed.len() && self.shown.len() == own.shown.len()
    }
}

impl State {
    /// A button is pressed in this tick, or let go.
    pub(crate) fn touch_key(&mut self, window: Window, button: usize, pressed: bool, tick: u64) {
        let first = if window == Window::Operator { 0 } else { BUTTONS };
        if let Some(slot) = self.touch.pressed.get_mut(first + button) {
            *slot = pressed.then_some(slot.unwrap_or(tick));
        }
    }
}

impl Pmi {
    pub(super) fn touch(&self, state: &mut State, now: &mut Context<'_>) {
        let TouchState { pressed, shown, touched } = &mut state.touch;
        let mut target = None;
        for (at, (repeats, button)) in self.variables.touch.iter().enumerate() {
            let since = pressed.get(at).copied().flatten();
            let Some(shown) = shown.get_mut(at) else { continue };
            target = target.or(since.map(|_| at as i64 + 1));
            let is_shown =
                since.is_some_and(|since| since == now.tick || repeats.is_on(now.access));
            if is_shown || *shown {
                button.write(now.access, is_shown.into());
            }
            *shown = is_shown;
        }
        if target.is_some() || *touched {
            self.variables.touched.write(now.access, target.unwrap_or(0));
        }
        *touched = target.is_some();
    }
}
