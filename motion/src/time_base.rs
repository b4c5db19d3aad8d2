//! The time bases of coordinate systems (guide, Time Base).

use plcc_abi::pmac::Space;

use crate::halt::Pause;
use crate::machine::Machine;
use crate::words::WORD;

impl Machine<'_> {
    /// B goes towards its goal (guide, Time Base).
    pub(crate) fn time_bases(&mut self) {
        for system in 0..self.system_count() {
            let commanded = self.commanded_base(system);
            let this = &mut self.state.systems[system];
            let goal = if this.held { 0 } else { commanded };
            if this.base != goal || this.pause != Pause::None {
                self.change_base(system, goal);
            } else {
                this.returning = false;
            }
            let base = self.state.systems[system].base as u32;
            self.set_word(self.setup.systems[system].present_base, base);
        }
    }

    /// B goes a step towards its goal.
    fn change_base(&mut self, system: usize, goal: i64) {
        let this = &self.state.systems[system];
        if this.is_paused() && !this.held {
            // The motors may jog, as fast as the time base lets them.
            self.state.systems[system].base = goal;
        } else if this.base != goal {
            let slow = this.held || this.returning;
            let step = match slow {
                true => self.hold_rate(system),
                false => self.system_i(system, 94),
            };
            let step = (step as i64).max(0);
            let this = &mut self.state.systems[system];
            let way = (goal - this.base).clamp(-step, step);
            this.base = (this.base + way).max(0);
        }
        let this = &mut self.state.systems[system];
        if this.base == goal {
            this.returning = false;
            self.base_reached(system);
        }
    }

    /// The commanded time base: the word that Ix93 names, that of the % command for 0.
    pub(crate) fn commanded_base(&self, system: usize) -> i64 {
        let words = &self.setup.systems[system];
        let address = self.system_i(system, 93) as u32;
        if address == 0 || address == words.base_address {
            return i64::from(self.word(words.commanded_base) & WORD);
        }
        i64::from(self.memory.read_word(Space::X, address & self.setup.layout.address_mask()))
    }

    /// The time base of a motor's moves.
    pub(crate) fn base_of(&self, motor: usize) -> i64 {
        let system = self.system_of(motor).unwrap_or(0);
        self.state.systems[system].base
    }
}
