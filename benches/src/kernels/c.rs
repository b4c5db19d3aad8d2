//! Prints kernels in C, in every layout of bits and style of logic that somebody might choose, as a
//! program that measures all of them.

use std::fmt::Write as _;

use super::{Expr, Inputs, Kernel, Op, PATTERNS, Stmt, WordType};

/// How the C keeps bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Bits {
    /// A byte for each.
    Bytes,
    /// 32 in a word.
    Words32,
    /// 24 in a word of 32 bits, as a PMAC has them.
    Words24,
}

/// How the C combines truth values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Logic {
    /// By `&`, `|` and `^`; both operands are computed.
    Bitwise,
    /// By `&&`, `||` and `!`.
    ShortCircuit,
}

/// A way to write a kernel in C.
#[derive(Clone, Copy, Debug)]
pub struct Variant {
    bits: Bits,
    logic: Logic,
}

impl Variant {
    /// The variants in which it makes sense to write a kernel.
    pub fn all(kernel: &Kernel) -> Vec<Self> {
        let mut layouts = vec![Bits::Bytes];
        if kernel.bits > 0 {
            layouts.push(Bits::Words32);
            if kernel.language.is_pmac() {
                layouts.push(Bits::Words24);
            }
        }
        let logics: &[Logic] = match kernel.bits {
            0 => &[Logic::Bitwise],
            _ => &[Logic::Bitwise, Logic::ShortCircuit],
        };
        let pair = |bits| logics.iter().map(move |&logic| Self { bits, logic });
        layouts.into_iter().flat_map(pair).collect()
    }

    /// A short name for tables.
    pub fn name(self) -> &'static str {
        match (self.bits, self.logic) {
            (Bits::Bytes, Logic::Bitwise) => "bytes &",
            (Bits::Bytes, Logic::ShortCircuit) => "bytes &&",
            (Bits::Words32, Logic::Bitwise) => "32 bits &",
            (Bits::Words32, Logic::ShortCircuit) => "32 bits &&",
            (Bits::Words24, Logic::Bitwise) => "24 bits &",
            (Bits::Words24, Logic::ShortCircuit) => "24 bits &&",
        }
    }
}

/// What is the same in every program: the commands that it reads from its input. `run V M N` runs
/// `N` scans of variant `V` with inputs `M` and prints the nanoseconds that they took, `cold V M N`
/// copies the inputs and clears the caches before each and prints the median of the times of the scans alone (at most 64), `state V` prints bits, words and elements,
/// `reset V` makes them 0.
const MAIN: &str = r#"
static double nanoseconds(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return t.tv_sec * 1e9 + t.tv_nsec;
}
static unsigned char evict[16 << 20];
int main(int argc, char **argv) {
    FILE *file = argc == 2 ? fopen(argv[1], "rb") : NULL;
    if (!file || fread(patterns, sizeof patterns, 1, file) != 1) return 1;
    for (unsigned v = 0; v < sizeof variants / sizeof *variants; v++) variants[v].prepare();
    char command[16];
    int v, m;
    long n;
    while (scanf("%15s %d", command, &v) == 2) {
        if (!strcmp(command, "state")) variants[v].state();
        if (!strcmp(command, "reset")) variants[v].reset();
        if (!strcmp(command, "run") && scanf("%d %ld", &m, &n) == 2) {
            double start = nanoseconds();
            variants[v].run(m, n);
            printf("%.1f\n", nanoseconds() - start);
        }
        if (!strcmp(command, "cold") && scanf("%d %ld", &m, &n) == 2) {
            double times[64];
            if (n > 64) n = 64;
            void (*scan)(void) = variants[v].scan;
            for (long k = 0; k < n; k++) {
                variants[v].run(m, 1);
                for (unsigned long i = 0; i < sizeof evict; i += 64) evict[i]++;
                nanoseconds();
                double start = nanoseconds();
                scan();
                double ns = nanoseconds() - start;
                long at = k;
                for (; at > 0 && times[at - 1] > ns; at--) times[at] = times[at - 1];
                times[at] = ns;
            }
            printf("%.1f\n", times[n / 2]);
        }
        fflush(stdout);
    }
    return 0;
}
"#;

/// The C program of a kernel, with all its variants.
pub fn program(kernel: &Kernel) -> String {
    let mut out = String::from("#include <stdio.h>\n#include <string.h>\n#include <time.h>\n");
    let word = match kernel.word_type {
        WordType::Signed16 => "short",
        WordType::Unsigned16 => "unsigned short",
        WordType::Signed24 | WordType::SmallInteger => "int",
        WordType::Double => "double",
    };
    let element = if kernel.real_elements { "double" } else { "word" };
    let (inputs, words) = (kernel.inputs, kernel.input_words);
    let _ = write!(
        out,
        "typedef {word} word;\ntypedef {element} element;\n#define W24(x) ((int)((unsigned)(x) << 8) >> 8)\n\
         static struct {{ unsigned char bits[{}]; short words[{}]; }} patterns[3][{PATTERNS}];\n",
        inputs.next_multiple_of(2).max(2),
        words.max(1),
    );
    let variants = Variant::all(kernel);
    for (number, variant) in variants.iter().enumerate() {
        Printer { kernel, variant: *variant, number, out: &mut out }.variant();
    }
    out.push_str(
        "static const struct { void (*prepare)(void), (*run)(int, long), (*scan)(void), (*state)(void), (*reset)(void); } variants[] = {\n",
    );
    for v in 0..variants.len() {
        let _ = writeln!(out, "    {{ prepare{v}, run{v}, scan{v}, state{v}, reset{v} }},");
    }
    out.push_str("};\n");
    out + MAIN
}

