//! Whether two versions of a module do the same: what the front end made, and what the passes made of it (translation validation;
//! Pnueli, Siegel and Singerman, 1998; Lopes and others, 2021).
//!
//! Each function is looked at by itself, from each of its labels, with the same image for both versions. It is cut at labels in its midst where both
//! versions come to them alike. Both must come to the same ends on the same conditions, with the same calls of the host in the same
//! order, and leave the same image but for bytes that are overwritten before anything reads them. Of the image only that is known which executive and program keep up
//! (`finite_regions`, `word_regions`, regions of bits).
//!
//! A difference counts only where the interpreter finds it too.

mod concrete;
mod cuts;
mod divide;
mod float;
mod refute;
mod simulate;
mod step;
mod sweep;
mod terms;
mod universe;
mod walk;

use std::time::{Duration, Instant};

use plcc_ir::{Block, Func, FuncData, InstData, Label, Module, PrimaryMap, StatementId};
use rustc_hash::FxHashSet;

use crate::logic::{FALSE, Lit, Memory};
use crate::scan::{Builder, Code, Reason};
use crate::solve::Deadline;

use cuts::{Dead, end_of_row, representatives};
use simulate::Simulation;
use sweep::{Finding, Sweep, WORDS};
use terms::Terms;
use universe::Universe;
use walk::{Context, Exit, Happening, Version, Way};

/// How many runs that the solver or the simulation suggests are tried in the interpreter.
const MOST_TRIED: usize = 24;

/// How many bytes, words and doubles of the image a function may access.
const MOST_CELLS: usize = 20_000;

/// How two versions of a function differ.
#[derive(Clone, Debug)]
pub struct Difference {
    /// What differs.
    pub what: String,
    /// The statement that does it, by file and line.
    pub place: Option<(String, u32)>,
    /// The bytes of the image with which they differ, others being 0: offsets and values.
    pub image: Vec<(usize, u8)>,
}

/// What is found out about a function.
#[derive(Clone, Debug)]
pub enum Verdict {
    /// Both versions do the same, for all images.
    Proved,
    /// They do not, and have been run to see it.
    Refuted(Difference),
    /// It is not known.
    Undecided(Reason),
}

/// A function, and what is found out about it.
#[derive(Clone, Debug)]
pub struct Answer {
    /// Its name.
    pub function: String,
    /// The first and the last line of its statements in the first file that it has statements of.
    pub lines: Option<(String, u32, u32)>,
    /// What is found out.
    pub verdict: Verdict,
}

/// Two versions of a module.
#[derive(Debug)]
pub struct Validation<'m> {
    before: &'m Module,
    after: &'m Module,
    codes: [Code<'m>; 2],
    labels: [PrimaryMap<Label, Option<(Func, Block)>>; 2],
    dead: Dead,
}

/// What must not be: a literal that says that something differs.
#[derive(Clone, Copy, Debug)]
struct Claim {
    differs: Lit,
    /// The number of the start.
    start: usize,
    /// The label of the cut to which control comes.
    cut: Option<Label>,
}

/// A label from which both versions were followed.
struct Start {
    label: Label,
    happenings: Vec<Happening>,
}

/// What came of looking at a function once.
enum Attempt {
    Done(Verdict),
    /// Something differs as far as the logic goes, but not in the interpreter; at these cuts one version comes to a label and the other does not.
    Differs(Vec<Label>),
}

impl<'m> Validation<'m> {
    /// The versions of a module: before the passes and after them.
    pub fn new(before: &'m Module, after: &'m Module) -> Self {
        Self {
            before,
            after,
            codes: [Code::of_functions(before), Code::of_functions(after)],
            labels: [before.label_targets(), after.label_targets()],
            dead: Dead::of(before),
        }
    }

    /// How many functions there are.
    pub fn len(&self) -> usize {
        self.before.funcs.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.before.funcs.is_empty()
    }

    /// What is found out about a function, by its number, in a time.
    pub fn function(&self, number: usize, time: Duration) -> Answer {
        let func = Func(number as u32);
        let deadline = Deadline(Some(Instant::now() + time));
        let (name, lines) = self
            .before
            .funcs
            .get(number)
            .map_or((String::new(), None), |data| (data.name().to_owned(), self.lines(data)));
        let verdict = self.verdict(func, deadline).unwrap_or_else(|| {
            let text = format!("the function {name} is not in both versions");
            Verdict::Undecided(Reason { text, place: None })
        });
        Answer { function: name, lines, verdict }
    }

