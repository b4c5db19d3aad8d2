//! Three buffers by which a writer hands sets of values to a control: the control always takes a whole
//! set, the newest one, and neither side ever waits for the other.
//!
//! The writer fills the *back* buffer, the control reads the *front* one, and the *middle* one is between
//! them. Publishing exchanges back and middle, taking exchanges front and middle. Which buffer is which
//! stands in one word, the state, and each exchange changes it as a whole. So a process may be killed at
//! any moment: what it had not published is never seen, and the process that takes its place finds a consistent state.
//!
//! | bits of the state | hold |
//! | --- | --- |
//! | 0 and 1 | the number of the front buffer, 0 to 2 |
//! | 2 and 3 | the number of the middle buffer |
//! | 4 and 5 | the number of the back buffer |
//! | 6 | whether the middle buffer is newer than the front one |
//!
//! `model.rs` runs this file on the atomics of `loom`.

use super::atomics::{AtomicU64, Ordering};

/// The state before anything was published.
pub const INITIAL: u64 = 0b10_01_00;
/// The bit that says that the middle buffer is newer than the front one.
const FRESH: u64 = 1 << 6;
/// How often the control tries to exchange buffers. A try fails only if the writer publishes at the same moment.
/// After the last one the control keeps the buffer that it has.
const TRIES: u32 = 8;

/// What the control reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Taken {
    /// The number of the buffer.
    pub front: usize,
    /// Whether it was published after the one that was taken before.
    pub fresh: bool,
}

/// The numbers of front, middle and back buffer; `None` for a state that no correct writer leaves.
fn parts(state: u64) -> Option<[u64; 3]> {
    let [front, middle, back] = [state & 3, state >> 2 & 3, state >> 4 & 3];
    (1 << front | 1 << middle | 1 << back == 0b111).then_some([front, middle, back])
}

/// The number of the buffer that the writer fills next. `None` where the state is damaged.
pub fn back(state: &AtomicU64) -> Option<usize> {
    parts(state.load(Ordering::Acquire)).map(|[_, _, back]| back as usize)
}

/// Publishes the back buffer. `None` where the state is damaged.
pub fn publish(state: &AtomicU64) -> Option<()> {
    loop {
        let old = state.load(Ordering::Relaxed);
        let [front, middle, back] = parts(old)?;
        let new = front | back << 2 | middle << 4 | FRESH;
        if state.compare_exchange(old, new, Ordering::AcqRel, Ordering::Relaxed).is_ok() {
            return Some(());
        }
    }
}

/// Takes what was published last. `None` where the state is damaged, or where the writer publishes so
/// often that the exchange has failed several times.
pub fn take(state: &AtomicU64) -> Option<Taken> {
    for _ in 0..TRIES {
        let old = state.load(Ordering::Acquire);
        let [front, middle, back] = parts(old)?;
        if old & FRESH == 0 {
            return Some(Taken { front: front as usize, fresh: false });
        }
        let new = middle | front << 2 | back << 4;
        if state.compare_exchange(old, new, Ordering::AcqRel, Ordering::Relaxed).is_ok() {
            return Some(Taken { front: middle as usize, fresh: true });
        }
    }
    None
}
