//! Property-directed reachability (IC3): looks for an invariant that excludes what is asked for.
//!
//! The invariant is found as clauses about the bits of the state. `frames[i]` holds the clauses that are true in all states
//! which are reached in `i` ticks at most, and are not in a later frame; when the clauses of a frame hold in the next one too,
//! they are the invariant. Clauses come from states that lead to what is asked for: each is shown not to be reachable in that many
//! ticks, and then as much of it is left out as can be (Eén, Mishchenko and Brayton, 2011).

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use rustc_hash::FxHashSet;
use rustsat::types::Lit as SatLit;

use super::induction::Found;
use super::sat::{Answer, Deadline};
use super::unroll::{Start, Unrolling};
use crate::logic::{Lit, Node};
use crate::system::{First, System};

/// Some bits of the state with values: the latch, and its value.
type Cube = Vec<(u32, bool)>;

/// After how many questions the solver is made anew, since each leaves a variable in it.
const MOST_QUESTIONS: usize = 4_000;

/// What could not be found out in time.
struct OutOfTime;

/// How much is done to find an invariant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effort {
    /// As many questions are put to a solver as take a moment.
    Little,
    /// All that there is time for.
    All,
}

/// How many questions are put with little effort.
const FEW_QUESTIONS: usize = 1_500;

/// How many steps each of these may take.
const FEW_STEPS: u32 = 2_000;

/// Looks for an invariant that excludes `bad`. It finds no runs: [`Found::Open`] says that it has found nothing.
///
/// Of several things that must not be, each is excluded by itself, since it depends on fewer bits.
pub fn invariant(system: &System, bad: Lit, effort: Effort, deadline: Deadline) -> Found {
    let mut most = 0;
    let mut left = (effort == Effort::Little).then_some(FEW_QUESTIONS);
    for bad in alternatives(system, bad) {
        let mut search = Search::new(system, bad, left, deadline);
        match search.run() {
            Ok(true) => most = most.max(search.frames.len()),
            Ok(false) | Err(OutOfTime) => return Found::Open(0),
        }
        left = search.left;
    }
    Found::Never(most)
}

/// The literals of which at least one is true where a literal is.
fn alternatives(system: &System, lit: Lit) -> Vec<Lit> {
    let (mut open, mut found) = (vec![lit], vec![]);
    while let Some(lit) = open.pop() {
        match system.builder.graph.node(lit.node()) {
            Node::And(a, b) if lit.is_complement() && found.len() < MOST_ALTERNATIVES => {
                open.extend([!a, !b]);
            }
            _ => found.push(lit),
        }
    }
    found.sort_unstable();
    found.dedup();
    found
}

/// Into how many parts a question is split.
const MOST_ALTERNATIVES: usize = 256;

/// A solver with one tick of the system.
struct Step<'s> {
    unrolling: Unrolling<'s>,
    /// For each latch that matters the literals of its value before and after the tick.
    latches: Vec<(u32, SatLit, SatLit)>,
    bad: SatLit,
    /// That the state is that of power-up.
    first: SatLit,
    /// For each frame the literal that has its clauses hold.
    frames: Vec<SatLit>,
    questions: usize,
}

impl<'s> Step<'s> {
    fn new(system: &'s System, bad: Lit, relevant: &[u32], deadline: Deadline) -> Self {
        let mut unrolling = Unrolling::new(system, Start::Anywhere, deadline);
        let latches = relevant.iter().filter_map(|&index| {
            let latch = system.latches.get(index as usize)?;
            let now = unrolling.sat_lit(0, latch.lit);
            Some((index, now, unrolling.sat_lit(0, latch.next)))
        });
        let latches: Vec<_> = latches.collect();
        let bad = unrolling.sat_lit(0, bad);
        let first = unrolling.sat().variable();
        for &(index, now, _) in &latches {
            if let Some(First::Constant(value)) =
                system.latches.get(index as usize).map(|latch| latch.first)
            {
                unrolling.sat().add(&[!first, with(now, value)]);
            }
        }
        Self { unrolling, latches, bad, first, frames: vec![], questions: 0 }
    }

    fn latch(&self, index: u32) -> Option<&(u32, SatLit, SatLit)> {
        let at = self.latches.binary_search_by_key(&index, |latch| latch.0).ok()?;
        self.latches.get(at)
    }

