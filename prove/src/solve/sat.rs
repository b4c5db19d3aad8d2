//! The SAT solver: a pure Rust one of the family of MiniSat, behind the interface that RustSAT gives to all solvers.

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

impl Callbacks for Deadline {
    fn stop(&self) -> bool {
        self.is_over()
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
    solver: rustsat_batsat::Solver<Deadline>,
    variables: u32,
    /// Whether a clause could not be added.
    failed: bool,
}

impl Sat {
    /// A solver that gives up at a moment.
    pub fn new(deadline: Deadline) -> Self {
        let mut this = Self::default();
        *this.solver.batsat_mut().cb_mut() = deadline;
        this
    }

    /// Another moment at which it gives up.
    pub fn set_deadline(&mut self, deadline: Deadline) {
        *self.solver.batsat_mut().cb_mut() = deadline;
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
