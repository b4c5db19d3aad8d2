//! The functions that C programs call. `include/plcrt.h` is made of this file.
//!
//! A function that is given a null pointer where it needs something, or text that is not UTF-8, fails with
//! an error. A panic in this library does not cross into the caller: the function fails with an error, and from
//! then on every function with that control fails, except `plcrt_close`.
#![allow(unsafe_code)]

use std::ffi::{CStr, CString, c_char, c_void};
use std::path::Path;
use std::slice;

use crate::control::Control;
use crate::error::{self, c_text, fail, guarded};
use crate::found::{self, Found};

/// A control with its program. It may be used by one thread at a time.
pub struct Plcrt {
    control: Control,
    /// The variables that were found, by their numbers.
    found: Vec<Found>,
    /// The text that was given last.
    text: CString,
    /// The callback for each event, and the first argument that it is given.
    on_event: Option<(Callback, *mut c_void)>,
    /// Whether a panic has happened while the control was used.
    broken: bool,
}

/// What is called for each event; see [`plcrt_on_event`].
type Callback = extern "C" fn(user: *mut c_void, json: *const c_char);

/// The result of a function that can fail.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlcrtStatus {
    /// Done.
    PlcrtOk = 0,
    /// The control has stopped the program, now or before.
    PlcrtStopped = 1,
    /// Not done; plcrt_error says why.
    PlcrtFailed = -1,
}

/// For plcrt_find: the variable is looked up to read it.
pub const PLCRT_READ: u32 = 0;
/// For plcrt_find: the variable is looked up to set it.
pub const PLCRT_WRITE: u32 = 1;
/// For plcrt_find: an output is looked up to read what is on its physical lines.
pub const PLCRT_LINES: u32 = 2;

/// The text that a pointer points to.
///
/// # Errors
/// When the pointer is null or the text is not UTF-8.
///
/// # Safety
/// The pointer is null or points to a text that ends with a zero and does not change while the result
/// is used.
unsafe fn text<'a>(pointer: *const c_char) -> Result<&'a str, String> {
    if pointer.is_null() {
        return Err("a text is missing: the pointer is null".into());
    }
    // SAFETY: it is not null, and the caller promises the rest.
    let text = unsafe { CStr::from_ptr(pointer) };
    text.to_str().map_err(|_| "a text is not UTF-8".into())
}

/// Does something with a control; a panic makes the control unusable.
///
/// # Safety
/// The pointer is null or was given by [`plcrt_open`] or [`plcrt_load`] and not closed since, and no
/// other thread uses it meanwhile.
unsafe fn with<T: Copy>(
    control: *mut Plcrt,
    failed: T,
    body: impl FnOnce(&mut Plcrt) -> Result<T, String>,
) -> T {
    // SAFETY: the caller promises that the pointer is null or that of a control which nobody else uses.
    let Some(plcrt) = (unsafe { control.as_mut() }) else {
        return fail(failed, "the control is missing: the pointer is null");
    };
    if plcrt.broken {
        return fail(
            failed,
            "the control had an error in libplcrt itself and can't be used any more",
        );
    }
    // Stays set if the body panics.
    plcrt.broken = true;
    guarded(failed, || {
        let result = body(plcrt);
        plcrt.broken = false;
        result
    })
}

/// Puts a control that was loaded into memory of its own, for C to keep a pointer to it.
fn boxed(control: Result<Control, String>) -> Result<*mut Plcrt, String> {
    let (found, text) = (vec![], CString::default());
    let plcrt = Plcrt { control: control?, found, text, on_event: None, broken: false };
    Ok(Box::into_raw(Box::new(plcrt)))
}

/// The text of the last error on this thread; empty if there was none. It is valid until the next
/// function of this library that this thread calls.
#[unsafe(no_mangle)]
pub extern "C" fn plcrt_error() -> *const c_char {
    error::last()
}

/// A control at power-up with the program of a file that `plcc build` has written. `options` are those
/// of `plcrt` under "Control", separated by blanks (`--period 10`), or null. Null if it fails.
///
/// # Safety
/// Both pointers are null or point to texts that end with a zero.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn plcrt_open(path: *const c_char, options: *const c_char) -> *mut Plcrt {
    guarded(std::ptr::null_mut(), || {
        // SAFETY: as the caller promises.
        let (path, options) = unsafe { (text(path)?, optional(options)?) };
        boxed(Control::open(Path::new(path), options))
    })
}

