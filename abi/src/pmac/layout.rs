//! Where a PMAC's memory is in the process image.
//!
//! The layout depends on nothing but the controller, so compiler, load evaluator and executive
//! all compute it alike. P, Q and I are doubles; every other register is a word of 24 bits in a
//! `u32`. Turbo's 24-bit address space is not all in the image: a few windows are, the rest is
//! kept by [`SparseMemory`](super::sparse_memory::SparseMemory).

use alloc::{string::ToString, vec::Vec};

use super::controller::Controller;
use crate::Region;

/// One of the two data spaces of the DSP (guide, Memory Map).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Space {
    /// X memory.
    X,
    /// Y memory.
    Y,
}

/// What a word address means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// A plain word, at this offset in the image.
    Word(u32),
    /// Half of the P-variable of this number.
    P(u32),
    /// Half of the Q-variable of this number.
    Q(u32),
    /// The I-variable of this number, an integer.
    I(u32),
    /// The definition of the M-variable of this number.
    Definition(u32),
    /// A plain word that is not in the image.
    Sparse,
}

/// Bytes of a double: a P-, Q- or I-variable, or the value of a thumbwheel M-variable.
pub const DOUBLE_SIZE: u32 = 8;

/// Bytes of a word of memory, 24 bits in a `u32`; also of the counts in [`exec`].
pub const WORD_SIZE: u32 = 4;

/// Bytes of an address of memory: its X word, then its Y word.
pub const ADDRESS_SIZE: u32 = 2 * WORD_SIZE;

/// Bytes of the code of an M-variable's definition.
pub const DEFINITION_SIZE: u32 = 8;

/// What the offset of a region is a multiple of.
const REGION_ALIGNMENT: u32 = 8;

/// The names of the image's regions.
pub mod region {
    /// [`Layout::p`](super::Layout::p).
    pub const P: &str = "p";
    /// [`Layout::q`](super::Layout::q).
    pub const Q: &str = "q";
    /// [`Layout::i`](super::Layout::i).
    pub const I: &str = "i";
    /// [`Layout::mdef`](super::Layout::mdef).
    pub const MDEF: &str = "mdef";
    /// [`Layout::reference_definitions`](super::Layout::reference_definitions).
    pub const REFERENCE_DEFINITIONS: &str = "reference_definitions";
    /// [`Layout::thumbwheels`](super::Layout::thumbwheels).
    pub const THUMBWHEELS: &str = "thumbwheels";
    /// [`Layout::words`](super::Layout::words).
    pub const WORDS: &str = "words";
    /// [`Layout::differing_definitions`](super::Layout::differing_definitions).
    pub const DIFFERING_DEFINITIONS: &str = "differing_definitions";
    /// [`Layout::assumption_flags`](super::Layout::assumption_flags).
    pub const ASSUMPTION_FLAGS: &str = "assumption_flags";
    /// What the executive counts: see [`exec`](super::exec).
    pub const EXEC: &str = "exec";
}

/// Contexts with an addressed coordinate system: PLC 0-31, PLCC 0-31, commands, motion programs.
pub const CONTEXTS: u32 = 66;

/// The context of queued commands.
pub const COMMAND_CONTEXT: u32 = 64;

/// The context of motion programs. The executive sets it before each calculation to the coordinate system that
/// runs the program, so that several can run one.
pub const MOTION_CONTEXT: u32 = 65;

/// The context of a PLC or PLCC.
pub const fn context(compiled: bool, number: u32) -> u32 {
    (number & 31) + if compiled { 32 } else { 0 }
}

/// Offsets in the region `exec`, in bytes from its start.
pub mod exec {
    /// [`Layout::invalid_assumptions`](super::Layout::invalid_assumptions).
    pub const INVALID_ASSUMPTIONS: u32 = 0;
    /// The first Q-variables of the addressed coordinate systems, 32 bits for each
    /// [context](super::context()). The four bytes before it are not used.
    pub const Q_BASES: u32 = 8;

    /// The offset of a context's first Q-variable.
    pub const fn q_base(context: u32) -> u32 {
        Q_BASES + super::WORD_SIZE * context
    }

    /// The offset of the number of a context's addressed motor, 0 until ADDRESS gives one.
    pub const fn motor(context: u32) -> u32 {
        q_base(super::CONTEXTS) + super::WORD_SIZE * context
    }
}

