//! A program with all that it needs.

use std::collections::BTreeSet;

use crate::flow::NOTHING;
use crate::functions;

/// An elementary type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Type {
    /// A bit.
    Bool,
    /// 8 bits without a sign.
    Usint,
    /// 16 bits with a sign.
    Int,
    /// 16 bits without a sign.
    Uint,
    /// 32 bits with a sign.
    Dint,
    /// 64 bits with a sign.
    Lint,
    /// Floating point of 64 bits.
    Lreal,
}

impl Type {
    /// The keyword.
    pub fn name(self) -> &'static str {
        match self {
            Self::Bool => "BOOL",
            Self::Usint => "USINT",
            Self::Int => "INT",
            Self::Uint => "UINT",
            Self::Dint => "DINT",
            Self::Lint => "LINT",
            Self::Lreal => "LREAL",
        }
    }
}

/// In which list of declarations a variable stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// Given from outside, and only read.
    Input,
    /// The program's own.
    Local,
    /// The program's own, and kept over power-off.
    Retained,
    /// A constant.
    Constant,
}

/// A variable.
#[derive(Clone, Debug)]
pub struct Variable {
    /// Its name, as [`Names`](crate::Names) made it.
    pub name: String,
    /// The type, of an array that of its elements.
    pub ty: Type,
    /// How many elements an array has; the first one is number 0.
    pub elements: Option<u32>,
    /// Which list it stands in.
    pub kind: Kind,
    /// The place of an input or output, such as `%IX1.0`.
    pub address: Option<String>,
    /// The first value, of an array the first values; none where they are 0.
    pub initial: Vec<String>,
    /// What it is, in one line; may be empty.
    pub comment: String,
}

impl Variable {
    /// A variable of the program's own, without address and value.
    pub fn local(name: impl Into<String>, ty: Type, comment: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            ty,
            elements: None,
            kind: Kind::Local,
            address: None,
            initial: vec![],
            comment: comment.into(),
        }
    }
}

/// A function that the statements call.
#[derive(Debug)]
pub struct Function {
    /// Its name.
    pub name: &'static str,
    /// What it returns.
    pub returns: Type,
    /// Its inputs, in order.
    pub inputs: &'static [(&'static str, Type)],
    /// Its own variables.
    pub locals: &'static [(&'static str, Type)],
    /// What it computes.
    pub comment: &'static str,
    /// Its statements, a line each.
    pub body: &'static [&'static str],
    /// The functions that it calls itself.
    pub needs: &'static [&'static str],
}

/// A program with all that it needs.
#[derive(Clone, Debug)]
pub struct Project {
    /// The name of the program.
    pub name: String,
    /// Where it comes from, a line each.
    pub comments: Vec<String>,
    /// Its variables, in the order in which they are declared.
    pub variables: Vec<Variable>,
    /// Its statements, a line each, with their indentation.
    pub body: Vec<String>,
    /// The time between two calls, in microseconds.
    pub interval_us: u64,
}

impl Project {
    /// Declares the variable of [`NOTHING`], if a line needs it.
    #[must_use]
    pub fn complete(mut self) -> Self {
        if self.body.iter().any(|line| line.trim_start() == NOTHING) {
            self.variables.push(Variable::local("NOTHING", Type::Bool, "is asked by nothing"));
        }
        self
    }

    /// The functions that the statements call, each after those that it calls itself.
    pub(crate) fn functions(&self) -> Vec<&'static Function> {
        let mut wanted: BTreeSet<&str> = BTreeSet::new();
        let called = |line: &String| -> Vec<&'static str> {
            functions::all()
                .filter(|function| calls(line, function.name))
                .map(|function| function.name)
                .collect()
        };
        let mut open: Vec<&'static str> = self.body.iter().flat_map(called).collect();
        while let Some(name) = open.pop() {
            if wanted.insert(name) {
                let function = functions::all().find(|function| function.name == name);
                open.extend(function.into_iter().flat_map(|function| function.needs));
            }
        }
        // In the table each function stands after those that it calls.
        functions::all().filter(|function| wanted.contains(function.name)).collect()
    }
}

/// Whether a line calls a function.
fn calls(line: &str, name: &str) -> bool {
    line.match_indices(name).any(|(at, _)| {
        let before = line.get(..at).and_then(|text| text.chars().next_back());
        let behind = line.get(at + name.len()..).and_then(|text| text.chars().next());
        behind == Some('(') && !before.is_some_and(|c| c.is_ascii_alphanumeric() || c == '_')
    })
}
