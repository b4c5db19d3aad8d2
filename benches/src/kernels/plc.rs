//! Prints kernels in the controls' languages.

use std::fmt::Write as _;

use super::{BitStyle, Expr, Kernel, Language, Op, Stmt};

/// The first byte of F that holds a kernel's bits in NCT; those before have a meaning for the
/// control.
pub(super) const NCT_FIRST_FLAG: usize = 100;
/// The byte of F of the first word in NCT.
pub(super) const NCT_FIRST_WORD: usize = 500;
/// The address in Y of the first word of bits of a PMAC.
pub(super) const PMAC_BITS: u32 = 0x07C0;
/// How many bits a word of a PMAC has.
pub(super) const PMAC_WORD_BITS: usize = 24;
/// The address in X of the first word that is an L-variable.
pub(super) const PMAC_WORDS: u32 = 0x0900;
/// The number of the P-variable that is the first word.
pub(super) const PMAC_FIRST_P: usize = 900;
/// The number of the P-variable that is the first element.
pub(super) const PMAC_FIRST_ELEMENT: usize = 800;

/// The text of a kernel in its language.
pub(super) fn print(kernel: &Kernel) -> String {
    let mut out = Printer { kernel, out: String::new() };
    match kernel.language {
        Language::Pmi => out.pmi(),
        Language::Nct => out.nct(),
        Language::PmacMixed | Language::Pmac | Language::Plcc => out.pmac(),
    }
    out.out
}

/// The text of a kernel so far.
struct Printer<'a> {
    kernel: &'a Kernel,
    out: String,
}

