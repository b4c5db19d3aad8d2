//! Two versions of a program that get the same inputs, and whether the machine can see a difference.

use std::collections::{BTreeMap, BTreeSet};
use std::time::{Duration, Instant};

use plcc_runtime::Executive;
use plcc_runtime::stimulus::{Player, Stimulus};
use rustc_hash::FxHashMap;

use crate::control::Source;
use crate::logic::{FALSE, Lit, Node};
use crate::question::reason;
use crate::scan::Reason;
use crate::solve::{Deadline, Effort, Found, Trace, correspond, invariant, search};
use crate::stimulus::{Row, Station, csv, rows, without_needless};
use crate::system::{First, Latch, System, Time, Variable};

/// How many ticks are looked at before invariants are looked for.
const FIRST_TICKS: usize = 24;

/// How many ticks are looked at at most.
const MOST_TICKS: usize = 100_000;

/// A version of a program.
#[derive(Clone, Copy)]
#[expect(missing_debug_implementations, reason = "a station has none")]
pub struct Version<'p> {
    /// The program, as it is made into logic.
    pub source: Source<'p>,
    /// Where it is run.
    pub station: &'p dyn Station,
}

/// Whether something differs between two versions.
#[derive(Clone, Debug)]
pub enum Comparison {
    /// It is the same in every tick, whatever the inputs are.
    Same,
    /// It can differ.
    Different {
        /// After how many ticks.
        scans: u64,
        /// A stimulus with which both were run in the interpreter, and differed.
        stimulus: String,
    },
    /// It is not known.
    Undecided {
        /// Why not.
        reason: Reason,
    },
}

/// Something that the machine sees of both versions.
struct Pair {
    name: String,
    /// For each of its bits the literals of both versions.
    lits: Vec<(Lit, Lit)>,
    /// For each of its bits the places in the images of both versions, offset and bit; `None` where it is always 0.
    places: Vec<[Option<(u32, u8)>; 2]>,
}

/// Both versions side by side.
struct Product {
    system: System,
    pairs: Vec<Pair>,
    /// Whether one is stopped and the other is not.
    stops_apart: Lit,
    running: Lit,
    escape: Lit,
    /// The names that inputs have in the old version, by those in the stimulus.
    old_names: BTreeMap<String, String>,
}

/// Compares each output and each retained variable of two versions, each within a time.
///
/// # Errors
/// When programs of the language can't be taken.
pub fn compare(
    old: Version<'_>,
    new: Version<'_>,
    time: Duration,
) -> Result<Vec<(String, Comparison)>, String> {
    let none = BTreeSet::new();
    let product = Product::new(
        old.source.system(Time::Exact, &none)?,
        new.source.system(Time::Exact, &none)?,
    );
    let Product { mut system, pairs, stops_apart, running, escape, old_names } = product;
    let mut asked = vec![];
    for pair in pairs {
        let mut differs = stops_apart;
        for &(a, b) in &pair.lits {
            let bit = system.graph().xor(a, b);
            differs = system.graph().or(differs, bit);
        }
        let differs = system.graph().and(differs, running);
        let bad = system.graph().or(differs, escape);
        asked.push((pair, bad));
    }
    let begin = Instant::now();
    let roots: Vec<Lit> = asked.iter().map(|(_, bad)| *bad).collect();
    correspond(&mut system, &roots, Deadline(Some(begin + time)));
    let mut answers = vec![];
    for (pair, bad) in asked {
        let begin = Instant::now();
        let until = |part: f64| Deadline(Some(begin + time.mul_f64(part)));
        let found = match search(&system, bad, FIRST_TICKS, true, until(0.5)) {
            Found::Open(FIRST_TICKS) => match invariant(&system, bad, Effort::All, until(0.5)) {
                Found::Open(_) => search(&system, bad, MOST_TICKS, true, until(1.0)),
                found => found,
            },
            found => found,
        };
        let answer = match found {
            Found::Never(_) => Comparison::Same,
            Found::Open(ticks) => {
                let text = format!("the time was up; it is the same in the first {ticks} scans");
                Comparison::Undecided { reason: Reason { text, place: None } }
            }
            Found::Run(trace) => different(&system, &trace, &pair, old, new, &old_names)
                .unwrap_or_else(|| Comparison::Undecided { reason: reason(&system, &trace) }),
        };
        answers.push((pair.name, answer));
    }
    Ok(answers)
}

