//! The statement interpreter: walks the download's statements, knows nothing of IR.
//!
//! Names are resolved to places beforehand; arithmetic is that of the `abi`, as the executive and
//! the load evaluator use it.

mod resolved;

use plcc_abi::image::{read_f64, read_u8, read_u32, write_f64, write_u32};
use plcc_abi::pmac::{Format, Kind, Layout, Range, Space, fixed, math};
use plcc_abi::{Engine, HostFn, Outcome, Scan};

use self::resolved::{Code, Long, Operand, Resolver, Step, Steps, Test, Whole, WholeStep};
use crate::pmac::analyse::eval;
use crate::pmac::analyse::load::Loaded;
use crate::pmac::ast::{Bin, Cmp, Download, Func, Target};
use crate::pmac::lower::{Runs, addresses, runs_of, tasks};

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
    tests: Vec<Test>,
    whole_steps: Vec<WholeStep>,
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
        let mut resolver = Resolver::new(download, loaded);
        let mut plcs = Vec::new();
        for (runs, code) in tasks(download, loaded) {
            let context = Runs::context(runs);
            let addresses = addresses(runs, code);
            resolver.addresses = addresses;
            let code = code.iter().map(|stmt| resolver.statement(stmt)).collect();
            plcs.push(Plc { code, context, addresses, next: 0 });
        }
        Self {
            layout: loaded.layout,
            steps: resolver.steps,
            tests: resolver.tests,
            whole_steps: resolver.whole_steps,
            plcs,
            longs: resolver.longs,
            ranges: loaded.ranges.clone(),
            stack: Vec::new(),
            integers: Vec::new(),
        }
    }
}

