//! Generates PMAC programs to measure (kernels) in three forms, each with the same statements in C: logic
//! on bits and counters in L-variables of a PLCC, the same logic in M- and P-variables, and floating
//! point.

use std::fmt::Write as _;

use plcc_random::Rng;

use crate::INPUT_SEED;

/// Which kernel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// L-variables in a PLCC: 24-bit integers.
    Long,
    /// The same statements with M-variables for bits and words and P-variables for counters and
    /// flags.
    Memory,
    /// Floating point in P-variables.
    Float,
}

/// A kernel: its PMAC text and its C.
#[derive(Clone, Debug)]
pub struct Kernel {
    /// The download.
    pub pmac: String,
    /// The C function `scan`, with what it needs.
    pub c: String,
}

/// The address of the first Y word with the bits of inputs and outputs, 16 in each word.
pub const BITS: u32 = 0x07C0;
/// So many of these words, the first ones, change from scan to scan.
pub const INPUT_WORDS: u32 = 2;
/// The number of P-variables that change from scan to scan.
pub const INPUT_P: usize = 8;
const WORDS: u32 = 0x07D0;
const BIT_COUNT: usize = 96;
const COUNT: usize = 32;
/// The first of these are words, the others counters and flags.
pub const WORD_COUNT: usize = 8;

/// The variables of one kernel and their names in C.
struct Names {
    form: Form,
}

impl Names {
    fn bit(&self, index: usize) -> String {
        match self.form {
            Form::Long => format!("L{index}"),
            _ => format!("M{index}"),
        }
    }

    /// A word, or a counter or flag.
    fn number(&self, index: usize) -> String {
        match self.form {
            Form::Long => format!("L{}", 500 + index),
            _ if index < WORD_COUNT => format!("M{}", 500 + index),
            _ => format!("P{index}"),
        }
    }
}

fn c_bit(index: usize) -> String {
    format!("((y[{}] >> {}) & 1)", index / 16, index % 16)
}

fn c_set_bit(index: usize, value: &str) -> String {
    let (word, bit) = (index / 16, index % 16);
    format!("y[{word}] = (y[{word}] & ~(1 << {bit})) | ((({value}) & 1) << {bit});")
}

impl Kernel {
    /// A kernel of about `statements` statements. `Long` and `Memory` of one seed do the same.
    pub fn new(form: Form, statements: usize, seed: u64) -> Self {
        match form {
            Form::Float => float(statements, seed),
            _ => logic(form, statements, seed),
        }
    }
}

