//! Statements with their names resolved: what the statement interpreter walks.
//!
//! An expression works on one value at hand; a stack keeps what waits meanwhile. An operator whose
//! right operand is a variable or a number takes it along.

use std::collections::HashMap;

use plcc_abi::pmac::{Definition, Direct, Field, Format, Kind, Layout, Place, PlcOp, Space};

use crate::pmac::analyse::load::Loaded;
use crate::pmac::ast::{Bin, Cmp, Download, Expr, Func, Op, Stmt, Target, What};
use crate::pmac::lower::reliance::places_after_load;

/// A field of a word in the image.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bits {
    /// The word's offset.
    pub(crate) offset: u32,
    left: u8,
    right: u8,
    signed: bool,
}

impl Bits {
    /// For the formats that are plain bits.
    fn new(offset: u32, field: Field) -> Option<Self> {
        let (signed, width) = match field.format {
            Format::U => (false, field.width),
            Format::S => (true, field.width),
            Format::D | Format::C => return None,
        };
        let left = 32u8.checked_sub(field.offset.checked_add(width)?)?;
        Some(Self { offset, left, right: 32u8.checked_sub(width)?, signed })
    }

    /// The field's value in a word.
    pub(crate) fn of(self, word: u32) -> i32 {
        let high = word.wrapping_shl(self.left.into());
        match self.signed {
            true => (high as i32).wrapping_shr(self.right.into()),
            false => high.wrapping_shr(self.right.into()) as i32,
        }
    }
}

/// An L-variable.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Long {
    pub(crate) space: Space,
    pub(crate) address: u32,
    pub(crate) field: Field,
    /// Its word's offset, where it is in the image.
    pub(crate) offset: Option<u32>,
}

/// What a step reads.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Operand {
    Const(f64),
    /// A double at an offset of the image: P, I, and Q of coordinate system 1.
    Double(u32),
    /// A Q-variable of the addressed coordinate system.
    System(u32),
    /// An M-variable: its number, and the field it is while it has not moved.
    Field(u16, Bits),
    /// An M-variable through the host.
    General(u32),
    /// An L-variable: its index in the table.
    Long(u32),
}

/// A step of an expression or condition.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Step {
    /// The first value.
    Load(Operand),
    /// A further value; the one at hand waits.
    Push(Operand),
    /// The value at hand and an operand.
    Bin(Bin, Operand),
    /// The value that waits and the one at hand.
    BinTop(Bin),
    Cmp(Cmp, Operand),
    CmpTop(Cmp),
    Neg,
    Call(Func),
    Indirect(Kind),
    Both,
    Either,
}

/// What a step of a statement of L-variables reads.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Whole {
    Const(i32),
    Bits(Bits),
    Long(u32),
}

/// A step of a statement of L-variables.
#[derive(Clone, Copy, Debug)]
pub(crate) enum WholeStep {
    Load(Whole),
    Push(Whole),
    Bin(Bin, Whole),
    BinTop(Bin),
    Cmp(Cmp, Whole),
    CmpTop(Cmp),
    Neg,
    Abs,
    Both,
    Either,
}

/// A stretch of steps.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Steps {
    start: u32,
    end: u32,
}

impl Steps {
    /// No steps.
    pub(crate) const NONE: Self = Self { start: 0, end: 0 };

    /// These steps.
    pub(crate) fn of<T>(self, all: &[T]) -> &[T] {
        all.get(self.start as usize..self.end as usize).unwrap_or(&[])
    }
}

/// A comparison of a variable with a number.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Test {
    pub(crate) cmp: Cmp,
    pub(crate) left: Operand,
    pub(crate) right: f64,
}

impl Test {
    /// The comparisons that steps are, when they are nothing but such, joined by AND.
    fn all(steps: &[Step]) -> Option<Vec<Self>> {
        let [Step::Load(left), Step::Cmp(cmp, Operand::Const(right)), rest @ ..] = steps else {
            return None;
        };
        let mut tests = vec![Self { cmp: *cmp, left: *left, right: *right }];
        let triples = rest.chunks_exact(3);
        if !triples.remainder().is_empty() {
            return None;
        }
        for triple in triples {
            let [Step::Push(left), Step::Cmp(cmp, Operand::Const(right)), Step::Both] = triple
            else {
                return None;
            };
            tests.push(Self { cmp: *cmp, left: *left, right: *right });
        }
        Some(tests)
    }
}

