//! Finds out where in compiled code a host function was called.
#![allow(unsafe_code)]

use std::ffi::{c_int, c_void};

/// The address in the code to which the host function that runs now returns, if that can be found out: that of
/// the innermost frame on the stack that belongs to the code.
pub(crate) fn return_address(code: [(usize, usize); 2]) -> Option<usize> {
    let mut search = FrameSearch { code, found: 0 };
    // SAFETY: the function calls `visit_frame` with the pointer that it is given, which lives until it
    // returns, once for each frame on this thread's stack. It stops at frames that it can't unwind.
    unsafe { _Unwind_Backtrace(visit_frame, (&raw mut search).cast()) };
    (search.found != 0).then_some(search.found)
}

/// A search for a frame of compiled code on the stack.
struct FrameSearch {
    /// Where the code begins and ends in memory; of each part of it.
    code: [(usize, usize); 2],
    /// The return address of the frame that was found; 0 as long as there is none.
    found: usize,
}

// The platform's unwinder, which the standard library links for panics (Itanium C++ ABI, Exception Handling).
// It passes a frame of a thread's stack as a pointer.
unsafe extern "C" {
    fn _Unwind_Backtrace(
        visit_frame: unsafe extern "C" fn(*mut c_void, *mut c_void) -> c_int,
        data: *mut c_void,
    ) -> c_int;
    fn _Unwind_GetIP(frame: *mut c_void) -> usize;
}

/// Looks at one frame: ends the search if it belongs to the code.
///
/// # Safety
/// Only `_Unwind_Backtrace` calls it, with a frame and the [`FrameSearch`] that it was given.
unsafe extern "C" fn visit_frame(frame: *mut c_void, search: *mut c_void) -> c_int {
    /// Go on with the next frame.
    const NO_REASON: c_int = 0;
    /// Go no further.
    const END_OF_STACK: c_int = 5;
    // SAFETY: the caller says so; nothing else uses the search meanwhile.
    let search = unsafe { &mut *search.cast::<FrameSearch>() };
    // SAFETY: the frame is that of the unwinder, which waits for this function.
    let address = unsafe { _Unwind_GetIP(frame) };
    // A return address lies after a call, so it may be the code's end and not its beginning.
    if search.code.iter().any(|&(start, end)| address > start && address <= end) {
        search.found = address;
        return END_OF_STACK;
    }
    NO_REASON
}
