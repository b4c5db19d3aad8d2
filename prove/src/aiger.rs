//! Systems as AIGER files, which other model checkers read (Biere, Heljanko and Wieringa, AIGER 1.9 and beyond, 2011).

use std::fmt::Write as _;

use plcc_abi::place::{Place, Type};
use plcc_runtime::{Names, Purpose};
use rustc_hash::{FxHashMap, FxHashSet};

use crate::logic::{FALSE, Graph, Lit, Node, TRUE};
use crate::scan::Reason;
use crate::system::{First, Latch, System};

/// How a file is coded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coding {
    /// As bytes (`aig`), which is shorter.
    Binary,
    /// As text (`aag`).
    Text,
}

/// A file, and what of the program is not in it.
#[derive(Clone, Debug)]
pub struct File {
    /// The file.
    pub bytes: Vec<u8>,
    /// What may be anything in it, since it is not followed.
    pub not_followed: Vec<Reason>,
}

/// A latch as the format has it.
struct Reset {
    next: Lit,
    /// 0, 1, or its own literal where it is anything.
    first: Lit,
}

/// The part of a system on which some literals depend, with the numbers that the format asks for: inputs, latches, conjunctions.
struct Part<'s> {
    system: &'s System,
    /// The nodes of the system that matter.
    cone: FxHashSet<u32>,
    graph: Graph,
    /// What the nodes of the system are here.
    known: FxHashMap<u32, Lit>,
    inputs: Vec<u32>,
    /// The latches of the system, by their nodes.
    latches: Vec<u32>,
    resets: Vec<Reset>,
}

/// Writes a system with literals that must never be true, each with the question that it is of. `called` says how a bit of the
/// process image is called.
pub fn write(
    system: &System,
    bad: &[(String, Lit)],
    called: &dyn Fn(u32, u8) -> Option<String>,
    coding: Coding,
) -> File {
    let part = Part::new(system, bad);
    let bad_lits: Vec<Lit> = bad.iter().map(|(_, lit)| part.get(*lit)).collect();
    let (inputs, latches) = (part.inputs.len(), part.resets.len());
    let last = part.graph.len() - 1;
    let ands = last - inputs - latches;
    let word = match coding {
        Coding::Binary => "aig",
        Coding::Text => "aag",
    };
    let mut text = format!("{word} {last} {inputs} {latches} 0 {ands} {}\n", bad.len());
    if coding == Coding::Text {
        (1..=inputs as u32).for_each(|node| line(&mut text, &[Lit::of_node(node)]));
    }
    for (node, reset) in (inputs as u32 + 1..).zip(&part.resets) {
        let own = Lit::of_node(node);
        let mut numbers = if coding == Coding::Text { vec![own] } else { vec![] };
        numbers.push(reset.next);
        if reset.first != FALSE {
            numbers.push(reset.first);
        }
        line(&mut text, &numbers);
    }
    bad_lits.iter().for_each(|&lit| line(&mut text, &[lit]));
    let mut bytes = text.into_bytes();
    for node in (inputs + latches + 1) as u32..=last as u32 {
        let Node::And(low, high) = part.graph.node(node) else { continue };
        let own = Lit::of_node(node);
        match coding {
            Coding::Text => {
                let mut text = String::new();
                line(&mut text, &[own, high, low]);
                bytes.extend(text.into_bytes());
            }
            Coding::Binary => {
                bytes.extend(difference(number(own) - number(high)));
                bytes.extend(difference(number(high) - number(low)));
            }
        }
    }
    let not_followed = part.not_followed();
    bytes.extend(symbols(&part, bad, called).into_bytes());
    bytes.extend(comment(&not_followed).into_bytes());
    File { bytes, not_followed }
}

/// The names of the bits of the process image, by offset and bit. A bit with a name of its own is called by that.
pub fn bits_of(names: &dyn Names) -> FxHashMap<(u32, u8), String> {
    let mut single = vec![];
    for (name, key) in names.declared() {
        // The counter of a timer of PMI is not declared; it is called by its control contact.
        let counter = format!("{name}#COUNT");
        if let Ok(key) = names.find(&counter, Purpose::Watch) {
            single.push((counter, key));
        }
        match names.properties(key).elements {
            None => single.push((name, key)),
            Some(count) => single.extend(
                (0..count)
                    .filter_map(|index| names.element(key, index))
                    .map(|element| (names.canonical(element), element)),
            ),
        }
    }
    let mut known = FxHashMap::default();
    for (name, key) in &single {
        if let Some(place) = names.properties(*key).value.filter(|it| width(it) == 1) {
            known.entry((place.offset, place.bit)).or_insert_with(|| name.clone());
        }
    }
    for (name, key) in &single {
        let Some(place) = names.properties(*key).value.filter(|it| width(it) > 1) else { continue };
        for number in 0..width(&place) {
            let at = u32::from(place.bit) + number;
            let at = (place.offset + at / 8, (at % 8) as u8);
            known.entry(at).or_insert_with(|| format!("{name}.{number}"));
        }
    }
    known
}

