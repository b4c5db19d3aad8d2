//! The statement interpreter.

use std::sync::Arc;

use plcc_abi::image::{read_i32, read_u8, write_i32, write_u8};
use plcc_abi::mini::Kind;
use plcc_abi::{Engine, Outcome, ResumePoint, Scan, SourceLine, Trap};

use super::ast::{self, Action, Code, Term};
use super::presentation::accessed;
use crate::common::{NoObserver, Observer, StatementInterpreter, Value};

#[derive(Clone, Debug)]
pub(super) struct Interpreter {
    pub(super) code: Arc<Code>,
}

impl Interpreter {
    fn value<O: Observer>(&self, terms: &[Term], image: &[u8], observer: &mut O) -> i32 {
        ast::evaluate(terms, |index| {
            let Some(symbol) = self.code.symbol(index) else { return 0 };
            let told = match symbol.kind {
                Kind::Number => {
                    Value::Integer(read_i32(image, symbol.offset).into())
                }
                Kind::Input | Kind::Output => {
                    Value::Logical(read_u8(image, symbol.offset) != 0)
                }
            };
            observer.read(accessed(symbol.offset), told);
            observer.instead(accessed(symbol.offset), told).number() as i32
        })
    }

    fn run<O: Observer>(&self, task: usize, scan: &mut Scan<'_>, observer: &mut O) -> Outcome {
        let all = 0..self.code.steps.len();
        if task == 0 { self.walk(all, scan, observer).0 } else { Outcome::End }
    }

    /// Executes the steps from one to another, and gives the number of the one that would follow.
    fn walk<O: Observer>(
        &self,
        range: std::ops::Range<usize>,
        scan: &mut Scan<'_>,
        observer: &mut O,
    ) -> (Outcome, usize) {
        let mut at = range.start;
        let mut limit = scan.limit;
        while let Some(step) = self.code.steps.get(..range.end).and_then(|steps| steps.get(at)) {
            if limit.is_over(scan.host) {
                let line = SourceLine { file: step.span.file.0, line: step.line };
                return (Outcome::Trap(Trap::late(Some(line))), at);
            }
            if observer.is_active() {
                observer.statement(at as u32, scan.image);
            }
            at += 1;
            match &step.action {
                Action::Assign { to, value } => {
                    let value = self.value(value, scan.image, observer);
                    let Some(symbol) = self.code.symbol(*to) else { continue };
                    let told = match symbol.kind {
                        Kind::Number => {
                            write_i32(scan.image, symbol.offset, value);
                            Value::Integer(value.into())
                        }
                        Kind::Input | Kind::Output => {
                            write_u8(scan.image, symbol.offset, u8::from(value != 0));
                            Value::Logical(value != 0)
                        }
                    };
                    observer.write(accessed(symbol.offset), told);
                }
                Action::If { condition, otherwise } => {
                    if self.value(condition, scan.image, observer) == 0 {
                        at = *otherwise;
                    }
                }
                Action::End => {}
            }
        }
        (Outcome::End, at)
    }
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
        let (at, end) = (statement as usize, self.code.steps.len());
        if task != 0 || at >= end {
            return None;
        }
        let (_, next) = self.walk(at..at + 1, scan, &mut observer);
        (next < end).then_some(next as u32)
    }
}
