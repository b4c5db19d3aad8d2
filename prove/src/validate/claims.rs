//! What two versions of a function have to agree in, from one of its labels on, and whether they do.

use std::cell::RefCell;

use plcc_ir::{Func, FuncData, Label};
use rustc_hash::{FxHashMap, FxHashSet};

use super::classes::Classes;
use super::known::{Known, Place, STEPS, Whole};
use super::simulate::{Answers, Simulation};
use super::sweep::{Finding, Reach, Sweep};
use super::terms::{Application, Terms};
use super::universe::Universe;
use super::walk::{Context, Exit, Happening, Version, Way};
use super::{Difference, Validation, Verdict};
use crate::logic::{FALSE, Graph, Lit, Memory};
use crate::scan::{Builder, Reason};
use crate::solve::{Answer, Deadline};

/// How many runs are simulated, 64 in a word, before a solver looks at the claims.
const WORDS: usize = 16;

/// How many runs that the simulation suggests are tried in the interpreter.
const MOST_TRIED: usize = 24;

/// How many claims are hard before all others count as hard.
const MOST_HARD: usize = 6;

/// How many questions that were answered are kept for a function.
const MOST_KEPT: usize = 3;

/// How many bytes, words and doubles of the image the code from a label on may access.
const MOST_CELLS: usize = 20_000;

const TIME: &str = "begins a function for which the time was up";

/// What must not be: a literal that says that something differs.
#[derive(Clone, Copy, Debug)]
pub(super) struct Claim {
    pub(super) differs: Lit,
    /// The label of the cut to which control comes.
    cut: Option<Label>,
}

/// What came of looking at a function from a label on once.
enum Attempt {
    Done(Verdict),
    /// Something differs as far as the logic goes, but not in the interpreter; at these cuts one version comes to a label and the other does not.
    Differs(Vec<Label>),
}

/// Two versions of a function.
pub(super) struct Pair<'p, 'm> {
    pub(super) validation: &'p Validation<'m>,
    pub(super) func: Func,
    pub(super) before: &'m FuncData,
    pub(super) after: &'m FuncData,
    /// The label that stands for each label.
    pub(super) first: FxHashMap<Label, Label>,
    /// The numbers that they compare with.
    pub(super) constants: Vec<i64>,
    pub(super) deadline: Deadline,
    /// What was proved last.
    pub(super) proved: RefCell<Vec<Question>>,
    /// What is known of its logic.
    pub(super) known: RefCell<Known>,
}

/// What is claimed of a graph.
pub(super) struct Question {
    graph: Graph,
    list: Vec<Application>,
    claims: Vec<Claim>,
}

impl Question {
    fn is(&self, other: &Self) -> bool {
        self.claims.iter().map(|it| it.differs).eq(other.claims.iter().map(|it| it.differs))
            && self.list == other.list
            && self.graph.is(&other.graph)
    }
}

impl Pair<'_, '_> {
    /// A reason that is about the function.
    pub(super) fn undecided(&self, text: &str) -> Verdict {
        let place = self.validation.lines(self.before).map(|(file, from, _)| (file, from));
        Verdict::Undecided(Reason { text: text.into(), place })
    }

    pub(super) fn time_is_up(&self) -> Verdict {
        self.undecided(TIME)
    }

    /// Whether both do the same from a label on.
    pub(super) fn from(&self, label: Label) -> Verdict {
        let mut cut_at: FxHashSet<Label> = self.first.values().copied().collect();
        let mut exact = false;
        loop {
            let labels = match self.attempt(label, &cut_at, exact) {
                Attempt::Done(verdict) => return verdict,
                Attempt::Differs(labels) => labels,
            };
            if self.deadline.is_over() {
                return self.time_is_up();
            }
            // Where one version passes a label by, it is not cut there; then nowhere; then doubles are computed.
            if !labels.is_empty() && labels.iter().any(|label| cut_at.contains(label)) {
                labels.iter().for_each(|label| {
                    cut_at.remove(label);
                });
            } else if !cut_at.is_empty() {
                cut_at.clear();
            } else if !exact {
                exact = true;
            } else {
                return self.undecided(
                    "begins a function of which the proof finds a difference that does not come about",
                );
            }
        }
    }