/// What a scan works with, apart from the stacks.
struct Machine<'a, 'b> {
    layout: &'a Layout,
    steps: &'a [Step],
    whole_steps: &'a [WholeStep],
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
        self.write_long_bits(long, fixed::field_bits(value, long.field.format));
    }

    fn write_long_integer(&mut self, index: u32, value: i32) {
        let Some(long) = self.longs.get(index as usize).copied() else { return };
        let bits = match long.field.format {
            Format::U | Format::S => value as u32,
            Format::D | Format::C => fixed::field_bits(f64::from(value), long.field.format),
        };
        self.write_long_bits(long, bits);
    }

    fn write_long_bits(&mut self, long: Long, bits: u32) {
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

    #[inline(always)]
    fn operand(&mut self, operand: Operand) -> f64 {
        match operand {
            Operand::Const(value) => value,
            Operand::Double(offset) => read_f64(self.scan.image, offset),
            Operand::Field(number, bits)
                if read_u8(self.scan.image, self.layout.moved + u32::from(number)) == 0 =>
            {
                f64::from(bits.of(read_u32(self.scan.image, bits.offset)))
            }
            other => self.far(other),
        }
    }

    /// An operand that takes more than to read the image.
    #[inline(never)]
    fn far(&mut self, operand: Operand) -> f64 {
        match operand {
            Operand::Const(value) => value,
            Operand::Double(offset) => read_f64(self.scan.image, offset),
            Operand::System(number) => read_f64(self.scan.image, self.q_offset(number)),
            Operand::Field(number, _) => self.read(Kind::M, u32::from(number)),
            Operand::General(number) => self.read(Kind::M, number),
            Operand::Long(index) => f64::from(self.read_long(index)),
        }
    }

    fn holds(&mut self, test: Test) -> bool {
        eval::compare(test.cmp, self.operand(test.left), test.right)
    }

    fn value(&mut self, steps: Steps, stack: &mut Vec<f64>) -> f64 {
        let mut value = 0.0;
        for step in steps.of(self.steps) {
            value = match *step {
                Step::Load(operand) => self.operand(operand),
                Step::Push(operand) => {
                    stack.push(value);
                    self.operand(operand)
                }
                Step::Bin(bin, operand) => {
                    let right = self.operand(operand);
                    eval::binary(bin, value, right)
                }
                Step::BinTop(bin) => eval::binary(bin, stack.pop().unwrap_or(0.0), value),
                Step::Cmp(cmp, operand) => {
                    let right = self.operand(operand);
                    truth(eval::compare(cmp, value, right))
                }
                Step::CmpTop(cmp) => truth(eval::compare(cmp, stack.pop().unwrap_or(0.0), value)),
                Step::Neg => -value,
                Step::Call(func) => {
                    let cosine = if func == Func::Atan2 { self.read(Kind::Q, 0) } else { 0.0 };
                    let radians = read_f64(self.scan.image, self.layout.i_offset(15)) != 0.0;
                    eval::function(func, value, cosine, radians)
                }
                Step::Indirect(kind) => self.read(kind, fixed::index(value, self.layout.count - 1)),
                Step::Both => truth((stack.pop().unwrap_or(0.0) != 0.0) & (value != 0.0)),
                Step::Either => truth((stack.pop().unwrap_or(0.0) != 0.0) | (value != 0.0)),
            };
        }
        value
    }

    fn whole(&mut self, operand: Whole) -> i32 {
        match operand {
            Whole::Const(value) => value,
            Whole::Bits(bits) => bits.of(read_u32(self.scan.image, bits.offset)),
            Whole::Long(index) => wrap(self.read_long(index)),
        }
    }

    /// The steps of a statement of L-variables: 24 bits, wrapping after every operation.
    fn integer(&mut self, steps: Steps, stack: &mut Vec<i32>) -> i32 {
        let mut value = 0;
        for step in steps.of(self.whole_steps) {
            value = match *step {
                WholeStep::Load(operand) => self.whole(operand),
                WholeStep::Push(operand) => {
                    stack.push(value);
                    self.whole(operand)
                }
                WholeStep::Bin(bin, operand) => integer_binary(bin, value, self.whole(operand)),
                WholeStep::BinTop(bin) => integer_binary(bin, stack.pop().unwrap_or(0), value),
                WholeStep::Cmp(cmp, operand) => compare(cmp, value, self.whole(operand)),
                WholeStep::CmpTop(cmp) => compare(cmp, stack.pop().unwrap_or(0), value),
                WholeStep::Neg => wrap(value.wrapping_neg()),
                WholeStep::Abs => wrap(value.wrapping_abs()),
                WholeStep::Both => stack.pop().unwrap_or(0) & value,
                WholeStep::Either => stack.pop().unwrap_or(0) | value,
            };
        }
        value
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

/// The low 24 bits, sign-extended.
fn wrap(value: i32) -> i32 {
    value << 8 >> 8
}

fn integer_binary(op: Bin, a: i32, b: i32) -> i32 {
    match op {
        Bin::Add => wrap(a.wrapping_add(b)),
        Bin::Sub => wrap(a.wrapping_sub(b)),
        Bin::Mul => wrap(a.wrapping_mul(b)),
        Bin::Div => math::int_div(a, b),
        Bin::Mod => math::int_modulo(a, b),
        Bin::And => a & b,
        Bin::Or => a | b,
        Bin::Xor => a ^ b,
    }
}

fn compare(cmp: Cmp, left: i32, right: i32) -> i32 {
    i32::from(match cmp {
        Cmp::Eq | Cmp::Near => left == right,
        Cmp::Ne | Cmp::NotNear => left != right,
        Cmp::Gt => left > right,
        Cmp::NotGt => left <= right,
        Cmp::Lt => left < right,
        Cmp::NotLt => left >= right,
    })
}

impl Engine for Interpreter {
    fn call(&mut self, task: usize, scan: &mut Scan<'_>) -> Outcome {
        let Some(plc) = self.plcs.get_mut(task) else { return Outcome::End };
        let mut machine = Machine {
            layout: &self.layout,
            steps: &self.steps,
            whole_steps: &self.whole_steps,
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
                        let whole = value as i32;
                        let bits = match field.format {
                            Format::U | Format::S if f64::from(whole) == value => whole as u32,
                            format => fixed::field_bits(value, format),
                        };
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
                    machine.write_long_integer(index, value);
                }
                Code::If(steps, target) => {
                    if machine.value(steps, stack) == 0.0 {
                        pc = target;
                    }
                }
                Code::IfOne(test, target) => {
                    if !machine.holds(test) {
                        pc = target;
                    }
                }
                Code::IfAll(start, end, target) => {
                    let tests = self.tests.get(start as usize..end as usize).unwrap_or(&[]);
                    if !tests.iter().all(|&test| machine.holds(test)) {
                        pc = target;
                    }
                }
                Code::IfOneInteger(cmp, left, right, target) => {
                    if compare(cmp, machine.whole(left), right) == 0 {
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
                Code::AddressBy(steps) => {
                    let number = fixed::bits(machine.value(steps, stack));
                    let offset = machine.layout.q_base + 4 * machine.context;
                    if (1..=u64::from(machine.layout.systems())).contains(&number) {
                        let base = machine.layout.q_base_of(number as u32);
                        write_u32(machine.scan.image, offset, base);
                    }
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