fn logic(kind: Form, statements: usize, seed: u64) -> Kernel {
    let names = Names { form: kind };
    let mut rng = Rng::new(seed);
    let mut pmac = String::from("I5=3\n");
    let arrow = if kind == Form::Long { 'L' } else { 'M' };
    for index in 0..BIT_COUNT {
        let (word, bit) = (BITS + index as u32 / 16, index % 16);
        let _ = writeln!(pmac, "{arrow}{index}->Y:${word:X},{bit},1");
    }
    for index in 0..COUNT {
        let _ = writeln!(pmac, "{arrow}{}->X:${:X},0,24,S", 500 + index, WORDS + index as u32);
    }
    pmac.push_str(if kind == Form::Long { "OPEN PLCC 1 CLEAR\n" } else { "OPEN PLC 1 CLEAR\n" });
    let mut c = String::from(
        "static int y[6], n[32];\n#define W(v) ((int)((unsigned)(v) << 8) >> 8)\nvoid scan(void) {\n",
    );
    let mut done = 0;
    while done < statements {
        let mut bit = || rng.below(BIT_COUNT);
        let (a, b, to) = (bit(), bit(), 32 + bit() % 64);
        let form = rng.below(6);
        let (least, most) = if form == 3 { (0, WORD_COUNT) } else { (WORD_COUNT, COUNT) };
        let mut number = || least + rng.below(most - least);
        let (x, z) = (number(), number());
        let (bit, n) = (|i| names.bit(i), |i| names.number(i));
        done += match form {
            0 => {
                let _ = writeln!(pmac, "{}={}&{}|{}", bit(to), bit(a), bit(b), bit(a + 1 - a % 2));
                let value = format!("({} & {}) | {}", c_bit(a), c_bit(b), c_bit(a + 1 - a % 2));
                let _ = writeln!(c, "{}", c_set_bit(to, &value));
                1
            }
            1 => {
                let _ = writeln!(
                    pmac,
                    "IF ({}=1 AND {}=0)\n{}={}+1\nENDIF",
                    bit(a),
                    bit(b),
                    n(x),
                    n(x)
                );
                let _ = writeln!(
                    c,
                    "if ({} == 1 && {} == 0) n[{x}] = W(n[{x}] + 1);",
                    c_bit(a),
                    c_bit(b)
                );
                2
            }
            2 => {
                let _ = writeln!(pmac, "IF ({}>1000)\n{}=0\nENDIF", n(x), n(x));
                let _ = writeln!(c, "if (n[{x}] > 1000) n[{x}] = 0;");
                2
            }
            3 => {
                let _ = writeln!(pmac, "{}=({}^{})&$FFFF|{}", n(x), n(x), n(z), bit(a));
                let _ = writeln!(c, "n[{x}] = ((n[{x}] ^ n[{z}]) & 0xFFFF) | {};", c_bit(a));
                1
            }
            4 => {
                let (flag, counter) = (n(x), n(z));
                let _ = writeln!(
                    pmac,
                    "IF ({}=1)\nIF ({flag}=0)\n{counter}={counter}+1\n{flag}=1\nENDIF\nELSE\n{flag}=0\nENDIF",
                    bit(a)
                );
                let _ = writeln!(
                    c,
                    "if ({} == 1) {{ if (n[{x}] == 0) {{ n[{z}] = W(n[{z}] + 1); n[{x}] = 1; }} }} else n[{x}] = 0;",
                    c_bit(a)
                );
                5
            }
            _ => {
                let _ = writeln!(pmac, "{}={}%100+{}*3", n(x), n(z), bit(b));
                // A remainder as the guide has it is never negative here: neither are counters.
                let _ = writeln!(c, "n[{x}] = W(n[{z}] % 100 + {} * 3);", c_bit(b));
                1
            }
        };
    }
    pmac.push_str("CLOSE\n");
    c.push_str("}\n");
    Kernel { pmac, c }
}