impl Printer<'_> {
    fn line(&mut self, text: &str) {
        self.out.push_str(text);
        self.out.push('\n');
    }

    fn pmi(&mut self) {
        let kernel = self.kernel;
        self.line("$INPUT");
        for bit in 0..kernel.inputs {
            self.line(&format!("I{bit} = {}/{}", bit / 8, bit % 8));
        }
        self.line("$INTEGER");
        for word in 0..kernel.words {
            self.line(&format!("W{word}"));
        }
        if kernel.elements > 0 {
            self.line(&format!("A[{}]", kernel.elements));
        }
        self.line("$END");
        self.stmts(&kernel.stmts);
    }

    fn nct(&mut self) {
        self.line(":001");
        self.stmts(&self.kernel.stmts);
        self.line("J1\n:000J0");
    }

    fn pmac(&mut self) {
        let kernel = self.kernel;
        let (letter, open) = match kernel.language {
            Language::Plcc => ('L', "OPEN PLCC 1 CLEAR"),
            _ => ('M', "OPEN PLC 1 CLEAR"),
        };
        self.line("I5=3");
        for bit in 0..kernel.bits {
            if self.bit(bit).starts_with(letter) {
                let (word, bit_of_word) = (bit / PMAC_WORD_BITS, bit % PMAC_WORD_BITS);
                let address = PMAC_BITS + word as u32;
                self.line(&format!("{letter}{bit}->Y:${address:X},{bit_of_word},1"));
            }
        }
        if kernel.language == Language::Plcc {
            for word in 0..kernel.words {
                let address = PMAC_WORDS + word as u32;
                let name = self.word(word);
                self.line(&format!("{name}->X:${address:X},0,24,S"));
            }
        }
        self.line(open);
        self.stmts(&kernel.stmts);
        self.line("CLOSE");
    }

    /// The name of a bit.
    fn bit(&self, bit: usize) -> String {
        let relay = bit.checked_sub(self.kernel.inputs);
        match (self.kernel.language, relay) {
            (Language::Pmi, None) => format!("I{bit}"),
            (Language::Pmi, Some(relay)) => format!("R{relay}"),
            (Language::Nct, None) => format!("I{:02}{}", bit / 8, bit % 8),
            (Language::Nct, Some(relay)) => {
                format!("F{:03}{}", NCT_FIRST_FLAG + relay / 8, relay % 8)
            }
            (Language::PmacMixed, Some(relay)) if relay % 2 == 1 => format!("P{}", relay / 2),
            (Language::Plcc, _) => format!("L{bit}"),
            (Language::PmacMixed | Language::Pmac, _) => format!("M{bit}"),
        }
    }

    /// The name of a word.
    fn word(&self, word: usize) -> String {
        match self.kernel.language {
            Language::Pmi => format!("W{word}"),
            Language::Nct => format!("F{:03}", NCT_FIRST_WORD + 2 * word),
            Language::Plcc => format!("L{}", self.kernel.bits + word),
            Language::PmacMixed | Language::Pmac => format!("P{}", PMAC_FIRST_P + word),
        }
    }

    fn stmts(&mut self, stmts: &[Stmt]) {
        for stmt in stmts {
            match self.kernel.language {
                Language::Pmi => self.pmi_stmt(stmt),
                Language::Nct => self.nct_stmt(stmt),
                _ => self.pmac_stmt(stmt),
            }
        }
    }

    fn pmi_stmt(&mut self, stmt: &Stmt) {
        match stmt {
            Stmt::SetBit(bit, value) => {
                let line = format!("{} = {}", self.bit(*bit), self.pmi_expr(value));
                self.line(&line);
            }
            Stmt::SetWord(word, value) => {
                let line = format!("{} = {}", self.word(*word), self.pmi_expr(value));
                self.line(&line);
            }
            Stmt::SetElement(index, value) => {
                let line = format!("A[{}] = {}", self.pmi_expr(index), self.pmi_expr(value));
                self.line(&line);
            }
            Stmt::If(cond, then, otherwise) => {
                let line = format!("IF ({})", self.pmi_expr(cond));
                self.line(&line);
                self.stmts(then);
                let mut rest = otherwise;
                while let [Stmt::If(cond, then, otherwise)] = rest.as_slice() {
                    let line = format!("ELSEIF ({})", self.pmi_expr(cond));
                    self.line(&line);
                    self.stmts(then);
                    rest = otherwise;
                }
                if !rest.is_empty() {
                    self.line("ELSE");
                    self.stmts(rest);
                }
                self.line("ENDIF");
            }
        }
    }

    fn pmi_expr(&self, expr: &Expr) -> String {
        let join = |parts: &[Expr], with: &str| {
            format!("({})", parts.iter().map(|p| self.pmi_expr(p)).collect::<Vec<_>>().join(with))
        };
        match expr {
            Expr::Bit(bit) => self.bit(*bit),
            Expr::NotBit(bit) => format!("/{}", self.bit(*bit)),
            Expr::All(parts) => join(parts, " & "),
            Expr::Any(parts) => join(parts, " ! "),
            Expr::Word(word) => self.word(*word),
            Expr::Element(index) => format!("A[{}]", self.pmi_expr(index)),
            Expr::Number(number) => format!("{number}"),
            Expr::Op(op, args) => {
                let op = match op {
                    Op::Add => "+",
                    Op::Sub => "-",
                    Op::Mul => "*",
                    Op::Rem => "%",
                    Op::Mask => "&",
                    Op::Eq => "=",
                    Op::Gt => ">",
                    Op::Lt => "<",
                };
                format!("({} {op} {})", self.pmi_expr(&args[0]), self.pmi_expr(&args[1]))
            }
        }
    }

    fn nct_stmt(&mut self, stmt: &Stmt) {
        match stmt {
            Stmt::SetBit(bit, value) if self.kernel.style == BitStyle::Operators => {
                let chain = self.nct_chain(value);
                let line = format!("{}S{}", chain, self.bit(*bit));
                self.line(&line);
            }
            Stmt::SetBit(bit, value) => {
                let (to, cond) = (self.bit(*bit), self.nct_condition(value));
                self.line(&format!("{cond}U{to}ED{to}Z"));
            }
            Stmt::SetWord(word, value) => {
                let line = format!("{}S{}", self.nct_chain(value), self.word(*word));
                self.line(&line);
            }
            Stmt::SetElement(..) => {}
            Stmt::If(cond, then, otherwise) => {
                let line = self.nct_condition(cond);
                self.line(&line);
                self.stmts(then);
                if !otherwise.is_empty() {
                    self.line("E");
                    self.stmts(otherwise);
                }
                self.line("Z");
            }
        }
    }

    /// A condition: a test of bits in parentheses, or a comparison with OP, which is loaded before.
    fn nct_condition(&self, expr: &Expr) -> String {
        match expr {
            Expr::Op(op, args) => {
                let op = match op {
                    Op::Gt => ">",
                    Op::Lt => "<",
                    _ => "=",
                };
                format!("{}{op}{}", self.nct_chain(&args[0]), self.nct_operand(&args[1]))
            }
            Expr::All(parts) | Expr::Any(parts) => {
                let with = if matches!(expr, Expr::All(_)) { "A" } else { "O" };
                let parts: Vec<String> = parts.iter().map(|p| self.nct_condition(p)).collect();
                format!("({})", parts.join(with))
            }
            Expr::NotBit(bit) => format!("N{}", self.bit(*bit)),
            Expr::Bit(bit) => self.bit(*bit),
            _ => String::new(),
        }
    }

    /// Statements that compute an expression in OP, from left to right.
    fn nct_chain(&self, expr: &Expr) -> String {
        match expr {
            Expr::Bit(_) | Expr::NotBit(_) | Expr::Word(_) => self.nct_operand(expr),
            Expr::Number(number) => format!(",{number}"),
            Expr::All(parts) | Expr::Any(parts) => {
                let with = if matches!(expr, Expr::All(_)) { "A" } else { "O" };
                let mut out = String::new();
                for (at, part) in parts.iter().enumerate() {
                    let part = if at == 0 { self.nct_chain(part) } else { self.nct_operand(part) };
                    let _ = write!(out, "{}{part}", if at == 0 { "" } else { with });
                }
                out
            }
            Expr::Op(op, args) => {
                let op = match op {
                    Op::Add => "+",
                    Op::Sub => "-",
                    Op::Mul => "*",
                    _ => "A",
                };
                format!("{}{op}{}", self.nct_chain(&args[0]), self.nct_operand(&args[1]))
            }
            Expr::Element(_) => String::new(),
        }
    }

    /// An operand of a chain: an operand that is not the first, or the only one.
    fn nct_operand(&self, expr: &Expr) -> String {
        match expr {
            Expr::Bit(bit) => format!("L{}", self.bit(*bit)),
            Expr::NotBit(bit) => format!("NL{}", self.bit(*bit)),
            Expr::Word(word) => format!("L{}", self.word(*word)),
            Expr::Number(number) => format!("{number}"),
            _ => format!("[{}]", self.nct_chain(expr)),
        }
    }

    fn pmac_stmt(&mut self, stmt: &Stmt) {
        match stmt {
            Stmt::SetBit(bit, value) => {
                let to = self.bit(*bit);
                if self.kernel.style == BitStyle::Operators || matches!(value, Expr::Bit(_)) {
                    let line = format!("{to}={}", self.pmac_value(value, true));
                    self.line(&line);
                    return;
                }
                let cond = self.pmac_condition(value, true);
                self.line(&format!("IF {cond}\n{to}=1\nELSE\n{to}=0\nENDIF"));
            }
            Stmt::SetWord(word, value) => {
                let line = format!("{}={}", self.word(*word), self.pmac_value(value, true));
                self.line(&line);
            }
            Stmt::SetElement(index, value) => {
                let (index, value) = (self.pmac_element(index), self.pmac_value(value, true));
                self.line(&format!("{index}={value}"));
            }
            Stmt::If(cond, then, otherwise) => {
                let line = format!("IF {}", self.pmac_condition(cond, true));
                self.line(&line);
                self.stmts(then);
                if !otherwise.is_empty() {
                    self.line("ELSE");
                    self.stmts(otherwise);
                }
                self.line("ENDIF");
            }
        }
    }

    /// A condition; with `outer` it has parentheses around it, as IF needs them.
    fn pmac_condition(&self, expr: &Expr, outer: bool) -> String {
        let text = match expr {
            Expr::Bit(bit) => format!("{}=1", self.bit(*bit)),
            Expr::NotBit(bit) => format!("{}=0", self.bit(*bit)),
            Expr::All(parts) | Expr::Any(parts) => {
                let with = if matches!(expr, Expr::All(_)) { " AND " } else { " OR " };
                let part = |p: &Expr| self.pmac_condition(p, false);
                return format!("({})", parts.iter().map(part).collect::<Vec<_>>().join(with));
            }
            Expr::Op(op, args) => {
                let op = match op {
                    Op::Gt => ">",
                    Op::Lt => "<",
                    _ => "=",
                };
                let [a, b] = [&args[0], &args[1]].map(|arg| self.pmac_value(arg, false));
                format!("{a}{op}{b}")
            }
            _ => String::new(),
        };
        if outer { format!("({text})") } else { text }
    }

    /// The array element with an index.
    fn pmac_element(&self, index: &Expr) -> String {
        format!("P({PMAC_FIRST_ELEMENT}+{})", self.pmac_value(index, false))
    }

    /// An expression; with `outer`, as the right side of an assignment, it has no parentheses around
    /// it.
    fn pmac_value(&self, expr: &Expr, outer: bool) -> String {
        match expr {
            Expr::Bit(bit) => self.bit(*bit),
            Expr::NotBit(bit) => format!("({}^1)", self.bit(*bit)),
            Expr::All(parts) | Expr::Any(parts) => {
                let with = if matches!(expr, Expr::All(_)) { "&" } else { "|" };
                let parts: Vec<String> = parts.iter().map(|p| self.pmac_value(p, false)).collect();
                format!("({})", parts.join(with))
            }
            Expr::Word(word) => self.word(*word),
            Expr::Element(index) => self.pmac_element(index),
            Expr::Number(number) => format!("{number}"),
            Expr::Op(op, args) => {
                let op = match op {
                    Op::Add => "+",
                    Op::Sub => "-",
                    Op::Mul => "*",
                    Op::Rem => "%",
                    Op::Mask => "&",
                    Op::Eq => "=",
                    Op::Gt => ">",
                    Op::Lt => "<",
                };
                let [a, b] = [&args[0], &args[1]].map(|arg| self.pmac_value(arg, false));
                if outer { format!("{a}{op}{b}") } else { format!("({a}{op}{b})") }
            }
        }
    }
}
