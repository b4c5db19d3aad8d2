//! The statement interpreter: walks the download's statements, knows nothing of IR.
//!
//! Names are resolved to places beforehand; arithmetic is that of the `abi`, as the executive and
//! the load evaluator use it.

use plcc_abi::image::{read_f64, read_u8, read_u32, write_f64, write_u32};
use plcc_abi::pmac::{Definition, Field, Kind, Layout, Place, PlcOp, Range, Space, fixed, math};
use plcc_abi::{Engine, HostFn, Outcome, Scan};

use super::ast::{Bin, Cmp, Download, Expr, Func, Op, Target, What};
use super::eval;
use super::load::Loaded;
use super::lower::{Lowerer, Runs, addresses, runs_of, tasks};
use super::variables::Direct;

/// A step of an expression with its variable resolved.
#[derive(Clone, Copy, Debug)]
enum Step {
    Const(f64),
    /// A double at an offset of the image: P, I, and Q of coordinate system 1.
    Double(u32),
    /// A Q-variable of the addressed coordinate system.
    System(u32),
    /// An M-variable: its number, and the field it is while it has not moved.
    Field(u32, u32, Field),
    /// An M-variable through the host.
    General(u32),
    /// An L-variable: its index in the table.
    Long(u32),
    Indirect(Kind),
    Neg,
    Bin(Bin),
    Call(Func),
    Cmp(Cmp),
    Both,
    Either,
}

#[derive(Clone, Copy, Debug)]
struct Steps {
    start: u32,
    len: u32,
}

/// A statement with everything resolved.
#[derive(Clone, Copy, Debug)]
enum Code {
    Assign(Target, Steps, Steps),
    /// A P-variable, at an offset.
    Store(u32, Steps),
    /// An M-variable that is a field while it has not moved.
    StoreField(u32, u32, Field, Steps),
    /// An L-variable's statement in integers: its index, the value.
    Integer(u32, Steps),
    If(Steps, u32),
    IfInteger(Steps, u32),
    Jump(u32),
    EndWhile(u32),
    Plc(PlcOp, bool, u32),
    Address(u32),
    Text(u32, Option<Steps>),
    Define(u32),
    Word(Space, u32, Steps),
    Save,
    Nothing,
}

#[derive(Clone, Copy, Debug)]
struct Long {
    space: Space,
    address: u32,
    field: Field,
    /// Its word's offset, where it is in the image.
    offset: Option<u32>,
}

#[derive(Clone, Debug)]
struct Plc {
    code: Vec<Code>,
    context: u32,
    addresses: bool,
    /// Where the next scan starts.
    next: u32,
}

/// The statement interpreter.
#[derive(Clone, Debug)]
pub struct Interpreter {
    layout: Layout,
    steps: Vec<Step>,
    plcs: Vec<Plc>,
    longs: Vec<Long>,
    /// Ranges of I-variables.
    ranges: Vec<(u32, Range)>,
    stack: Vec<f64>,
    integers: Vec<i32>,
}

impl Interpreter {
    /// An interpreter at the state after load.
    pub(crate) fn new(download: &Download, loaded: &Loaded) -> Self {
        let mut this = Self {
            layout: loaded.layout,
            steps: Vec::new(),
            plcs: Vec::new(),
            longs: Vec::new(),
            ranges: loaded.ranges.clone(),
            stack: Vec::new(),
            integers: Vec::new(),
        };
        let mut resolver = Resolver {
            download,
            places: Lowerer::places_after_load(loaded),
            long_index: std::collections::HashMap::new(),
            addresses: false,
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
            resolver.long_index.insert(number, this.longs.len() as u32);
            this.longs.push(Long { space, address, field, offset });
        }
        for (runs, code) in tasks(download, loaded) {
            let context = Runs::context(runs);
            let addresses = addresses(runs, code);
            resolver.addresses = addresses;
            let code = code.iter().map(|stmt| this.resolve(&resolver, stmt)).collect();
            this.plcs.push(Plc { code, context, addresses, next: 0 });
        }
        this
    }