/// How many bits a variable has.
fn width(place: &Place) -> u32 {
    match place.ty {
        Type::Logical => 1,
        _ => place.width.into(),
    }
}

/// The number by which the format names a literal.
fn number(lit: Lit) -> u32 {
    lit.node() << 1 | u32::from(lit.is_complement())
}

/// A line of literals.
fn line(text: &mut String, lits: &[Lit]) {
    let numbers: Vec<String> = lits.iter().map(|&lit| number(lit).to_string()).collect();
    text.push_str(&numbers.join(" "));
    text.push('\n');
}

/// A difference of literals in the binary form: seven bits a byte, the lowest first, the highest bit set but in the last.
fn difference(mut number: u32) -> Vec<u8> {
    let mut bytes = vec![];
    while number >= 0x80 {
        bytes.push((number & 0x7F) as u8 | 0x80);
        number >>= 7;
    }
    bytes.push(number as u8);
    bytes
}

/// The names of inputs, latches and questions.
fn symbols(
    part: &Part<'_>,
    bad: &[(String, Lit)],
    called: &dyn Fn(u32, u8) -> Option<String>,
) -> String {
    let mut names: FxHashMap<u32, String> = FxHashMap::default();
    for variable in part.system.inputs.iter().chain(&part.system.retained) {
        for (place, bit) in variable.bits.iter().enumerate() {
            let name = match variable.bits.len() {
                1 => variable.name.clone(),
                _ => format!("{}.{place}", variable.name),
            };
            names.entry(bit.node()).or_insert(name);
        }
    }
    for latch in &part.system.latches {
        if let Some(name) = latch.place.and_then(|(offset, bit)| called(offset, bit)) {
            names.entry(latch.lit.node()).or_insert(name);
        }
    }
    let builder = &part.system.builder;
    for (node, reason) in &builder.unknown {
        if let Some(reason) = builder.reasons.get(*reason as usize) {
            let place = reason.place.as_ref();
            let place = place.map_or_else(String::new, |(file, line)| format!(" {file}:{line}"));
            names.entry(*node).or_insert(format!("not followed{place}"));
        }
    }
    let mut text = String::new();
    let mut used: FxHashMap<String, u32> = FxHashMap::default();
    let mut tell = |letter: char, index: usize, name: Option<&str>| {
        let Some(name) = name else { return };
        let mut name = name.replace(['\n', '\r'], " ");
        // ABC takes each name once: an input that is kept is called `I540#2` there.
        let times = used.entry(name.clone()).or_default();
        *times += 1;
        if *times > 1 {
            // Writing to a text does not fail.
            let _ = write!(name, "#{times}");
        }
        let _ = writeln!(text, "{letter}{index} {name}");
    };
    for (letter, nodes) in [('i', &part.inputs), ('l', &part.latches)] {
        for (index, node) in nodes.iter().enumerate() {
            tell(letter, index, names.get(node).map(String::as_str));
        }
    }
    if part.resets.len() > part.latches.len() {
        tell('l', part.latches.len(), Some("after power-up"));
    }
    for (index, (name, _)) in bad.iter().enumerate() {
        tell('b', index, Some(name));
    }
    text
}

/// The comment at the end of a file.
fn comment(not_followed: &[Reason]) -> String {
    let mut text = format!("c\nplcc {}\n", env!("CARGO_PKG_VERSION"));
    for Reason { text: why, place } in not_followed {
        let place =
            place.as_ref().map_or_else(String::new, |(file, line)| format!("{file}:{line} "));
        let _ = writeln!(text, "not followed: {place}{why}");
    }
    text
}