/// The text that a pointer points to, empty if it is null.
///
/// # Errors
/// When the text is not UTF-8.
///
/// # Safety
/// As for [`text`].
unsafe fn optional<'a>(pointer: *const c_char) -> Result<&'a str, String> {
    // SAFETY: as the caller promises.
    if pointer.is_null() { Ok("") } else { unsafe { text(pointer) } }
}

/// The same as plcrt_open, with the `length` bytes of a file in memory, which are not needed
/// afterwards.
///
/// # Safety
/// `bytes` is null or points to `length` bytes; `options` is null or a text that ends with a zero.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn plcrt_load(
    bytes: *const u8,
    length: usize,
    options: *const c_char,
) -> *mut Plcrt {
    guarded(std::ptr::null_mut(), || {
        // SAFETY: as the caller promises.
        let (bytes, options) = unsafe { (memory(bytes, length)?, optional(options)?) };
        boxed(Control::load(bytes, options))
    })
}

/// The bytes that a pointer points to.
///
/// # Errors
/// When the pointer is null or there are more than any memory has.
///
/// # Safety
/// The pointer is null or points to so many bytes, which do not change while the result is used.
unsafe fn memory<'a>(bytes: *const u8, length: usize) -> Result<&'a [u8], String> {
    if bytes.is_null() || isize::try_from(length).is_err() {
        return Err("bytes are missing: the pointer is null, or the length is impossible".into());
    }
    // SAFETY: it is not null, the length is possible, and the caller promises the rest.
    Ok(unsafe { slice::from_raw_parts(bytes, length) })
}

/// Gives a control's memory back. Null does nothing.
///
/// # Safety
/// `control` is null or was given by plcrt_open or plcrt_load; it is not used afterwards.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn plcrt_close(control: *mut Plcrt) {
    if !control.is_null() {
        // SAFETY: it was made by `Box::into_raw`, and the caller does not use it any more.
        let control = unsafe { Box::from_raw(control) };
        guarded((), || {
            drop(control);
            Ok(())
        });
    }
}

/// Does one base tick: a PMI scan, an NCT slice of 20 ms, a PMAC servo cycle. The library does not look
/// at the clock: call it when a tick is due.
///
/// # Safety
/// `control` is null or open, and no other thread uses it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn plcrt_tick(control: *mut Plcrt) -> PlcrtStatus {
    // SAFETY: as the caller promises.
    unsafe {
        with(control, PlcrtStatus::PlcrtFailed, |plcrt| {
            let goes_on = plcrt.control.tick();
            if let Some((callback, user)) = plcrt.on_event {
                while let Some(event) = plcrt.control.next_event() {
                    callback(user, c_text(&event).as_ptr());
                }
            }
            Ok(if goes_on { PlcrtStatus::PlcrtOk } else { PlcrtStatus::PlcrtStopped })
        })
    }
}

/// Gives the lines of the outputs their safe values, as a stop does, before the end of who uses the control.
///
/// # Safety
/// As for plcrt_tick.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn plcrt_make_safe(control: *mut Plcrt) -> PlcrtStatus {
    // SAFETY: as the caller promises.
    unsafe {
        with(control, PlcrtStatus::PlcrtFailed, |plcrt| {
            plcrt.control.make_safe();
            Ok(PlcrtStatus::PlcrtOk)
        })
    }
}

/// How many ticks have been begun; 0 for null.
///
/// # Safety
/// As for plcrt_tick.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn plcrt_ticks(control: *mut Plcrt) -> u64 {
    // SAFETY: as the caller promises.
    unsafe { with(control, 0, |plcrt| Ok(plcrt.control.ticks())) }
}

/// The length of a tick in nanoseconds of the control's time; 0 for null. A PMAC program may change it.
///
/// # Safety
/// As for plcrt_tick.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn plcrt_tick_ns(control: *mut Plcrt) -> u64 {
    // SAFETY: as the caller promises.
    unsafe { with(control, 0, |plcrt| Ok(plcrt.control.tick_ns())) }
}

