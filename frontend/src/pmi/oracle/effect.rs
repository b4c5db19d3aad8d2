//! What an assignment does apart from storing a value: reset-only variables, timers and flip-flops (PMI 2.2.4.5,
//! 3.1.9, 3.1.10).

use plcc_abi::{
    image::{read_i32, read_u8, write_i32, write_u8},
    pmi::{TimerKind, Type},
};

use crate::pmi::layout::Location;

/// What an assignment does apart from storing a value.
#[derive(Clone, Copy, Debug)]
pub(super) enum Effect {
    /// The variable is reset-only: bits become 0 where the value has a 0, and never become 1.
    Reset,
    /// A timer's control contact was assigned.
    Timer(Timer),
    /// A flip-flop's clock was assigned.
    Clock(FlipFlop),
    /// A flip-flop's preset or clear was assigned.
    Pin(FlipFlop),
}

/// A timer: the offsets of its parts in the image, and its delay in units of 20 ms.
#[derive(Clone, Copy, Debug)]
pub(super) struct Timer {
    pub(super) kind: TimerKind,
    pub(super) delayed: u32,
    pub(super) counter: u32,
    pub(super) preset: i32,
}

/// A flip-flop: the offsets of its pins and of its last clock in the image.
#[derive(Clone, Copy, Debug)]
pub(super) struct FlipFlop {
    pub(super) q: u32,
    pub(super) d: u32,
    pub(super) clock: u32,
    pub(super) preset: u32,
    pub(super) clear: u32,
    pub(super) last_clock: u32,
}

impl Effect {
    /// The variables that the effect writes apart from the one that is assigned.
    pub(super) fn written(self) -> Vec<Location> {
        match self {
            Self::Reset => vec![],
            Self::Timer(Timer { delayed, counter, .. }) => vec![
                Location { offset: delayed, ty: Type::Logical },
                Location { offset: counter, ty: Type::Long },
            ],
            Self::Clock(FlipFlop { q, .. }) | Self::Pin(FlipFlop { q, .. }) => {
                vec![Location { offset: q, ty: Type::Logical }]
            }
        }
    }
}

impl Timer {
    /// PMI 3.1.9.2 and 3.1.9.3: what the control contact does at once.
    pub(super) fn control(self, image: &mut [u8], on: bool) {
        let idle = read_i32(image, self.counter) == -1;
        let delayed = read_u8(image, self.delayed) != 0;
        match (self.kind, on) {
            (TimerKind::E, false) => {
                write_u8(image, self.delayed, 0);
                write_i32(image, self.counter, -1);
            }
            (TimerKind::E, true) if idle => write_i32(image, self.counter, self.preset),
            (TimerKind::D, true) => {
                write_u8(image, self.delayed, 1);
                write_i32(image, self.counter, -1);
            }
            (TimerKind::D, false) if idle && delayed => {
                write_i32(image, self.counter, self.preset);
            }
            _ => {}
        }
    }
}

impl FlipFlop {
    /// PMI 3.1.10.1: what an assignment to a pin does at once; `clocked` says that the pin is the
    /// clock.
    pub(super) fn act(self, image: &mut [u8], clocked: bool) {
        let on = |offset| read_u8(image, offset) != 0;
        let clock = on(self.clock);
        let rising = clocked && clock && !on(self.last_clock);
        let q = if on(self.clear) {
            false
        } else if on(self.preset) {
            true
        } else if rising {
            on(self.d)
        } else {
            on(self.q)
        };
        write_u8(image, self.q, u8::from(q));
        if clocked {
            write_u8(image, self.last_clock, u8::from(clock));
        }
    }
}