    fn now(&self, (index, value): (u32, bool)) -> Option<SatLit> {
        self.latch(index).map(|latch| with(latch.1, value))
    }

    fn after(&self, (index, value): (u32, bool)) -> Option<SatLit> {
        self.latch(index).map(|latch| with(latch.2, value))
    }

    /// What has the clauses of a frame and those after it hold; of frame 0 that the state is that of power-up.
    fn frame(&self, frame: usize) -> Vec<SatLit> {
        if frame == 0 {
            return vec![self.first];
        }
        self.frames.iter().copied().skip(frame).collect()
    }

    fn add_clause(&mut self, frame: usize, cube: &Cube) {
        while self.frames.len() <= frame {
            let lit = self.unrolling.sat().variable();
            self.frames.push(lit);
        }
        let mut clause: Vec<SatLit> = cube.iter().filter_map(|&it| Some(!self.now(it)?)).collect();
        if let Some(&lit) = self.frames.get(frame) {
            clause.push(!lit);
        }
        self.unrolling.sat().add(&clause);
    }

    /// The state of the solver's answer.
    fn state(&mut self) -> Cube {
        let Self { unrolling, latches, .. } = self;
        let sat = unrolling.sat();
        latches.iter().map(|&(index, now, _)| (index, sat.value(now))).collect()
    }
}

fn with(lit: SatLit, value: bool) -> SatLit {
    if value { lit } else { !lit }
}

struct Search<'s> {
    system: &'s System,
    bad: Lit,
    deadline: Deadline,
    /// How many more questions are put to a solver; `None` if they are not counted.
    left: Option<usize>,
    relevant: Vec<u32>,
    /// The inputs that matter, by their nodes.
    inputs: Vec<Lit>,
    frames: Vec<Vec<Cube>>,
    step: Step<'s>,
    /// A solver that knows no frames, to find out what of a state matters.
    lift: Step<'s>,
    lift_inputs: Vec<SatLit>,
}

/// The latches and inputs on which a literal depends, now or in a later tick.
pub(super) fn cone(system: &System, lit: Lit) -> (Vec<u32>, Vec<Lit>) {
    let index_of: rustc_hash::FxHashMap<u32, u32> =
        system.latches.iter().zip(0..).map(|(latch, index)| (latch.lit.node(), index)).collect();
    let mut seen: FxHashSet<u32> = FxHashSet::default();
    let (mut latches, mut inputs) = (vec![], vec![]);
    let mut open = vec![lit.node()];
    while let Some(node) = open.pop() {
        if !seen.insert(node) {
            continue;
        }
        match system.builder.graph.node(node) {
            Node::False => {}
            Node::And(a, b) => open.extend([a.node(), b.node()]),
            Node::Input if system.same.contains_key(&node) => {
                open.extend(system.same.get(&node).map(|lit| lit.node()));
            }
            Node::Input => match index_of.get(&node) {
                Some(&index) => {
                    latches.push(index);
                    if let Some(latch) = system.latches.get(index as usize) {
                        open.push(latch.next.node());
                    }
                }
                None => inputs.push(Lit::of_node(node)),
            },
        }
    }
    latches.sort_unstable();
    (latches, inputs)
}

impl<'s> Search<'s> {
    fn new(system: &'s System, bad: Lit, left: Option<usize>, deadline: Deadline) -> Self {
        let (relevant, inputs) = cone(system, bad);
        let step = Step::new(system, bad, &relevant, deadline);
        let mut lift = Step::new(system, bad, &relevant, deadline);
        let lift_inputs = inputs.iter().map(|&it| lift.unrolling.sat_lit(0, it)).collect();
        let mut this = Self {
            system,
            bad,
            deadline,
            left,
            relevant,
            inputs,
            frames: vec![vec![], vec![]],
            step,
            lift,
            lift_inputs,
        };
        this.renew();
        this
    }

    /// Makes the solver anew.
    fn renew(&mut self) {
        self.step = Step::new(self.system, self.bad, &self.relevant, self.deadline);
        for &input in &self.inputs {
            self.step.unrolling.sat_lit(0, input);
        }
        for (frame, cubes) in self.frames.iter().enumerate() {
            // The frame's literal is made also where it has no clause yet.
            while self.step.frames.len() <= frame {
                let lit = self.step.unrolling.sat().variable();
                self.step.frames.push(lit);
            }
            for cube in cubes {
                self.step.add_clause(frame, cube);
            }
        }
    }

