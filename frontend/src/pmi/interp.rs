//! The statement interpreter: walks the checked program as the original control did.
//!
//! It is the oracle that the other engines are held against. It knows nothing of IR; names are
//! resolved to offsets beforehand, and a scan allocates nothing.

use plcc_abi::{
    Engine, Outcome, Scan, TrapCode,
    image::{read_i16, read_i32, read_u8, write_i16, write_i32, write_u8},
    pmi::{TimerKind, Type},
};
use plcc_diag::Span;

use super::{
    arith,
    ast::{Action, Binary, Checked, Meaning, Op, Ops, SymbolId, Target},
    layout::Layout,
};

/// An operation with its operand's place.
#[derive(Clone, Copy, Debug)]
enum Code {
    Const(i32),
    Load(Place),
    /// Pops an index into so many elements.
    Element(Place, u32),
    Neg(bool),
    Not,
    Binary(Binary),
}

/// A variable's place.
#[derive(Clone, Copy, Debug)]
struct Place {
    offset: u32,
    ty: Type,
}

impl Place {
    fn read(self, image: &[u8]) -> i32 {
        match self.ty {
            Type::Logical => i32::from(read_u8(image, self.offset)),
            Type::Integer => i32::from(read_i16(image, self.offset)),
            Type::Long => read_i32(image, self.offset),
        }
    }

    fn write(self, image: &mut [u8], value: i32) {
        let value = arith::convert(value, self.ty);
        match self.ty {
            Type::Logical => write_u8(image, self.offset, value as u8),
            Type::Integer => write_i16(image, self.offset, value as i16),
            Type::Long => write_i32(image, self.offset, value),
        }
    }

    /// The element of an index, if there is one.
    fn at(self, index: i32, elements: u32) -> Option<Self> {
        let index = u32::try_from(index).ok().filter(|&index| index < elements)?;
        Some(Self { offset: self.offset + index * self.ty.size(), ..self })
    }
}

/// What an assignment sets off.
#[derive(Clone, Copy, Debug)]
enum Effect {
    None,
    /// The old value limits the new.
    Reset,
    Timer(Timer),
    FlipFlop {
        flipflop: FlipFlop,
        clocked: bool,
    },
}

/// A timer's places.
#[derive(Clone, Copy, Debug)]
struct Timer {
    kind: TimerKind,
    delayed: u32,
    counter: u32,
    preset: i32,
}

/// A flip-flop's places.
#[derive(Clone, Copy, Debug)]
struct FlipFlop {
    q: u32,
    d: u32,
    clock: u32,
    preset: u32,
    clear: u32,
    last_clock: u32,
}

/// A step with everything resolved.
#[derive(Clone, Debug)]
enum Step {
    /// Assigns to a variable.
    Assign { place: Place, value: Ops, effect: Effect },
    /// Assigns to an element.
    AssignElement { place: Place, elements: u32, index: Ops, value: Ops, effect: Effect },
    /// Goes on with the next step, or elsewhere.
    If { condition: Ops, otherwise: u32 },
    /// Goes on elsewhere.
    Jump(u32),
}

/// The statement interpreter.
#[derive(Clone, Debug)]
pub struct Interpreter {
    code: Vec<Code>,
    steps: Vec<Step>,
    /// How often each step ran; for those that are no statement of their own, nothing is told.
    counts: Vec<u64>,
    /// Places of the statements that steps stand for.
    spans: Vec<Option<Span>>,
    stack: Vec<i32>,
}

impl Interpreter {
    pub(super) fn new(checked: &Checked, layout: &Layout) -> Self {
        let resolver = Resolver { checked, layout };
        let steps: Vec<Step> =
            checked.steps.iter().map(|step| resolver.step(&step.action)).collect();
        let told = |action: &Action| !matches!(action, Action::Jump { counted: false, .. });
        Self {
            code: checked.ops.iter().map(|&op| resolver.code(op)).collect(),
            counts: vec![0; steps.len()],
            spans: checked.steps.iter().map(|s| told(&s.action).then_some(s.span)).collect(),
            steps,
            stack: vec![],
        }
    }

