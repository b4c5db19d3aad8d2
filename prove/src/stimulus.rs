//! Runs that logic has found, as stimuli for the interpreter.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use plcc_abi::Engine;
use plcc_runtime::stimulus::{Player, Stimulus};
use plcc_runtime::{Executive, Names, Purpose};

use crate::solve::Trace;
use crate::system::{System, Variable};

/// How many ticks a run is stretched to at most, so that its timers run down.
const MOST_TICKS: u64 = 4_000_000;

/// How many rows there may be for the rows that nothing needs to be looked for, and how many ticks.
const FEW: (usize, u64) = (200, 3_000);

/// A row: tick, name, value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Row {
    pub(crate) tick: u64,
    name: String,
    value: String,
}

impl Row {
    /// Whether a program has the variable.
    pub(crate) fn is_known(&self, names: &dyn Names) -> bool {
        names.find(&self.name, Purpose::Stimulus).is_ok()
    }

    /// The row with the name that its variable has in another version.
    pub(crate) fn renamed(&self, names: &BTreeMap<String, String>) -> Self {
        let name = names.get(&self.name).unwrap_or(&self.name);
        Self { tick: self.tick, name: name.clone(), value: self.value.clone() }
    }
}

/// The rows that give a program the inputs of a run. `ticks` says in which tick each tick of the run comes about, and how many
/// ticks before it its inputs are given already.
pub(crate) fn rows(system: &System, trace: &Trace, ticks: &[u64]) -> Vec<Row> {
    let mut rows = vec![];
    let mut known: BTreeMap<&str, i64> = BTreeMap::new();
    // The value of a variable in a tick of the run, if the run says one.
    let value_of = |variable: &Variable, at: usize| {
        let is_known = variable.bits.iter().any(|&bit| trace.value(at, bit).is_some());
        is_known.then(|| variable.number(|bit| trace.value(at, bit).unwrap_or(false)))
    };
    for variable in &system.retained {
        if let Some(value) = value_of(variable, 0).filter(|value| *value != variable.first) {
            let value = variable.text(value);
            rows.push(Row { tick: 0, name: variable.name.clone(), value });
        }
    }
    for (at, &tick) in ticks.iter().enumerate().take(trace.ticks.len()) {
        for variable in &system.inputs {
            let Some(value) = value_of(variable, at) else { continue };
            let before = match variable.is_pulse {
                true => 0,
                false => known.get(variable.name.as_str()).copied().unwrap_or(variable.first),
            };
            if before != value {
                let text = variable.text(value);
                rows.push(Row { tick, name: variable.name.clone(), value: text });
                known.insert(&variable.name, value);
            }
        }
    }
    rows
}

/// The rows as a file.
pub(crate) fn csv(rows: &[Row]) -> String {
    let mut text = "tick,name,value\n".to_owned();
    for Row { tick, name, value } in rows {
        // Writing to a text does not fail.
        let _ = writeln!(text, "{tick},{name},{value}");
    }
    text
}

/// When each tick of a run comes about if its timers take their time: as many ticks after the first as let each timer run as
/// long as it takes, and that none runs down which the run leaves running. `None` if that cannot be.
pub(crate) fn schedule(system: &System, trace: &Trace) -> Option<Vec<u64>> {
    let count = trace.ticks.len();
    // Pairs of ticks, and how many ticks the second comes after the first at least.
    let mut least: Vec<(usize, usize, i64)> = (1..count).map(|at| (at - 1, at, 1)).collect();
    for elapse in &system.elapses {
        let mut since = None;
        for at in 0..count {
            let running = evaluate(system, trace, at, elapse.running);
            if running != Some(true) {
                since = None;
            }
            let expires =
                running == Some(true) && evaluate(system, trace, at, elapse.expires) == Some(true);
            if let Some(start) = since {
                let ticks = elapse.ticks as i64;
                if expires {
                    least.push((start, at, ticks));
                    least.push((at, start, -ticks));
                } else if at > start {
                    least.push((at, start, 1 - ticks));
                }
            }
            if expires {
                since = None;
            }
            let runs_on = evaluate(system, trace, at, elapse.runs_on);
            let starts = evaluate(system, trace, at, elapse.starts) == Some(true);
            if (running != Some(true) || expires || starts) && runs_on == Some(true) {
                since = Some(at);
            }
        }
    }
    let mut ticks = vec![0_i64; count];
    for round in 0..=count {
        let mut changed = false;
        for &(from, to, distance) in &least {
            let earliest = ticks.get(from)? + distance;
            let slot = ticks.get_mut(to)?;
            if *slot < earliest {
                *slot = earliest;
                changed = true;
            }
        }
        if !changed {
            break;
        }
        if round == count {
            return None;
        }
    }
    let first = *ticks.first()?;
    let last = *ticks.last()?;
    let fits = first == 0 && u64::try_from(last).is_ok_and(|last| last <= MOST_TICKS);
    fits.then(|| ticks.iter().map(|&tick| tick as u64).collect())
}