    fn solve(&mut self, assumptions: &[SatLit]) -> Result<bool, OutOfTime> {
        if self.deadline.is_over() || self.left == Some(0) {
            return Err(OutOfTime);
        }
        if let Some(left) = &mut self.left {
            *left -= 1;
            self.step.unrolling.sat().set_steps(Some(FEW_STEPS));
        }
        match self.step.unrolling.sat().solve(assumptions) {
            Answer::Yes => Ok(true),
            Answer::No => Ok(false),
            Answer::Unknown => Err(OutOfTime),
        }
    }

    /// Whether a state of power-up is in a cube.
    fn is_first(&self, cube: &Cube) -> bool {
        cube.iter().all(|&(index, value)| {
            match self.system.latches.get(index as usize).map(|latch| latch.first) {
                Some(First::Constant(first)) => first == value,
                _ => true,
            }
        })
    }

    /// Looks for the invariant; false where there is a run to what is asked for.
    fn run(&mut self) -> Result<bool, OutOfTime> {
        if self.solve(&[self.step.first, self.step.bad])? {
            return Ok(false);
        }
        loop {
            let last = self.frames.len() - 1;
            loop {
                let mut assumptions = self.step.frame(last);
                assumptions.push(self.step.bad);
                if !self.solve(&assumptions)? {
                    break;
                }
                let state = self.step.state();
                let inputs = self.input_values();
                let cube = self.lifted(&state, &inputs, None);
                if !self.block(cube, last)? {
                    return Ok(false);
                }
            }
            self.frames.push(vec![]);
            self.renew();
            if self.propagate()? {
                return Ok(true);
            }
        }
    }

    fn input_values(&mut self) -> Vec<bool> {
        let lits: Vec<SatLit> =
            self.inputs.iter().map(|&it| self.step.unrolling.sat_lit(0, it)).collect();
        let sat = self.step.unrolling.sat();
        lits.into_iter().map(|lit| sat.value(lit)).collect()
    }

    /// What of a state suffices, with these inputs, to lead into a cube; without one to what is asked for.
    fn lifted(&mut self, state: &Cube, inputs: &[bool], to: Option<&Cube>) -> Cube {
        let lift = &mut self.lift;
        let mut assumptions: Vec<SatLit> = state.iter().filter_map(|&it| lift.now(it)).collect();
        assumptions.extend(self.lift_inputs.iter().zip(inputs).map(|(&it, &v)| with(it, v)));
        let mut done = None;
        match to {
            None => assumptions.push(!lift.bad),
            Some(cube) => {
                let act = lift.unrolling.sat().variable();
                let mut clause: Vec<SatLit> =
                    cube.iter().filter_map(|&it| Some(!lift.after(it)?)).collect();
                clause.push(!act);
                lift.unrolling.sat().add(&clause);
                assumptions.push(act);
                done = Some(act);
            }
        }
        let answer = lift.unrolling.sat().solve(&assumptions);
        let core: FxHashSet<_> = match answer {
            Answer::No => lift.unrolling.sat().core().into_iter().map(|lit| lit.var()).collect(),
            _ => FxHashSet::default(),
        };
        if let Some(act) = done {
            lift.unrolling.sat().add(&[!act]);
        }
        lift.questions += 1;
        if answer != Answer::No {
            return state.clone();
        }
        let kept = state
            .iter()
            .copied()
            .filter(|&it| lift.now(it).is_some_and(|lit| core.contains(&lit.var())));
        let kept: Cube = kept.collect();
        if lift.questions > MOST_QUESTIONS {
            *lift = Step::new(self.system, self.bad, &self.relevant, self.deadline);
            let inputs = &self.inputs;
            self.lift_inputs = inputs.iter().map(|&it| lift.unrolling.sat_lit(0, it)).collect();
        }
        kept
    }

