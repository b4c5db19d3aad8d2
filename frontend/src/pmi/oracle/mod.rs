//! The statement interpreter, which walks the checked program's statements.
//!
//! It is the oracle with which the other engines are compared. It uses neither lowering nor IR.
//! Names are resolved to offsets before the first scan, and a scan allocates nothing.

mod effect;
mod resolve;
mod row;

use std::ops::Range;

use plcc_abi::{
    Engine, Host, Outcome, ResumePoint, Scan, SourceLine, TimeLimit, Trap, TrapCode,
    image::{write_i16, write_i32, write_u8},
    pmi::{Type, arithmetic},
};
use plcc_diag::Span;

use crate::common::{NoObserver, Observer, StatementInterpreter};
use crate::pmi::{
    access,
    ast::{self, Checked},
    layout::{Layout, Location},
};
use effect::Effect;
use resolve::Resolver;
use row::{Array, Observed, Row, Rows};

/// A step of the program, with names resolved to places.
#[derive(Clone, Copy, Debug)]
enum Step {
    /// Assigns to a LOGICAL, without any effect.
    Logical { offset: u32, value: Row },
    /// Assigns to a variable. `effect` is an index in [`Interpreter::effects`], or
    /// [`resolve::NO_EFFECT`].
    Assign { location: Location, value: Row, effect: u32 },
    /// Assigns to an element of an array; `effect` as in `Assign`.
    AssignElement { array: Array, index: Row, value: Row, effect: u32 },
    /// Goes on with the next step if the condition is true, otherwise with the step at the index `otherwise`.
    If { condition: Row, otherwise: u32 },
    /// Goes on with the step at this index.
    Jump(u32),
}

/// The statement interpreter.
#[derive(Clone, Debug)]
pub struct Interpreter {
    rows: Rows,
    steps: Vec<Step>,
    /// What assignments do besides storing a value; steps name these by their index.
    effects: Vec<Effect>,
    /// How often each step ran; empty if the interpreter does not count.
    counts: Vec<u64>,
    /// The place of each step's statement; `None` for the jump at the end of an IF's body, which is
    /// no statement of its own.
    spans: Vec<Option<Span>>,
    /// The line at which each step's statement begins.
    lines: Vec<SourceLine>,
}

impl Interpreter {
    pub(crate) fn new(checked: &Checked, layout: &Layout) -> Self {
        let mut resolver = Resolver::new(checked, layout);
        let steps: Vec<Step> =
            checked.steps.iter().map(|step| resolver.step(&step.action)).collect();
        let Resolver { rows, effects, .. } = resolver;
        let spans =
            checked.steps.iter().map(|s| s.action.is_statement().then_some(s.span)).collect();
        let line = |step: &ast::Step| SourceLine { file: step.span.file.0, line: step.line };
        let lines = checked.steps.iter().map(line).collect();
        Self { rows, steps, effects, counts: vec![], spans, lines }
    }

    /// This interpreter, but with counts of how often each step runs.
    pub(crate) fn counting(self) -> Self {
        Self { counts: vec![0; self.steps.len()], ..self }
    }

    /// The place of every executable statement (assignment, IF, ELSEIF, GOTO) and the number of
    /// times that it has run. Empty if the interpreter does not count.
    pub fn counts(&self) -> impl Iterator<Item = (Span, u64)> {
        self.spans.iter().zip(&self.counts).filter_map(|(span, &count)| Some(((*span)?, count)))
    }

