//! Definitions of M-variables that change while the program runs.

use super::Writer;

impl Writer {
    /// The word of a definition is changed, and what it defines is used.
    pub(super) fn move_by_word(&mut self) {
        let pointer = self.memory.pointer(&mut self.rng);
        let statement = match self.rng.below(4) {
            0 => format!("{pointer}={pointer}+1"),
            1 => format!("{pointer}={}", self.memory.address(&mut self.rng)),
            2 => {
                let bit = self.bit(1);
                format!("{pointer}={}+({bit})", self.memory.address(&mut self.rng))
            }
            _ => format!("M({})={}", self.index(1), self.memory.address(&mut self.rng)),
        };
        self.guarded(statement);
        let moved = *self.rng.pick(&["M10", "M40", "M70", "M84"]);
        let (target, value) = (self.target(), self.number(1));
        match self.rng.below(3) {
            0 => line!(self, "{moved}={value}"),
            1 => line!(self, "{target}={moved}+({value})"),
            _ => line!(self, "{moved}={moved}^1"),
        }
    }

    pub(super) fn move_by_command(&mut self) {
        let (number, definition) = self.memory.moved(&mut self.rng);
        let word = *self.rng.pick(&["CMD", "COMMAND"]);
        self.guarded(format!("{word}\"M{number}->{definition}\""));
        let value = self.number(1);
        line!(self, "M{number}=M{number}+{value}");
    }
}
