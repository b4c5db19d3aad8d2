//! Numbers that passes and code generation were tuned with. They depend on processors, not on
//! programs: measure them again when processors change (`cargo bench -p plcc-benches --bench
//! kernels -- --without PASS`).

/// If a module has more instructions than this before the passes, truth values are not forwarded
/// but loaded again: its code does not fit the processor's cache of decoded instructions (some
/// 28 kB), so that bytes of code are what costs time. In shorter code it is the time from a store to
/// the next load of what was stored.
pub const RELOAD_BITS_FROM: usize = 8000;

/// For so many instructions behind a store, its byte is not loaded together with others, since the
/// processor cannot take such a load from the store. With 0, short programs of relay logic take 2.5
/// to 3.5 times as long; beyond 100 little changes.
pub const STORED_RECENTLY: u32 = 100;
