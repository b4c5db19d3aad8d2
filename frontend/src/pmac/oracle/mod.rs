//! The statement interpreter, which executes the download's statements without lowering and IR.
//!
//! It is the oracle that compiled code is compared with, so it decides by itself how
//! [variables reach memory](memory) and what [operators give](evaluate). Only the arithmetic
//! library, the image's layout and the executive are shared.

mod evaluate;
mod memory;
mod resolve;
mod resolved;

use plcc_abi::pmac::{Kind, Layout, Range, arithmetic, fixed};
use plcc_abi::{Engine, HostFn, Outcome, ResumePoint, Scan, SourceLine, Trap, TrapCode};
use plcc_diag::SourceMap;

use self::evaluate::{integer_binary, integer_compare, truth, wrap};
use self::memory::{Memory, MemoryMap};
use self::resolve::{Resolver, Tables};
use self::resolved::{
    Comparison, Destination, IntegerOperand, Operand, Operation, Statement, TableRange,
};
use super::analyse::load::Loaded;
use super::ast::{Download, Func, Stmt};
use super::tasks::{resume_points, tasks};
use crate::common::{NoObserver, Observer, StatementInterpreter};

/// The statements of a PLC, a PLCC or a command.
#[derive(Clone, Debug)]
struct Task {
    statements: Vec<Statement>,
    /// The offset in the image of the task's context, which has its addressed coordinate system.
    context: u32,
    /// The indices of the statements at which a suspended task goes on, in their order: the WHILE statements, in a
    /// motion program others too.
    resume_points: Vec<u32>,
    /// The number that its first statement has among the statements of all tasks.
    first: u32,
    /// The line at which each statement begins.
    lines: Vec<SourceLine>,
}

impl Task {
    /// The scan ends, and the next one goes on at the statement with this index.
    fn suspended(&self, at: u32) -> Outcome {
        match self.resume_points.binary_search(&at) {
            Ok(number) => Outcome::Suspended(ResumePoint(number as u32)),
            Err(_) => Outcome::trap(TrapCode::Internal),
        }
    }
}

/// The statement interpreter.
#[derive(Clone, Debug)]
pub struct Interpreter {
    layout: Layout,
    map: MemoryMap,
    tables: Tables,
    tasks: Vec<Task>,
    /// The ranges of I-variables, by rising number.
    ranges: Vec<(u32, Range)>,
    /// The stacks of values that wait for operators. They are kept from scan to scan so that a scan
    /// does not allocate.
    waiting: Vec<f64>,
    waiting_integers: Vec<i32>,
}

impl Interpreter {
    /// An interpreter for a download, whose texts are in `sources`. `loaded` is what executing its on-line
    /// commands gave.
    pub(crate) fn new(download: &Download, loaded: &Loaded, sources: &SourceMap) -> Self {
        let mut resolver = Resolver::new(download, loaded);
        let line = |stmt: &Stmt| {
            let (span, _) = download.origins.place(stmt.at);
            SourceLine { file: span.file.0, line: sources.line(span.file, span.start) }
        };
        let mut all = Vec::new();
        let mut first = 0;
        for (kind, code) in tasks(download, loaded) {
            let statements = code.iter().map(|stmt| resolver.statement(stmt)).collect();
            let resume_points = resume_points(download, kind, code);
            let lines = code.iter().map(line).collect();
            all.push(Task { statements, context: kind.context(), resume_points, first, lines });
            first += code.len() as u32;
        }
        Self {
            layout: loaded.layout,
            map: MemoryMap::new(loaded.layout.controller),
            tables: resolver.tables,
            tasks: all,
            ranges: loaded.ranges.clone(),
            waiting: Vec::new(),
            waiting_integers: Vec::new(),
        }
    }
}

/// What a scan works with, apart from the stacks.
struct Machine<'a, 'b, O> {
    tables: &'a Tables,
    memory: Memory<'a, 'b, O>,
}

impl<O: Observer> Machine<'_, '_, O> {
    #[inline(always)]
    fn operand(&mut self, operand: Operand) -> f64 {
        match operand {
            Operand::Constant(value) => value,
            Operand::Double(offset) => self.memory.double(offset),
            Operand::Field(number, bits) if self.memory.is_as_loaded(number) => {
                f64::from(self.memory.bits(Kind::M, number, bits))
            }
            other => self.computed_operand(other),
        }
    }

