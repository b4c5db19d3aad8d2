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

/// If all passes may run and a module has fewer instructions than this behind them, truth values are
/// computed in 8 bits: shorter code does not pay where the processor holds all of it decoded, and a
/// load that is part of an operation makes the chain of operations longer. On an AMD EPYC of 2024
/// programs of 200 relay equations take 5 to 10 % longer with 32 bits, and those of 500 take 10 to
/// 25 % less.
pub const WIDE_BITS_FROM: usize = 3000;
