//! The statement interpreter, which walks the checked program's statements (NCT 4).
//!
//! It is the oracle with which the other engines are compared. It uses neither lowering nor IR;
//! only the layout is the same.

mod area;
mod arithmetic;
mod execute;
mod memory;
mod run;

use std::sync::Arc;

use plcc_abi::{
    Engine, Outcome, ResumePoint, Scan, SourceLine, TimeLimit, Trap, TrapCode,
    image::{read_u16, write_u16},
    nct::{NctName, context},
};

use crate::common::{NoObserver, Observer, StatementInterpreter, Value};
use crate::nct::{
    access,
    ast::{Op, Operand, Program, Variable, Word},
    layout::Layout,
};
use run::{Next, Run};

/// The statement interpreter.
pub struct Interpreter {
    program: Arc<Program>,
    layout: Arc<Layout>,
    /// The modules, in the order of the tasks: number, and index of the first statement.
    modules: Vec<(u16, usize)>,
    /// The statements at which a task can be suspended, in the source's order: the resume points.
    /// Each module can reach each label, so they are the same for all tasks.
    resume_points: Vec<usize>,
    /// The statements that call, in the source's order. The index in this list is the call's
    /// number, which is the return address in the image.
    calls: Vec<usize>,
    /// A stack for results of a condition's tests, which A, O and X of the condition combine.
    waiting: Vec<bool>,
    /// How often each statement ran.
    counts: Vec<u64>,
}

impl Interpreter {
    pub(crate) fn new(program: Arc<Program>, layout: Arc<Layout>) -> Self {
        Self {
            modules: program.modules().collect(),
            resume_points: program.resume_points(),
            calls: program.calls().collect(),
            waiting: vec![],
            counts: vec![0; program.stmts.len()],
            program,
            layout,
        }
    }

    /// For each statement the line at which it begins (from 1), and how often it ran.
    pub fn counts(&self) -> impl Iterator<Item = (u32, u64)> {
        self.program.lines.iter().copied().zip(self.counts.iter().copied())
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
        self.execute_statement(task, statement, scan, observer)
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
        let Some(&(module, entry)) = self.modules.get(task) else { return Outcome::End };
        let start = match from {
            None => Some(entry),
            Some(ResumePoint(number)) => self.resume_points.get(number as usize).copied(),
        };
        let Some(mut at) = start else { return Outcome::trap(TrapCode::Internal) };
        let program = Arc::clone(&self.program);
        let layout = Arc::clone(&self.layout);
        let mut run = Run {
            program: &program,
            layout: &layout,
            calls: &self.calls,
            image: &mut *scan.image,
            op: 0,
            waiting: &mut self.waiting,
            limit: scan.limit,
            observer,
        };
        run.op = read_u16(run.image, layout.context + context::OP);
        if from.is_none() {
            run.set_depth(0);
        }
        let outcome = loop {
            if run.limit.is_late() && run.limit.is_over(scan.host) {
                break Outcome::Trap(Trap::late(line(&program, at)));
            }
            let Some(stmt) = program.stmts.get(at) else { break Outcome::End };
            if let Some(count) = self.counts.get_mut(at) {
                *count += 1;
            }
            let op_before = run.op;
            if run.observer.is_active() {
                // An observer may evaluate expressions, which read OP from the image; there it is otherwise written
                // only at the end of the scan.
                write_u16(run.image, layout.context + context::OP, run.op);
                run.observer.statement(at as u32, run.image);
            }
            if let Op::Area { op, area } = stmt.op {
                let args = [area.into(), run.op.into(), 0, 0];
                if run.observer.is_active() {
                    let result = run.observe_area_reads(op, area);
                    scan.host.call(run.image, op.host_function(), args);
                    run.observe_area_writes(op, area, result);
                } else {
                    scan.host.call(run.image, op.host_function(), args);
                }
                if run.limit.is_late() && run.limit.is_over(scan.host) {
                    break Outcome::Trap(Trap::late(line(&program, at)));
                }
                at += 1;
                continue;
            }
            let next = run.step(at, &stmt.op);
            if run.observer.is_active() && run.op != op_before {
                let register = access::accessed(NctName::Op(module as u8));
                run.observer.write(register, Value::Integer(run.op.into()));
            }
            match next {
                Next::At(next) => at = next,
                Next::Suspend(next) => {
                    break match self.resume_points.binary_search(&next) {
                        Ok(number) => Outcome::Suspended(ResumePoint(number as u32)),
                        Err(_) => Outcome::trap(TrapCode::Internal),
                    };
                }
                Next::End => break Outcome::End,
                Next::Trap(code @ (TrapCode::Timeout | TrapCode::CallDepth)) => {
                    break Outcome::Trap(Trap { statement: line(&program, at), ..Trap::new(code) });
                }
                Next::Trap(code) => break Outcome::trap(code),
            }
        };
        write_u16(run.image, layout.context + context::OP, run.op);
        outcome
    }
}

/// The line of the statement with the index `at`.
fn line(program: &Program, at: usize) -> Option<SourceLine> {
    program.lines.get(at).map(|&line| SourceLine { file: 0, line })
}

/// The result of the statements of an expression.
pub(crate) enum Computed {
    /// OP after the last statement.
    Op(u16),
    /// The result of the condition that is the last statement.
    Condition(bool),
    /// None: an indirect load takes its address from the word at this byte of F, which holds no valid address.
    NoAddress(u16),
}

/// Runs the statements of an expression, which change nothing but OP and status flags. They are
/// changed in `image`, so it must be a copy.
pub(crate) fn compute(program: &Program, layout: &Layout, image: &mut [u8]) -> Computed {
    let mut waiting = vec![];
    let op = read_u16(image, layout.context + context::OP);
    let mut run = Run {
        program,
        layout,
        calls: &[],
        image,
        op,
        waiting: &mut waiting,
        limit: TimeLimit::NONE,
        observer: NoObserver,
    };
    for (at, stmt) in program.stmts.iter().enumerate() {
        if let Op::If { first, count, .. } = stmt.op {
            return Computed::Condition(run.condition(first, count));
        }
        if let Op::Load(operand) = stmt.op {
            match (run.operand(operand), operand) {
                (Some(value), _) => run.op = value,
                (None, Operand::Load { place: Variable::Word(Word::Indirect(at)), .. }) => {
                    return Computed::NoAddress(at);
                }
                (None, _) => {}
            }
        } else {
            run.step(at, &stmt.op);
        }
    }
    Computed::Op(run.op)
}