    fn resolve(&mut self, resolver: &Resolver<'_>, stmt: &super::ast::Stmt) -> Code {
        let mut expr = |expr: Expr| resolver.steps(self.layout, &mut self.steps, expr);
        match stmt.what {
            What::Assign(Target::Var(Kind::L, number), value) if stmt.integer => {
                match resolver.long_index.get(&number) {
                    Some(&index) => Code::Integer(index, expr(value)),
                    None => Code::Nothing,
                }
            }
            What::Assign(Target::Var(Kind::P, number), value) => {
                Code::Store(self.layout.p_offset(u32::from(number)), expr(value))
            }
            What::Assign(target, value) => {
                if let Target::Var(Kind::M, number) = target
                    && let Some(Direct::Word(offset, _, field)) = resolver.place(number)
                {
                    let number = u32::from(number);
                    return Code::StoreField(
                        number,
                        self.layout.words + offset,
                        field,
                        expr(value),
                    );
                }
                let index = match target {
                    Target::Indirect(_, index) => expr(index),
                    _ => Steps { start: 0, len: 0 },
                };
                let target = match target {
                    // From here on the number is the index in the table.
                    Target::Var(Kind::L, number) => {
                        let index = resolver.long_index.get(&number).copied().unwrap_or(0);
                        Target::Var(Kind::L, index as u16)
                    }
                    other => other,
                };
                Code::Assign(target, index, expr(value))
            }
            What::If(condition, target) | What::While(condition, target) => {
                let steps = expr(condition);
                if stmt.integer { Code::IfInteger(steps, target) } else { Code::If(steps, target) }
            }
            What::Jump(target) => Code::Jump(target),
            What::EndWhile(head) => Code::EndWhile(head),
            What::Plc(op, plcs) => Code::Plc(op, plcs.compiled, plcs.set),
            What::Address(_, Some(system)) => {
                Code::Address(self.layout.q_base_of(u32::from(system)))
            }
            What::Address(_, None) => Code::Nothing,
            What::Text(index, value) => Code::Text(index, value.map(expr)),
            What::Define(index) => Code::Define(index),
            What::Word(space, address, value) => Code::Word(space, address, expr(value)),
            What::Save => Code::Save,
        }
    }
}

/// What is needed to resolve names.
struct Resolver<'a> {
    download: &'a Download,
    places: Vec<Direct>,
    long_index: std::collections::HashMap<u16, u32>,
    addresses: bool,
}

impl Resolver<'_> {
    fn place(&self, number: u16) -> Option<Direct> {
        self.places.get(usize::from(number)).copied()
    }

    fn steps(&self, layout: Layout, out: &mut Vec<Step>, expr: Expr) -> Steps {
        let start = out.len() as u32;
        for op in self.download.ops(expr) {
            out.push(match *op {
                Op::Const(value) => Step::Const(value),
                Op::Var(kind, number) => self.variable(layout, kind, number),
                Op::Indirect(kind) => Step::Indirect(kind),
                Op::Neg => Step::Neg,
                Op::Bin(bin) => Step::Bin(bin),
                Op::Call(func) => Step::Call(func),
                Op::Cmp(cmp) => Step::Cmp(cmp),
                Op::Both => Step::Both,
                Op::Either => Step::Either,
            });
        }
        Steps { start, len: out.len() as u32 - start }
    }

    fn variable(&self, layout: Layout, kind: Kind, number: u16) -> Step {
        let wide = u32::from(number);
        match kind {
            Kind::P => Step::Double(layout.p_offset(wide)),
            Kind::I => Step::Double(layout.i_offset(wide)),
            Kind::Q if !self.addresses => Step::Double(layout.q_offset(wide)),
            Kind::Q => Step::System(wide),
            Kind::L => Step::Long(self.long_index.get(&number).copied().unwrap_or(u32::MAX)),
            Kind::M => match self.place(number) {
                Some(Direct::Word(offset, _, field)) => {
                    Step::Field(wide, layout.words + offset, field)
                }
                _ => Step::General(wide),
            },
        }
    }
}