/// Finds a variable by its name as the control's users know it, and gives its number for plcrt_read
/// (`purpose` PLCRT_READ) or plcrt_write (PLCRT_WRITE); -1 if it fails. Each call gives a new number, so a
/// variable is best found once. With PLCRT_LINES plcrt_read reads what a machine gets of an output: safe values when the
/// program is stopped, while the variable keeps its own; of what has no lines the same as with PLCRT_READ.
///
/// # Safety
/// As for plcrt_tick; `name` is null or a text that ends with a zero.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn plcrt_find(control: *mut Plcrt, name: *const c_char, purpose: u32) -> i64 {
    // SAFETY: as the caller promises.
    unsafe {
        with(control, -1, |plcrt| {
            plcrt.found.push(Found::look_up(&plcrt.control, text(name)?, purpose)?);
            Ok(plcrt.found.len() as i64 - 1)
        })
    }
}

/// Writes the value of a variable that was found with PLCRT_READ or PLCRT_LINES to `value`; of an array the element
/// with this index, from 0. For a variable that is not an array `index` must be 0. Integers of a control
/// have at most 48 bits, so a double holds them exactly.
///
/// # Safety
/// As for plcrt_tick; `value` is null or points to a double.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn plcrt_read(
    control: *mut Plcrt,
    variable: i64,
    index: u32,
    value: *mut f64,
) -> PlcrtStatus {
    // SAFETY: as the caller promises.
    unsafe {
        with(control, PlcrtStatus::PlcrtFailed, |plcrt| {
            let number = found::element(&plcrt.control, &plcrt.found, variable, index)?;
            let value = value.as_mut().ok_or("there is no place for the value: it is null")?;
            *value = number;
            Ok(PlcrtStatus::PlcrtOk)
        })
    }
}

/// The number of elements of a variable found with PLCRT_READ or PLCRT_LINES: 1 if it is not an array, 0 if it fails.
///
/// # Safety
/// As for plcrt_tick.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn plcrt_elements(control: *mut Plcrt, variable: i64) -> u32 {
    // SAFETY: as the caller promises.
    unsafe { with(control, 0, |plcrt| found::elements(&plcrt.found, variable)) }
}

/// Sets a variable that was found with PLCRT_WRITE, as the machine or the operator would: the value
/// is converted as in an assignment of the program. It fails for a value that is not finite, and for
/// a fraction unless the control is a PMAC.
///
/// # Safety
/// As for plcrt_tick.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn plcrt_write(
    control: *mut Plcrt,
    variable: i64,
    value: f64,
) -> PlcrtStatus {
    // SAFETY: as the caller promises.
    unsafe {
        with(control, PlcrtStatus::PlcrtFailed, |plcrt| {
            let variable = found::settable(&plcrt.found, variable)?;
            if !value.is_finite() {
                return Err(format!("{value} is not a value of a variable"));
            }
            plcrt.control.set_number(variable, value)?;
            Ok(PlcrtStatus::PlcrtOk)
        })
    }
}

/// Writes the value of the variable `name` to `value`; `A[3]` names an element of an array.
///
/// # Safety
/// As for plcrt_find and plcrt_read.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn plcrt_get(
    control: *mut Plcrt,
    name: *const c_char,
    value: *mut f64,
) -> PlcrtStatus {
    // SAFETY: as the caller promises.
    unsafe {
        with(control, PlcrtStatus::PlcrtFailed, |plcrt| {
            let variable = plcrt.control.find(text(name)?)?;
            let number = plcrt.control.get(variable).number();
            let number = number.ok_or("it is an array; name one of its elements")?;
            let value = value.as_mut().ok_or("there is no place for the value: it is null")?;
            *value = number;
            Ok(PlcrtStatus::PlcrtOk)
        })
    }
}

/// Sets a variable by its name; see plcrt_write.
///
/// # Safety
/// As for plcrt_find.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn plcrt_set(
    control: *mut Plcrt,
    name: *const c_char,
    value: f64,
) -> PlcrtStatus {
    // SAFETY: as the caller promises.
    unsafe {
        with(control, PlcrtStatus::PlcrtFailed, |plcrt| {
            if !value.is_finite() {
                return Err(format!("{value} is not a value of a variable"));
            }
            plcrt.control.set(text(name)?, &value.to_string())?;
            Ok(PlcrtStatus::PlcrtOk)
        })
    }
}

/// The oldest event that was not taken yet, as one JSON object, valid until the next function with this
/// control; null if there is none. At most 65 536 events wait; then the oldest is lost.
///
/// # Safety
/// As for plcrt_tick.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn plcrt_next_event(control: *mut Plcrt) -> *const c_char {
    // SAFETY: as the caller promises.
    unsafe {
        with(control, std::ptr::null(), |plcrt| {
            let Some(event) = plcrt.control.next_event() else { return Ok(std::ptr::null()) };
            plcrt.text = c_text(&event);
            Ok(plcrt.text.as_ptr())
        })
    }
}