    /// The value of any operand. `operand` calls it for those for which one read of the image is not enough.
    #[inline(never)]
    fn computed_operand(&mut self, operand: Operand) -> f64 {
        match operand {
            Operand::Constant(value) => value,
            Operand::Double(offset) => self.memory.double(offset),
            Operand::Q(number) => self.memory.read(Kind::Q, number),
            Operand::Field(number, _) => self.memory.read(Kind::M, u32::from(number)),
            Operand::M(number) => self.memory.read(Kind::M, number),
            Operand::L(index) => f64::from(self.memory.read_l_variable(index)),
        }
    }

    fn holds(&mut self, comparison: Comparison) -> bool {
        evaluate::compare(comparison.cmp, self.operand(comparison.left), comparison.right)
    }

    /// The value of an expression; of a condition 1 or 0.
    fn value(&mut self, expression: TableRange, waiting: &mut Vec<f64>) -> f64 {
        let mut value = 0.0;
        for operation in expression.of(&self.tables.operations) {
            value = match *operation {
                Operation::Load(operand) => self.operand(operand),
                Operation::Push(operand) => {
                    waiting.push(value);
                    self.operand(operand)
                }
                Operation::Binary(op, operand) => {
                    let right = self.operand(operand);
                    evaluate::binary(op, value, right)
                }
                Operation::BinaryWaiting(op) => {
                    evaluate::binary(op, waiting.pop().unwrap_or(0.0), value)
                }
                Operation::Compare(cmp, operand) => {
                    let right = self.operand(operand);
                    truth(evaluate::compare(cmp, value, right))
                }
                Operation::CompareWaiting(cmp) => {
                    truth(evaluate::compare(cmp, waiting.pop().unwrap_or(0.0), value))
                }
                Operation::Negate => -value,
                Operation::Call(func) => {
                    let atan2 = func == Func::Atan2;
                    let cosine = if atan2 { self.memory.read(Kind::Q, 0) } else { 0.0 };
                    evaluate::function(func, value, cosine, self.memory.radians())
                }
                Operation::Indirect(kind) => {
                    let number = self.memory.map.computed_number(value);
                    self.memory.read(kind, number)
                }
                Operation::Both => {
                    let left = waiting.pop().unwrap_or(0.0);
                    truth((left != 0.0) & (value != 0.0))
                }
                Operation::Either => {
                    let left = waiting.pop().unwrap_or(0.0);
                    truth((left != 0.0) | (value != 0.0))
                }
            };
        }
        value
    }

    fn integer_operand(&mut self, operand: IntegerOperand) -> i32 {
        match operand {
            IntegerOperand::Constant(value) => value,
            IntegerOperand::Bits(number, bits) => self.memory.bits(Kind::L, number, bits),
            IntegerOperand::L(index) => wrap(self.memory.read_l_variable(index)),
        }
    }

    /// The value of an expression of L-variables, which wraps to 24 bits after every operation; of a condition
    /// 1 or 0.
    fn integer(&mut self, expression: TableRange, waiting: &mut Vec<i32>) -> i32 {
        let mut value = 0;
        for operation in expression.of(&self.tables.integer_operations) {
            value = match *operation {
                Operation::Load(operand) => self.integer_operand(operand),
                Operation::Push(operand) => {
                    waiting.push(value);
                    self.integer_operand(operand)
                }
                Operation::Binary(op, operand) => {
                    integer_binary(op, value, self.integer_operand(operand))
                }
                Operation::BinaryWaiting(op) => {
                    integer_binary(op, waiting.pop().unwrap_or(0), value)
                }
                Operation::Compare(cmp, operand) => {
                    integer_compare(cmp, value, self.integer_operand(operand))
                }
                Operation::CompareWaiting(cmp) => {
                    integer_compare(cmp, waiting.pop().unwrap_or(0), value)
                }
                Operation::Negate => wrap(value.wrapping_neg()),
                Operation::Call(Func::Abs) => wrap(value.wrapping_abs()),
                // INT of an integer. There are no others.
                Operation::Call(_) | Operation::Indirect(_) => value,
                Operation::Both => waiting.pop().unwrap_or(0) & value,
                Operation::Either => waiting.pop().unwrap_or(0) | value,
            };
        }
        value
    }