fn float(statements: usize, seed: u64) -> Kernel {
    let mut rng = Rng::new(seed);
    let mut pmac = String::from("I5=3\nOPEN PLC 1 CLEAR\n");
    let mut c = String::from(
        "#include <float.h>\n#include <math.h>\nstatic double p[64];
static inline double fin(double x) {
    if (x != x) return 0; if (x > DBL_MAX) return DBL_MAX; if (x < -DBL_MAX) return -DBL_MAX;
    return x + 0.0;
}
static inline double dv(double a, double b) {
    if (b == 0) return a > 0 ? DBL_MAX : a < 0 ? -DBL_MAX : 0;
    return a / b;
}
void scan(void) {\n",
    );
    let mut done = 0;
    while done < statements {
        let mut any = || rng.below(64);
        let (a, b, d, e) = (any(), any(), any(), any());
        let (to, input) = (INPUT_P + any() % (64 - INPUT_P), b % INPUT_P);
        // Nothing grows without bound, so that the numbers stay ordinary ones.
        let (count, line, c_line) = match rng.below(5) {
            0 => (
                1,
                format!("P{to}=P{a}*P{input}*0.002+P{d}/(P{input}+200)-0.5"),
                format!(
                    "p[{to}] = fin(p[{a}] * p[{input}] * 0.002 + dv(p[{d}], p[{input}] + 200) - 0.5);"
                ),
            ),
            1 => (
                1,
                format!("P{to}=(P{a}+P{b})*(P{d}-P{e})/(ABS(P{d})*4+ABS(P{e})*4+1)"),
                format!(
                    "p[{to}] = fin(dv((p[{a}] + p[{b}]) * (p[{d}] - p[{e}]), fabs(p[{d}]) * 4 + fabs(p[{e}]) * 4 + 1));"
                ),
            ),
            2 => (
                3,
                format!("IF (P{a}>P{b})\nP{to}=P{d}/2\nELSE\nP{to}=P{to}*0.5+P{e}*0.4\nENDIF"),
                format!(
                    "if (p[{a}] > p[{b}]) p[{to}] = fin(p[{d}] / 2); else p[{to}] = fin(p[{to}] * 0.5 + p[{e}] * 0.4);"
                ),
            ),
            3 => (
                1,
                format!("P{to}=SQRT(ABS(P{a}*P{b}))*0.5-P{d}*0.25"),
                format!(
                    "p[{to}] = fin(fin(sqrt(fin(fabs(p[{a}] * p[{b}])))) * 0.5 - p[{d}] * 0.25);"
                ),
            ),
            _ => (
                1,
                format!("P{to}=P{a}*0.25+P{b}*0.25-P{d}*0.4"),
                format!("p[{to}] = fin(p[{a}] * 0.25 + p[{b}] * 0.25 - p[{d}] * 0.4);"),
            ),
        };
        let _ = writeln!(pmac, "{line}");
        let _ = writeln!(c, "{c_line}");
        done += count;
    }
    pmac.push_str("CLOSE\n");
    c.push_str("}\n");
    Kernel { pmac, c }
}

/// The numbers that inputs take in turn.
pub fn patterns() -> Vec<u64> {
    let mut rng = Rng::new(INPUT_SEED);
    (0..64).map(|_| rng.bits()).collect()
}

impl Kernel {
    /// A C program that runs `argv[1]` scans, then prints nanoseconds a scan and the final state.
    pub fn c_program(&self, form: Form) -> String {
        let mut out = String::from("#include <stdio.h>\n#include <stdlib.h>\n#include <time.h>\n");
        out.push_str(&self.c);
        let (inputs, state) = match form {
            Form::Float => (
                format!(
                    "for (int i = 0; i < {INPUT_P}; i++) p[i] = (double)((x >> (i * 8)) & 255) - 100;"
                ),
                "for (int i = 0; i < 64; i++) printf(\"%a \", p[i]);",
            ),
            _ => (
                format!("for (int i = 0; i < {INPUT_WORDS}; i++) y[i] = (x >> (i * 16)) & 0xFFFF;"),
                "for (int i = 0; i < 6; i++) printf(\"%d \", y[i]);\nfor (int i = 0; i < 32; i++) printf(\"%d \", n[i]);",
            ),
        };
        let list: Vec<String> = patterns().iter().map(|p| format!("{p}u")).collect();
        let list = list.join("l,");
        let _ = write!(
            out,
            r#"
static const unsigned long patterns[] = {{ {list} }};
int main(int argc, char **argv) {{
    long scans = atol(argv[1]);
    struct timespec a, b;
    clock_gettime(CLOCK_MONOTONIC, &a);
    for (long k = 0; k < scans; k++) {{
        unsigned long x = patterns[k % 64];
        {inputs}
        scan();
    }}
    clock_gettime(CLOCK_MONOTONIC, &b);
    printf("%.3f\n", ((b.tv_sec - a.tv_sec) * 1e9 + (b.tv_nsec - a.tv_nsec)) / scans);
    {state}
    putchar('\n');
    return 0;
}}
"#
        );
        out
    }
}

#[cfg(test)]
mod tests {
    use super::{Form, Kernel};

    #[test]
    fn the_same_seed_gives_the_same_statements() {
        let long = Kernel::new(Form::Long, 40, 7);
        let memory = Kernel::new(Form::Memory, 40, 7);
        assert_eq!(long.c, memory.c);
        let after = |text: &str| text.lines().skip_while(|l| !l.starts_with("OPEN")).count();
        assert_eq!(after(&long.pmac), after(&memory.pmac));
    }
}
