//! The queue of frames from the thread that runs the ticks to the one that writes.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

use plcc_runtime::Executive;
use rtrb::{Consumer, Producer};

use crate::file::FrameKind;

/// The queue has room for two checkpoints and for this many bytes more.
const QUEUE_ROOM: usize = 1 << 20;

/// How long the queue must be for a program, in bytes.
pub(crate) fn queue_length(executive: &dyn Executive) -> usize {
    let mut state = vec![];
    executive.state_into(&mut state);
    QUEUE_ROOM + 2 * (executive.image().len() + state.len())
}

/// The scan's end of a queue that takes the place of the run's one with an online change, since the new
/// program's checkpoints have no room in that. All its memory is there beforehand.
#[derive(Debug)]
pub struct LargerQueue {
    pub(crate) frames: Producer<u8>,
    pub(crate) in_use: Arc<AtomicBool>,
}

impl LargerQueue {
    /// Exchanges the queue that a recorder fills for this one, if this is larger. Nothing is allocated or
    /// freed: the former queue is in this value afterwards.
    pub(crate) fn put_in_use(&mut self, queue: &mut Producer<u8>) {
        if self.frames.buffer().capacity() > queue.buffer().capacity() {
            std::mem::swap(&mut self.frames, queue);
            // The writing thread goes on with this queue when it has taken all from the former one.
            self.in_use.store(true, Ordering::Release);
        }
    }
}

/// The writing thread's end of such a queue, until it is in use.
#[derive(Debug)]
pub(crate) struct NextQueue {
    pub(crate) frames: Consumer<u8>,
    pub(crate) in_use: Arc<AtomicBool>,
}

/// The queues that were made for online changes. Only the threads that prepare and that write take the lock.
pub(crate) type NextQueues = Arc<Mutex<Vec<NextQueue>>>;

/// The length of what stands before each frame in the queue: its kind, its length and the tick.
pub(crate) const FRAME_HEADER: usize = 13;

/// What stands before a frame in the queue.
pub(crate) fn frame_header(kind: FrameKind, length: usize, tick: u64) -> [u8; FRAME_HEADER] {
    let [a, b, c, d, ..] = (length as u64).to_le_bytes();
    let [e, f, g, h, i, j, k, l] = tick.to_le_bytes();
    [kind as u8, a, b, c, d, e, f, g, h, i, j, k, l]
}

/// The kind, the length in bytes and the tick of a frame; `None` if `bytes` do not begin with a whole header.
pub(crate) fn read_frame_header(bytes: &[u8]) -> Option<(FrameKind, usize, u64)> {
    let (kind, rest) = bytes.split_first()?;
    let (length, rest) = rest.split_first_chunk::<4>()?;
    let tick = rest.first_chunk::<8>()?;
    let kinds = [FrameKind::Tick, FrameKind::Checkpoint, FrameKind::Gap, FrameKind::End];
    let kind = kinds.into_iter().find(|known| *known as u8 == *kind)?;
    Some((kind, u32::from_le_bytes(*length) as usize, u64::from_le_bytes(*tick)))
}

/// Writes to all memory of a queue once, so that the operating system maps it now and not during a tick.
pub(crate) fn touch(queue: &mut Producer<u8>, frames: &mut Consumer<u8>) {
    while let Ok(()) = queue.push(0) {}
    while frames.pop().is_ok() {}
}
