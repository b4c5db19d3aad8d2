//! The SAT solver: a pure Rust one of the family of MiniSat, behind the interface that RustSAT gives to all solvers.

use std::cell::Cell;
use std::time::Instant;

use batsat::Callbacks;
use rustsat::clause;
use rustsat::solvers::{Solve, SolveIncremental, SolverResult};
use rustsat::types::{Clause, Lit, TernaryVal, Var};

/// When a search has to end.
#[derive(Clone, Copy, Debug, Default)]
pub struct Deadline(pub Option<Instant>);

impl Deadline {
    /// Whether it has passed.
    pub fn is_over(self) -> bool {
        self.0.is_some_and(|end| Instant::now() >= end)
    }
}

/// What ends a search: a moment, or a number of steps, which is the same on each computer.
#[derive(Debug, Default)]
struct Limit {
    deadline: Deadline,
    /// How many steps are left; `None` if they are not counted.
    steps: Cell<Option<u32>>,
    /// Steps since the clock was read, and whether the moment was over then.
    since: Cell<u32>,
    is_over: Cell<bool>,
}

impl Callbacks for Limit {
    fn stop(&self) -> bool {
        if let Some(left) = self.steps.get() {
            self.steps.set(Some(left.saturating_sub(1)));
            if left == 0 {
                return true;
            }
        }
        // The solver asks again after it has stopped: what is over stays so.
        self.since.set(self.since.get() + 1);
        if self.since.get() >= 64 && !self.is_over.get() {
            self.since.set(0);
            self.is_over.set(self.deadline.is_over());
        }
        self.is_over.get()
    }
}

/// The answer of a solver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answer {
    /// All clauses can be true.
    Yes,
    /// They cannot.
    No,
    /// The time was up.
    Unknown,
}

/// A solver.
#[derive(Debug, Default)]
pub struct Sat {
    solver: rustsat_batsat::Solver<Limit>,
    variables: u32,
    /// Whether a clause could not be added.
    failed: bool,
    steps: Option<u32>,
}

impl Sat {
    /// A solver that gives up at a moment.
    pub fn new(deadline: Deadline) -> Self {
        let mut this = Self::default();
        this.set_deadline(deadline);
        this
    }

    /// Another moment at which it gives up.
    pub fn set_deadline(&mut self, deadline: Deadline) {
        let limit = self.solver.batsat_mut().cb_mut();
        limit.deadline = deadline;
        limit.is_over.set(false);
    }

    /// How many steps each search may take; `None` if they are not counted.
    pub fn set_steps(&mut self, steps: Option<u32>) {
        self.steps = steps;
    }

    /// A new variable, as a literal.
    pub fn variable(&mut self) -> Lit {
        let lit = Var::new(self.variables).pos_lit();
        self.variables += 1;
        self.failed |= self.solver.reserve(lit.var()).is_err();
        lit
    }

    /// Adds a clause: at least one of the literals is true.
    pub fn add(&mut self, lits: &[Lit]) {
        let clause: Clause = lits.iter().copied().collect();
        self.failed |= self.solver.add_clause(clause).is_err();
    }

    /// Makes a literal be the conjunction of two.
    pub fn define_and(&mut self, lit: Lit, a: Lit, b: Lit) {
        for clause in [clause![!lit, a], clause![!lit, b], clause![lit, !a, !b]] {
            self.failed |= self.solver.add_clause(clause).is_err();
        }
    }

    /// Whether all clauses can be true together with some literals.
    pub fn solve(&mut self, assumptions: &[Lit]) -> Answer {
        if self.failed {
            return Answer::Unknown;
        }
        let limit = self.solver.batsat_mut().cb_mut();
        if limit.deadline.is_over() {
            return Answer::Unknown;
        }
        limit.steps.set(self.steps);
        match self.solver.solve_assumps(assumptions) {
            Ok(SolverResult::Sat) => Answer::Yes,
            Ok(SolverResult::Unsat) => Answer::No,
            _ => Answer::Unknown,
        }
    }

    /// The value of a literal after the answer yes; false where it does not matter.
    pub fn value(&self, lit: Lit) -> bool {
        matches!(self.solver.lit_val(lit), Ok(TernaryVal::True))
    }

    /// Those of the assumptions that suffice for the answer no.
    pub fn core(&mut self) -> Vec<Lit> {
        // The solver's clause says of which assumptions one must be false.
        self.solver.core().unwrap_or_default().into_iter().map(|lit| !lit).collect()
    }
}