impl<'s> Part<'s> {
    fn new(system: &'s System, bad: &[(String, Lit)]) -> Self {
        let by_node: FxHashMap<u32, &Latch> =
            system.latches.iter().map(|latch| (latch.lit.node(), latch)).collect();
        let roots = bad.iter().map(|(_, lit)| lit.node());
        let cone = cone(system, &by_node, roots);
        let mut part = Self {
            system,
            cone,
            graph: Graph::default(),
            known: FxHashMap::from_iter([(0, FALSE)]),
            inputs: vec![],
            latches: vec![],
            resets: vec![],
        };
        let mut rest: Vec<u32> =
            part.cone.iter().copied().filter(|node| !by_node.contains_key(node)).collect();
        rest.sort_unstable();
        let named = system.inputs.iter().flat_map(|variable| &variable.bits);
        let named: Vec<u32> = named.map(|bit| bit.node()).collect();
        for node in named.into_iter().chain(rest) {
            let is_input = system.builder.graph.node(node) == Node::Input;
            if is_input && part.cone.contains(&node) && !part.known.contains_key(&node) {
                let lit = part.graph.input();
                part.known.insert(node, lit);
                part.inputs.push(node);
            }
        }
        part.make_latches();
        part.make_rest();
        let next = part.latches.iter().map(|node| by_node.get(node).map(|latch| latch.next));
        let next: Vec<Lit> = next.map(|lit| part.get(lit.unwrap_or(FALSE))).collect();
        for (reset, next) in part.resets.iter_mut().zip(next) {
            reset.next = next;
        }
        part
    }

    /// What a literal of the system is here.
    fn get(&self, lit: Lit) -> Lit {
        let known = self.known.get(&lit.node()).copied().unwrap_or(FALSE);
        known.complement_if(lit.is_complement())
    }

    /// Makes the latches. One that is at power-up what another one is has that one's value in the first tick, which a latch of
    /// its own knows.
    fn make_latches(&mut self) {
        let all: Vec<Latch> = self.system.latches.clone();
        let all = all.iter().filter(|latch| self.cone.contains(&latch.lit.node()));
        let all: Vec<&Latch> = all.collect();
        for latch in &all {
            let lit = self.graph.input();
            self.latches.push(latch.lit.node());
            let first = match latch.first {
                First::Constant(value) => Lit::constant(value),
                First::Free => lit,
                First::As(_) => FALSE,
            };
            self.resets.push(Reset { next: FALSE, first });
            self.known.insert(latch.lit.node(), lit);
        }
        let others = all.iter().filter_map(|latch| match latch.first {
            First::As(other) => Some((latch.lit.node(), other)),
            _ => None,
        });
        let others: Vec<(u32, Lit)> = others.collect();
        if others.is_empty() {
            return;
        }
        let later = self.graph.input();
        self.resets.push(Reset { next: TRUE, first: FALSE });
        for (node, other) in others {
            let (own, other) = (self.get(Lit::of_node(node)), self.get(other));
            let value = self.graph.choose(later, own, other);
            self.known.insert(node, value);
        }
    }

    /// Makes the conjunctions.
    fn make_rest(&mut self) {
        let mut nodes: Vec<u32> = self.cone.iter().copied().collect();
        nodes.sort_unstable();
        for node in nodes {
            if let Node::And(a, b) = self.system.builder.graph.node(node) {
                let (a, b) = (self.get(a), self.get(b));
                let lit = self.graph.and(a, b);
                self.known.insert(node, lit);
            }
        }
    }

    /// What may be anything in this part, or leads out of what is followed.
    fn not_followed(&self) -> Vec<Reason> {
        let builder = &self.system.builder;
        let mut numbers: Vec<u32> =
            self.inputs.iter().filter_map(|node| builder.unknown.get(node)).copied().collect();
        let is_possible = |lit: &Lit| *lit != FALSE && self.cone.contains(&lit.node());
        let escapes = builder.escapes.iter().filter(|(lit, _)| is_possible(lit));
        numbers.extend(escapes.map(|(_, reason)| *reason));
        numbers.sort_unstable();
        numbers.dedup();
        numbers.iter().filter_map(|&it| builder.reasons.get(it as usize)).cloned().collect()
    }
}

/// The nodes on which some depend, in this tick or by what is kept from earlier ones.
fn cone(
    system: &System,
    latches: &FxHashMap<u32, &Latch>,
    roots: impl Iterator<Item = u32>,
) -> FxHashSet<u32> {
    let mut cone = FxHashSet::default();
    let mut open: Vec<u32> = roots.collect();
    while let Some(node) = open.pop() {
        if !cone.insert(node) {
            continue;
        }
        match (system.builder.graph.node(node), latches.get(&node)) {
            (Node::And(a, b), _) => open.extend([a.node(), b.node()]),
            (Node::Input, Some(latch)) => {
                open.push(latch.next.node());
                if let First::As(other) = latch.first {
                    open.push(other.node());
                }
            }
            (Node::Input | Node::False, _) => {}
        }
    }
    cone
}