/// The answer where both versions differ in the interpreter, with the inputs of a run.
fn different(
    system: &System,
    trace: &Trace,
    pair: &Pair,
    old: Version<'_>,
    new: Version<'_>,
    old_names: &BTreeMap<String, String>,
) -> Option<Comparison> {
    let ticks: Vec<u64> = (0..trace.ticks.len() as u64).collect();
    let rows = rows(system, trace, &ticks);
    let run = |rows: &[Row], last| run(rows, pair, old, new, old_names, last + 1);
    let found = run(&rows, *ticks.last()?)?;
    let (rows, last) = without_needless(rows, found, &run);
    Some(Comparison::Different { scans: last + 1, stimulus: csv(&rows) })
}

/// Runs both versions, and gives the first tick in which they differ.
fn run(
    rows: &[Row],
    pair: &Pair,
    old: Version<'_>,
    new: Version<'_>,
    old_names: &BTreeMap<String, String>,
    last: u64,
) -> Option<u64> {
    let renamed: Vec<Row> = rows.iter().map(|row| row.renamed(old_names)).collect();
    let mut sides = vec![];
    for (version, rows) in [(old, renamed.as_slice()), (new, rows)] {
        let executive = version.station.executive();
        let names = executive.names();
        // An input that only the other version has says nothing to this one.
        let own = rows.iter().filter(|row| row.is_known(&*names)).cloned();
        let text = csv(&own.collect::<Vec<_>>());
        let stimulus = Stimulus::parse(text.as_bytes(), &*names, executive.tick_ns()).ok()?;
        sides.push((executive, version.station.engine(), Player::new(stimulus, false)));
    }
    let read = |executive: &dyn Executive, place: Option<(u32, u8)>| {
        place.and_then(|(offset, bit)| Some(executive.image().get(offset as usize)? >> bit & 1))
    };
    for tick in 0..last {
        let mut stopped = vec![];
        for (executive, engine, player) in &mut sides {
            player.apply(tick, executive.as_mut());
            stopped.push(executive.tick(engine.as_mut(), &mut vec![]).is_err());
        }
        let [(old, ..), (new, ..)] = sides.as_slice() else { return None };
        let differs = pair.places.iter().any(|&[a, b]| {
            read(old.as_ref(), a).unwrap_or(0) != read(new.as_ref(), b).unwrap_or(0)
        });
        if differs || stopped.first() != stopped.last() {
            return Some(tick);
        }
        if stopped.contains(&true) {
            return None;
        }
    }
    None
}

