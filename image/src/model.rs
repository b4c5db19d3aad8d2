//! Checks the sequence counter and the three buffers with loom, which tries all orders of loads and stores that the
//! memory model allows. For that `sequence.rs` and `triple_buffer.rs` are compiled once more here, with loom's
//! atomics.

/// The atomics that the two included files use here.
mod atomics {
    pub(crate) use loom::sync::atomic::{AtomicU64, Ordering, fence};
}

#[allow(clippy::duplicate_mod, reason = "it uses other atomics here")]
#[path = "sequence.rs"]
#[allow(dead_code, unreachable_pub, reason = "each check uses a part of it")]
mod sequence;

#[allow(clippy::duplicate_mod, reason = "it uses other atomics here")]
#[path = "triple_buffer.rs"]
#[allow(dead_code, unreachable_pub, reason = "each check uses a part of it")]
mod triple_buffer;

use std::sync::Arc;

use atomics::AtomicU64;
use sequence::{begin_read, begin_write, end_read, end_write, read_word, write_word};

/// Two writes of two words beside one reader: what the reader accepts belongs to one write.
#[test]
fn a_reader_accepts_whole_ticks_only() {
    // How often the reader accepted the words of tick 0, 1 and 2, over all orders. Each must have been
    // accepted at least once; a reader that never accepts anything would pass the test otherwise.
    let accepted = Arc::new([(); 3].map(|()| std::sync::atomic::AtomicU64::new(0)));
    let seen = Arc::clone(&accepted);
    loom::model(move || {
        let shared = loom::sync::Arc::new([0, 0, 0].map(AtomicU64::new));
        let writer = {
            let shared = shared.clone();
            loom::thread::spawn(move || {
                let [counter, a, b] = &*shared;
                let mut number = 0;
                for tick in 1..=2 {
                    number = begin_write(counter, number);
                    write_word(a, tick);
                    write_word(b, tick);
                    end_write(counter, number);
                }
            })
        };
        let [counter, a, b] = &*shared;
        if let Some(number) = begin_read(counter) {
            let (a, b) = (read_word(a), read_word(b));
            if end_read(counter, number) {
                assert_eq!(a, b, "words of two ticks");
                assert_eq!(number, 2 * a, "the words of another tick than the counter's");
                seen[a as usize].fetch_add(1, std::sync::atomic::Ordering::Relaxed);
            }
        }
        writer.join().unwrap();
    });
    for (tick, count) in accepted.iter().enumerate() {
        assert!(count.load(std::sync::atomic::Ordering::Relaxed) > 0, "tick {tick}");
    }
}

/// The same without the fence after the counter's first store: loom finds the order in which a
/// reader accepts words of two ticks, so that the test above can fail.
#[test]
fn without_its_fence_the_counter_protects_nothing() {
    let failed = std::panic::catch_unwind(|| {
        loom::model(|| {
            let shared = loom::sync::Arc::new([0, 0, 0].map(AtomicU64::new));
            let writer = {
                let shared = shared.clone();
                loom::thread::spawn(move || {
                    let [counter, a, b] = &*shared;
                    counter.store(1, atomics::Ordering::Relaxed);
                    write_word(a, 1);
                    write_word(b, 1);
                    end_write(counter, 2);
                })
            };
            let [counter, a, b] = &*shared;
            if let Some(number) = begin_read(counter) {
                let (a, b) = (read_word(a), read_word(b));
                if end_read(counter, number) {
                    assert_eq!(a, b, "words of two ticks");
                }
            }
            writer.join().unwrap();
        });
    });
    assert!(failed.is_err());
}

/// Two sets of two values beside a control that takes twice: what it takes belongs to one set, and it never
/// takes an older one than before.
#[test]
fn the_control_takes_whole_sets_of_inputs_only() {
    let taken = Arc::new([(); 3].map(|()| std::sync::atomic::AtomicU64::new(0)));
    let seen = Arc::clone(&taken);
    loom::model(move || {
        let state = loom::sync::Arc::new(AtomicU64::new(triple_buffer::INITIAL));
        let buffers = loom::sync::Arc::new([0; 6].map(AtomicU64::new));
        let writer = {
            let (state, buffers) = (state.clone(), buffers.clone());
            loom::thread::spawn(move || {
                for set in 1..=2 {
                    let back = triple_buffer::back(&state).unwrap();
                    write_word(&buffers[back * 2], set);
                    write_word(&buffers[back * 2 + 1], set);
                    triple_buffer::publish(&state).unwrap();
                }
            })
        };
        let mut last = 0;
        for _ in 0..2 {
            // loom compares only the last access to an atomic with each further one, and would not take
            // between the two sets otherwise.
            loom::thread::yield_now();
            let Some(taken) = triple_buffer::take(&state) else { continue };
            let a = read_word(&buffers[taken.front * 2]);
            let b = read_word(&buffers[taken.front * 2 + 1]);
            assert_eq!(a, b, "values of two sets");
            assert!(a >= last, "an older set");
            assert!(a > last || !taken.fresh, "a set that was taken before is not fresh");
            last = a;
            seen[a as usize].fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        }
        writer.join().unwrap();
    });
    for (set, count) in taken.iter().enumerate() {
        assert!(count.load(std::sync::atomic::Ordering::Relaxed) > 0, "set {set}");
    }
}
