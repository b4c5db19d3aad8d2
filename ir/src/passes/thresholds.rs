//! Limits that were found by measuring how fast code is. The right ones depend on processors:
//! measure again when processors change (`cargo bench -p plcc-benches --bench kernels -- --without
//! -NAME`, with the name of the pass or technique that uses the limit).

/// If a module has more instructions than this before the passes, truth values are not forwarded
/// but loaded again (`reload-bits`), which makes code shorter. The code of such a module does not fit
/// the processor's cache of decoded instructions (some 28 kB), so its speed depends on its length.
/// Shorter code would have to wait for the loads, since what they load has just been stored.
pub const RELOAD_BITS_FROM: usize = 8000;

/// In this many instructions after a store, code generation does not load the stored byte as a part of
/// 32 bits (`wide-bits`), since the processor can't take such a load from the store. With 0, short
/// programs of relay logic take 2.5 to 3.5 times as long; beyond 100 little changes.
pub const STORED_RECENTLY: u32 = 100;

/// If all passes may run and a module has fewer instructions than this after them, truth values are
/// computed in 8 bits, not in 32 (`wide-bits`). With 32 bits loads are parts of operations. That makes
/// code shorter, which does not pay where the processor holds all of it decoded, and each result later,
/// since an operation then waits for its load. On an AMD EPYC of 2024 programs of 200 relay equations
/// take 5 to 10 % longer with 32 bits, and those of 500 take 10 to 25 % less.
pub const WIDE_BITS_FROM: usize = 3000;

/// If a module has at least as many instructions as this before the passes, bits of words become bytes
/// where that saves instructions (`byte-bits`). In a shorter one the bytes that are packed at the end have just been
/// stored, and the processor has a load of eight of them wait until they are all in its cache. On an AMD EPYC of
/// 2024 PLCCs of 200 to 400 equations take 0.3 to 0.5 times as long with bytes; touch panels, rows of copies and
/// shift registers, which are shorter than this, take 1.3 to 2.3 times as long.
pub const UNPACK_BITS_FROM: usize = 6000;

/// If a module has fewer instructions than this before the passes, it counts as short, and bits of
/// words are collected (`packed-bits`). In a long one so many truth values would have to be kept until
/// their word is stored that the code becomes longer, and the processor finds enough to do while a
/// statement waits for another.
pub const LONG_FROM: usize = 20_000;

/// How many instructions it takes to shift a 1 by a number that several tests use (`decoders`), with the check that the
/// distance is less than the width.
pub const DECODER_COST: u32 = 6;

/// How many more it takes if the number is a double, which is converted to an integer and back, and compared.
pub const DOUBLE_DECODER_COST: u32 = 5;

/// How many instructions a test of the shifted 1 takes (`decoders`).
pub const DECODER_TEST_COST: u32 = 2;

/// How many instructions a comparison of an integer with a number takes.
pub const COMPARISON_COST: u32 = 2;

/// How many instructions a comparison of a double with a number takes, one of which finds whether it is NaN.
pub const DOUBLE_COMPARISON_COST: u32 = 4;

/// How many instructions a comparison of a double's bits with those of a number takes, which have to be in a register.
pub const BITS_COMPARISON_COST: u32 = 3;