/// Says whether events are kept from now on; they are at first. Without them, plcrt_tick, plcrt_read and
/// plcrt_write neither allocate memory nor call the operating system once the first tick is done, so that a
/// thread with real-time priority may call them. Two things do: the tick in which the program is stopped,
/// and an error.
///
/// # Safety
/// As for plcrt_tick.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn plcrt_keep_events(control: *mut Plcrt, keep: bool) -> PlcrtStatus {
    // SAFETY: as the caller promises.
    unsafe {
        with(control, PlcrtStatus::PlcrtFailed, |plcrt| {
            plcrt.control.keep_events(keep);
            Ok(PlcrtStatus::PlcrtOk)
        })
    }
}

/// Why the program was stopped, for people: the control's code and a sentence. Null if it was not stopped.
/// The text is valid until the next function with this control.
///
/// # Safety
/// As for plcrt_tick.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn plcrt_stop_message(control: *mut Plcrt) -> *const c_char {
    // SAFETY: as the caller promises.
    unsafe {
        with(control, std::ptr::null(), |plcrt| {
            let Some(stop) = plcrt.control.stop() else { return Ok(std::ptr::null()) };
            plcrt.text = c_text(&format!("{}: {}", stop.code, stop.message));
            Ok(plcrt.text.as_ptr())
        })
    }
}

/// How many events were lost; 0 for null.
///
/// # Safety
/// As for plcrt_tick.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn plcrt_lost_events(control: *mut Plcrt) -> u64 {
    // SAFETY: as the caller promises.
    unsafe { with(control, 0, |plcrt| Ok(plcrt.control.lost_events())) }
}

/// From now on plcrt_tick calls `callback` for each event, and plcrt_next_event gives none. If
/// `callback` is null, that ends. `user` is passed on to it; `json` is one JSON object as
/// `plcrt --events` writes it, valid during the call. The callback must not use the control.
///
/// # Safety
/// As for plcrt_tick. The function may be called with `user` as long as the control is open.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn plcrt_on_event(
    control: *mut Plcrt,
    callback: Option<extern "C" fn(user: *mut c_void, json: *const c_char)>,
    user: *mut c_void,
) -> PlcrtStatus {
    // SAFETY: as the caller promises.
    unsafe {
        with(control, PlcrtStatus::PlcrtFailed, |plcrt| {
            plcrt.on_event = callback.map(|callback| (callback, user));
            Ok(PlcrtStatus::PlcrtOk)
        })
    }
}

/// The state as `plcrt --dump` writes it, one JSON object, valid until the next function with this
/// control: `state`, why the program was stopped, all variables. Null if it fails.
///
/// # Safety
/// As for plcrt_tick.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn plcrt_dump(control: *mut Plcrt) -> *const c_char {
    // SAFETY: as the caller promises.
    unsafe {
        with(control, std::ptr::null(), |plcrt| {
            plcrt.text = c_text(plcrt.control.dump()?.trim_end());
            Ok(plcrt.text.as_ptr())
        })
    }
}

/// Copies the data that survives power-off to `buffer` if it is at most `size` bytes long. Gives its
/// length in bytes, 0 where the program keeps none, -1 if it fails. `buffer` may be null to ask for the
/// length.
///
/// # Safety
/// As for plcrt_tick; `buffer` is null or points to `size` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn plcrt_retained(control: *mut Plcrt, buffer: *mut u8, size: usize) -> i64 {
    // SAFETY: as the caller promises.
    unsafe {
        with(control, -1, |plcrt| {
            let retained = plcrt.control.retained().unwrap_or_default();
            if !buffer.is_null() && retained.len() <= size {
                buffer.copy_from_nonoverlapping(retained.as_ptr(), retained.len());
            }
            Ok(retained.len() as i64)
        })
    }
}

/// Takes back the data that plcrt_retained gave, before the first tick.
///
/// # Safety
/// As for plcrt_tick; `bytes` is null or points to `length` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn plcrt_restore(
    control: *mut Plcrt,
    bytes: *const u8,
    length: usize,
) -> PlcrtStatus {
    // SAFETY: as the caller promises.
    unsafe {
        with(control, PlcrtStatus::PlcrtFailed, |plcrt| {
            plcrt.control.restore(memory(bytes, length)?)?;
            Ok(PlcrtStatus::PlcrtOk)
        })
    }
}