/// Prints one variant; its number is part of the names in C.
struct Printer<'a> {
    kernel: &'a Kernel,
    variant: Variant,
    number: usize,
    out: &'a mut String,
}

impl Printer<'_> {
    /// The variables and functions of the variant.
    fn variant(&mut self) {
        let (kernel, v) = (self.kernel, self.number);
        let (ty, part) = match self.variant.bits {
            Bits::Bytes => ("unsigned char", 1),
            Bits::Words32 => ("unsigned", 32),
            Bits::Words24 => ("unsigned", 24),
        };
        let (inputs, bits) = (kernel.inputs.div_ceil(part), kernel.bits.div_ceil(part).max(1));
        let (words, elements) = (kernel.words.max(1), kernel.elements.max(1));
        let reals = kernel.reals.max(1);
        let start: Vec<String> = kernel.start.iter().map(f64::to_string).collect();
        let (input_words, input_bits) = (kernel.input_words, kernel.inputs);
        let _ = write!(
            self.out,
            "static {ty} b{v}[{bits}], in{v}[3][{PATTERNS}][{}];\n\
             static word w{v}[{words}], inw{v}[3][{PATTERNS}][{}];\n\
             static element a{v}[{elements}];\nstatic double r{v}[{reals}];\n\
             __attribute__((noinline)) void scan{v}(void) {{\n",
            inputs.max(1),
            input_words.max(1),
        );
        self.stmts(&kernel.stmts);
        let get = match part {
            1 => format!("b{v}[i]"),
            _ => format!("(b{v}[i / {part}] >> i % {part} & 1)"),
        };
        let put = match part {
            1 => format!("in{v}[m][k][i] = patterns[m][k].bits[i]"),
            _ => {
                format!("in{v}[m][k][i / {part}] |= (unsigned)patterns[m][k].bits[i] << i % {part}")
            }
        };
        let copy_bits = match inputs {
            0 => String::new(),
            _ => format!("memcpy(b{v}, in{v}[m][pattern], {inputs} * sizeof *b{v});"),
        };
        let copy_words = match input_words {
            0 => String::new(),
            _ => format!("memcpy(w{v}, inw{v}[m][pattern], {input_words} * sizeof(word));"),
        };
        let _ = write!(
            self.out,
            r#"}}
static void prepare{v}(void) {{
    for (int m = 0; m < 3; m++) for (int k = 0; k < {PATTERNS}; k++) {{
        for (int i = 0; i < {input_bits}; i++) {put};
        for (int i = 0; i < {input_words}; i++) inw{v}[m][k][i] = patterns[m][k].words[i];
    }}
}}
static void run{v}(int m, long n) {{
    for (long k = 0; k < n; k++) {{
        long pattern = m == {fixed} ? 0 : k % {PATTERNS};
        (void)pattern;
        {copy_bits}
        {copy_words}
        scan{v}();
    }}
}}
static void reset{v}(void) {{
    memset(b{v}, 0, sizeof b{v});
    memset(w{v}, 0, sizeof w{v});
    static const element start[{elements}] = {{ {start} }};
    memcpy(a{v}, start, sizeof start);
    memset(r{v}, 0, sizeof r{v});
}}
static void state{v}(void) {{
    for (int i = 0; i < {}; i++) printf("%d ", (int){get});
    for (int i = 0; i < {}; i++) printf("%.17g ", (double)w{v}[i]);
    for (int i = 0; i < {}; i++) printf("%.17g ", (double)a{v}[i]);
    for (int i = 0; i < {}; i++) printf("%.17g ", r{v}[i]);
    putchar('\n');
}}
"#,
            kernel.bits,
            kernel.words,
            kernel.elements,
            kernel.reals,
            start = start.join(", "),
            fixed = Inputs::Static as usize,
        );
    }

    fn stmts(&mut self, stmts: &[Stmt]) {
        for stmt in stmts {
            self.stmt(stmt);
        }
    }

    fn stmt(&mut self, stmt: &Stmt) {
        let v = self.number;
        match stmt {
            Stmt::SetBit(bit, value) => {
                let value = self.truth(value);
                let part = match self.variant.bits {
                    Bits::Bytes => {
                        let _ = writeln!(self.out, "b{v}[{bit}] = {value};");
                        return;
                    }
                    Bits::Words32 => 32,
                    Bits::Words24 => 24,
                };
                let (word, mask, at) = (bit / part, 1u32 << (bit % part), bit % part);
                let _ = match self.variant.logic {
                    Logic::Bitwise => writeln!(
                        self.out,
                        "b{v}[{word}] = (b{v}[{word}] & ~{mask}u) | (unsigned)({value}) << {at};"
                    ),
                    Logic::ShortCircuit => writeln!(
                        self.out,
                        "if ({value}) b{v}[{word}] |= {mask}u; else b{v}[{word}] &= ~{mask}u;"
                    ),
                };
            }
            Stmt::Toggle(bit) => self.toggle(*bit),
            Stmt::SetWord(word, value) => {
                let value = self.word(value);
                let _ = writeln!(self.out, "w{v}[{word}] = {value};");
            }
            Stmt::SetReal(real, value) => {
                let value = self.word(value);
                let _ = writeln!(self.out, "r{v}[{real}] = {value};");
            }
            Stmt::SetElement(index, value) => {
                let (index, value) = (self.word(index), self.word(value));
                let _ = writeln!(self.out, "a{v}[{index}] = {value};");
            }
            Stmt::If(cond, then, otherwise) => {
                let cond = self.truth(cond);
                let _ = writeln!(self.out, "if ({cond}) {{");
                self.stmts(then);
                self.out.push_str("} else {\n");
                self.stmts(otherwise);
                self.out.push_str("}\n");
            }
        }
    }

    /// A bit becomes its opposite.
    fn toggle(&mut self, bit: usize) {
        let v = self.number;
        let part = match (self.variant.bits, self.variant.logic) {
            (Bits::Bytes, Logic::Bitwise) => {
                let _ = writeln!(self.out, "b{v}[{bit}] ^= 1;");
                return;
            }
            (Bits::Bytes, Logic::ShortCircuit) => {
                let _ = writeln!(self.out, "b{v}[{bit}] = !b{v}[{bit}];");
                return;
            }
            (Bits::Words32, _) => 32,
            (Bits::Words24, _) => 24,
        };
        let _ = writeln!(self.out, "b{v}[{}] ^= {}u;", bit / part, 1u32 << (bit % part));
    }

    /// A truth value, 0 or 1.
    fn truth(&self, expr: &Expr) -> String {
        let bitwise = self.variant.logic == Logic::Bitwise;
        match expr {
            Expr::Bit(bit) => self.bit(*bit),
            Expr::Truth(value) => u8::from(*value).to_string(),
            Expr::NotBit(bit) if bitwise => format!("({} ^ 1)", self.bit(*bit)),
            Expr::NotBit(bit) => format!("!{}", self.bit(*bit)),
            Expr::All(parts) | Expr::Any(parts) => {
                let with = match (matches!(expr, Expr::All(_)), bitwise) {
                    (true, true) => " & ",
                    (true, false) => " && ",
                    (false, true) => " | ",
                    (false, false) => " || ",
                };
                let parts: Vec<String> = parts.iter().map(|part| self.truth(part)).collect();
                format!("({})", parts.join(with))
            }
            _ => self.word(expr),
        }
    }

    fn bit(&self, bit: usize) -> String {
        let v = self.number;
        let part = match self.variant.bits {
            Bits::Bytes => return format!("b{v}[{bit}]"),
            Bits::Words32 => 32,
            Bits::Words24 => 24,
        };
        match self.variant.logic {
            Logic::Bitwise => format!("(b{v}[{}] >> {} & 1)", bit / part, bit % part),
            Logic::ShortCircuit => {
                format!("((b{v}[{}] & {}u) != 0)", bit / part, 1u32 << (bit % part))
            }
        }
    }

    /// A number that has wrapped as the language's arithmetic does.
    fn word(&self, expr: &Expr) -> String {
        let v = self.number;
        match expr {
            Expr::Word(word) => format!("w{v}[{word}]"),
            Expr::Element(index) => format!("a{v}[{}]", self.word(index)),
            Expr::Number(number) => format!("{number}"),
            Expr::Real(real) => format!("r{v}[{real}]"),
            Expr::Int(value) => format!("(int)({})", self.word(value)),
            Expr::Op(Op::Div, args) => {
                format!("((double){} / {})", self.word(&args[0]), self.word(&args[1]))
            }
            Expr::Op(op, args) => {
                let (a, b) = (self.word(&args[0]), self.word(&args[1]));
                let (sign, wraps) = match op {
                    Op::Add => ("+", true),
                    Op::Sub => ("-", true),
                    Op::Mul => ("*", true),
                    Op::Rem => ("%", false),
                    Op::Quot | Op::Div => ("/", false),
                    Op::Mask => ("&", false),
                    Op::Join => ("|", false),
                    Op::Left => ("<<", true),
                    Op::Right => (">>", false),
                    Op::Eq => ("==", false),
                    Op::Gt => (">", false),
                    Op::Lt => ("<", false),
                };
                match self.kernel.word_type {
                    WordType::Signed16 | WordType::Unsigned16 if wraps => {
                        format!("(word)({a} {sign} {b})")
                    }
                    WordType::Signed24 if wraps => format!("W24({a} {sign} {b})"),
                    _ => format!("({a} {sign} {b})"),
                }
            }
            _ => self.truth(expr),
        }
    }
}