    /// Every executable statement (assignments, IF, ELSEIF, GOTO) with the number of times it
    /// has run.
    pub fn counts(&self) -> impl Iterator<Item = (Span, u64)> {
        self.spans.iter().zip(&self.counts).filter_map(|(span, &count)| Some(((*span)?, count)))
    }

    fn scan(&mut self, image: &mut [u8]) -> Outcome {
        let mut at = 0;
        while let Some(step) = self.steps.get(at) {
            if let Some(count) = self.counts.get_mut(at) {
                *count += 1;
            }
            at += 1;
            match step {
                Step::Assign { place, value, effect } => {
                    let Some(value) = eval(&self.code, value, &mut self.stack, image) else {
                        return Outcome::Trap(TrapCode::ArrayBounds);
                    };
                    assign(image, *place, value, *effect);
                }
                Step::AssignElement { place, elements, index, value, effect } => {
                    let index = eval(&self.code, index, &mut self.stack, image);
                    let Some(place) = index.and_then(|index| place.at(index, *elements)) else {
                        return Outcome::Trap(TrapCode::ArrayBounds);
                    };
                    let Some(value) = eval(&self.code, value, &mut self.stack, image) else {
                        return Outcome::Trap(TrapCode::ArrayBounds);
                    };
                    assign(image, place, value, *effect);
                }
                Step::If { condition, otherwise } => {
                    match eval(&self.code, condition, &mut self.stack, image) {
                        Some(0) => at = *otherwise as usize,
                        Some(_) => {}
                        None => return Outcome::Trap(TrapCode::ArrayBounds),
                    }
                }
                Step::Jump(to) => at = *to as usize,
            }
        }
        Outcome::End
    }
}

/// An expression's value; nothing where an index is outside its array.
fn eval(code: &[Code], ops: &Ops, stack: &mut Vec<i32>, image: &[u8]) -> Option<i32> {
    stack.clear();
    for op in code.get(ops.start as usize..ops.end as usize).unwrap_or(&[]) {
        let value = match *op {
            Code::Const(value) => value,
            Code::Load(place) => place.read(image),
            Code::Element(place, elements) => {
                place.at(stack.pop().unwrap_or(0), elements)?.read(image)
            }
            Code::Neg(long) => arith::negate(stack.pop().unwrap_or(0), long),
            Code::Not => i32::from(stack.pop().unwrap_or(0) == 0),
            Code::Binary(op) => {
                let right = stack.pop().unwrap_or(0);
                let left = stack.pop().unwrap_or(0);
                arith::binary(op, left, right)
            }
        };
        stack.push(value);
    }
    stack.pop().or(Some(0))
}

fn assign(image: &mut [u8], place: Place, value: i32, effect: Effect) {
    match effect {
        Effect::None => place.write(image, value),
        Effect::Reset => {
            let value = arith::convert(value, place.ty) & place.read(image);
            place.write(image, value);
        }
        Effect::Timer(timer) => {
            place.write(image, value);
            timer.control(image, value != 0);
        }
        Effect::FlipFlop { flipflop, clocked } => {
            place.write(image, value);
            flipflop.act(image, clocked);
        }
    }
}

impl Timer {
    /// PMI 3.1.9.2 and 3.1.9.3: what the control contact does at once.
    fn control(self, image: &mut [u8], on: bool) {
        let idle = read_i32(image, self.counter) == -1;
        let delayed = read_u8(image, self.delayed) != 0;
        match (self.kind, on) {
            (TimerKind::E, false) => {
                write_u8(image, self.delayed, 0);
                write_i32(image, self.counter, -1);
            }
            (TimerKind::E, true) if idle => write_i32(image, self.counter, self.preset),
            (TimerKind::D, true) => {
                write_u8(image, self.delayed, 1);
                write_i32(image, self.counter, -1);
            }
            (TimerKind::D, false) if idle && delayed => {
                write_i32(image, self.counter, self.preset);
            }
            _ => {}
        }
    }
}