    /// Looks at both from a label on, cut at some labels.
    fn attempt(&self, label: Label, cut_at: &FxHashSet<Label>, exact: bool) -> Attempt {
        let [old, new] = &self.validation.codes;
        let versions = [old, new].map(|code| Version::new(code, self.func, &self.first, cut_at));
        let [Some(old), Some(new)] = versions else { return Attempt::Differs(vec![]) };
        let blocks = [(self.before, &old), (self.after, &new)];
        let blocks = blocks.map(|(data, version)| (data, version.reach(label)));
        let universe = Universe::of(self.validation.before, &blocks);
        if universe.cells.len() > MOST_CELLS {
            let text = "begins a function that may access more of the image than is followed";
            return Attempt::Done(self.undecided(text));
        }
        let mut context = Context {
            builder: Builder::default(),
            terms: Terms::new(exact),
            universe: &universe,
            deadline: self.deadline,
        };
        let mut memory = universe.empty();
        let raw = context.builder.graph.inputs(universe.width());
        universe.fill(&mut context.builder.graph, &mut memory, &raw);
        let one = old.walk(&mut context, label, &memory);
        let second = context.builder.graph.len() as u32;
        let walks = match one {
            Ok(one) => new.walk(&mut context, label, &memory).map(|other| (one, other)),
            Err(reason) => Err(reason),
        };
        let ((exits, happenings), (new_exits, _)) = match walks {
            Ok(walks) => walks,
            Err(reason) => return Attempt::Done(Verdict::Undecided(reason)),
        };
        let Some(claims) = self.claims(&mut context, &exits, &new_exits) else {
            return Attempt::Done(self.time_is_up());
        };
        let Context { builder, terms, .. } = context;
        if let Some(reason) = builder.reasons.into_iter().next() {
            return Attempt::Done(Verdict::Undecided(reason));
        }
        // Code that can be entered at several labels is often the same logic from each.
        let question = Question { graph: builder.graph, list: terms.list, claims };
        let is_known = || self.proved.borrow().iter().any(|known| known.is(&question));
        if question.claims.is_empty() || is_known() {
            return Attempt::Done(Verdict::Proved);
        }
        let subject = Subject {
            validation: self.validation,
            universe: &universe,
            graph: &question.graph,
            list: &question.list,
            memory: &memory,
            raw: &raw,
            constants: &self.constants,
            label,
            happenings: &happenings,
            second,
            deadline: self.deadline,
        };
        let attempt = subject.decide(&question.claims, &mut self.known.borrow_mut());
        if matches!(attempt, Attempt::Done(Verdict::Proved)) {
            let mut proved = self.proved.borrow_mut();
            proved.truncate(MOST_KEPT - 1);
            proved.insert(0, question);
        }
        attempt
    }

    /// What both versions have to agree in; nothing if the time is up.
    fn claims(&self, context: &mut Context<'_>, old: &[Exit], new: &[Exit]) -> Option<Vec<Claim>> {
        let graph = &mut context.builder.graph;
        let mut ways: Vec<Way> = old.iter().map(|exit| exit.way).collect();
        ways.extend(
            new.iter().map(|exit| exit.way).filter(|way| old.iter().all(|it| it.way != *way)),
        );
        let mut claims = vec![];
        for way in ways {
            if self.deadline.is_over() {
                return None;
            }
            let find = |exits: &'_ [Exit]| exits.iter().position(|exit| exit.way == way);
            let (one, other) =
                (find(old).and_then(|at| old.get(at)), find(new).and_then(|at| new.get(at)));
            let cond = |exit: Option<&Exit>| exit.map_or(FALSE, |exit| exit.cond);
            let cut = match way {
                Way::Goto(label) => Some(label),
                _ => None,
            };
            // Whether control comes there is looked at first: it is what differs where a cut has to go.
            let differs = graph.xor(cond(one), cond(other));
            if differs != FALSE {
                claims.insert(0, Claim { differs, cut });
            }
            let mut claim = |differs: Lit| {
                if differs != FALSE {
                    claims.push(Claim { differs, cut });
                }
            };
            let (Some(one), Some(other)) = (one, other) else { continue };
            let history = graph.xor(one.history, other.history);
            claim(graph.and(one.cond, history));
            let words = !graph.equal(&one.words, &other.words);
            claim(graph.and(one.cond, words));
            for cell in &context.universe.cells {
                for offset in cell.range() {
                    let (a, b) = (one.memory.byte(offset), other.memory.byte(offset));
                    let is_dead =
                        || cut.is_some_and(|label| self.validation.dead.contains(label, offset));
                    if a == b || is_dead() {
                        continue;
                    }
                    let differs = !graph.equal(&a, &b);
                    claim(graph.and(one.cond, differs));
                }
            }
        }
        Some(claims)
    }
}

