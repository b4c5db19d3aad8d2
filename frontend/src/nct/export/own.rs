//! The variables that the program in IEC 61131-3 has besides those of the source.

use plcc_iec::{Names, Type, Variable};

use super::condition;
use crate::nct::ast::{Op, Program};

/// The variables that the program in IEC 61131-3 has besides those of the source.
pub(super) struct Own {
    pub(super) next: String,
    /// OP of the module that runs.
    pub(super) op: String,
    /// OP of each module while it does not run.
    pub(super) op_of: [String; 3],
    pub(super) module: String,
    /// The block that follows the module that runs.
    pub(super) after: String,
    pub(super) fuel: String,
    pub(super) depth: String,
    pub(super) depth_of_0: String,
    pub(super) returns: String,
    /// The block at which :000 goes on, 0 if at its beginning.
    pub(super) resume: String,
    pub(super) level0_starts: String,
    pub(super) synchronised: String,
    pub(super) slice: String,
    pub(super) stop: String,
    /// How often :002 has run in this slice.
    pub(super) runs: String,
    pub(super) value: String,
    pub(super) result: String,
    pub(super) carry: String,
    pub(super) valid: String,
    pub(super) address: String,
    /// Values that brackets keep.
    pub(super) slots: Vec<String>,
    /// Results of tests in a condition.
    pub(super) tests: Vec<String>,
}

impl Own {
    pub(super) fn new(program: &Program, names: &mut Names) -> Self {
        let most_tests = program.stmts.iter().map(|stmt| match stmt.op {
            Op::If { count, .. } => count as usize,
            _ => 0,
        });
        let tests =
            if condition::any_indirect(program) { most_tests.max().unwrap_or(0) } else { 0 };
        let slots = (1..=program.slots).map(|n| names.make(&format!("KEPT{n}"))).collect();
        let tests = (1..=tests).map(|n| names.make(&format!("TEST{n}"))).collect();
        let mut make = |name: &str| names.make(name);
        Self {
            next: make("NEXT_BLOCK"),
            op: make("OP"),
            op_of: ["OP0", "OP1", "OP2"].map(&mut make),
            module: make("MODULE"),
            after: make("AFTER_MODULE"),
            fuel: make("SAFEPOINTS"),
            depth: make("DEPTH"),
            depth_of_0: make("DEPTH_OF_0"),
            returns: make("RETURN_TO"),
            resume: make("RESUME_0"),
            level0_starts: make("STARTS_0"),
            synchronised: make("SYNCHRONISED"),
            slice: make("SLICE"),
            stop: make("STOPPED"),
            runs: make("RUNS_OF_2"),
            value: make("VALUE"),
            result: make("RESULT"),
            carry: make("CARRY"),
            valid: make("IS_ADDRESS"),
            address: make("ADDRESS"),
            slots,
            tests,
        }
    }

    pub(super) fn declare(&self, list: &mut Vec<Variable>) {
        let mut add = |name: &String, ty, about: &str| list.push(Variable::local(name, ty, about));
        add(
            &self.next,
            Type::Dint,
            "the number of the block of statements that is next, 0 at the end of the slice",
        );
        add(&self.op, Type::Uint, "the accumulator of the module that runs");
        for (name, about) in self.op_of.iter().zip([":000", ":001", ":002"]) {
            add(name, Type::Uint, &format!("the accumulator of {about} while it does not run"));
        }
        add(&self.module, Type::Int, "the module that runs");
        add(&self.after, Type::Dint, "the block behind the module that runs");
        add(&self.fuel, Type::Dint, "how many jumps back and calls the module may still make");
        add(&self.depth, Type::Int, "how many calls are open");
        add(&self.depth_of_0, Type::Int, "how many calls are open in :000 while it does not run");
        add(&self.resume, Type::Dint, "the block at which :000 goes on, 0 if at its beginning");
        add(&self.slice, Type::Dint, "the number of the slice, up to 3000, then from 1 on");
        add(
            &self.stop,
            Type::Int,
            "0: it runs; 1 and 2: PLC TIMEOUT1 and PLC TIMEOUT2; 3: CALL DEPTH",
        );
        add(&self.runs, Type::Int, "how often :002 has run in this slice");
        add(&self.value, Type::Uint, "an operand");
        add(&self.result, Type::Uint, "a result");
        add(&self.carry, Type::Bool, "a carry");
        add(&self.valid, Type::Bool, "whether an address is one");
        add(&self.address, Type::Uint, "an address");
        self.slots
            .iter()
            .for_each(|slot| add(slot, Type::Uint, "a value of OP that a bracket keeps"));
        self.tests.iter().for_each(|test| add(test, Type::Bool, "a result of a test"));
        for (name, about) in [
            (&self.level0_starts, ":000 starts from its beginning"),
            (&self.synchronised, ":000 sees the inputs of the slice in which it began"),
        ] {
            let initial = vec!["TRUE".to_owned()];
            list.push(Variable { initial, ..Variable::local(name, Type::Bool, about) });
        }
        let variable = Variable::local(&self.returns, Type::Dint, "where open calls return to");
        list.push(Variable { elements: Some(96), ..variable });
    }
}