    fn lines(&self, data: &FuncData) -> Option<(String, u32, u32)> {
        let insts = data.blocks().flat_map(|(_, block)| &block.insts);
        let lines: Vec<_> = insts.filter_map(|&inst| self.before.line(data.loc(inst))).collect();
        let first = lines.first()?;
        let own = || lines.iter().filter(|line| line.file == first.file).map(|line| line.line);
        let file = self.before.files.get(first.file as usize)?;
        Some((file.name.clone(), own().min()?, own().max()?))
    }

    fn verdict(&self, func: Func, deadline: Deadline) -> Option<Verdict> {
        let before = self.before.funcs.get(func.index())?;
        let after = self.after.funcs.get(func.index())?;
        if before.name() != after.name() {
            return None;
        }
        let first = representatives(before);
        let mut cut_at: FxHashSet<Label> = first.values().copied().collect();
        let mut exact = false;
        loop {
            let labels = match self.attempt(func, &cut_at, exact, deadline) {
                Attempt::Done(verdict) => return Some(verdict),
                Attempt::Differs(labels) => labels,
            };
            if deadline.is_over() {
                break;
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
                break;
            }
        }
        let place = self.lines(before).map(|(file, from, _)| (file, from));
        let text = match deadline.is_over() {
            true => TIME,
            false => {
                "begins a function of which the proof finds a difference that does not come about"
            }
        };
        Some(Verdict::Undecided(Reason { text: text.into(), place }))
    }

    /// Looks at a function, cut at some labels.
    fn attempt(
        &self,
        func: Func,
        cut_at: &FxHashSet<Label>,
        exact: bool,
        deadline: Deadline,
    ) -> Attempt {
        let datas = [self.before, self.after].map(|module| module.funcs.get(func.index()));
        let [Some(before), Some(after)] = datas else { return Attempt::Differs(vec![]) };
        let first = representatives(before);
        let universe = Universe::of(self.before, &[before, after]);
        if universe.cells.len() > MOST_CELLS {
            let place = self.lines(before).map(|(file, from, _)| (file, from));
            let text = "begins a function that may access more of the image than is followed";
            return Attempt::Done(Verdict::Undecided(Reason { text: text.into(), place }));
        }
        let mut context = Context {
            builder: Builder::default(),
            terms: Terms::new(exact),
            universe: &universe,
            deadline,
        };
        let mut memory = universe.empty();
        let raw = context.builder.graph.inputs(universe.width());
        universe.fill(&mut context.builder.graph, &mut memory, &raw);
        let [old, new] = &self.codes;
        let versions =
            [Version::new(old, func, &first, cut_at), Version::new(new, func, &first, cut_at)];
        let [Some(old), Some(new)] = versions else { return Attempt::Differs(vec![]) };
        let (mut starts, mut claims): (Vec<Start>, Vec<Claim>) = (vec![], vec![]);
        let mut second = vec![];
        let mut seen = FxHashSet::default();
        for &(label, block) in before.entries() {
            let other = after.entries().iter().find(|(other, _)| *other == label);
            let Some(&(_, other)) = other else { continue };
            if !seen.insert((end_of_row(before, block), end_of_row(after, other))) {
                continue;
            }
            let one = old.walk(&mut context, label, &memory);
            let from = context.builder.graph.len() as u32;
            let walks = [one, new.walk(&mut context, label, &memory)];
            let [Ok((exits, happenings)), Ok((new_exits, _))] = walks else {
                let reason = walks.into_iter().find_map(Result::err);
                return Attempt::Done(undecided(reason));
            };
            self.claim(&mut context, (&exits, &new_exits), starts.len(), &mut claims);
            second.push(from..context.builder.graph.len() as u32);
            starts.push(Start { label, happenings });
        }
        let Context { builder, terms, .. } = context;
        if let Some(reason) = builder.reasons.into_iter().next() {
            return Attempt::Done(Verdict::Undecided(reason));
        }
        claims.retain(|claim| claim.differs != FALSE);
        if claims.is_empty() {
            return Attempt::Done(Verdict::Proved);
        }
        let subject = Subject {
            validation: self,
            universe: &universe,
            graph: &builder.graph,
            terms: &terms,
            memory: &memory,
            raw: &raw,
            constants: constants(&[before, after]),
            starts: &starts,
            second: &second,
            deadline,
        };
        subject.decide(&claims)
    }