/// A function of which something is claimed.
pub(super) struct Subject<'s, 'm> {
    pub(super) validation: &'s Validation<'m>,
    pub(super) universe: &'s Universe,
    pub(super) graph: &'s Graph,
    pub(super) list: &'s [Application],
    /// The image at the beginning, and the inputs that it is made of.
    pub(super) memory: &'s Memory,
    raw: &'s [Lit],
    constants: &'s [i64],
    /// Where both versions begin.
    pub(super) label: Label,
    pub(super) happenings: &'s [Happening],
    /// The first node that was made for the second version and the claims.
    second: u32,
    pub(super) deadline: Deadline,
}

impl Subject<'_, '_> {
    /// Whether a node was made for the second version or the claims alone.
    pub(super) fn is_of_second(&self, node: u32) -> bool {
        node >= self.second
    }

    /// Puts random bits into the image.
    pub(super) fn randomize(&self, run: &mut Simulation<'_>) {
        run.randomize(self.universe, self.raw, self.constants);
    }

    /// The bit of the image for which each of the first inputs stands.
    pub(super) fn places(&self) -> FxHashMap<u32, Place> {
        let cells = self.universe.cells.iter();
        let places =
            cells.flat_map(|cell| (0..cell.width()).map(|bit| (cell.kind, cell.offset, bit)));
        self.raw.iter().map(|lit| lit.node()).zip(places).collect()
    }

    /// Whether one of the claims does not hold.
    fn decide(&self, claims: &[Claim], known: &mut Known) -> Attempt {
        let mut run = Simulation::new(self.graph, self.list);
        let mut classes = Classes::new(self.graph.len());
        let mut broken = vec![];
        let mut tried = 0;
        for _ in 0..WORDS {
            self.randomize(&mut run);
            if !run.run(Answers::Computed, self.deadline) {
                return Attempt::Differs(vec![]);
            }
            for claim in claims {
                let lanes = run.get(claim.differs);
                if lanes == 0 || tried >= MOST_TRIED {
                    continue;
                }
                tried += 1;
                broken.push(*claim);
                if let Some(difference) = self.replay(&run, lanes.trailing_zeros()) {
                    return Attempt::Done(Verdict::Refuted(difference));
                }
            }
            classes.add(&run.values);
        }
        if !broken.is_empty() {
            return Attempt::Differs(broken.iter().filter_map(|claim| claim.cut).collect());
        }
        let mut claims = self.hard(claims);
        known.shrink();
        let mut runs = (run, classes);
        for reach in [Reach::Near, Reach::All] {
            let mut open = vec![];
            let mut sweep = Sweep::new(known, self, &claims, reach, runs);
            for claim in &claims {
                match sweep.decide(claim.differs) {
                    Finding::Holds => {}
                    Finding::Open if reach == Reach::Near && !self.deadline.is_over() => {
                        open.push(*claim);
                    }
                    Finding::Open => return Attempt::Differs(vec![]),
                    Finding::Differs(difference) => {
                        return Attempt::Done(Verdict::Refuted(difference));
                    }
                    Finding::Broken(values) => {
                        return match self.tried(&values) {
                            Some(difference) => Attempt::Done(Verdict::Refuted(difference)),
                            None => Attempt::Differs(claim.cut.into_iter().collect()),
                        };
                    }
                }
            }
            if open.is_empty() {
                break;
            }
            runs = sweep.runs();
            claims = open;
        }
        Attempt::Done(Verdict::Proved)
    }

    /// The claims that a solver does not see at once to hold. It sees no functions, and gives up when a few claims are hard.
    fn hard(&self, claims: &[Claim]) -> Vec<Claim> {
        let mut whole = Whole::new(self.deadline);
        whole.sat.set_steps(Some(STEPS));
        let mut hard = vec![];
        for claim in claims {
            if hard.len() < MOST_HARD {
                let goal = whole.tell(self.graph, claim.differs);
                if whole.sat.solve(&[goal]) == Answer::No {
                    continue;
                }
            }
            hard.push(*claim);
        }
        hard
    }

    /// The difference in the interpreter where inputs have some values.
    fn tried(&self, values: &FxHashMap<u32, bool>) -> Option<Difference> {
        let mut run = Simulation::new(self.graph, self.list);
        for (&node, &value) in values {
            run.set(Lit::of_node(node), if value { u64::MAX } else { 0 });
        }
        run.run(Answers::Happened, self.deadline).then_some(())?;
        self.replay(&run, 0)
    }
}
