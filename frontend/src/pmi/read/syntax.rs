//! The statements of a program as they are written. What their names stand for is not known yet.
//!
//! A statement with an error of its form has everything that was read in front of the error, so
//! that errors of names are found there too: the first error of a statement is the one that is
//! reported.

use std::ops::Range;

use plcc_abi::pmi::{Lines, TimerKind, Type};
use plcc_diag::{Diagnostic, SourceMap, Span};

use crate::pmi::read::{cursor::Cursor, section::Section, split::Extent, token::Token};

/// The statements of a program and of all files that it includes.
#[derive(Debug)]
pub(crate) struct Text {
    pub(crate) statements: Vec<Statement>,
    /// The tokens of all statements.
    pub(crate) tokens: Vec<Token>,
    /// The parts of all expressions.
    pub(crate) parts: Vec<Part>,
    /// Whether it has a `$END`.
    pub(crate) has_end: bool,
    /// The last line of the program's own file that is not empty. An error about something that is
    /// missing points there.
    pub(crate) last: Span,
}

/// A statement.
#[derive(Debug)]
pub(crate) struct Statement {
    pub(crate) extent: Extent,
    /// Its tokens: a range of indices in [`Text::tokens`].
    pub(crate) tokens: Range<u32>,
    pub(crate) form: Form,
    /// What is wrong with its form, after all that `form` has.
    pub(crate) error: Option<Box<Diagnostic>>,
}

impl Statement {
    /// A cursor at the statement's first token.
    pub(crate) fn cursor<'a>(&self, sources: &'a SourceMap, tokens: &'a [Token]) -> Cursor<'a> {
        let range = self.tokens.start as usize..self.tokens.end as usize;
        let own = tokens.get(range).unwrap_or(&[]);
        Cursor::new(sources.text(self.extent.file), own, self.extent)
    }
}

/// A statement of the specification section, or else of the execution section.
#[derive(Debug)]
pub(crate) enum Form {
    Declaration(Declaration),
    Logic(Logic),
}

/// A statement of the specification section.
#[derive(Debug)]
pub(crate) struct Declaration {
    /// The part of the section in which it is; `None` before the first directive, or after an
    /// unknown one.
    pub(crate) section: Option<Section>,
    pub(crate) form: DeclarationForm,
}

/// How a declaration is written. Lists and parts end where the statement has an error.
#[derive(Debug)]
pub(crate) enum DeclarationForm {
    /// A directive; `None` for one that does not exist.
    Directive(Option<Section>),
    Variables(Vec<VariableDeclaration>),
    Lines(PortLines),
    /// A fault or message.
    Announcement {
        name: Option<Token>,
        items: Vec<TextItem>,
    },
    Key {
        name: Option<Token>,
        text: Option<String>,
    },
    /// M or G codes, each with whether it is delayed (/D).
    Codes(Vec<(Token, bool)>),
    Timer(Timer),
    /// The pins of a flip-flop.
    FlipFlop(Vec<Token>),
    Auxiliary {
        name: Option<Token>,
        numbers: Vec<i32>,
    },
    /// A statement for which there is no directive.
    Unknown,
}

/// A variable, constant or array, with what was read of it.
#[derive(Debug)]
pub(crate) struct VariableDeclaration {
    pub(crate) ty: Type,
    pub(crate) name: Token,
    /// How many elements an array has.
    pub(crate) elements: Option<u32>,
    /// The values of constants, each with its place.
    pub(crate) constants: Option<Vec<(i32, Span)>>,
    /// Whether all of it was read.
    pub(crate) is_whole: bool,
}

/// A digital input or output, with what was read of it.
#[derive(Debug, Default)]
pub(crate) struct PortLines {
    pub(crate) name: Option<Token>,
    /// The port's number and its place.
    pub(crate) port: Option<(u16, Span)>,
    pub(crate) lines: Option<Lines>,
}

/// A part of a fault's or message's text: characters, or the name of a variable.
#[derive(Debug)]
pub(crate) enum TextItem {
    Text(String),
    Name(Token),
}

/// A timer, with what was read of it.
#[derive(Debug, Default)]
pub(crate) struct Timer {
    pub(crate) kind: Option<TimerKind>,
    pub(crate) control: Option<Token>,
    pub(crate) delayed: Option<Token>,
    /// The delay and its place.
    pub(crate) preset: Option<(i32, Span)>,
}

/// A statement of the execution section.
#[derive(Debug)]
pub(crate) struct Logic {
    /// The labels in front of it. It may have one; a second one is an error, but a label
    /// nevertheless.
    pub(crate) labels: Vec<Token>,
    /// The variable that it assigns, also if the statement has an error; no element of an array.
    pub(crate) assigned: Option<Token>,
    pub(crate) form: LogicForm,
}

/// How a statement of the execution section is written.
#[derive(Debug)]
pub(crate) enum LogicForm {
    Assignment {
        name: Token,
        /// The index of an assigned element.
        index: Option<Expression>,
        value: Option<Expression>,
    },
    If {
        word: Token,
        condition: Option<Expression>,
    },
    ElseIf {
        word: Token,
        condition: Option<Expression>,
    },
    Else {
        word: Token,
        /// Whether an IF follows, so that ELSEIF was meant.
        is_else_if: bool,
    },
    EndIf {
        word: Token,
    },
    Goto {
        word: Token,
        label: Option<Token>,
    },
    /// A label alone, or what is not a statement.
    Other {
        /// Whether it was meant to end an IF.
        ends_if: bool,
    },
}

/// An expression as it is written.
#[derive(Debug)]
pub(crate) struct Expression {
    /// Its range of indices in [`Text::parts`].
    pub(crate) parts: Range<u32>,
    /// What is wrong with its form.
    pub(crate) error: Option<Box<Diagnostic>>,
}

/// A part of an expression, in postfix order.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Part {
    pub(crate) kind: PartKind,
    pub(crate) token: Token,
}

/// What a part of an expression is, as far as its token does not say it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PartKind {
    /// A number, a variable, T or F.
    Operand,
    /// The name of an array, in front of the parts of its index.
    Array,
    /// The `]` after an index.
    Element,
    /// NOT or the minus sign of a negation.
    Unary,
    /// An operator between two operands.
    Binary,
    /// An operand that is missing. The token is the last one of the statement.
    Missing,
}