/// The value of a literal in a tick of a run, as far as what is known of the inputs decides it.
pub(crate) fn evaluate(
    system: &System,
    trace: &Trace,
    tick: usize,
    lit: crate::logic::Lit,
) -> Option<bool> {
    use crate::logic::Node;
    use rustc_hash::FxHashMap;
    let graph = &system.builder.graph;
    let mut known: FxHashMap<u32, Option<bool>> = FxHashMap::default();
    let mut open = vec![lit.node()];
    while let Some(&node) = open.last() {
        if known.contains_key(&node) {
            open.pop();
            continue;
        }
        let value = match graph.node(node) {
            Node::False => Some(false),
            Node::Input => trace.value(tick, crate::logic::Lit::of_node(node)),
            Node::And(a, b) => {
                let get = |lit: crate::logic::Lit| {
                    known.get(&lit.node()).map(|it| it.map(|it| it != lit.is_complement()))
                };
                match (get(a), get(b)) {
                    (Some(a), Some(b)) => match (a, b) {
                        (Some(false), _) | (_, Some(false)) => Some(false),
                        (Some(true), Some(true)) => Some(true),
                        _ => None,
                    },
                    (x, y) => {
                        if x.is_none() {
                            open.push(a.node());
                        }
                        if y.is_none() {
                            open.push(b.node());
                        }
                        continue;
                    }
                }
            }
        };
        known.insert(node, value);
        open.pop();
    }
    let value = known.get(&lit.node()).copied().flatten()?;
    Some(value != lit.is_complement())
}

/// Makes controls in which runs are tried.
pub trait Station {
    /// A control at its first power-up.
    fn executive(&self) -> Box<dyn Executive>;

    /// An interpreter of its program.
    fn engine(&self) -> Box<dyn Engine>;
}

/// Runs a stimulus, and gives the first tick at whose end something is wrong, up to tick `last`.
pub(crate) fn run(
    station: &dyn Station,
    text: &str,
    last: u64,
    wrong: &mut dyn FnMut(&dyn Executive) -> bool,
) -> Option<u64> {
    let mut executive = station.executive();
    let mut engine = station.engine();
    let stimulus = Stimulus::parse(text.as_bytes(), &*executive.names(), executive.tick_ns());
    let mut player = Player::new(stimulus.ok()?, false);
    let mut events = vec![];
    for tick in 0..=last {
        player.apply(tick, executive.as_mut());
        let stopped = executive.tick(engine.as_mut(), &mut events).is_err();
        events.clear();
        if wrong(executive.as_ref()) {
            return Some(tick);
        }
        if stopped {
            return None;
        }
    }
    None
}

/// Leaves out the rows without which the same comes about, where there are few. `run` runs rows, up to a tick, and gives the tick
/// in which it does.
pub(crate) fn without_needless(
    mut rows: Vec<Row>,
    mut last: u64,
    run: &dyn Fn(&[Row], u64) -> Option<u64>,
) -> (Vec<Row>, u64) {
    if rows.len() <= FEW.0 && last <= FEW.1 {
        for index in (0..rows.len()).rev() {
            let mut fewer = rows.clone();
            fewer.remove(index);
            if let Some(tick) = run(&fewer, last) {
                (rows, last) = (fewer, tick);
            }
        }
    }
    rows.retain(|row| row.tick <= last);
    (rows, last)
}