/// What a scan works with, apart from the stacks.
struct Machine<'a, 'b> {
    layout: &'a Layout,
    steps: &'a [Step],
    longs: &'a [Long],
    ranges: &'a [(u32, Range)],
    context: u32,
    /// Whether the task's coordinate system can be another than the first.
    addresses: bool,
    scan: &'a mut Scan<'b>,
}

impl Machine<'_, '_> {
    fn host(&mut self, function: HostFn, args: [u64; 4]) -> u64 {
        self.scan.host.call(self.scan.image, function, args)
    }

    fn q_offset(&self, number: u32) -> u32 {
        let base = if self.addresses {
            read_u32(self.scan.image, self.layout.q_base + 4 * self.context)
        } else {
            0
        };
        self.layout.q_offset(base.wrapping_add(number))
    }

    fn read(&mut self, kind: Kind, number: u32) -> f64 {
        let offset = match kind {
            Kind::P => self.layout.p_offset(number),
            Kind::I => self.layout.i_offset(number),
            Kind::Q => self.q_offset(number),
            Kind::M | Kind::L => {
                return f64::from_bits(self.host(HostFn::PmacMRead, [number.into(), 0, 0, 0]));
            }
        };
        read_f64(self.scan.image, offset)
    }

    fn word(&mut self, long: Long) -> u32 {
        match long.offset {
            Some(offset) => read_u32(self.scan.image, offset) & 0xFF_FFFF,
            None => {
                let space = u64::from(long.space == Space::Y);
                self.host(HostFn::PmacWordRead, [space, long.address.into(), 0, 0]) as u32
            }
        }
    }

    fn read_long(&mut self, index: u32) -> i32 {
        match self.longs.get(index as usize).copied() {
            Some(long) => fixed::read_field(self.word(long), long.field),
            None => 0,
        }
    }

    fn write_long(&mut self, index: u32, value: f64) {
        let Some(long) = self.longs.get(index as usize).copied() else { return };
        let bits = fixed::field_bits(value, long.field.format);
        let word = fixed::insert_field(self.word(long), long.field, bits);
        match long.offset {
            Some(offset) => write_u32(self.scan.image, offset, word),
            None => {
                let space = u64::from(long.space == Space::Y);
                let args = [space, long.address.into(), word.into(), 0];
                self.host(HostFn::PmacWordWrite, args);
            }
        }
    }

    fn value(&mut self, steps: Steps, stack: &mut Vec<f64>) -> f64 {
        let all = self.steps;
        let start = steps.start as usize;
        stack.clear();
        for step in all.get(start..start + steps.len as usize).unwrap_or(&[]) {
            let value = match *step {
                Step::Const(value) => value,
                Step::Double(offset) => read_f64(self.scan.image, offset),
                Step::System(number) => read_f64(self.scan.image, self.q_offset(number)),
                Step::Field(number, offset, field) => {
                    if read_u8(self.scan.image, self.layout.moved + number) != 0 {
                        self.read(Kind::M, number)
                    } else {
                        f64::from(fixed::read_field(read_u32(self.scan.image, offset), field))
                    }
                }
                Step::General(number) => self.read(Kind::M, number),
                Step::Long(index) => f64::from(self.read_long(index)),
                Step::Indirect(kind) => {
                    let index = stack.pop().unwrap_or(0.0);
                    self.read(kind, fixed::index(index, self.layout.count - 1))
                }
                Step::Neg => -stack.pop().unwrap_or(0.0),
                Step::Bin(bin) => {
                    let right = stack.pop().unwrap_or(0.0);
                    eval::binary(bin, stack.pop().unwrap_or(0.0), right)
                }
                Step::Call(func) => {
                    let x = stack.pop().unwrap_or(0.0);
                    let cosine = if func == Func::Atan2 { self.read(Kind::Q, 0) } else { 0.0 };
                    let radians = read_f64(self.scan.image, self.layout.i_offset(15)) != 0.0;
                    eval::function(func, x, cosine, radians)
                }
                Step::Cmp(cmp) => {
                    let right = stack.pop().unwrap_or(0.0);
                    truth(eval::compare(cmp, stack.pop().unwrap_or(0.0), right))
                }
                Step::Both => {
                    let right = stack.pop().unwrap_or(0.0) != 0.0;
                    truth(stack.pop().unwrap_or(0.0) != 0.0 && right)
                }
                Step::Either => {
                    let right = stack.pop().unwrap_or(0.0) != 0.0;
                    truth(stack.pop().unwrap_or(0.0) != 0.0 || right)
                }
            };
            stack.push(value);
        }
        stack.pop().unwrap_or(0.0)
    }

