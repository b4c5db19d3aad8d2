//! Limits that were found by measuring how fast code is. The right ones depend on processors:
//! measure again when processors change (`cargo bench -p plcc-benches --bench kernels -- --without
//! -NAME`, with the name of the pass or technique that uses the limit). A number that only bounds how long a pass
//! takes is where it is used.

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

/// What gates cost, in instructions (`gates`).
pub mod gates {
    /// The cost of an operation on two registers.
    pub const OPERATION: u32 = 2;
    /// The cost of an operation with a byte of the image.
    pub const OPERATION_WITH_LOAD: u32 = 3;
    /// The cost of a load.
    pub const LOAD: u32 = 4;
    /// The cost of a NOT.
    pub const NOT: u32 = 3;
}

/// How much is copied to skip a test (`thread-tests`).
pub mod thread_tests {
    /// How many blocks are searched at most for the value of a variable.
    pub const MAX_BLOCKS: usize = 12;
    /// A block where ways meet is copied if it has no more instructions than this.
    pub const MAX_COPIED: usize = 4;
    /// A block where more ways meet than this is not copied.
    pub const MAX_WAYS: usize = 8;
}

/// When bytes pay (`byte-bits`).
pub mod byte_bits {
    /// What a read of a bit saves, in instructions: a shift, and a load that becomes an operand.
    pub const SAVED_BY_READ: u32 = 2;
    /// What a write of a bit saves, in instructions: the load of the word, two masks and an OR. The shift may remain.
    pub const SAVED_BY_WRITE: u32 = 4;
    /// What it costs to unpack a group of eight bits, in instructions.
    pub const UNPACK_GROUP: u32 = 6;
    /// What it costs to pack a group of eight bits, in instructions.
    pub const PACK_GROUP: u32 = 4;
    /// How many instructions must be saved in one execution of the function: what is packed was stored just before, and
    /// what is unpacked is loaded soon after, so the processor waits for both. Of state machines, for instance,
    /// only one state's code is executed in each scan.
    pub const MIN_SAVED: f32 = 300.0;
    /// How often the branch of one state is taken, of a machine that has several.
    pub const STATE: f32 = 0.1;
    /// How often a cold block is executed when the block before it is.
    pub const COLD: f32 = 0.01;
}

/// When the tests of a condition are split (`thread-tests`).
pub mod split_tests {
    /// Rows of fewer conditions stay as they are.
    pub const MIN_TESTS: usize = 5;
}

/// How much is checked and copied (`speculate`).
pub mod speculate {
    /// A stretch may have at most this many checks.
    pub const MAX_CHECKS: usize = 8;
    /// If a statement has no more instructions than this from its first effect on, they belong to the stretch, and both
    /// copies contain them. Otherwise the stretch ends before them.
    pub const MAX_COPIED_FROM_EFFECT: usize = 2;
}

/// When a copy for integers pays (`speculate-variables`).
pub mod speculate_variables {
    /// The checked variables must be loaded at least this often on average: otherwise checking each costs more than it
    /// saves.
    pub const LOADS_PER_VARIABLE: usize = 2;
    /// The least number of loads for which the code is copied.
    pub const MIN_LOADS: usize = 24;
    /// For each operand that must still be checked in the copy, there must be at least this many operations that gain
    /// by integers: after a check that may fail, a result is not known to be an integer any more.
    pub const GAINING_PER_OTHER: usize = 8;
}

/// How far stored values are forwarded (`forward`).
pub mod forward {
    /// The forwarding window: a value is forwarded in this many statements after the one in which it
    /// was stored or loaded.
    pub const FORWARDING_WINDOW: u32 = 8;
    /// The same for numbers of up to 32 bits. (In NCT each operation counts as a statement.)
    pub const FORWARDING_WINDOW_OF_NUMBERS: u32 = 64;
}

/// When a row of statements pays (`rows`).
pub mod rows {
    /// Words with fewer lanes than this stay as they are.
    pub const MIN_LANES: usize = 4;
}

/// When selects pay (`if-convert`).
pub mod if_convert {
    /// The instructions of both ways may cost no more than this together, in cycles, roughly. It is
    /// about half of what a wrongly predicted branch costs.
    pub const MAX_COST: u32 = 8;
    /// The cost of a store, with the load of the value that it writes back if its way is not taken.
    pub const STORE_COST: u32 = 3;
    /// Ways that end with stores to the same place may cost this much more: only one of the two stores is left,
    /// and neither needs a load and a select.
    pub const SAVED_BY_COMMON_STORE: u32 = STORE_COST + 2;
}

/// When a table of jumps pays (`switches`).
pub mod switches {
    /// Fewer comparisons than this stay branches: the machine predicts a branch well, and a jump
    /// through a table badly.
    pub const MIN_TESTS: usize = 5;
    /// The same for doubles, whose conversion takes as long as some comparisons.
    pub const MIN_TESTS_OF_DOUBLES: usize = 8;
    /// The table of a switch has at most four entries for each comparison, and this many more.
    pub const MAX_EXTRA_ENTRIES: u64 = 8;
    /// If the least constant is below this, the table begins at 0, which saves a subtraction.
    pub const START_AT_ZERO_BELOW: u64 = 4;
}

/// When vectors pay (`vectors`).
pub mod vectors {
    /// How many consecutive selects become one choice: at least and at most.
    pub const MIN_CHAIN: usize = 8;
    /// Blocks with fewer stores than this have no rows.
    pub const MIN_STORES: usize = 4;
}

/// When a base register pays.
pub mod base_registers {
    /// The largest number of bases, since each takes a register.
    pub const MAX_BASES: usize = 2;
    /// The largest number of bases in a function with local bits, which seldom accesses the image itself.
    pub const MAX_BASES_WITH_LOCAL_BITS: usize = 3;
    /// The number of accesses from which on a base is worth its register and the instructions that
    /// compute it.
    pub const MIN_ACCESSES: usize = 24;
}

/// When checks are made in vectors.
pub mod variable_checks {
    /// The number of checks from which on they are made in vectors.
    pub const MIN_CHECKS: usize = 4;
}

/// When a constant is kept in a register (`double-constants`).
pub mod double_constants {
    /// The largest number of constants, of 16 registers for doubles.
    pub const MAX_CONSTANTS: usize = 6;
    /// The number of uses from which on a constant is worth its register and being loaded where the function is entered.
    pub const MIN_USES: u32 = 6;
}

/// How a function is entered.
pub mod entries {
    /// A function is entered by a jump table if for each label there are at most this many entries;
    /// otherwise a search takes less code.
    pub const MAX_ENTRIES_PER_LABEL: u32 = 8;
    /// A function with no more labels than this is always entered by a search: one comparison and a branch for
    /// two labels, two for four. A jump table takes eight instructions.
    pub const MAX_SEARCHED_LABELS: usize = 4;
}