    /// What both versions have to agree in.
    fn claim(
        &self,
        context: &mut Context<'_>,
        (old, new): (&[Exit], &[Exit]),
        start: usize,
        claims: &mut Vec<Claim>,
    ) {
        let graph = &mut context.builder.graph;
        let mut ways: Vec<Way> = old.iter().map(|exit| exit.way).collect();
        ways.extend(
            new.iter().map(|exit| exit.way).filter(|way| old.iter().all(|it| it.way != *way)),
        );
        for way in ways {
            let find = |exits: &'_ [Exit]| exits.iter().position(|exit| exit.way == way);
            let (one, other) =
                (find(old).and_then(|at| old.get(at)), find(new).and_then(|at| new.get(at)));
            let cond = |exit: Option<&Exit>| exit.map_or(FALSE, |exit| exit.cond);
            let cut = match way {
                Way::Goto(label) => Some(label),
                _ => None,
            };
            let differs = graph.xor(cond(one), cond(other));
            claims.push(Claim { differs, start, cut });
            let (Some(one), Some(other)) = (one, other) else { continue };
            let mut claim = |differs: Lit| claims.push(Claim { differs, start, cut });
            let history = graph.xor(one.history, other.history);
            claim(graph.and(one.cond, history));
            let words = !graph.equal(&one.words, &other.words);
            claim(graph.and(one.cond, words));
            for cell in &context.universe.cells {
                for offset in cell.range() {
                    let (a, b) = (one.memory.byte(offset), other.memory.byte(offset));
                    if a == b || cut.is_some_and(|label| self.dead.contains(label, offset)) {
                        continue;
                    }
                    let differs = !graph.equal(&a, &b);
                    claim(graph.and(one.cond, differs));
                }
            }
        }
    }

    fn place(&self, loc: StatementId) -> Option<(String, u32)> {
        self.codes.first()?.place(loc)
    }
}

const TIME: &str = "begins a function for which the time was up";

fn undecided(reason: Option<Reason>) -> Verdict {
    Verdict::Undecided(reason.unwrap_or(Reason { text: TIME.into(), place: None }))
}

/// The numbers that functions compare with.
fn constants(funcs: &[&FuncData]) -> Vec<i64> {
    let mut all = std::collections::BTreeSet::new();
    for func in funcs {
        for (_, block) in func.blocks() {
            for &inst in &block.insts {
                match *func.inst(inst) {
                    InstData::Iconst { value, .. } => {
                        all.insert(value);
                    }
                    InstData::Fconst { bits } => {
                        let value = f64::from_bits(bits);
                        all.insert(if value.fract() == 0.0 { value as i64 } else { bits as i64 });
                    }
                    _ => {}
                }
            }
        }
    }
    all.into_iter().collect()
}

/// A function of which something is claimed.
struct Subject<'s, 'm> {
    validation: &'s Validation<'m>,
    universe: &'s Universe,
    graph: &'s crate::logic::Graph,
    terms: &'s Terms,
    /// The image at the beginning, and the inputs that it is made of.
    memory: &'s Memory,
    raw: &'s [Lit],
    constants: Vec<i64>,
    starts: &'s [Start],
    /// The nodes that were made for the second version.
    second: &'s [std::ops::Range<u32>],
    deadline: Deadline,
}

impl Subject<'_, '_> {
    /// Whether one of the claims does not hold.
    fn decide(&self, claims: &[Claim]) -> Attempt {
        let mut run = Simulation::new(self.graph, self.terms);
        let mut runs = vec![];
        let mut broken = vec![];
        let mut tried = 0;
        for _ in 0..WORDS {
            run.randomize(self.universe, self.raw, &self.constants);
            run.run(false);
            for claim in claims {
                let lanes = run.get(claim.differs);
                if lanes == 0 || tried >= MOST_TRIED {
                    continue;
                }
                tried += 1;
                broken.push(*claim);
                if let Some(difference) = self.replay(&run, lanes.trailing_zeros(), claim.start) {
                    return Attempt::Done(Verdict::Refuted(difference));
                }
            }
            runs.push(run.values.clone());
            if self.deadline.is_over() {
                break;
            }
        }
        if !broken.is_empty() {
            return Attempt::Differs(broken.iter().filter_map(|claim| claim.cut).collect());
        }
        let mut sweep = Sweep::new(self.graph, self.terms, &runs, self.second, self.deadline);
        drop(runs);
        for claim in claims {
            if sweep.holds_at_once(claim.differs, Duration::from_millis(300)) {
                continue;
            }
            match sweep.decide(claim.differs) {
                Finding::Holds => {}
                Finding::Open => return Attempt::Differs(vec![]),
                Finding::Broken(values) => {
                    let mut run = Simulation::new(self.graph, self.terms);
                    for (node, value) in values {
                        run.set(Lit::of_node(node), if value { u64::MAX } else { 0 });
                    }
                    run.run(true);
                    return match self.replay(&run, 0, claim.start) {
                        Some(difference) => Attempt::Done(Verdict::Refuted(difference)),
                        None => Attempt::Differs(claim.cut.into_iter().collect()),
                    };
                }
            }
        }
        Attempt::Done(Verdict::Proved)
    }
}
