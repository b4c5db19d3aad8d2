//! Timers and flip-flops, which the manual calls macros (PMI 3.1.9, 3.1.10): what time does to them, and
//! what an assignment from outside does at once. Program code does the same in its own assignments.

use plcc_abi::image::{read_i32, read_u8, write_i32, write_u8};
use plcc_abi::pmi::{FlipFlop, Timer, TimerKind};

/// What the counter of a timer holds while it does not run.
const IDLE: i32 = -1;

/// Counts a timer that runs down by `units` of 20 ms. At 0 its delayed contact changes: that of type E
/// becomes 1, that of type D becomes 0.
pub(super) fn count_down(image: &mut [u8], timer: &Timer, units: i32) {
    let count = read_i32(image, timer.counter);
    if count <= 0 || units == 0 {
        return;
    }
    let left = count.saturating_sub(units).max(0);
    write_i32(image, timer.counter, left);
    if left == 0 {
        write_u8(image, timer.delayed, u8::from(timer.kind == TimerKind::E));
    }
}

/// Starts or stops a timer after an assignment to its control contact.
pub(super) fn control(image: &mut [u8], timer: &Timer) {
    let on = read_u8(image, timer.control) != 0;
    let idle = read_i32(image, timer.counter) == IDLE;
    let delayed = read_u8(image, timer.delayed) != 0;
    let energised = timer.kind == TimerKind::D;
    if on == energised {
        // The delayed contact follows at once, without a delay.
        write_u8(image, timer.delayed, u8::from(on));
        write_i32(image, timer.counter, IDLE);
    } else if idle && (timer.kind == TimerKind::E || delayed) {
        write_i32(image, timer.counter, timer.preset);
    }
}

/// Sets a flip-flop's output after an assignment to the pin at `offset`.
pub(super) fn pin(image: &mut [u8], flipflop: &FlipFlop, offset: u32) {
    let on = |image: &[u8], pin: Option<u32>| pin.is_some_and(|pin| read_u8(image, pin) != 0);
    let clock = on(image, flipflop.clock);
    let clocked = flipflop.clock == Some(offset);
    let rising = clocked && clock && read_u8(image, flipflop.last_clock) == 0;
    let q = if on(image, flipflop.clear) {
        Some(false)
    } else if on(image, flipflop.preset) {
        Some(true)
    } else {
        rising.then(|| on(image, flipflop.d))
    };
    if let Some(q) = q {
        write_u8(image, flipflop.q, u8::from(q));
    }
    if clocked {
        write_u8(image, flipflop.last_clock, u8::from(clock));
    }
}