/// Offsets of everything, in bytes from the image's start.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layout {
    /// The controller whose memory it is.
    pub controller: Controller,
    /// Numbers of each kind of variable: 1024 or 8192, a power of two.
    pub count: u32,
    /// The P-variables, a double each.
    pub p: u32,
    /// The Q-variables, a double each.
    pub q: u32,
    /// The I-variables, a double each.
    pub i: u32,
    /// The M-variables' definitions as they are now, [`DEFINITION_SIZE`] bytes each
    /// ([`Definition::encode`](super::Definition::encode)).
    pub mdef: u32,
    /// The M-variables' reference definitions, encoded as `mdef` is: those that compiled code
    /// assumes; for variables of which it assumes nothing, those after load.
    pub reference_definitions: u32,
    /// Values of thumbwheel M-variables, a double each.
    pub thumbwheels: u32,
    /// Memory words, X before Y, [`ADDRESS_SIZE`] bytes an address.
    pub words: u32,
    /// For each M-variable a byte: 1 while its definition differs from its reference definition.
    pub differing_definitions: u32,
    /// For each M-variable a byte of flags: what compiled code [assumes](super::assumption) of it.
    pub assumption_flags: u32,
    /// A `u32`: the number of M-variables whose definition differs from what code assumes.
    pub invalid_assumptions: u32,
    /// For each [context] a `u32`: the number of the first Q-variable of its addressed
    /// coordinate system.
    pub q_base: u32,
    /// Length of the image.
    pub size: u32,
}

/// Address windows whose words are in the image.
const PMAC_WINDOWS: &[(u32, u32)] = &[(0, 0x1_0000)];
const TURBO_WINDOWS: &[(u32, u32)] = &[(0, 0x1_0000), (0x6_0000, 0x7_0000), (0x7_8000, 0x8_0000)];

impl Layout {
    /// The layout for a controller.
    pub const fn new(controller: Controller) -> Self {
        let count = match controller {
            Controller::Pmac => 1024,
            Controller::Turbo => 8192,
        };
        let p = 0;
        let q = p + DOUBLE_SIZE * count;
        let i = q + DOUBLE_SIZE * count;
        let mdef = i + DOUBLE_SIZE * count;
        let reference_definitions = mdef + DEFINITION_SIZE * count;
        let thumbwheels = reference_definitions + DEFINITION_SIZE * count;
        let words = thumbwheels + DOUBLE_SIZE * count;
        let differing_definitions = words + ADDRESS_SIZE * resident(windows(controller));
        let assumption_flags = differing_definitions + count;
        let invalid_assumptions = assumption_flags + count;
        let q_base = invalid_assumptions + exec::Q_BASES;
        let end = invalid_assumptions + exec::motor(CONTEXTS);
        let size = end.next_multiple_of(REGION_ALIGNMENT);
        Self {
            controller,
            count,
            p,
            q,
            i,
            mdef,
            reference_definitions,
            thumbwheels,
            words,
            differing_definitions,
            assumption_flags,
            invalid_assumptions,
            q_base,
            size,
        }
    }

    /// The offset in the image of the first Q-variable of a context's coordinate system.
    pub const fn q_base_at(&self, context: u32) -> u32 {
        self.invalid_assumptions + exec::q_base(context)
    }

    /// The offset in the image of the number of a context's addressed motor.
    pub const fn motor_at(&self, context: u32) -> u32 {
        self.invalid_assumptions + exec::motor(context)
    }

    /// The image's regions by rising offset, with the names in [`region`]. What is where in the
    /// region [`region::EXEC`], the module [`exec`] says.
    pub fn regions(&self) -> Vec<Region> {
        let bounds = [
            (region::P, self.p, self.q),
            (region::Q, self.q, self.i),
            (region::I, self.i, self.mdef),
            (region::MDEF, self.mdef, self.reference_definitions),
            (region::REFERENCE_DEFINITIONS, self.reference_definitions, self.thumbwheels),
            (region::THUMBWHEELS, self.thumbwheels, self.words),
            (region::WORDS, self.words, self.differing_definitions),
            (region::DIFFERING_DEFINITIONS, self.differing_definitions, self.assumption_flags),
            (region::ASSUMPTION_FLAGS, self.assumption_flags, self.invalid_assumptions),
            (region::EXEC, self.invalid_assumptions, self.size),
        ];
        bounds
            .into_iter()
            .map(|(name, offset, end)| Region {
                name: name.to_string(),
                offset,
                size: end - offset,
                bits: name == region::DIFFERING_DEFINITIONS,
            })
            .collect()
    }

    /// Bits of an address.
    pub const fn address_mask(&self) -> u32 {
        match self.controller {
            Controller::Pmac => 0xFFFF,
            Controller::Turbo => 0xFF_FFFF,
        }
    }

    /// Whether a word is one of the I/O, not of memory: for PMAC the gate arrays at $C000-$C03F and
    /// the I/O registers at Y:$F000-$FFFF (guide, Memory Map). For Turbo PMAC, whose map the guide does
    /// not have, the words from $78000 on.
    pub const fn is_io(&self, space: Space, address: u32) -> bool {
        let address = address & self.address_mask();
        match self.controller {
            Controller::Pmac => {
                let gates = address >= 0xC000 && address < 0xC040;
                gates || address >= 0xF000 && matches!(space, Space::Y)
            }
            Controller::Turbo => address >= 0x7_8000 && address < 0x8_0000,
        }
    }

