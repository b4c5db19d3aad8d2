//! What a PMAC keeps outside the process image.

use std::collections::VecDeque;
use std::sync::Arc;

use plcc_abi::ResumePoint;
use plcc_abi::pmac::{Layout, PlcOp, PmacTables, Run, SparseMemory};
use serde::{Deserialize, Serialize};

use super::forces::Forces;
use super::save::Origin;

/// All of it. Variables, the words of memory that have a place, the definitions of M-variables and
/// the timers are in the image.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct State {
    /// The number of the next servo cycle.
    pub(super) tick: u64,
    /// Servo cycles until the next real-time interrupt.
    pub(super) until_interrupt: u32,
    /// The interpreted PLC that ran last in background.
    pub(super) last_plc: u32,
    pub(super) plcs: Plcs,
    pub(super) plccs: Plcs,
    /// The commands that wait for the end of the background step.
    pub(super) queue: VecDeque<Queued>,
    /// Memory that has no place in the image.
    pub(super) sparse: SparseMemory,
    pub(super) saved: SavedImage,
    /// The forces in effect.
    pub(super) forces: Forces,
    /// The motors and coordinate systems, where they are simulated.
    pub(super) motion: Option<Box<plcc_motion::State>>,
}

/// What the last SAVE kept.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct SavedImage {
    /// The image's regions `p q i mdef`. There is room for them from the start, so that SAVE is
    /// nothing but copying.
    #[serde(with = "crate::checkpoint::bytes")]
    pub(super) image: Vec<u8>,
    /// Whether there was a SAVE.
    pub(super) exists: bool,
    /// The download that saved it, where that is another one, which ran before an online change.
    pub(super) origin: Option<Arc<Origin>>,
}

/// Whether a PLC runs when its turn comes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) enum Status {
    /// There is none, or it is empty.
    #[default]
    Absent,
    /// It is passed over.
    Disabled,
    /// It runs.
    Enabled,
    /// It is passed over until RESUME.
    Paused,
}

/// A PLC or PLCC.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(super) struct Plc {
    pub(super) status: Status,
    /// It was enabled since its last scan began, so the next one begins at the top.
    pub(super) restart: bool,
    pub(super) task: usize,
    /// Where its last scan was suspended; `None` when the next begins at the top.
    pub(super) resume: Option<ResumePoint>,
}

/// All PLCs, or all PLCCs, by number.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(super) struct Plcs {
    plcs: [Plc; 32],
    /// A bit for each that is enabled, so that the next in turn is found at once.
    #[serde(skip)]
    enabled: u32,
}

/// A command that waits for its turn.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(super) struct Queued {
    /// The index of the text, which says what is done.
    pub(super) text: u32,
    /// The motor that its PLC addressed; 0 for none.
    pub(super) motor: u32,
    /// The Q-variables of the coordinate system that its PLC addressed.
    pub(super) q_base: u32,
}

/// How many commands wait at most. In runs without background steps none is ever done; further ones
/// are lost then.
pub(super) const MAX_QUEUED: usize = 1 << 16;

impl Plcs {
    /// The enabled PLC of the lowest number from `from` on.
    pub(super) fn next(&self, from: u32) -> Option<u32> {
        let bits = self.enabled.checked_shr(from)?;
        (bits != 0).then(|| from + bits.trailing_zeros())
    }

    pub(super) fn get_mut(&mut self, number: u32) -> Option<&mut Plc> {
        self.plcs.get_mut(number as usize)
    }

    /// All of them.
    pub(super) fn all(&self) -> &[Plc] {
        &self.plcs
    }

    /// Puts a PLC in its place.
    fn put(&mut self, number: u32, plc: Plc) {
        if let Some(slot) = self.plcs.get_mut(number as usize) {
            *slot = plc;
            self.update_enabled_bit(number);
        }
    }

    pub(super) fn update_enabled_bit(&mut self, number: u32) {
        let runs = self.plcs.get(number as usize).is_some_and(|p| p.status == Status::Enabled);
        let bit = 1_u32.checked_shl(number).unwrap_or(0);
        self.enabled = if runs { self.enabled | bit } else { self.enabled & !bit };
    }

    /// Enables, disables, pauses or resumes the PLC of a number.
    pub(super) fn apply(&mut self, op: PlcOp, number: u32) {
        let Some(plc) = self.plcs.get_mut(number as usize) else {
            return;
        };
        match (op, plc.status) {
            (_, Status::Absent) => {}
            (PlcOp::Enable, _) => {
                plc.status = Status::Enabled;
                plc.restart = true;
            }
            (PlcOp::Disable, _) => plc.status = Status::Disabled,
            (PlcOp::Pause, Status::Enabled) => plc.status = Status::Paused,
            (PlcOp::Resume, Status::Paused) => plc.status = Status::Enabled,
            (PlcOp::Pause | PlcOp::Resume, _) => {}
        }
        self.update_enabled_bit(number);
    }

    /// Whether the same PLCs exist as in another state, with the same tasks.
    fn fits(&self, own: &Self) -> bool {
        let same = |(plc, own): (&Plc, &Plc)| {
            plc.task == own.task && (plc.status == Status::Absent) == (own.status == Status::Absent)
        };
        self.plcs.iter().zip(&own.plcs).all(same)
    }
}

impl State {
    /// The state after load.
    pub(super) fn new(tables: &PmacTables, layout: &Layout) -> Self {
        let (mut plcs, mut plccs) = (Plcs::default(), Plcs::default());
        for program in &tables.programs {
            let status = match (program.enabled, program.paused) {
                (true, _) => Status::Enabled,
                (false, true) => Status::Paused,
                (false, false) => Status::Disabled,
            };
            let task = program.task as usize;
            let plc = Plc { status, restart: false, task, resume: None };
            if program.compiled { &mut plccs } else { &mut plcs }.put(program.number, plc);
        }
        let mut image = vec![0; layout.reference_definitions as usize];
        if tables.save {
            Run::unpack(&tables.initial, &mut image);
        }
        Self {
            tick: 0,
            until_interrupt: 0,
            last_plc: 0,
            plcs,
            plccs,
            queue: VecDeque::with_capacity(64),
            sparse: tables.sparse.clone(),
            saved: SavedImage { image, exists: tables.save, origin: None },
            forces: Forces::default(),
            motion: None,
        }
    }

    /// Makes a state that was read usable in the place of another one, which is the program's own;
    /// `None` where it does not fit.
    pub(super) fn fitted(mut self, own: &Self, tables: &PmacTables) -> Option<Self> {
        let motion_fits = match (&mut self.motion, &own.motion) {
            (None, None) => true,
            (Some(read), Some(own)) => {
                read.make_room();
                read.fits(own, &tables.motion)
            }
            _ => false,
        };
        let fits = motion_fits
            && self.plcs.fits(&own.plcs)
            && self.plccs.fits(&own.plccs)
            && self.saved.image.len() == own.saved.image.len()
            && self.last_plc < 32
            && self.queue.len() <= MAX_QUEUED;
        for number in 0..32 {
            self.plcs.update_enabled_bit(number);
            self.plccs.update_enabled_bit(number);
        }
        // As much room as at power-up, so that scans need not allocate.
        self.queue.reserve(64);
        self.forces = self.forces.with_room()?;
        fits.then_some(self)
    }
}