/// A statement.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Code {
    Assign(Target, Steps, Steps),
    /// A P-variable, at an offset.
    Store(u32, Steps),
    /// An M-variable that is a field while it has not moved.
    StoreField(u32, u32, Field, Steps),
    /// An L-variable's statement in integers: its index, the value.
    Integer(u32, Steps),
    If(Steps, u32),
    /// A condition that compares a variable with a number.
    IfOne(Test, u32),
    /// Several such that must all hold: the first, and behind the last.
    IfAll(u32, u32, u32),
    IfInteger(Steps, u32),
    /// The same with an L-variable.
    IfOneInteger(Cmp, Whole, i32, u32),
    Jump(u32),
    EndWhile(u32),
    Plc(PlcOp, bool, u32),
    Address(u32),
    AddressBy(Steps),
    Text(u32, Option<Steps>),
    Define(u32),
    Word(Space, u32, Steps),
    Save,
    Nothing,
}

/// Resolves names.
pub(crate) struct Resolver<'a> {
    download: &'a Download,
    layout: Layout,
    places: Vec<Option<Direct>>,
    /// The task's coordinate system can be another than the first.
    pub(crate) addresses: bool,
    long_index: HashMap<u16, u32>,
    /// L-variables.
    pub(crate) longs: Vec<Long>,
    /// All steps.
    pub(crate) steps: Vec<Step>,
    /// All comparisons of conditions that are several.
    pub(crate) tests: Vec<Test>,
    /// All steps of statements of L-variables.
    pub(crate) whole_steps: Vec<WholeStep>,
}

impl<'a> Resolver<'a> {
    pub(crate) fn new(download: &'a Download, loaded: &Loaded) -> Self {
        let mut this = Self {
            download,
            layout: loaded.layout,
            places: places_after_load(loaded),
            addresses: false,
            long_index: HashMap::new(),
            longs: Vec::new(),
            steps: Vec::new(),
            tests: Vec::new(),
            whole_steps: Vec::new(),
        };
        for (&number, definition) in &download.l_defs {
            let (space, address, field) = match *definition {
                Definition::X { address, field } => (Space::X, address, field),
                Definition::Y { address, field } => (Space::Y, address, field),
                _ => continue,
            };
            let offset = match this.layout.place(space, address) {
                Place::Word(offset) => Some(offset),
                _ => None,
            };
            this.long_index.insert(number, this.longs.len() as u32);
            this.longs.push(Long { space, address, field, offset });
        }
        this
    }

    pub(crate) fn statement(&mut self, stmt: &Stmt) -> Code {
        match stmt.what {
            What::Assign(Target::Var(Kind::L, number), value) if stmt.integer => {
                match self.long_index.get(&number).copied() {
                    Some(index) => Code::Integer(index, self.whole(value)),
                    None => Code::Nothing,
                }
            }
            What::Assign(Target::Var(Kind::P, number), value) => {
                Code::Store(self.layout.p_offset(u32::from(number)), self.expr(value))
            }
            What::Assign(target, value) => self.assign(target, value),
            What::If(condition, target) | What::While(condition, target) if stmt.integer => {
                let steps = self.whole(condition);
                match *steps.of(&self.whole_steps) {
                    [WholeStep::Load(left), WholeStep::Cmp(cmp, Whole::Const(right))] => {
                        Code::IfOneInteger(cmp, left, right, target)
                    }
                    _ => Code::IfInteger(steps, target),
                }
            }
            What::If(condition, target) | What::While(condition, target) => {
                let steps = self.expr(condition);
                match Test::all(steps.of(&self.steps)).as_deref() {
                    Some(&[test]) => Code::IfOne(test, target),
                    Some(tests) => {
                        let start = self.tests.len() as u32;
                        self.tests.extend_from_slice(tests);
                        Code::IfAll(start, self.tests.len() as u32, target)
                    }
                    None => Code::If(steps, target),
                }
            }
            What::Jump(target) => Code::Jump(target),
            What::EndWhile(head) => Code::EndWhile(head),
            What::Plc(op, plcs) => Code::Plc(op, plcs.compiled, plcs.set),
            What::Address(_, Some(system)) => {
                Code::Address(self.layout.q_base_of(u32::from(system)))
            }
            What::AddressBy(_, system) if system.len > 0 => Code::AddressBy(self.expr(system)),
            What::Address(_, None) | What::AddressBy(..) => Code::Nothing,
            What::Text(index, value) => Code::Text(index, value.map(|value| self.expr(value))),
            What::Define(index) => Code::Define(index),
            What::Word(space, address, value) => Code::Word(space, address, self.expr(value)),
            What::Save => Code::Save,
        }
    }

    fn assign(&mut self, target: Target, value: Expr) -> Code {
        if let Target::Var(Kind::M, number) = target
            && let Some(Direct::Word(offset, _, field)) = self.place(number)
        {
            let offset = self.layout.words + offset;
            return Code::StoreField(u32::from(number), offset, field, self.expr(value));
        }
        let index = match target {
            Target::Indirect(_, index) => self.expr(index),
            _ => Steps::NONE,
        };
        let target = match target {
            // From here on the number is the index in the table.
            Target::Var(Kind::L, number) => {
                let index = self.long_index.get(&number).copied().unwrap_or(0);
                Target::Var(Kind::L, index as u16)
            }
            other => other,
        };
        Code::Assign(target, index, self.expr(value))
    }