    /// The address of P0.
    pub const fn p_address(&self) -> u32 {
        match self.controller {
            Controller::Pmac => 0x1000,
            Controller::Turbo => 0x6000,
        }
    }

    /// The address of &1Q0.
    pub const fn q_address(&self) -> u32 {
        match self.controller {
            Controller::Pmac => 0x1400,
            Controller::Turbo => 0x8000,
        }
    }

    /// The address of M0's definition, in Y.
    pub const fn m_address(&self) -> u32 {
        match self.controller {
            Controller::Pmac => 0xBC00,
            Controller::Turbo => 0x4000,
        }
    }

    /// The number of coordinate systems.
    pub const fn systems(&self) -> u32 {
        match self.controller {
            Controller::Pmac => 8,
            Controller::Turbo => 16,
        }
    }

    /// The number of Q0 of a coordinate system (from 1) among all Q-variables.
    pub const fn q_base_of(&self, system: u32) -> u32 {
        let block = self.count / self.systems();
        (system.wrapping_sub(1).wrapping_mul(block)) & (self.count - 1)
    }

    /// Offset of a P-variable; numbers wrap.
    pub const fn p_offset(&self, number: u32) -> u32 {
        self.p + DOUBLE_SIZE * (number & (self.count - 1))
    }

    /// Offset of a Q-variable, counted from &1Q0; numbers wrap.
    pub const fn q_offset(&self, number: u32) -> u32 {
        self.q + DOUBLE_SIZE * (number & (self.count - 1))
    }

    /// Offset of an I-variable; numbers wrap.
    pub const fn i_offset(&self, number: u32) -> u32 {
        self.i + DOUBLE_SIZE * (number & (self.count - 1))
    }

    /// Offset of the code of an M-variable's definition; numbers wrap.
    pub const fn definition_offset(&self, number: u32) -> u32 {
        self.mdef + DEFINITION_SIZE * (number & (self.count - 1))
    }

    /// Offset of the code of an M-variable's reference definition; numbers wrap.
    pub const fn reference_offset(&self, number: u32) -> u32 {
        self.reference_definitions + DEFINITION_SIZE * (number & (self.count - 1))
    }

    /// Offset of the value of a thumbwheel M-variable; numbers wrap.
    pub const fn thumbwheel_offset(&self, number: u32) -> u32 {
        self.thumbwheels + DOUBLE_SIZE * (number & (self.count - 1))
    }

    /// What an address is; it wraps at the controller's width.
    pub fn place(&self, space: Space, address: u32) -> Place {
        let address = address & self.address_mask();
        let within = |start: u32| {
            let number = address.wrapping_sub(start);
            (number < self.count).then_some(number)
        };
        if let Some(number) = within(self.p_address()) {
            return Place::P(number);
        }
        if let Some(number) = within(self.q_address()) {
            return Place::Q(number);
        }
        if self.controller == Controller::Pmac
            && space == Space::X
            && let Some(number) = i_at(address)
        {
            return Place::I(number);
        }
        if space == Space::Y
            && let Some(number) = within(self.m_address())
        {
            return Place::Definition(number);
        }
        match self.resident(address) {
            Some(index) => {
                let half = if space == Space::Y { WORD_SIZE } else { 0 };
                Place::Word(self.words + ADDRESS_SIZE * index + half)
            }
            None => Place::Sparse,
        }
    }

    /// The index of an address among those in the image.
    fn resident(&self, address: u32) -> Option<u32> {
        let mut base = 0;
        for &(start, end) in windows(self.controller) {
            if start <= address && address < end {
                return Some(base + address - start);
            }
            base += end - start;
        }
        None
    }
}

/// The I-variables whose addresses the guide tells: Ix05 at X:$2A (under PMAC Position Registers)
/// and $3C further for each motor.
fn i_at(address: u32) -> Option<u32> {
    let (motor, rest) = (address.checked_sub(0x2A)? / 0x3C, (address - 0x2A) % 0x3C);
    (motor < 8 && rest == 0).then_some(105 + 100 * motor)
}

const fn windows(controller: Controller) -> &'static [(u32, u32)] {
    match controller {
        Controller::Pmac => PMAC_WINDOWS,
        Controller::Turbo => TURBO_WINDOWS,
    }
}

const fn resident(windows: &[(u32, u32)]) -> u32 {
    let (mut sum, mut rest) = (0, windows);
    while let [(start, end), behind @ ..] = rest {
        sum += *end - *start;
        rest = behind;
    }
    sum
}

