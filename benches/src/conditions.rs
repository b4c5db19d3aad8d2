//! Generates conditions as NCT programs have them, `(I… A Y…) U… E D… Z` (if the inputs hold, switch a
//! bit on, else off), in NCT's language and in C.
//!
//! Each condition switches a bit of its own, as most programs do: outputs first, then flags. Or, with
//! `again`, several conditions switch the same output; then a compiler need not compute what is
//! overwritten before anything reads it.

use std::fmt::Write as _;

use plcc_random::Rng;

use crate::{INPUT_SEED, c_rows};

/// Bits of an image: a hundred bytes.
pub const BITS: usize = 800;
/// Patterns of the inputs; scan `n` sees pattern `n % PATTERNS`.
pub const PATTERNS: usize = 64;

/// How the C keeps bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layout {
    /// A byte for each bit.
    Bytes,
    /// Eight bits to a byte, as the control has them.
    Packed,
}

/// The first byte of F whose bits are switched; those before have a meaning for the control.
pub const FIRST_FLAG: usize = 10;

/// A condition: the input and the output that it looks at, and the bit that it switches.
struct Condition {
    input: usize,
    output: usize,
    target: usize,
}

/// A program of conditions.
pub struct Conditions {
    all: Vec<Condition>,
}

impl Conditions {
    /// Makes `count` conditions, the same for the same seed. With `again` they switch random outputs,
    /// else each one its own bit.
    pub fn new(count: usize, seed: u64, again: bool) -> Self {
        let mut rng = Rng::new(seed);
        let condition = |n| Condition {
            // Every input is used, so that their bytes are adjacent in the image.
            input: if n < BITS { n } else { rng.below(BITS) },
            output: rng.below(BITS),
            target: if again { rng.below(BITS) } else { n },
        };
        Self { all: (0..count).map(condition).collect() }
    }

    /// The number of bits that conditions can switch.
    pub fn states(&self) -> usize {
        self.all.iter().map(|condition| condition.target + 1).max().unwrap_or(0)
    }

    /// The program in NCT's language, all of it in `:001`.
    pub fn nct(&self) -> String {
        let mut out = String::from(":001\n");
        for Condition { input, output, target } in &self.all {
            let [input, output] = [input, output].map(|bit| format!("{:02}{}", bit / 8, bit % 8));
            let target = match target.checked_sub(BITS) {
                None => format!("{:02}{}", target / 8, target % 8),
                Some(flag) => format!("F{:03}{}", FIRST_FLAG + flag / 8, flag % 8),
            };
            let _ = writeln!(out, "(I{input}AY{output})U{target}ED{target}Z");
        }
        out + "J1\n:000J0\n"
    }

    /// The program in C with a `main` that takes a number of scans, runs them with changing
    /// inputs, and prints nanoseconds a scan and the outputs' final states.
    pub fn c(&self, layout: Layout) -> String {
        let part = if layout == Layout::Bytes { 1 } else { 8 };
        let (size, states) = (BITS / part, self.states().max(BITS).div_ceil(part));
        let rows = match layout {
            Layout::Bytes => c_rows(&patterns()),
            Layout::Packed => c_rows(&patterns().map(|row| packed(&row))),
        };
        let mut out = format!(
            "#include <stdio.h>\n#include <stdlib.h>\n#include <string.h>\n#include <time.h>\n\
             static unsigned char in[{size}], y[{states}];\n\
             static const unsigned char patterns[{PATTERNS}][{size}] = {{ {rows} }};\n\
             __attribute__((noinline)) void scan(void) {{\n"
        );
        for Condition { input, output, target } in &self.all {
            let _ = match layout {
                Layout::Bytes => writeln!(out, "    y[{target}] = in[{input}] & y[{output}];"),
                Layout::Packed => writeln!(
                    out,
                    "    if ((in[{}] & {}) && (y[{}] & {})) y[{}] |= {}; else y[{}] &= ~{};",
                    input / 8,
                    1 << (input % 8),
                    output / 8,
                    1 << (output % 8),
                    target / 8,
                    1 << (target % 8),
                    target / 8,
                    1 << (target % 8),
                ),
            };
        }
        let get = match layout {
            Layout::Bytes => "y[i]",
            Layout::Packed => "(y[i / 8] >> (i % 8) & 1)",
        };
        let (count, set_all) = (self.states(), if part == 1 { 1 } else { 255 });
        let _ = write!(
            out,
            r#"}}
int main(int argc, char **argv) {{
    long scans = argc > 1 ? atol(argv[1]) : 1000;
    memset(y, {set_all}, {size});
    struct timespec a, b;
    clock_gettime(CLOCK_MONOTONIC, &a);
    for (long n = 0; n < scans; n++) {{
        memcpy(in, patterns[n % {PATTERNS}], sizeof in);
        scan();
    }}
    clock_gettime(CLOCK_MONOTONIC, &b);
    printf("%.3f\n", ((b.tv_sec - a.tv_sec) * 1e9 + (b.tv_nsec - a.tv_nsec)) / scans);
    for (int i = 0; i < {count}; i++) putchar('0' + {get});
    putchar('\n');
    return 0;
}}
"#
        );
        out
    }
}

/// The patterns of the inputs, one byte an input.
pub fn patterns() -> [[u8; BITS]; PATTERNS] {
    let mut rng = Rng::new(INPUT_SEED);
    std::array::from_fn(|_| std::array::from_fn(|_| u8::from(rng.chance(50))))
}

/// Bits eight to a byte, the first in the lowest place.
fn packed(bits: &[u8; BITS]) -> [u8; BITS / 8] {
    std::array::from_fn(|byte| (0..8).map(|bit| bits[byte * 8 + bit] << bit).sum())
}
