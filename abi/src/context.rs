//! The call into compiled code.
//!
//! A compiled program is a sequence of functions of the type [`ChunkFn`]. Each is entered at one of
//! its labels and returns a [`RawOutcome`]: another label to go on with, or how the scan ended.
//! The loop that enters the function of the next label belongs to the host. So no function needs
//! to be long, and none calls another.

use core::ffi::c_void;

use crate::outcome::TrapCode;

/// All that compiled code can reach. It is passed by address and read, never written.
#[repr(C)]
#[derive(Debug)]
pub struct ScanContext {
    /// The process image.
    pub image: *mut u8,
    /// The only function that compiled code calls.
    pub host: HostCall,
    /// Belongs to the host.
    pub host_data: *mut c_void,
}

/// The type of [`ScanContext::host`]: context, the number of a [`HostFn`](crate::HostFn), four
/// arguments. Integers travel zero-extended, floating point as its bits.
///
/// It may be called only with the context that the compiled function was given.
pub type HostCall = unsafe extern "C" fn(*const ScanContext, u32, u64, u64, u64, u64) -> u64;

/// The type of every compiled function: context and label to a [`RawOutcome`].
///
/// It may be called only with a context whose image has the size that the code was made for and
/// whose host function and data belong together.
pub type ChunkFn = unsafe extern "C" fn(*const ScanContext, u32) -> u64;

/// A compiled function's result: a kind in the high 32 bits, a label or trap code in the low.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RawOutcome(pub u64);

impl RawOutcome {
    /// Kind: go on at the label.
    pub const GOTO: u32 = 0;
    /// Kind: the scan is over.
    pub const END: u32 = 1;
    /// Kind: the scan is over, the next starts at the label.
    pub const SUSPEND: u32 = 2;
    /// Kind: stopped with the trap code.
    pub const TRAP: u32 = 3;

    /// Puts the parts together.
    pub const fn new(kind: u32, payload: u32) -> Self {
        Self((kind as u64) << 32 | payload as u64)
    }

    /// The result for a trap.
    pub const fn trap(code: TrapCode) -> Self {
        Self::new(Self::TRAP, code as u32)
    }

    /// The high half.
    pub const fn kind(self) -> u32 {
        (self.0 >> 32) as u32
    }

    /// The low half.
    pub const fn payload(self) -> u32 {
        self.0 as u32
    }
}
