//! The sequence counter by which readers of an image file see whole ticks.
//!
//! One writer changes words; any number of readers, in other processes too, copy them. The writer
//! makes the counter odd, writes the words, and makes the counter even again. A reader takes the
//! counter, copies the words and takes the counter again: if both are the same even number, nothing
//! was written meanwhile, else it tries again. The writer never waits for readers.
//!
//! All words are atomic and accessed with relaxed order, so a reader that reads while the writer
//! writes gets words of two ticks, which it throws away, and no undefined behaviour. Two fences make
//! the order: no word is written before the counter is odd, and none is read after the counter has
//! been looked at the second time. `model.rs` runs this file on the atomics of `loom`, which tries
//! all orders that the memory model allows.

use super::atomics::{AtomicU64, Ordering, fence};

/// Makes the counter odd: from now on readers discard what they copy.
///
/// `number` is what the counter holds; the writer knows it, since nobody else changes it. (It is not
/// loaded here, since loom would not try all orders then: of the accesses to an atomic it compares
/// only the last one with each store.) Gives the even number that [`end_write`] must set. A counter
/// that a dead writer has left odd becomes the next odd number.
pub fn begin_write(counter: &AtomicU64, number: u64) -> u64 {
    let odd = if number & 1 == 0 { number.wrapping_add(1) } else { number.wrapping_add(2) };
    counter.store(odd, Ordering::Relaxed);
    // The stores of the words, which follow, stay after the store of the counter.
    fence(Ordering::Release);
    odd.wrapping_add(1)
}

/// Makes the counter even: readers that begin now see all that was written.
pub fn end_write(counter: &AtomicU64, even: u64) {
    counter.store(even, Ordering::Release);
}

/// Writes a word.
pub fn write_word(word: &AtomicU64, value: u64) {
    word.store(value, Ordering::Relaxed);
}

/// Begins to read: gives the counter, or `None` while something is being written.
pub fn begin_read(counter: &AtomicU64) -> Option<u64> {
    let number = counter.load(Ordering::Acquire);
    (number & 1 == 0).then_some(number)
}

/// Reads a word.
pub fn read_word(word: &AtomicU64) -> u64 {
    word.load(Ordering::Relaxed)
}

/// Whether all that was read since [`begin_read`] gave `number` belongs together.
pub fn end_read(counter: &AtomicU64, number: u64) -> bool {
    // The loads of the words, which came before, stay before the load of the counter.
    fence(Ordering::Acquire);
    counter.load(Ordering::Relaxed) == number
}
