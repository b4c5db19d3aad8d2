//! The call into compiled code.
//!
//! A program is compiled in pieces, the chunks: functions of the type [`ChunkFn`]. Each is entered
//! at one of its labels and returns a [`RawOutcome`]: another label to go on with, or how the scan
//! ended. The loop that enters the function of the next label is that of the engine (or of
//! `plcc_scan` in C). So no function needs to be long, and none calls another.

use core::ffi::c_void;
use core::sync::atomic::AtomicU64;

use crate::outcome::{Trap, TrapCode, TrapSite};

/// All that compiled code can reach: what a caller passes to it by address. Compiled code reads it
/// and never writes it. `struct plcc_context` of `plcc.h` is the same in C.
#[repr(C)]
#[derive(Debug)]
pub struct ScanContext {
    /// The process image.
    pub image: *mut u8,
    /// The only function that compiled code calls.
    pub host: HostCall,
    /// For the host function, which is given this context; compiled code does not use it.
    pub host_data: *mut c_void,
    /// The [epoch](crate::deadline): the time as another thread stored it last. Code that jumps back
    /// looks at it.
    pub epoch: *const AtomicU64,
    /// The scan is late once the epoch has reached this. A host function may raise it.
    pub limit: AtomicU64,
}

/// The type of [`ScanContext::host`]. It takes the context, the number of a
/// [`HostFn`](crate::HostFn) and its arguments, and returns the result. Integers are zero-extended,
/// doubles are passed as their bits, and what the function's signature does not have is 0.
///
/// It may be called only with the context that the compiled function was given.
pub type HostCall = unsafe extern "C" fn(*const ScanContext, u32, u64, u64, u64, u64) -> u64;

/// The type of every compiled function. It takes the context and the number of the label to begin
/// at, and returns a [`RawOutcome`].
///
/// It may be called only with a context whose image has the size that the code was made for, whose host
/// function and data belong together, and whose epoch can be read as long as the call lasts.
pub type ChunkFn = unsafe extern "C" fn(*const ScanContext, u32) -> u64;

/// A compiled function's result:
///
/// | bits | hold |
/// | --- | --- |
/// | 32 to 39 | the kind: [`GOTO`](Self::GOTO), [`END`](Self::END), [`SUSPEND`](Self::SUSPEND) or [`TRAP`](Self::TRAP) |
/// | 40 to 63 | of a trap: 0, or 1 more than the number of its [`TrapSite`]; otherwise 0 |
/// | 0 to 31 | the payload: of a goto or a suspension the label; of a trap with a site the index with which an array was accessed; of a trap without one its code |
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RawOutcome(pub u64);

impl RawOutcome {
    /// Kind: the scan goes on at the label, perhaps in another function.
    pub const GOTO: u32 = 0;
    /// Kind: the scan is over.
    pub const END: u32 = 1;
    /// Kind: the scan is over; the task's next one starts at the label.
    pub const SUSPEND: u32 = 2;
    /// Kind: the program is stopped.
    pub const TRAP: u32 = 3;

    /// The number of trap sites that a program may have at most. This number itself is that of no
    /// site, and code may return it for one that does not exist.
    pub const MAX_TRAP_SITES: u32 = (1 << 24) - 2;

    /// An outcome of a kind, with the payload that belongs to it.
    pub const fn new(kind: u32, payload: u32) -> Self {
        Self((kind as u64) << 32 | payload as u64)
    }

    /// The result for a trap for which no statement is to blame.
    pub const fn trap(code: TrapCode) -> Self {
        Self::new(Self::TRAP, code as u32)
    }

    /// The high 32 bits of the result for a trap at the site with a number, which is at most
    /// [`MAX_TRAP_SITES`](Self::MAX_TRAP_SITES).
    pub const fn trap_kind(site: u32) -> u32 {
        Self::TRAP | site.wrapping_add(1) << 8
    }

    /// The trap that a result of the kind [`TRAP`](Self::TRAP) stands for, given the program's trap
    /// sites. A site or code that does not exist is [`TrapCode::Internal`].
    pub fn to_trap(self, sites: &[TrapSite]) -> Trap {
        let site = (self.0 >> 40) as usize;
        let trap = match site.checked_sub(1) {
            Some(site) => sites.get(site).map(|site| site.trap(self.payload())),
            None => TrapCode::from_number(self.payload()).map(Trap::new),
        };
        trap.unwrap_or(Trap::new(TrapCode::Internal))
    }

    /// The kind: [`GOTO`](Self::GOTO), [`END`](Self::END), [`SUSPEND`](Self::SUSPEND) or
    /// [`TRAP`](Self::TRAP).
    pub const fn kind(self) -> u32 {
        (self.0 >> 32) as u32 & 0xFF
    }

    /// The payload.
    pub const fn payload(self) -> u32 {
        self.0 as u32
    }
}
