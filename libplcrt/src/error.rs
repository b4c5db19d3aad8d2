//! Errors and panics as C programs learn of them: a function that fails stores a text for its thread, which
//! `plcrt_error` gives.

use std::cell::RefCell;
use std::ffi::{CString, c_char};
use std::panic::{AssertUnwindSafe, catch_unwind};

thread_local! {
    /// The text of the last error on this thread.
    static ERROR: RefCell<CString> = RefCell::default();
}

/// A text for C, which ends with a zero byte; zero bytes within it become question marks.
pub(crate) fn c_text(text: &str) -> CString {
    CString::new(text.replace('\0', "?")).unwrap_or_default()
}

/// Stores the text of an error for `plcrt_error`, and gives `value`.
pub(crate) fn fail<T>(value: T, why: &str) -> T {
    // While a thread ends its storage may be gone; then nobody can ask for the error either.
    let _ = ERROR.try_with(|error| *error.borrow_mut() = c_text(why));
    value
}

/// Runs `body` and gives its value. If it fails or panics, the text of the error is stored and `failed` given.
pub(crate) fn guarded<T>(failed: T, body: impl FnOnce() -> Result<T, String>) -> T {
    match catch_unwind(AssertUnwindSafe(body)) {
        Ok(Ok(value)) => value,
        Ok(Err(why)) => fail(failed, &why),
        Err(payload) => {
            // A payload may panic when it is dropped.
            std::mem::forget(payload);
            fail(failed, "an error in libplcrt itself; please report it")
        }
    }
}

/// The text of the last error on this thread; empty if there was none. It is valid until the next one.
pub(crate) fn last() -> *const c_char {
    ERROR.try_with(|error| error.borrow().as_ptr()).unwrap_or(c"".as_ptr())
}