    fn assign(&mut self, to: Destination, expression: TableRange, waiting: &mut Vec<f64>) {
        match to {
            Destination::Variable(Kind::L, index) => {
                let value = arithmetic::finite(self.value(expression, waiting));
                self.memory.write_l_variable(index, value);
            }
            Destination::Variable(kind, number) => {
                let value = self.value(expression, waiting);
                self.memory.write(kind, number, value);
            }
            Destination::Indirect(kind, index) => {
                let index = self.value(index, waiting);
                let number = self.memory.map.computed_number(index);
                let value = self.value(expression, waiting);
                self.memory.write(kind, number, value);
            }
            // The right side is evaluated once.
            Destination::Range { kind, first, count, step } => {
                let value = self.value(expression, waiting);
                for k in 0..count {
                    self.memory.write(kind, first + k * step, value);
                }
            }
            Destination::LVariables(l_variables) => {
                let value = arithmetic::finite(self.value(expression, waiting));
                for &index in l_variables.of(&self.tables.l_variable_ranges) {
                    self.memory.write_l_variable(index, value);
                }
            }
        }
    }
}

impl Engine for Interpreter {
    fn call(&mut self, task: usize, from: Option<ResumePoint>, scan: &mut Scan<'_>) -> Outcome {
        self.run(task, from, scan, NoObserver)
    }
}

impl StatementInterpreter for Interpreter {
    fn call_observed(
        &mut self,
        task: usize,
        from: Option<ResumePoint>,
        scan: &mut Scan<'_>,
        observer: &mut dyn Observer,
    ) -> Outcome {
        self.run(task, from, scan, observer)
    }

    fn execute(
        &mut self,
        task: usize,
        statement: u32,
        scan: &mut Scan<'_>,
        observer: &mut dyn Observer,
    ) -> Option<u32> {
        let Task { first, statements, .. } = self.tasks.get(task)?;
        let (first, count) = (*first, statements.len() as u32);
        let at = statement.checked_sub(first).filter(|&at| at < count)?;
        let (outcome, next) = self.walk(task, at..at + 1, scan, observer);
        (outcome == Outcome::End && next < count).then_some(first + next)
    }
}

impl Interpreter {
    fn run<O: Observer>(
        &mut self,
        task: usize,
        from: Option<ResumePoint>,
        scan: &mut Scan<'_>,
        observer: O,
    ) -> Outcome {
        let Some(Task { statements, resume_points, .. }) = self.tasks.get(task) else {
            return Outcome::End;
        };
        let start = match from {
            None => Some(0),
            Some(ResumePoint(number)) => resume_points.get(number as usize).copied(),
        };
        let Some(at) = start else { return Outcome::trap(TrapCode::Internal) };
        let end = statements.len() as u32;
        self.walk(task, at..end, scan, observer).0
    }

