//! Prints kernels in NCT's language.

use std::fmt::Write as _;

use super::Printer;
use crate::kernels::{BitStyle, Expr, Op, Stmt};

impl Printer<'_> {
    /// Statements in their order. What is compared with several numbers one after another is loaded once, as the
    /// manual's programs do.
    pub(super) fn nct_stmts(&mut self, stmts: &[Stmt]) {
        let mut loaded = None;
        for stmt in stmts {
            let word = compared_word(stmt);
            if let (Stmt::If(Expr::Op(op, args), then, otherwise), true) =
                (stmt, word.is_some() && word == loaded)
            {
                let comparison = format!("{}{}", comparator(*op), self.nct_operand(&args[1]));
                self.nct_if(&comparison, then, otherwise);
            } else {
                self.nct_stmt(stmt);
            }
            let is_kept = match stmt {
                Stmt::If(_, then, otherwise) => keep_op(then) && keep_op(otherwise),
                _ => false,
            };
            loaded = word.filter(|_| is_kept);
        }
    }

    fn nct_if(&mut self, cond: &str, then: &[Stmt], otherwise: &[Stmt]) {
        self.line(cond);
        self.stmts(then);
        if !otherwise.is_empty() {
            self.line("E");
            self.stmts(otherwise);
        }
        self.line("Z");
    }

    fn nct_stmt(&mut self, stmt: &Stmt) {
        match stmt {
            Stmt::SetBit(bit, Expr::Truth(value)) => {
                let line = format!("{}{}", if *value { "U" } else { "D" }, self.bit(*bit));
                self.line(&line);
            }
            Stmt::Toggle(bit) => {
                let name = self.bit(*bit);
                self.line(&format!("NL{name}S{name}"));
            }
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
            Stmt::SetElement(..) | Stmt::SetReal(..) => {}
            Stmt::If(cond, then, otherwise) => {
                let cond = self.nct_condition(cond);
                self.nct_if(&cond, then, otherwise);
            }
        }
    }

    /// A condition: a test of bits in parentheses, or a comparison with OP, which is loaded before.
    fn nct_condition(&self, expr: &Expr) -> String {
        match expr {
            Expr::Op(op, args) => {
                let (op, with) = (comparator(*op), self.nct_operand(&args[1]));
                format!("{}{op}{with}", self.nct_chain(&args[0]))
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
                    Op::Join => "O",
                    Op::Left => "<<",
                    Op::Right => ">>",
                    _ => "A",
                };
                format!("{}{op}{}", self.nct_chain(&args[0]), self.nct_operand(&args[1]))
            }
            _ => String::new(),
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
}

fn comparator(op: Op) -> &'static str {
    match op {
        Op::Gt => ">",
        Op::Lt => "<",
        _ => "=",
    }
}

/// The word that a condition compares with a number.
fn compared_word(stmt: &Stmt) -> Option<usize> {
    match stmt {
        Stmt::If(cond @ Expr::Op(_, args), ..) if cond.is_comparison() => match **args {
            [Expr::Word(word), Expr::Number(_)] => Some(word),
            _ => None,
        },
        _ => None,
    }
}

/// Whether statements only switch bits, so that OP keeps its value.
fn keep_op(stmts: &[Stmt]) -> bool {
    stmts.iter().all(|stmt| matches!(stmt, Stmt::SetBit(_, Expr::Truth(_))))
}