/// A stretch of the image that is not 0 at power-up.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Run {
    /// Where it starts.
    pub offset: u32,
    /// What it holds.
    pub bytes: Vec<u8>,
}

impl Run {
    /// All that is not 0 in an image, in stretches.
    pub fn pack(image: &[u8]) -> Vec<Self> {
        let stretches = Self::stretches(image);
        stretches.map(|(offset, bytes)| Self { offset, bytes: bytes.to_vec() }).collect()
    }

    /// The same without copying: the offset and the bytes of each stretch. A stretch begins and ends
    /// with a byte that is not 0, and has less than 16 zeros in a row.
    pub fn stretches(image: &[u8]) -> impl Iterator<Item = (u32, &[u8])> {
        const GAP: usize = 16;
        let mut at = 0;
        core::iter::from_fn(move || {
            let start = at + image.get(at..)?.iter().position(|&byte| byte != 0)?;
            let mut last = start;
            let behind = image.iter().enumerate().skip(start + 1);
            for (index, _) in behind.filter(|(_, byte)| **byte != 0) {
                if index - last > GAP {
                    break;
                }
                last = index;
            }
            at = last + 1;
            Some((start as u32, image.get(start..at)?))
        })
    }

    /// Puts stretches back into an image; what would fall outside is dropped.
    pub fn unpack(runs: &[Self], image: &mut [u8]) {
        for run in runs {
            for (byte, slot) in run.bytes.iter().zip(image.iter_mut().skip(run.offset as usize)) {
                *slot = *byte;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use alloc::vec;

    use super::*;

    #[test]
    fn regions_cover_the_image_without_gaps() {
        for controller in [Controller::Pmac, Controller::Turbo] {
            let layout = Layout::new(controller);
            let mut end = 0;
            for region in layout.regions() {
                assert_eq!(region.offset, end, "{}", region.name);
                assert_eq!(region.offset % 8, 0);
                end += region.size;
            }
            assert_eq!(end, layout.size);
        }
    }

    #[test]
    fn addresses_are_what_the_guide_says() {
        let pmac = Layout::new(Controller::Pmac);
        assert_eq!(pmac.place(Space::X, 0x1000), Place::P(0));
        assert_eq!(pmac.place(Space::Y, 0x13FF), Place::P(1023));
        assert_eq!(pmac.place(Space::X, 0x1400), Place::Q(0));
        assert_eq!(pmac.place(Space::Y, 0xBC22), Place::Definition(34));
        assert_eq!(pmac.place(Space::X, 0), Place::Word(pmac.words));
        assert_eq!(
            pmac.place(Space::Y, 0xFFFF),
            Place::Word(pmac.differing_definitions - WORD_SIZE)
        );
        assert!(matches!(pmac.place(Space::X, 0xBC22), Place::Word(_)));
        assert_eq!(pmac.place(Space::X, 0x2A), Place::I(105));
        assert_eq!(pmac.place(Space::X, 0x1CE), Place::I(805));
        assert!(matches!(pmac.place(Space::Y, 0x2A), Place::Word(_)));
        assert!(matches!(pmac.place(Space::X, 0x20A), Place::Word(_)));
        let turbo = Layout::new(Controller::Turbo);
        assert_eq!(turbo.place(Space::Y, 0x6001), Place::P(1));
        assert_eq!(turbo.place(Space::X, 0x9FFF), Place::Q(8191));
        assert_eq!(turbo.place(Space::Y, 0x4000), Place::Definition(0));
        assert_eq!(
            turbo.place(Space::Y, 0x7_FFFF),
            Place::Word(turbo.differing_definitions - WORD_SIZE)
        );
        assert_eq!(turbo.place(Space::Y, 0x5_0000), Place::Sparse);
        assert_eq!(turbo.place(Space::X, 0x100_0000), Place::Word(turbo.words));
    }

    #[test]
    fn coordinate_systems_share_the_q_variables() {
        let pmac = Layout::new(Controller::Pmac);
        assert_eq!(pmac.q_base_of(1), 0);
        assert_eq!(pmac.q_base_of(2), 0x80);
        assert_eq!(pmac.q_base_of(8), 0x380);
        assert_eq!(Layout::new(Controller::Turbo).q_base_of(2), 0x200);
    }

    #[test]
    fn images_survive_packing() {
        let mut image = vec![0_u8; 200];
        for (at, byte) in [(0, 1), (3, 2), (50, 3), (199, 4)] {
            image[at] = byte;
        }
        let runs = Run::pack(&image);
        assert_eq!(runs.len(), 3);
        assert_eq!(runs[0].bytes, [1, 0, 0, 2]);
        let mut copy = vec![0_u8; 200];
        Run::unpack(&runs, &mut copy);
        assert_eq!(copy, image);
        Run::unpack(&runs, &mut copy[..10]);
        assert_eq!(Run::pack(&[]), []);
    }
}