    /// Executes the statements of a task from one to another, and gives how that ended, with the number of the statement
    /// that would follow. Jumps lead forwards alone.
    fn walk<O: Observer>(
        &mut self,
        task: usize,
        range: std::ops::Range<u32>,
        scan: &mut Scan<'_>,
        observer: O,
    ) -> (Outcome, u32) {
        let mut at = range.start;
        let Some(task) = self.tasks.get(task) else { return (Outcome::End, at) };
        let statements = task.statements.get(..range.end as usize).unwrap_or(&[]);
        let memory = Memory {
            layout: &self.layout,
            map: &self.map,
            l_variables: &self.tables.l_variables,
            ranges: &self.ranges,
            definitions: &self.tables.definitions,
            context: task.context,
            scan,
            observer,
        };
        let mut machine = Machine { tables: &self.tables, memory };
        let mut limit = machine.memory.scan.limit;
        let waiting = &mut self.waiting;
        while let Some(statement) = statements.get(at as usize) {
            if machine.memory.observer.is_active() {
                let Memory { observer, scan, .. } = &mut machine.memory;
                observer.statement(task.first + at, scan.image);
            }
            let this = at;
            at += 1;
            match *statement {
                Statement::AssignDouble(offset, expression) => {
                    let value = machine.value(expression, waiting);
                    machine.memory.write_double(offset, arithmetic::finite(value));
                }
                Statement::AssignField(number, offset, field, expression) => {
                    let value = machine.value(expression, waiting);
                    if machine.memory.is_as_loaded(number) {
                        machine.memory.write_bits(number, offset, field, value);
                    } else {
                        machine.memory.write(Kind::M, u32::from(number), value);
                    }
                }
                Statement::Assign(to, expression) => machine.assign(to, expression, waiting),
                Statement::AssignInteger(index, expression) => {
                    let value = machine.integer(expression, &mut self.waiting_integers);
                    machine.memory.write_l_variable_integer(index, value);
                }
                Statement::AssignIntegers(l_variables, expression) => {
                    let value = machine.integer(expression, &mut self.waiting_integers);
                    for &index in l_variables.of(&self.tables.l_variable_ranges) {
                        machine.memory.write_l_variable_integer(index, value);
                    }
                }
                Statement::If(condition, target) => {
                    if machine.value(condition, waiting) == 0.0 {
                        at = target;
                    }
                }
                Statement::IfComparison(comparison, target) => {
                    if !machine.holds(comparison) {
                        at = target;
                    }
                }
                Statement::IfAll(comparisons, target) => {
                    let comparisons = comparisons.of(&self.tables.comparisons);
                    // An observer is told of all variables that the condition names.
                    let mut all = true;
                    for &comparison in comparisons {
                        all &= machine.holds(comparison);
                        if !all && !machine.memory.observer.is_active() {
                            break;
                        }
                    }
                    if !all {
                        at = target;
                    }
                }
                Statement::IfIntegerComparison(cmp, left, right, target) => {
                    if integer_compare(cmp, machine.integer_operand(left), right) == 0 {
                        at = target;
                    }
                }
                Statement::IfInteger(condition, target) => {
                    if machine.integer(condition, &mut self.waiting_integers) == 0 {
                        at = target;
                    }
                }
                Statement::Jump(target) => at = target,
                Statement::EndWhile(head) => {
                    return (task.suspended(head), at);
                }
                Statement::Plc(op, compiled, set) => {
                    for number in (0..32_u64).filter(|number| set >> number & 1 != 0) {
                        let args = [op as u64, u64::from(compiled), number, number];
                        machine.memory.host(HostFn::PmacPlc, args);
                    }
                }
                Statement::Address(system) => machine.memory.address(system),
                Statement::AddressBy(expression) => {
                    let number = machine.value(expression, waiting);
                    machine.memory.address(fixed::bits(number));
                }
                Statement::Text(index, shown) => {
                    let value = shown.map_or(0.0, |expression| machine.value(expression, waiting));
                    let value = arithmetic::finite(value).to_bits();
                    machine.memory.host(HostFn::PmacEvent, [index.into(), value, 0, 0]);
                }
                Statement::Define(index) => {
                    machine.memory.host(HostFn::PmacDefine, [index.into(), 0, 0, 0]);
                }
                Statement::Word(space, address, expression) => {
                    let value = machine.value(expression, waiting);
                    machine.memory.write_word(space, address, fixed::bits(value) as u32);
                }
                Statement::AddressMotor(motor) => {
                    machine.memory.address_motor(f64::from(motor));
                }
                Statement::AddressBoth(motor, system) => {
                    let motor = machine.value(motor, waiting);
                    machine.memory.address_motor(motor);
                    if let Some(system) = system {
                        let number = machine.value(system, waiting);
                        machine.memory.address(fixed::bits(number));
                    }
                }
                Statement::Motion(index, values) => {
                    let args = [u64::from(index), 0, 0, 0];
                    if machine.memory.host(HostFn::PmacMotionReady, args) == 0 {
                        return (task.suspended(this), at);
                    }
                    for value in values.of(&machine.tables.motion_values) {
                        let value = arithmetic::finite(machine.value(*value, waiting));
                        machine.memory.host(HostFn::PmacMotionValue, [value.to_bits(), 0, 0, 0]);
                    }
                    if machine.memory.host(HostFn::PmacMotion, args) != 0 {
                        return (task.suspended(at), at);
                    }
                }
                Statement::Loop(head, index) => {
                    machine.memory.host(HostFn::PmacMotion, [u64::from(index), 0, 0, 0]);
                    return (task.suspended(head), at);
                }
                Statement::Save => {
                    machine.memory.host(HostFn::PmacSave, [0; 4]);
                }
                Statement::Nothing => {}
            }
            if limit.is_late() && limit.is_over(machine.memory.scan.host) {
                return (Outcome::Trap(Trap::late(task.lines.get(this as usize).copied())), at);
            }
        }
        (Outcome::End, at)
    }
}