impl Product {
    fn new(old: System, new: System) -> Self {
        // The inputs of the new version are those of the old one with the same key.
        let mut system = old;
        let mut known: FxHashMap<u32, Lit> = FxHashMap::default();
        let mut old_names = BTreeMap::new();
        let by_key = |variables: &[Variable]| -> BTreeMap<String, usize> {
            variables.iter().enumerate().map(|(at, it)| (it.key.clone(), at)).collect()
        };
        let keys = by_key(&system.inputs);
        let mut more = vec![];
        for variable in &new.inputs {
            match keys.get(&variable.key).and_then(|&at| system.inputs.get_mut(at)) {
                Some(own) if own.bits.len() == variable.bits.len() => {
                    for (theirs, mine) in variable.bits.iter().zip(&own.bits) {
                        known.insert(theirs.node(), *mine);
                    }
                    if own.name != variable.name {
                        old_names.insert(variable.name.clone(), own.name.clone());
                        own.name.clone_from(&variable.name);
                    }
                }
                _ => more.push(variable.clone()),
            }
        }
        let kept = by_key(&system.retained);
        let mut same: FxHashMap<u32, Lit> = FxHashMap::default();
        for variable in &new.retained {
            let own = kept.get(&variable.key).and_then(|&at| system.retained.get(at));
            for (theirs, mine) in
                variable.bits.iter().zip(own.map_or(&[][..], |own| own.bits.as_slice()))
            {
                same.insert(theirs.node(), *mine);
            }
        }
        // The nodes of the new version, each after those that it is made of.
        let nodes = new.builder.graph.len() as u32;
        let get = |known: &FxHashMap<u32, Lit>, lit: Lit| {
            let made = known.get(&lit.node()).copied().unwrap_or(FALSE);
            made.complement_if(lit.is_complement())
        };
        for node in 0..nodes {
            if known.contains_key(&node) {
                continue;
            }
            let made = match new.builder.graph.node(node) {
                Node::False => FALSE,
                Node::Input => system.graph().input(),
                Node::And(a, b) => {
                    let (a, b) = (get(&known, a), get(&known, b));
                    system.graph().and(a, b)
                }
            };
            known.insert(node, made);
        }
        for variable in more {
            let bits = variable.bits.iter().map(|&bit| get(&known, bit)).collect();
            system.inputs.push(Variable { bits, ..variable });
        }
        for (node, reason) in &new.builder.unknown {
            let text = new.builder.reasons.get(*reason as usize).cloned();
            if let (Some(lit), Some(text)) = (known.get(node), text) {
                let reason = system.builder.reason(text);
                system.builder.unknown.insert(lit.node(), reason);
            }
        }
        for (lit, reason) in &new.builder.escapes {
            if let Some(text) = new.builder.reasons.get(*reason as usize).cloned() {
                let reason = system.builder.reason(text);
                system.builder.escapes.push((get(&known, *lit), reason));
            }
        }
        for latch in &new.latches {
            let first = match (latch.first, same.get(&latch.lit.node())) {
                (First::Free, Some(&own)) => First::As(own),
                (first, _) => first,
            };
            let (lit, next) = (get(&known, latch.lit), get(&known, latch.next));
            system.latches.push(Latch { lit, first, next, place: None });
        }
        let (new_running, new_stops) = (get(&known, new.running), get(&known, new.stops));
        let (old_running, old_stops) = (system.running, system.stops);
        let running = system.graph().and(old_running, new_running);
        let stops_apart = system.graph().xor(old_stops, new_stops);
        let escapes: Vec<Lit> = system.builder.escapes.iter().map(|(lit, _)| *lit).collect();
        let escape = system.graph().any(escapes);
        let escape = system.graph().and(escape, running);
        let mut pairs = vec![];
        let bits_of = |observed: &[crate::system::Observed]| -> BTreeMap<String, ((u32, u8), Lit)> {
            let bits = observed.iter().flat_map(|it| it.bits.iter().cloned());
            bits.map(|(key, place, lit)| (key, (place, lit))).collect()
        };
        let (old_bits, new_bits) = (bits_of(&system.observed), bits_of(&new.observed));
        for (observed, is_new) in new
            .observed
            .iter()
            .map(|it| (it, true))
            .chain(system.observed.iter().map(|it| (it, false)))
        {
            let others = if is_new { &old_bits } else { &new_bits };
            let is_known = observed.bits.iter().all(|(key, ..)| others.contains_key(key));
            // What both have is told once, and what only one keeps while the power is off is not a difference.
            if is_known && !is_new || !is_known && observed.is_retained {
                continue;
            }
            let mut pair = Pair { name: observed.name.clone(), lits: vec![], places: vec![] };
            for (key, place, lit) in &observed.bits {
                let other = others.get(key);
                let (other_place, other_lit) =
                    other.map_or((None, FALSE), |(place, lit)| (Some(*place), *lit));
                if is_new {
                    pair.lits.push((other_lit, get(&known, *lit)));
                    pair.places.push([other_place, Some(*place)]);
                } else {
                    pair.lits.push((*lit, get(&known, other_lit)));
                    pair.places.push([Some(*place), other_place]);
                }
            }
            pairs.push(pair);
        }
        Self { system, pairs, stops_apart, running, escape, old_names }
    }
}
