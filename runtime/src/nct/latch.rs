//! How the inputs of a slice are latched (NCT 1.2): the physical lines and the NC's flags become the
//! input image of :001. Mostly none of them has changed, which a comparison of both with what was latched
//! last finds out at once.

use plcc_abi::nct::{IMAGE_BYTES, LINE_BYTES};

use super::state::State;
use super::tick::NctExecutive;

/// I510, which is 1 in the first slice.
const FIRST_CALL: (usize, u8) = (51, 0);
/// I543, which is 1 when :000 begins at its label.
const LEVEL0_START: (usize, u8) = (54, 3);

impl NctExecutive {
    /// Copies the physical inputs and the NC's flags into the input image of :001, with forced values in
    /// their place.
    pub(super) fn latch(&mut self) {
        self.image.show(&mut self.state.modules, false);
        self.image.age_inputs();
        if self.inputs_may_differ() {
            self.latch_each_byte();
        }
        self.image.set_input_bit(FIRST_CALL.0, FIRST_CALL.1, self.state.tick == 0);
        self.image.set_input_bit(LEVEL0_START.0, LEVEL0_START.1, self.state.level0_starts);
    }

    /// Whether a physical input or a flag of the NC may differ from what was latched last.
    fn inputs_may_differ(&self) -> bool {
        let State { latched, nc_flags, forces, .. } = &self.state;
        let behind_lines =
            |all: &Vec<u8>| all.last_chunk::<{ IMAGE_BYTES - LINE_BYTES }>().copied();
        forces.maybe_input()
            || self.image.lines_in() != latched.first_chunk()
            || behind_lines(nc_flags) != behind_lines(latched)
    }

    /// Latches byte by byte, and tells the input image of those that differ.
    fn latch_each_byte(&mut self) {
        for byte in 0..IMAGE_BYTES {
            let lines = self.image.lines_in();
            let line = lines.and_then(|lines| lines.get(byte));
            let value = line.or(self.state.nc_flags.get(byte)).copied().unwrap_or(0);
            let value = self.state.forces.input(byte, value);
            if let Some(last) = self.state.latched.get_mut(byte).filter(|last| **last != value) {
                *last = value;
                self.image.set_input(byte, value);
            }
        }
    }
}
