//! gdb's interface for code that is made while a program runs ("JIT Compilation Interface" in gdb's
//! manual): a list of ELF files in memory that gdb reads. gdb finds the list and the function that says it
//! has changed by their names, so these two are not mangled, which Rust counts as unsafe. gdb looks for the
//! names among the symbols of the program: one that is stripped has to keep these two (`scripts/deb`).
#![allow(unsafe_code)]
#![allow(non_upper_case_globals, reason = "gdb's names")]

use std::hint::black_box;
use std::ptr;
use std::sync::atomic::{AtomicPtr, AtomicU32, Ordering};
use std::sync::{Mutex, PoisonError};

/// The value of [`Descriptor::action`] when an entry was added.
const REGISTER: u32 = 1;

/// An entry of the list, as gdb reads it (`struct jit_code_entry`).
#[repr(C)]
struct Entry {
    next: AtomicPtr<Entry>,
    previous: AtomicPtr<Entry>,
    file: AtomicPtr<u8>,
    length: u64,
}

/// What gdb looks at (`struct jit_descriptor`).
#[repr(C)]
struct Descriptor {
    version: u32,
    action: AtomicU32,
    /// The entry that was added.
    relevant: AtomicPtr<Entry>,
    first: AtomicPtr<Entry>,
}

// SAFETY: no other code that is linked with this crate has a symbol of this name;
// wasmtime's, which has, is not used.
#[unsafe(no_mangle)]
static __jit_debug_descriptor: Descriptor = Descriptor {
    version: 1,
    action: AtomicU32::new(0),
    relevant: AtomicPtr::new(ptr::null_mut()),
    first: AtomicPtr::new(ptr::null_mut()),
};

/// gdb has a breakpoint here, and reads the descriptor when it is reached.
// SAFETY: as above, for the name.
#[unsafe(no_mangle)]
#[inline(never)]
extern "C" fn __jit_debug_register_code() {
    // Keeps the compiler from leaving out the call of a function that does nothing, and has everything
    // stored before it.
    black_box(&raw const __jit_debug_descriptor);
}

/// The newest entry, with which the list begins.
static NEWEST: Mutex<Option<&'static Entry>> = Mutex::new(None);

/// Tells gdb of an ELF file, whose sections have the addresses of what they describe. The file stays in
/// memory until the process ends.
pub(super) fn register(file: Vec<u8>) {
    let file: &'static [u8] = file.leak();
    let mut newest = NEWEST.lock().unwrap_or_else(PoisonError::into_inner);
    let address = |entry: &'static Entry| (&raw const *entry).cast_mut();
    let entry: &'static Entry = Box::leak(Box::new(Entry {
        next: AtomicPtr::new(newest.map_or(ptr::null_mut(), address)),
        previous: AtomicPtr::new(ptr::null_mut()),
        file: AtomicPtr::new(file.as_ptr().cast_mut()),
        length: file.len() as u64,
    }));
    if let Some(next) = newest.replace(entry) {
        next.previous.store(address(entry), Ordering::Relaxed);
    }
    let descriptor = &__jit_debug_descriptor;
    descriptor.first.store(address(entry), Ordering::Relaxed);
    descriptor.relevant.store(address(entry), Ordering::Relaxed);
    descriptor.action.store(REGISTER, Ordering::Release);
    __jit_debug_register_code();
    descriptor.action.store(0, Ordering::Relaxed);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The list as gdb follows it: each entry is linked with the one that was registered before it.
    #[test]
    fn the_list_has_the_files_that_were_registered() {
        let newest = || *NEWEST.lock().unwrap_or_else(PoisonError::into_inner);
        let address = |entry: Option<&'static Entry>| entry.map_or(ptr::null(), |entry| entry);
        let mut last = newest();
        for length in 1..4 {
            register(vec![7; length]);
            let entry = newest();
            let Some(added) = entry else { continue };
            assert_eq!(added.length, length as u64);
            assert_eq!(added.next.load(Ordering::Relaxed).cast_const(), address(last));
            assert_eq!(
                __jit_debug_descriptor.first.load(Ordering::Relaxed).cast_const(),
                address(entry)
            );
            if let Some(last) = last {
                assert_eq!(last.previous.load(Ordering::Relaxed).cast_const(), address(entry));
            }
            last = entry;
        }
        assert!(last.is_some_and(|entry| entry.previous.load(Ordering::Relaxed).is_null()));
        assert_eq!(__jit_debug_descriptor.action.load(Ordering::Relaxed), 0);
    }
}
