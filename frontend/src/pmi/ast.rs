//! The checked program. All names in it are resolved and all types known.
//!
//! Its expressions are operations in postfix order, all in one vector, so that an expression of any
//! length is evaluated in a loop. Its statements are steps with jump targets, in the order of the
//! text.

use std::ops::Range;

pub(crate) use plcc_abi::pmi::arithmetic::Binary;
use plcc_abi::pmi::{DeclaredCode, Lines, TimerKind, Type};
use plcc_diag::Span;

/// An index into [`Checked::symbols`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) struct SymbolId(pub(super) u32);

/// What a name stands for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Meaning {
    /// A variable that may be read and written. Data pins of flip-flops, faults and messages are
    /// such variables too.
    Variable,
    /// Digital inputs.
    Input(Lines),
    /// Digital outputs.
    Output(Lines),
    /// A constant, or an array of them, with its values.
    Constant(Vec<i32>),
    /// An executive variable that may be read.
    ReadOnly,
    /// An executive variable that an assignment can only clear.
    ResetOnly,
    /// A timer's control contact: its index in [`Checked::timers`].
    TimerControl(u32),
    /// A timer's delayed contact, or a flip-flop's output. The program can only read it.
    Derived,
    /// A flip-flop's clock: its index in [`Checked::flipflops`].
    Clock(u32),
    /// A flip-flop's preset or clear: its index in [`Checked::flipflops`].
    Pin(u32),
    /// A statement label: the index of the step that it marks, `None` until the label is reached.
    Label(Option<u32>),
    /// A name from a declaration that has an error. Nothing is known of it, so no use of it is
    /// reported.
    Unknown,
}

/// A name of the program.
#[derive(Clone, Debug)]
pub(crate) struct Symbol {
    pub(crate) name: String,
    pub(crate) ty: Type,
    /// How many elements an array has; `None` for what is not an array.
    pub(crate) elements: Option<u32>,
    pub(crate) meaning: Meaning,
    /// Where it is declared; nowhere for executive variables.
    pub(crate) declared: Option<Span>,
    /// Whether the program declares or uses it. Only such symbols are dumped.
    pub(crate) named: bool,
    /// Whether it is an executive variable; its name begins with `@`.
    pub(crate) executive: bool,
}

/// A timer by its contacts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TimerDef {
    pub(crate) kind: TimerKind,
    pub(crate) control: SymbolId,
    pub(crate) delayed: SymbolId,
    /// The delay, in units of 20 ms.
    pub(crate) preset: i32,
    /// Where the source has the delay.
    pub(crate) preset_span: Span,
}

/// A flip-flop by its pins.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FlipFlopDef {
    pub(crate) q: SymbolId,
    pub(crate) d: SymbolId,
    pub(crate) clock: SymbolId,
    pub(crate) preset: SymbolId,
    pub(crate) clear: SymbolId,
}

/// A part of a fault's or message's text: characters, or the value of a variable.
#[derive(Clone, Debug)]
pub(crate) enum Item {
    Text(String),
    Value(SymbolId),
}

/// A fault or message.
#[derive(Clone, Debug)]
pub(crate) struct Announcement {
    pub(crate) symbol: SymbolId,
    pub(crate) items: Vec<Item>,
}

/// An operation of an expression in postfix order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Op {
    /// Pushes a value.
    Const(i32),
    /// Pushes a variable's value.
    Load(SymbolId),
    /// Pushes the value of an element whose index is known.
    LoadAt(SymbolId, u32),
    /// Pops an index and pushes that element, or stops the program.
    Element(SymbolId),
    /// Negates, in 16 bits unless `long`.
    Neg { long: bool },
    /// True for zero.
    Not,
    /// Pops the right operand, then the left, and pushes the result.
    Binary(Binary),
}

/// An expression: its range of indices in [`Checked::ops`].
pub(crate) type Ops = Range<u32>;

/// Where an assignment goes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Target {
    /// A variable.
    Scalar(SymbolId),
    /// An element whose index is known.
    At(SymbolId, u32),
    /// An element; its index is computed before the value.
    Element(SymbolId, Ops),
}

/// What a step does.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Action {
    /// Assigns a value.
    Assign { target: Target, value: Ops },
    /// Goes on with the next step if the condition is true, otherwise with the step `otherwise`.
    If { condition: Ops, otherwise: u32 },
    /// Goes on with the later step `to`. This is a GOTO, or else the end of a body of an IF.
    Jump { to: u32, is_goto: bool },
}

impl Action {
    /// Whether it is a statement of the source: everything but the jump at the end of a body of an IF.
    pub(crate) fn is_statement(&self) -> bool {
        !matches!(self, Self::Jump { is_goto: false, .. })
    }
}

/// A step of the scan.
#[derive(Clone, Debug)]
pub(crate) struct Step {
    pub(crate) action: Action,
    pub(crate) span: Span,
    /// The line in which it starts, from 1.
    pub(crate) line: u32,
}

/// A checked program.
#[derive(Clone, Debug, Default)]
pub(crate) struct Checked {
    pub(crate) symbols: Vec<Symbol>,
    /// Where the source has the values of the constants that the program declares, one span for each value.
    pub(crate) constant_spans: Vec<(SymbolId, Vec<Span>)>,
    pub(crate) timers: Vec<TimerDef>,
    pub(crate) flipflops: Vec<FlipFlopDef>,
    pub(crate) faults: Vec<Announcement>,
    pub(crate) messages: Vec<Announcement>,
    /// The keys that `$KEY` declares, in order: name and text.
    pub(crate) keys: Vec<(String, String)>,
    /// The lines of `$AUXAXIS`: name and numbers.
    pub(crate) auxiliary: Vec<(String, Vec<i32>)>,
    /// The M and G codes that `$MCODE` and `$GCODE` declare, in order.
    pub(crate) codes: Vec<DeclaredCode>,
    pub(crate) ops: Vec<Op>,
    pub(crate) steps: Vec<Step>,
}

impl Checked {
    pub(crate) fn ops(&self, range: &Ops) -> &[Op] {
        self.ops.get(range.start as usize..range.end as usize).unwrap_or(&[])
    }

    pub(crate) fn symbol(&self, id: SymbolId) -> Option<&Symbol> {
        self.symbols.get(id.0 as usize)
    }

    /// As [`place_of_value`](crate::language::CheckedProgram::place_of_value).
    pub(crate) fn place_of_value(&self, name: &str) -> Option<Span> {
        let named = |id: SymbolId, name: &str| self.symbol(id).is_some_and(|it| it.name == name);
        if let Some(control) = name.strip_suffix("#DELAY") {
            let timer = self.timers.iter().find(|timer| named(timer.control, control))?;
            return Some(timer.preset_span);
        }
        let (base, index) = match name.split_once('[') {
            Some((base, rest)) => (base, Some(rest.strip_suffix(']')?.trim().parse().ok()?)),
            None => (name, None),
        };
        let (id, spans) = self.constant_spans.iter().find(|(id, _)| named(*id, base))?;
        let symbol = self.symbol(*id)?;
        let is_number = matches!(symbol.ty, Type::Integer | Type::Long);
        let is_whole = symbol.elements.is_some() == index.is_some();
        spans.get(index.unwrap_or(0)).copied().filter(|_| is_number && is_whole)
    }
}