    fn place(&self, number: u16) -> Option<Direct> {
        self.places.get(usize::from(number)).copied().flatten()
    }

    fn expr(&mut self, expr: Expr) -> Steps {
        let start = self.steps.len() as u32;
        let mut depth = 0;
        let mut ops = self.download.ops(expr).iter().peekable();
        while let Some(op) = ops.next() {
            let operand = match *op {
                Op::Const(value) => Operand::Const(value),
                Op::Var(kind, number) => self.variable(kind, number),
                Op::Indirect(kind) => {
                    self.steps.push(Step::Indirect(kind));
                    continue;
                }
                Op::Neg => {
                    self.steps.push(Step::Neg);
                    continue;
                }
                Op::Call(func) => {
                    self.steps.push(Step::Call(func));
                    continue;
                }
                Op::Bin(_) | Op::Cmp(_) | Op::Both | Op::Either => {
                    depth -= 1;
                    self.steps.push(match *op {
                        Op::Bin(bin) => Step::BinTop(bin),
                        Op::Cmp(cmp) => Step::CmpTop(cmp),
                        Op::Both => Step::Both,
                        _ => Step::Either,
                    });
                    continue;
                }
            };
            let step = match ops.peek() {
                Some(Op::Bin(bin)) => Step::Bin(*bin, operand),
                Some(Op::Cmp(cmp)) => Step::Cmp(*cmp, operand),
                _ => {
                    depth += 1;
                    self.steps.push(match depth {
                        1 => Step::Load(operand),
                        _ => Step::Push(operand),
                    });
                    continue;
                }
            };
            ops.next();
            self.steps.push(step);
        }
        Steps { start, end: self.steps.len() as u32 }
    }

    fn whole(&mut self, expr: Expr) -> Steps {
        let start = self.whole_steps.len() as u32;
        let mut depth = 0;
        let mut ops = self.download.ops(expr).iter().peekable();
        while let Some(op) = ops.next() {
            let operand = match *op {
                Op::Const(value) => Whole::Const(value as i32),
                Op::Var(_, number) => self.long(number),
                Op::Neg => {
                    self.whole_steps.push(WholeStep::Neg);
                    continue;
                }
                Op::Call(Func::Abs) => {
                    self.whole_steps.push(WholeStep::Abs);
                    continue;
                }
                // INT of an integer; nothing else comes here.
                Op::Call(_) | Op::Indirect(_) => continue,
                Op::Bin(_) | Op::Cmp(_) | Op::Both | Op::Either => {
                    depth -= 1;
                    self.whole_steps.push(match *op {
                        Op::Bin(bin) => WholeStep::BinTop(bin),
                        Op::Cmp(cmp) => WholeStep::CmpTop(cmp),
                        Op::Both => WholeStep::Both,
                        _ => WholeStep::Either,
                    });
                    continue;
                }
            };
            let step = match ops.peek() {
                Some(Op::Bin(bin)) => WholeStep::Bin(*bin, operand),
                Some(Op::Cmp(cmp)) => WholeStep::Cmp(*cmp, operand),
                _ => {
                    depth += 1;
                    self.whole_steps.push(match depth {
                        1 => WholeStep::Load(operand),
                        _ => WholeStep::Push(operand),
                    });
                    continue;
                }
            };
            ops.next();
            self.whole_steps.push(step);
        }
        Steps { start, end: self.whole_steps.len() as u32 }
    }

    fn long(&self, number: u16) -> Whole {
        let Some(&index) = self.long_index.get(&number) else { return Whole::Const(0) };
        let bits = self.longs.get(index as usize).and_then(|long| {
            // All 24 bits without sign are taken for a sign all the same.
            let field = match long.field {
                Field { width: 24, format: Format::U, offset } => {
                    Field { width: 24, format: Format::S, offset }
                }
                other => other,
            };
            Bits::new(long.offset?, field)
        });
        bits.map_or(Whole::Long(index), Whole::Bits)
    }

    fn variable(&self, kind: Kind, number: u16) -> Operand {
        let wide = u32::from(number);
        match kind {
            Kind::P => Operand::Double(self.layout.p_offset(wide)),
            Kind::I => Operand::Double(self.layout.i_offset(wide)),
            Kind::Q if !self.addresses => Operand::Double(self.layout.q_offset(wide)),
            Kind::Q => Operand::System(wide),
            Kind::L => Operand::Long(self.long_index.get(&number).copied().unwrap_or(u32::MAX)),
            Kind::M => match self.place(number) {
                Some(Direct::Word(offset, _, field)) => {
                    match Bits::new(self.layout.words + offset, field) {
                        Some(bits) => Operand::Field(number, bits),
                        None => Operand::General(wide),
                    }
                }
                _ => Operand::General(wide),
            },
        }
    }
}
