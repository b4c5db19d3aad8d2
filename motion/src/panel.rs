//! The control panel of a PMAC (I2=0): switches at its connector, whose bits in Y:$FFC0 are 0 while they are closed (guide,
//! Control-Panel Port).

use std::sync::Arc;

use plcc_abi::pmac::Space;
use plcc_abi::pmac::motion::{Jog, JogGoal, MotionAction};

use crate::commands::Address;
use crate::machine::Machine;

/// The word of the connector, in Y memory.
const WORD: u32 = 0xFFC0;

/// The first of the four bits that select motor and coordinate system.
const SELECT: u32 = 16;

const MINUS: u32 = 8;
const PLUS: u32 = 9;

/// The texts of the commands that switches give, as refusals name them.
const TEXTS: [&str; 10] = ["J-", "J+", "J=", "R", "S", "Q", "A", "HM", "H", "J/"];

/// The texts, so that a command allocates nothing.
pub(crate) fn texts() -> Vec<Arc<str>> {
    TEXTS.into_iter().map(Into::into).collect()
}

fn jog(goal: JogGoal) -> MotionAction {
    MotionAction::Jog(Jog { goal, trigger: None })
}

impl Machine<'_> {
    /// Whether the panel is in use.
    fn has_panel(&self) -> bool {
        !self.turbo() && self.i(2) == 0.0
    }

    /// At power-up all switches of the panel are open.
    pub(crate) fn open_panel(&mut self) {
        if self.has_panel() {
            self.memory.write_word(Space::Y, WORD, 0xFF_FFFF);
        }
        self.state.panel = self.memory.read_word(Space::Y, WORD);
    }

    /// Gives the commands of the switches that have closed.
    pub(crate) fn panel(&mut self) {
        let now = self.memory.read_word(Space::Y, WORD);
        let before = std::mem::replace(&mut self.state.panel, now);
        if now == before || !self.has_panel() {
            return;
        }
        let selected = (!now >> SELECT & 15) as usize;
        if !(1..=self.motor_count()).contains(&selected) {
            return;
        }
        let at = Address { motor: selected - 1, system: selected - 1 };
        let (closed, opened) = (before & !now, !before & now);
        let runs = self.state.systems.get(at.system).is_some_and(|system| system.running);
        let step = if runs { MotionAction::Quit } else { MotionAction::Step };
        if opened & (1 << MINUS | 1 << PLUS) != 0 {
            self.press("J/", &jog(JogGoal::Stop), at);
        }
        let commands = [
            (MINUS, "J-", jog(JogGoal::Negative)),
            (PLUS, "J+", jog(JogGoal::Positive)),
            (10, "J=", jog(JogGoal::PreJog)),
            (11, "R", MotionAction::Run),
            (12, if runs { "Q" } else { "S" }, step),
            (13, "A", MotionAction::Abort),
            (14, "HM", MotionAction::Home),
            (15, "H", MotionAction::Hold),
        ];
        for (bit, text, action) in commands {
            if closed & 1 << bit != 0 {
                self.press(text, &action, at);
            }
        }
    }

    fn press(&mut self, text: &str, action: &MotionAction, at: Address) {
        let texts = &self.setup.panel;
        let text = texts.iter().find(|own| ***own == *text).cloned();
        self.carry_out(action, &text.unwrap_or_else(|| "".into()), at);
    }
}