    /// Runs the steps of a scan from one to another, and gives the number of the step that would follow.
    ///
    /// # Errors
    /// When an index is outside its array, and when the scan takes too long.
    fn scan<O: Observer>(
        &mut self,
        range: Range<usize>,
        image: &mut [u8],
        host: &mut dyn Host,
        mut limit: TimeLimit<'_>,
        observer: &mut O,
    ) -> Result<usize, Stopped> {
        let Self { rows, steps, effects, counts, spans, .. } = self;
        let mut at = range.start;
        // Jumps lead forwards alone.
        let steps = steps.get(..range.end).unwrap_or(steps);
        while let Some(step) = steps.get(at) {
            if limit.is_over(host) {
                return Err(Stopped::Late(at));
            }
            if let Some(count) = counts.get_mut(at) {
                *count += 1;
            }
            if observer.is_active() && spans.get(at).is_some_and(Option::is_some) {
                observer.statement(at as u32, image);
            }
            let this = Stopped::Missing(at);
            at += 1;
            match *step {
                Step::Logical { offset, value } => {
                    let value = rows.value(value, image, observer).ok_or(this)?;
                    write_u8(image, offset, u8::from(value != 0));
                    observer.write(access::accessed(offset), Type::Logical.observed(value));
                }
                Step::Assign { location, value, effect } => {
                    let value = rows.value(value, image, observer).ok_or(this)?;
                    assign(image, location, value, effects.get(effect as usize), observer);
                }
                Step::AssignElement { array, index, value, effect } => {
                    let location = array
                        .at(rows.value(index, image, observer).ok_or(this)?)
                        .map_err(|element| {
                            rows.missing = Some(element);
                            this
                        })?;
                    let value = rows.value(value, image, observer).ok_or(this)?;
                    assign(image, location, value, effects.get(effect as usize), observer);
                }
                Step::If { condition, otherwise } => {
                    if rows.value(condition, image, observer).ok_or(this)? == 0 {
                        at = otherwise as usize;
                    }
                }
                Step::Jump(to) => at = to as usize,
            }
        }
        Ok(at)
    }
}

/// Assigns a value to a variable and does what follows from that.
fn assign<O: Observer>(
    image: &mut [u8],
    location: Location,
    value: i32,
    effect: Option<&Effect>,
    observer: &mut O,
) {
    let mut value = arithmetic::convert(value, location.ty);
    if let Some(Effect::Reset) = effect {
        value &= location.read(image);
    }
    match location.ty {
        Type::Logical => write_u8(image, location.offset, value as u8),
        Type::Integer => write_i16(image, location.offset, value as i16),
        Type::Long => write_i32(image, location.offset, value),
    }
    observer.write(access::accessed(location.offset), location.ty.observed(value));
    match effect {
        Some(Effect::Timer(timer)) => timer.control(image, value != 0),
        Some(Effect::Clock(flipflop)) => flipflop.act(image, true),
        Some(Effect::Pin(flipflop)) => flipflop.act(image, false),
        Some(Effect::Reset) | None => {}
    }
    if observer.is_active()
        && let Some(effect) = effect
    {
        for location in effect.written() {
            observer.write(
                access::accessed(location.offset),
                location.ty.observed(location.read(image)),
            );
        }
    }
}

/// Why a scan did not come to its end.
#[derive(Clone, Copy, Debug)]
enum Stopped {
    /// In the step with this number an index was outside its array. [`Rows::missing`] is the element.
    Missing(usize),
    /// It took too long, and was stopped before the step with this number.
    Late(usize),
}

impl Engine for Interpreter {
    fn call(&mut self, task: usize, _: Option<ResumePoint>, scan: &mut Scan<'_>) -> Outcome {
        self.run(task, scan, &mut NoObserver)
    }
}

impl StatementInterpreter for Interpreter {
    fn call_observed(
        &mut self,
        task: usize,
        _: Option<ResumePoint>,
        scan: &mut Scan<'_>,
        mut observer: &mut dyn Observer,
    ) -> Outcome {
        self.run(task, scan, &mut observer)
    }

    fn execute(
        &mut self,
        task: usize,
        statement: u32,
        scan: &mut Scan<'_>,
        mut observer: &mut dyn Observer,
    ) -> Option<u32> {
        let at = statement as usize;
        if task != 0 || at >= self.steps.len() {
            return None;
        }
        let next = self.scan(at..at + 1, scan.image, scan.host, scan.limit, &mut observer).ok()?;
        (next < self.steps.len()).then_some(next as u32)
    }
}

impl Interpreter {
    fn run<O: Observer>(&mut self, task: usize, scan: &mut Scan<'_>, observer: &mut O) -> Outcome {
        if task != 0 {
            return Outcome::End;
        }
        match self.scan(0..self.steps.len(), scan.image, scan.host, scan.limit, observer) {
            Ok(_) => Outcome::End,
            Err(Stopped::Late(step)) => Outcome::Trap(Trap::late(self.lines.get(step).copied())),
            Err(Stopped::Missing(step)) => Outcome::Trap(Trap {
                code: TrapCode::ArrayBounds,
                statement: self.lines.get(step).copied(),
                element: self.rows.missing,
            }),
        }
    }
}
