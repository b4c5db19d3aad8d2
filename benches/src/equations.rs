//! Generates boolean equations as relay logic has them, in PMI and in C.
//!
//! An equation computes a relay from two to nine contacts. Most of these are relays of equations shortly
//! before it; some are inputs, and some are relays of later equations, whose values are from the scan
//! before. The C program keeps each bit in a byte.

use std::fmt::Write as _;

use plcc_random::Rng;

use crate::{INPUT_SEED, c_rows};

/// Inputs, eight to a port from port 0.
pub const INPUTS: usize = 256;
/// Patterns of the inputs; scan `n` sees pattern `n % PATTERNS`.
pub const PATTERNS: usize = 64;

/// A program of equations.
pub struct Equations {
    equations: Vec<Vec<Group>>,
}

/// Contacts that are joined by OR; the groups of an equation are joined by AND.
type Group = Vec<Contact>;

#[derive(Clone, Copy)]
struct Contact {
    source: Source,
    inverted: bool,
}

#[derive(Clone, Copy)]
enum Source {
    Input(usize),
    Relay(usize),
}

impl Equations {
    /// `count` equations, the same for the same seed.
    pub fn new(count: usize, seed: u64) -> Self {
        let mut rng = Rng::new(seed);
        let equations = (0..count).map(|i| equation(&mut rng, i, count)).collect();
        Self { equations }
    }

    /// The number of equations.
    pub fn len(&self) -> usize {
        self.equations.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.equations.is_empty()
    }

    /// The program in PMI.
    pub fn pmi(&self) -> String {
        let mut out = String::from("$INPUT\n");
        for i in 0..INPUTS {
            let _ = writeln!(out, "{} = {}/{}", name(Source::Input(i)), i / 8, i % 8);
        }
        out.push_str("$END\n");
        for (i, groups) in self.equations.iter().enumerate() {
            let _ = write!(out, "{} = ", name(Source::Relay(i)));
            write_groups(&mut out, groups, [" & ", " ! "], "/", name);
            out.push('\n');
        }
        out
    }

    /// The program in C: `scan` over `in` and `r`, one byte a bit.
    pub fn c(&self) -> String {
        let mut out = format!(
            "static unsigned char in[{INPUTS}];\nstatic unsigned char r[{}];\n\
             __attribute__((noinline)) void scan(void) {{\n",
            self.len()
        );
        for (i, groups) in self.equations.iter().enumerate() {
            let _ = write!(out, "    r[{i}] = ");
            write_groups(&mut out, groups, [" & ", " | "], "!", c_name);
            out.push_str(";\n");
        }
        out.push_str("}\n");
        out
    }

    /// The C with a `main` that takes a number of scans, runs them with changing inputs, and
    /// prints nanoseconds a scan and the relays' final states.
    pub fn c_program(&self) -> String {
        let mut out = String::from(
            "#include <stdio.h>\n#include <stdlib.h>\n#include <string.h>\n#include <time.h>\n",
        );
        out.push_str(&self.c());
        let patterns = c_rows(&patterns());
        let _ = write!(
            out,
            r#"
static const unsigned char patterns[{PATTERNS}][{INPUTS}] = {{ {patterns} }};
int main(int argc, char **argv) {{
    long scans = argc > 1 ? atol(argv[1]) : 1000;
    struct timespec a, b;
    clock_gettime(CLOCK_MONOTONIC, &a);
    for (long n = 0; n < scans; n++) {{
        memcpy(in, patterns[n % {PATTERNS}], {INPUTS});
        scan();
    }}
    clock_gettime(CLOCK_MONOTONIC, &b);
    printf("%.3f\n", ((b.tv_sec - a.tv_sec) * 1e9 + (b.tv_nsec - a.tv_nsec)) / scans);
    for (unsigned i = 0; i < sizeof r; i++) putchar('0' + r[i]);
    putchar('\n');
    return 0;
}}
"#
        );
        out
    }
}

/// The patterns of the inputs, one byte an input.
pub fn patterns() -> Vec<[u8; INPUTS]> {
    let mut rng = Rng::new(INPUT_SEED);
    (0..PATTERNS).map(|_| std::array::from_fn(|_| u8::from(rng.chance(50)))).collect()
}

fn equation(rng: &mut Rng, index: usize, count: usize) -> Vec<Group> {
    let groups = 2 + rng.below(3);
    (0..groups)
        .map(|_| (0..1 + rng.below(3)).map(|_| contact(rng, index, count)).collect())
        .collect()
}

fn contact(rng: &mut Rng, index: usize, count: usize) -> Contact {
    let source = match rng.below(10) {
        0..3 => Source::Input(rng.below(INPUTS)),
        3..8 => Source::Relay(index.saturating_sub(1 + rng.below(40)) % count),
        _ => Source::Relay(rng.below(count)),
    };
    Contact { source, inverted: rng.below(3) == 0 }
}

fn name(source: Source) -> String {
    match source {
        Source::Input(i) => format!("L{i}"),
        Source::Relay(i) => format!("R{i}"),
    }
}

fn c_name(source: Source) -> String {
    match source {
        Source::Input(i) => format!("in[{i}]"),
        Source::Relay(i) => format!("r[{i}]"),
    }
}

fn write_groups(
    out: &mut String,
    groups: &[Group],
    [row, side]: [&str; 2],
    not: &str,
    name: impl Fn(Source) -> String,
) {
    for (g, group) in groups.iter().enumerate() {
        out.push_str(if g > 0 { row } else { "" });
        let many = group.len() > 1;
        out.push_str(if many { "(" } else { "" });
        for (c, contact) in group.iter().enumerate() {
            out.push_str(if c > 0 { side } else { "" });
            out.push_str(if contact.inverted { not } else { "" });
            out.push_str(&name(contact.source));
        }
        out.push_str(if many { ")" } else { "" });
    }
}

#[cfg(test)]
mod tests {
    use super::Equations;

    #[test]
    fn the_same_seed_gives_the_same_program() {
        assert_eq!(Equations::new(50, 7).pmi(), Equations::new(50, 7).pmi());
        assert_ne!(Equations::new(50, 7).pmi(), Equations::new(50, 8).pmi());
    }
}
