//! What an NCT control keeps outside the process image.

use plcc_abi::ResumePoint;
use plcc_abi::nct::{IMAGE_BYTES, MODULES, context};
use serde::{Deserialize, Serialize};

use super::forces::Forces;
use super::memory::NcMemory;

/// All of it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct State {
    /// The number of the next slice.
    pub(super) tick: u64,
    /// Where each module's last call was suspended; `None` when it begins at its label.
    pub(super) resume: [Option<ResumePoint>; MODULES],
    /// Whether :000 starts from its beginning when it is next called.
    pub(super) level0_starts: bool,
    /// Whether :000 sees the inputs as they were when it started (Y541, decided in slice 0).
    pub(super) synchronised: bool,
    /// NC flags I400 to I997, bytes 40 and on; those below are the physical lines.
    pub(super) nc_flags: Vec<u8>,
    /// The inputs as they were latched last.
    pub(super) latched: Vec<u8>,
    /// The output bytes Y70 to Y89, whose bits are messages, as they were last reported.
    pub(super) messages: Vec<u8>,
    /// Registers and inputs of the modules that are not running.
    pub(super) modules: Modules,
    /// The NC's memory, as MR and MW reach it.
    pub(super) memory: NcMemory,
    /// The forces in effect.
    pub(super) forces: Forces,
}

/// What belongs to the modules while they do not run.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Modules {
    /// Whether the input images in the process image are those of :000; else they are :001's,
    /// which :002 shares.
    pub(super) level0_inputs: bool,
    /// The others, which wait here.
    pub(super) saved_inputs: SavedInputs,
    /// The registers of each module: the region `context`.
    pub(super) registers: [Vec<u8>; MODULES],
}

/// The input images that are not in the process image: bytes and single bits.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct SavedInputs {
    pub(super) input: [Vec<u8>; 2],
    pub(super) previous: [Vec<u8>; 2],
}

impl State {
    /// The state at power-up, with input images of these lengths.
    pub(super) fn new(memory: NcMemory, inputs: [usize; 2], messages: usize) -> Self {
        let zeros = || inputs.map(|length| vec![0; length]);
        Self {
            tick: 0,
            resume: [None; MODULES],
            level0_starts: true,
            synchronised: true,
            nc_flags: vec![0; IMAGE_BYTES],
            latched: vec![0; IMAGE_BYTES],
            messages: vec![0; messages],
            modules: Modules {
                level0_inputs: false,
                saved_inputs: SavedInputs { input: zeros(), previous: zeros() },
                registers: [(); MODULES].map(|()| vec![0; context::SIZE as usize]),
            },
            memory,
            forces: Forces::default(),
        }
    }

    /// Whether all parts have the lengths of another state's, which is the program's own.
    pub(super) fn fits(&self, own: &Self) -> bool {
        let inputs = |state: &Self| {
            let SavedInputs { input, previous } = &state.modules.saved_inputs;
            [input, previous].map(|parts| parts.each_ref().map(Vec::len))
        };
        let lengths = |state: &Self| {
            [&state.nc_flags, &state.latched, &state.messages].map(|part| part.len())
        };
        let registers = |state: &Self| state.modules.registers.each_ref().map(Vec::len);
        inputs(self) == inputs(own)
            && lengths(self) == lengths(own)
            && registers(self) == registers(own)
            && self.memory.fits(&own.memory)
            && self.forces.fits(&own.forces)
    }
}