    /// The steps of a statement of L-variables: 24 bits, wrapping after every operation.
    fn integer(&mut self, steps: Steps, stack: &mut Vec<i32>) -> i32 {
        let all = self.steps;
        let start = steps.start as usize;
        stack.clear();
        for step in all.get(start..start + steps.len as usize).unwrap_or(&[]) {
            let mut pop = || stack.pop().unwrap_or(0);
            let value = match *step {
                Step::Const(value) => value as i32,
                Step::Long(index) => math::wrap24(i64::from(self.read_long(index))),
                Step::Neg => math::wrap24(-i64::from(pop())),
                Step::Bin(bin) => {
                    let (right, left) = (pop(), pop());
                    integer_binary(bin, left, right)
                }
                Step::Call(Func::Abs) => math::wrap24(i64::from(pop()).abs()),
                Step::Cmp(cmp) => {
                    let (right, left) = (pop(), pop());
                    i32::from(match cmp {
                        Cmp::Eq | Cmp::Near => left == right,
                        Cmp::Ne | Cmp::NotNear => left != right,
                        Cmp::Gt => left > right,
                        Cmp::NotGt => left <= right,
                        Cmp::Lt => left < right,
                        Cmp::NotLt => left >= right,
                    })
                }
                Step::Both => {
                    let (right, left) = (pop(), pop());
                    left & right
                }
                Step::Either => {
                    let (right, left) = (pop(), pop());
                    left | right
                }
                // INT of an integer; nothing else comes here.
                _ => pop(),
            };
            stack.push(value);
        }
        stack.pop().unwrap_or(0)
    }

    fn write(&mut self, kind: Kind, number: u32, value: f64) {
        let value = math::finite(value);
        match kind {
            Kind::P => write_f64(self.scan.image, self.layout.p_offset(number), value),
            Kind::Q => {
                let offset = self.q_offset(number);
                write_f64(self.scan.image, offset, value);
            }
            Kind::I => {
                let number = number & (self.layout.count - 1);
                let range = self.ranges.binary_search_by_key(&number, |r| r.0).ok();
                let range = range.and_then(|index| self.ranges.get(index));
                let value = range.map_or(value, |r| r.1.convert(value));
                write_f64(self.scan.image, self.layout.i_offset(number), value);
            }
            Kind::M => {
                self.host(HostFn::PmacMWrite, [number.into(), value.to_bits(), 0, 0]);
            }
            Kind::L => self.write_long(number, value),
        }
    }
}

fn truth(value: bool) -> f64 {
    f64::from(u8::from(value))
}

fn integer_binary(op: Bin, a: i32, b: i32) -> i32 {
    let (x, y) = (i64::from(a), i64::from(b));
    match op {
        Bin::Add => math::wrap24(x + y),
        Bin::Sub => math::wrap24(x - y),
        Bin::Mul => math::wrap24(x * y),
        Bin::Div => math::int_div(a, b),
        Bin::Mod => math::int_modulo(a, b),
        Bin::And => a & b,
        Bin::Or => a | b,
        Bin::Xor => a ^ b,
    }
}