impl FlipFlop {
    /// PMI 3.1.10.1: what an assignment to a pin does at once.
    fn act(self, image: &mut [u8], clocked: bool) {
        let on = |offset| read_u8(image, offset) != 0;
        let clock = on(self.clock);
        let rising = clocked && clock && !on(self.last_clock);
        let q = if on(self.clear) {
            false
        } else if on(self.preset) {
            true
        } else if rising {
            on(self.d)
        } else {
            on(self.q)
        };
        write_u8(image, self.q, u8::from(q));
        if clocked {
            write_u8(image, self.last_clock, u8::from(clock));
        }
    }
}

impl Engine for Interpreter {
    fn call(&mut self, task: usize, scan: &mut Scan<'_>) -> Outcome {
        if task == 0 { self.scan(scan.image) } else { Outcome::End }
    }

    fn reset(&mut self, _: usize) {}
}

/// Names to places.
struct Resolver<'a> {
    checked: &'a Checked,
    layout: &'a Layout,
}

impl Resolver<'_> {
    fn place(&self, id: SymbolId, index: u32) -> Place {
        let ty = self.checked.symbol(id).map_or(Type::Logical, |symbol| symbol.ty);
        Place { offset: self.layout.place(id) + index * ty.size(), ty }
    }

    fn elements(&self, id: SymbolId) -> u32 {
        self.checked.symbol(id).and_then(|symbol| symbol.elements).unwrap_or(1)
    }

    fn code(&self, op: Op) -> Code {
        match op {
            Op::Const(value) => Code::Const(value),
            Op::Load(id) => Code::Load(self.place(id, 0)),
            Op::LoadAt(id, index) => Code::Load(self.place(id, index)),
            Op::Element(id) => Code::Element(self.place(id, 0), self.elements(id)),
            Op::Neg { long } => Code::Neg(long),
            Op::Not => Code::Not,
            Op::Binary(op) => Code::Binary(op),
        }
    }

    fn step(&self, action: &Action) -> Step {
        match action {
            Action::Assign { target, value } => self.assign(target, value.clone()),
            Action::If { condition, otherwise } => {
                Step::If { condition: condition.clone(), otherwise: *otherwise }
            }
            Action::Jump { to, .. } => Step::Jump(*to),
        }
    }

    fn assign(&self, target: &Target, value: Ops) -> Step {
        match target {
            Target::Scalar(id) => {
                Step::Assign { place: self.place(*id, 0), value, effect: self.effect(*id) }
            }
            Target::At(id, index) => {
                Step::Assign { place: self.place(*id, *index), value, effect: self.effect(*id) }
            }
            Target::Element(id, index) => Step::AssignElement {
                place: self.place(*id, 0),
                elements: self.elements(*id),
                index: index.clone(),
                value,
                effect: self.effect(*id),
            },
        }
    }

    fn effect(&self, id: SymbolId) -> Effect {
        match self.checked.symbol(id).map(|symbol| &symbol.meaning) {
            Some(Meaning::ResetOnly) => Effect::Reset,
            Some(Meaning::TimerControl(index)) => self.timer(*index),
            Some(Meaning::Clock(index)) => self.flipflop(*index, true),
            Some(Meaning::Pin(index)) => self.flipflop(*index, false),
            _ => Effect::None,
        }
    }

    fn timer(&self, index: u32) -> Effect {
        let index = index as usize;
        let found = self.checked.timers.get(index).zip(self.layout.counters.get(index));
        found.map_or(Effect::None, |(timer, &counter)| {
            Effect::Timer(Timer {
                kind: timer.kind,
                delayed: self.layout.place(timer.delayed),
                counter,
                preset: timer.preset,
            })
        })
    }

    fn flipflop(&self, index: u32, clocked: bool) -> Effect {
        let index = index as usize;
        let found = self.checked.flipflops.get(index).zip(self.layout.last_clocks.get(index));
        found.map_or(Effect::None, |(pins, &last_clock)| {
            let flipflop = FlipFlop {
                q: self.layout.place(pins.q),
                d: self.layout.place(pins.d),
                clock: self.layout.place(pins.clock),
                preset: self.layout.place(pins.preset),
                clear: self.layout.place(pins.clear),
                last_clock,
            };
            Effect::FlipFlop { flipflop, clocked }
        })
    }
}