    /// Whether a cube can't be reached in one tick from the states of a frame that are not in it; then the part of it for which
    /// that is known too.
    fn unreachable(&mut self, cube: &Cube, frame: usize) -> Result<Option<Cube>, OutOfTime> {
        self.step.questions += 1;
        if self.step.questions > MOST_QUESTIONS {
            self.renew();
        }
        let act = self.step.unrolling.sat().variable();
        let mut clause: Vec<SatLit> =
            cube.iter().filter_map(|&it| Some(!self.step.now(it)?)).collect();
        clause.push(!act);
        self.step.unrolling.sat().add(&clause);
        let mut assumptions = self.step.frame(frame);
        assumptions.push(act);
        let after: Vec<SatLit> = cube.iter().filter_map(|&it| self.step.after(it)).collect();
        assumptions.extend(&after);
        let reached = self.solve(&assumptions)?;
        if reached {
            return Ok(None);
        }
        let core: FxHashSet<_> =
            self.step.unrolling.sat().core().into_iter().map(|lit| lit.var()).collect();
        self.step.unrolling.sat().add(&[!act]);
        let mut kept: Cube = cube
            .iter()
            .copied()
            .filter(|&it| self.step.after(it).is_some_and(|lit| core.contains(&lit.var())))
            .collect();
        if self.is_first(&kept) {
            // A bit that is another one at power-up stays.
            let other = cube.iter().copied().find(|&it| !self.is_first(&vec![it]));
            kept.extend(other);
            kept.sort_unstable();
        }
        Ok(Some(kept))
    }

    /// Leaves out as much of a cube as can be, so that it still can't be reached from a frame.
    fn generalized(&mut self, mut cube: Cube, frame: usize) -> Result<Cube, OutOfTime> {
        let mut at = 0;
        while at < cube.len() && cube.len() > 1 {
            let mut less = cube.clone();
            less.remove(at);
            if self.is_first(&less) {
                at += 1;
                continue;
            }
            match self.unreachable(&less, frame)? {
                Some(kept) => cube = kept,
                None => at += 1,
            }
        }
        Ok(cube)
    }

    /// Shows that a cube can't be reached in `last` ticks; false where it can.
    fn block(&mut self, cube: Cube, last: usize) -> Result<bool, OutOfTime> {
        let mut open = BinaryHeap::new();
        let mut number = 0_u64;
        open.push(Reverse((last, number, cube)));
        while let Some(Reverse((frame, _, cube))) = open.pop() {
            if frame == 0 || self.is_first(&cube) {
                return Ok(false);
            }
            let known = self.frames.iter().skip(frame).flatten();
            let mut known = known.filter(|known| known.iter().all(|it| cube.contains(it)));
            if known.next().is_some() {
                continue;
            }
            match self.unreachable(&cube, frame - 1)? {
                Some(kept) => {
                    let mut kept = self.generalized(kept, frame - 1)?;
                    // It may hold for more ticks.
                    let mut to = frame;
                    while to < last {
                        match self.unreachable(&kept, to)? {
                            Some(less) => kept = less,
                            None => break,
                        }
                        to += 1;
                    }
                    self.step.add_clause(to, &kept);
                    if let Some(cubes) = self.frames.get_mut(to) {
                        cubes.retain(|other| !kept.iter().all(|it| other.contains(it)));
                        cubes.push(kept);
                    }
                    if to < last {
                        number += 1;
                        open.push(Reverse((to + 1, number, cube)));
                    }
                }
                None => {
                    let state = self.step.state();
                    let inputs = self.input_values();
                    let before = self.lifted(&state, &inputs, Some(&cube));
                    number += 2;
                    open.push(Reverse((frame - 1, number - 1, before)));
                    open.push(Reverse((frame, number, cube)));
                }
            }
        }
        Ok(true)
    }

    /// Moves clauses to later frames where they hold there too; true where those of a frame all do.
    fn propagate(&mut self) -> Result<bool, OutOfTime> {
        for frame in 1..self.frames.len() - 1 {
            let cubes = self.frames.get(frame).cloned().unwrap_or_default();
            let mut stay = vec![];
            for cube in cubes {
                let mut assumptions = self.step.frame(frame);
                assumptions.extend(cube.iter().filter_map(|&it| self.step.after(it)));
                if self.solve(&assumptions)? {
                    stay.push(cube);
                } else {
                    self.step.add_clause(frame + 1, &cube);
                    if let Some(next) = self.frames.get_mut(frame + 1) {
                        next.push(cube);
                    }
                }
            }
            let is_done = stay.is_empty();
            if let Some(slot) = self.frames.get_mut(frame) {
                *slot = stay;
            }
            if is_done {
                return Ok(true);
            }
        }
        Ok(false)
    }
}
