//! Which synchronous assignments the last tick has carried out, for those who ask why a variable has its value.

use crate::machine::State;
use crate::system::MAX_SYNC;

/// The assignments. They do not belong to the state.
#[derive(Clone, Debug, Default)]
pub(crate) struct CarriedOut(Vec<Assigned>);

/// An assignment that was carried out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Assigned {
    /// The number of the M-variable.
    pub number: u32,
    /// The index of the statement's file.
    pub file: u32,
    /// The statement's line, from 1.
    pub line: u32,
}

impl CarriedOut {
    pub(crate) fn new() -> Self {
        Self(Vec::with_capacity(MAX_SYNC))
    }

    pub(crate) fn make_room(&mut self) {
        self.0.reserve(MAX_SYNC.saturating_sub(self.0.len()));
    }

    /// Notes one while there is room, since nothing is allocated in a tick.
    pub(crate) fn note(&mut self, number: u32, (file, line): (u32, u32)) {
        if self.0.len() < self.0.capacity() {
            self.0.push(Assigned { number, file, line });
        }
    }

    pub(crate) fn clear(&mut self) {
        self.0.clear();
    }
}

/// Two states are the same whatever has led to them.
impl PartialEq for CarriedOut {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl State {
    /// The synchronous assignments that the last tick has carried out, in their order; at most 1024 of them.
    pub fn carried_out(&self) -> &[Assigned] {
        &self.carried_out.0
    }
}