impl Engine for Interpreter {
    fn call(&mut self, task: usize, scan: &mut Scan<'_>) -> Outcome {
        let Some(plc) = self.plcs.get_mut(task) else { return Outcome::End };
        let mut machine = Machine {
            layout: &self.layout,
            steps: &self.steps,
            longs: &self.longs,
            ranges: &self.ranges,
            context: plc.context,
            addresses: plc.addresses,
            scan,
        };
        let stack = &mut self.stack;
        let mut pc = std::mem::take(&mut plc.next);
        while let Some(code) = plc.code.get(pc as usize) {
            pc += 1;
            match *code {
                Code::Store(offset, steps) => {
                    let value = machine.value(steps, stack);
                    write_f64(machine.scan.image, offset, math::finite(value));
                }
                Code::StoreField(number, offset, field, steps) => {
                    let value = machine.value(steps, stack);
                    if read_u8(machine.scan.image, machine.layout.moved + number) != 0 {
                        machine.write(Kind::M, number, value);
                    } else {
                        let bits = fixed::field_bits(value, field.format);
                        let word = read_u32(machine.scan.image, offset);
                        let word = fixed::insert_field(word, field, bits);
                        write_u32(machine.scan.image, offset, word);
                    }
                }
                Code::Assign(target, index, steps) => match target {
                    Target::Var(kind, number) => {
                        let value = machine.value(steps, stack);
                        machine.write(kind, u32::from(number), value);
                    }
                    Target::Indirect(kind, _) => {
                        let index = machine.value(index, stack);
                        let index = fixed::index(index, machine.layout.count - 1);
                        let value = machine.value(steps, stack);
                        machine.write(kind, index, value);
                    }
                    Target::Range { kind, first, count, step } => {
                        let value = machine.value(steps, stack);
                        for k in 0..u32::from(count) {
                            machine.write(kind, u32::from(first) + k * u32::from(step), value);
                        }
                    }
                },
                Code::Integer(index, steps) => {
                    let value = machine.integer(steps, &mut self.integers);
                    machine.write_long(index, f64::from(value));
                }
                Code::If(steps, target) => {
                    if machine.value(steps, stack) == 0.0 {
                        pc = target;
                    }
                }
                Code::IfInteger(steps, target) => {
                    if machine.integer(steps, &mut self.integers) == 0 {
                        pc = target;
                    }
                }
                Code::Jump(target) => pc = target,
                Code::EndWhile(head) => {
                    plc.next = head;
                    return Outcome::Suspended;
                }
                Code::Plc(op, compiled, set) => {
                    for (first, last) in runs_of(set) {
                        let args = [op as u64, u64::from(compiled), first.into(), last.into()];
                        machine.host(HostFn::PmacPlc, args);
                    }
                }
                Code::Address(base) => {
                    let offset = machine.layout.q_base + 4 * machine.context;
                    write_u32(machine.scan.image, offset, base);
                }
                Code::Text(index, steps) => {
                    let value = steps.map_or(0.0, |steps| machine.value(steps, stack));
                    let value = math::finite(value).to_bits();
                    machine.host(HostFn::PmacEvent, [index.into(), value, 0, 0]);
                }
                Code::Define(index) => {
                    machine.host(HostFn::PmacDefine, [index.into(), 0, 0, 0]);
                }
                Code::Word(space, address, steps) => {
                    let value = fixed::bits(machine.value(steps, stack)) & 0xFFFF_FFFF;
                    let space = u64::from(space == Space::Y);
                    machine.host(HostFn::PmacWordWrite, [space, address.into(), value, 0]);
                }
                Code::Save => {
                    machine.host(HostFn::PmacSave, [0; 4]);
                }
                Code::Nothing => {}
            }
        }
        Outcome::End
    }

    fn reset(&mut self, task: usize) {
        if let Some(plc) = self.plcs.get_mut(task) {
            plc.next = 0;
        }
    }
}
