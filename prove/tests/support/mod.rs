//! Small random programs, and what the tests ask of them.

#![allow(dead_code, clippy::unwrap_used, clippy::panic, clippy::indexing_slicing, reason = "tests")]

pub(crate) mod pmac;

use std::collections::{HashMap, HashSet, VecDeque};
use std::hash::{Hash, Hasher};
use std::time::Duration;

use fastrand::Rng;
use plcc_abi::{Dialect, Engine};
use plcc_diag::{SourceMap, Span};
use plcc_frontend::common::{Lowered, MemoryLoader, Options};
use plcc_frontend::{CheckedProgram, language};
use plcc_plctest::{Invariant, Plan, Progress, parse};
use plcc_prove::control::{Settings, Source};
use plcc_prove::{Answer, Question, Station, Subject};
use plcc_runtime::nct::{NctExecutive, NctOptions};
use plcc_runtime::pmac::{PmacExecutive, PmacOptions};
use plcc_runtime::pmi::{PmiExecutive, PmiOptions};
use plcc_runtime::{Executive, Names, Purpose, Setting, VariableKey};

/// The seeds of the programs of a test: `PLCC_SEEDS` of them, or else as many as it takes by itself.
pub(crate) fn seeds(usual: u64) -> std::ops::Range<u64> {
    let asked = std::env::var("PLCC_SEEDS").ok().and_then(|text| text.parse().ok());
    0..asked.unwrap_or(usual)
}

/// A program, ready to be run and asked about.
pub(crate) struct Bench {
    pub(crate) text: String,
    pub(crate) checked: Box<dyn CheckedProgram>,
    pub(crate) lowered: Lowered,
    pub(crate) image: Vec<u8>,
}

impl Bench {
    pub(crate) fn new(dialect: Dialect, text: &str) -> Self {
        Self::try_new(dialect, text).unwrap_or_else(|| panic!("{text}"))
    }

    /// A program; `None` where it has errors.
    pub(crate) fn try_new(dialect: Dialect, text: &str) -> Option<Self> {
        let mut sources = SourceMap::new();
        let file = sources.add("p", text.as_bytes());
        let options = Options::default();
        let (checked, found) =
            language(dialect).check(&mut sources, &[file], &MemoryLoader::new(), &options);
        found.iter().filter(|it| it.is_error()).for_each(|it| eprintln!("{it:?}"));
        let checked = checked?;
        let lowered = checked.lower().unwrap();
        let mut this = Self { text: text.into(), checked, lowered, image: vec![] };
        this.image = this.executive().image().to_vec();
        Some(this)
    }

    pub(crate) fn source(&self) -> Source<'_> {
        let settings = Settings {
            period_ns: 20_000_000,
            level2_ms: 1,
            boards: 4,
            level0_safepoints: 10_000,
            background_steps: 1,
            as_declared: true,
        };
        Source {
            program: &self.lowered.program,
            module: &self.lowered.module,
            returns: self.lowered.return_stack,
            image: &self.image,
            settings,
        }
    }

    pub(crate) fn question(&self, line: &str) -> Question {
        let mut sources = SourceMap::new();
        let text = format!("program \"p\"\n{line}\n");
        let file = sources.add("s", text.as_bytes());
        let (script, wrong) = parse(&sources, file);
        assert!(wrong.is_empty(), "{line} {wrong:?}");
        let slice = |span: Span| sources.slice(span);
        let names = self.executive().names();
        let plan =
            Plan::new(&script, &slice, self.checked.as_ref(), &self.lowered.program, &*names);
        let plan = plan.unwrap_or_else(|wrong| panic!("{line} {wrong:?}"));
        let Invariant { claim, text, .. } = plan.invariants.into_iter().next().unwrap();
        Question { text, claim }
    }

    pub(crate) fn ask(&self, question: &Question, time: Duration) -> Answer {
        self.subject(&*self.executive().names()).answer(question, time).unwrap()
    }

    /// The program to ask about; `names` are those of its executive.
    pub(crate) fn subject<'s>(&'s self, names: &'s dyn Names) -> Subject<'s> {
        Subject { checked: self.checked.as_ref(), source: self.source(), names, station: self }
    }

    /// The keys of variables.
    pub(crate) fn keys(&self, names: &[&str]) -> Vec<VariableKey> {
        let all = self.executive().names();
        names.iter().map(|name| all.find(name, Purpose::Stimulus).unwrap()).collect()
    }

    /// Searches all states that can be reached with these inputs; gives the first tick that breaks the question, `None` where
    /// none does. The whole answer is `None` where there are too many states.
    pub(crate) fn exhaustive(
        &self,
        question: &Question,
        inputs: &[&str],
        most: usize,
    ) -> Option<Option<u64>> {
        let keys = self.keys(inputs);
        let mut executive = self.executive();
        let mut engine = self.engine();
        let mut seen: HashSet<(Vec<u8>, Progress)> = HashSet::new();
        let mut open = VecDeque::from([(executive.checkpoint(), 0_u64, Progress::default())]);
        while let Some((state, tick, before)) = open.pop_front() {
            for choice in 0..1_u32 << keys.len() {
                executive.resume(&state).unwrap();
                for (bit, &key) in keys.iter().enumerate() {
                    executive.write(key, Setting::Int((choice >> bit & 1).into()));
                }
                let stopped = executive.tick(engine.as_mut(), &mut vec![]).is_err();
                let mut progress = before.clone();
                let breach = question.claim.breach(&mut progress, executive.as_ref());
                if breach.is_some_and(|breach| !breach.has_no_value) {
                    return Some(Some(tick));
                }
                if stopped {
                    continue;
                }
                let mut state = vec![];
                executive.state_into(&mut state);
                // The number of the tick does not belong to the state after the first one.
                let own = without_tick(&state, tick + 1);
                let key = key_of(executive.as_ref(), own);
                if seen.insert((key, progress.clone())) {
                    if seen.len() > most {
                        return None;
                    }
                    open.push_back((executive.checkpoint(), tick + 1, progress));
                }
            }
        }
        Some(None)
    }
}

/// What two states have in common from which a program goes on in the same way. A PMAC counts cycles and lets timers go on below
/// 0, of which the programs here ask nothing. Its states are large, so that a digest stands for one.
fn key_of(executive: &dyn Executive, own: Vec<u8>) -> Vec<u8> {
    let mut key: Vec<u8> = executive.image().to_vec();
    let names = executive.names();
    let at = |name: &str| {
        names.find(name, Purpose::Watch).ok().and_then(|key| names.properties(key).value)
    };
    let Some(cycles) = at("X:$0") else {
        key.extend(own);
        return key;
    };
    for (place, is_timer) in [
        (Some(cycles), false),
        (at("X:$700"), true),
        (at("Y:$700"), true),
        (at("X:$701"), true),
        (at("Y:$701"), true),
    ] {
        let offset = place.unwrap().offset as usize;
        let is_over = key[offset + 2] & 0x80 != 0;
        if !is_timer || is_over {
            key[offset..offset + 3].fill(0);
        }
    }
    key.extend(own);
    let digest = |salt: u8| {
        let mut hasher = std::hash::DefaultHasher::new();
        (salt, &key).hash(&mut hasher);
        hasher.finish().to_le_bytes()
    };
    [digest(0), digest(1)].concat()
}

/// A state without the number of the tick, with which it begins.
fn without_tick(state: &[u8], tick: u64) -> Vec<u8> {
    // A number is written in groups of seven bits.
    let mut length = 1;
    while tick >> (7 * length) != 0 {
        length += 1;
    }
    state[length..].to_vec()
}

/// A copy of a program of PMI with one operator, contact or constant changed.
pub(crate) fn changed(rng: &mut Rng, text: &str) -> String {
    let begin = text.find("$END").unwrap() + 5;
    let bytes = text.as_bytes();
    loop {
        let at = rng.usize(begin..text.len() - 40);
        let before = &text[..at];
        let after = &text[at + 1..];
        let line = before.rfind('\n').map_or(0, |it| it + 1);
        let is_right = text[line..at].contains('=') || text[line..at].contains('(');
        let with = match bytes[at] {
            b'&' => "!",
            b'!' => "&",
            b'<' => ">",
            b'A' | b'B' | b'C' if is_right && bytes[at - 1] == b' ' || bytes[at - 1] == b'/' => {
                ["A", "B", "C", "L1"][rng.usize(..4)]
            }
            b'1'..=b'4' if is_right && bytes[at - 1] == b' ' => {
                ["1", "2", "3", "4"][rng.usize(..4)]
            }
            b'/' if is_right && bytes[at - 1] != b' ' => "",
            _ => continue,
        };
        let changed = format!("{before}{with}{after}");
        if changed != text {
            return changed;
        }
    }
}

/// Searches all states of two programs with the same inputs for a difference of one of their outputs; `None` where there
/// are too many states.
pub(crate) fn first_difference(
    old: &Bench,
    new: &Bench,
    inputs: &[&str],
    output: &str,
    most: usize,
) -> Option<Option<u64>> {
    let benches = [old, new];
    let keys = benches.map(|bench| bench.keys(inputs));
    let outputs = benches.map(|bench| bench.keys(&[output])[0]);
    let mut executives = benches.map(|bench| bench.executive());
    let mut engines = benches.map(|bench| bench.engine());
    let mut seen: HashSet<Vec<u8>> = HashSet::new();
    let begin = [executives[0].checkpoint(), executives[1].checkpoint()];
    let mut open = VecDeque::from([(begin, 0_u64)]);
    while let Some((states, tick)) = open.pop_front() {
        for choice in 0..1_u32 << inputs.len() {
            let mut stopped = [false; 2];
            let mut key = vec![];
            for side in 0..2 {
                let executive = &mut executives[side];
                executive.resume(&states[side]).unwrap();
                for (bit, &key) in keys[side].iter().enumerate() {
                    executive.write(key, Setting::Int((choice >> bit & 1).into()));
                }
                stopped[side] = executive.tick(engines[side].as_mut(), &mut vec![]).is_err();
                let mut state = vec![];
                executive.state_into(&mut state);
                key.extend_from_slice(executive.image());
                key.extend(without_tick(&state, tick + 1));
            }
            let values = [0, 1].map(|side| executives[side].read(outputs[side]));
            // After a stop the lines of outputs are off, whatever the variables are.
            if stopped[0] != stopped[1] || !stopped[0] && values[0] != values[1] {
                return Some(Some(tick));
            }
            if stopped[0] {
                continue;
            }
            if seen.insert(key) {
                if seen.len() > most {
                    return None;
                }
                let states = [executives[0].checkpoint(), executives[1].checkpoint()];
                open.push_back((states, tick + 1));
            }
        }
    }
    Some(None)
}

impl Station for Bench {
    fn executive(&self) -> Box<dyn Executive> {
        let program = &self.lowered.program;
        match program.dialect() {
            Dialect::Pmi => Box::new(PmiExecutive::new(program, PmiOptions::default()).unwrap()),
            Dialect::Nct => Box::new(NctExecutive::new(program, NctOptions::default()).unwrap()),
            _ => Box::new(PmacExecutive::new(program, PmacOptions::default()).unwrap()),
        }
    }

    fn engine(&self) -> Box<dyn Engine> {
        self.checked.interpreter()
    }
}

/// A random program of PMI with the inputs A, B and C, and a condition about it.
pub(crate) fn pmi(rng: &mut Rng) -> (String, String) {
    let mut text = String::from("$INPUT\nA = 0/0\nB = 0/1\nC = 0/2\n$OUTPUT\nX = 1/0\nY = 1/1\n");
    let bits = ["L1", "L2", "L3", "X", "Y"];
    text.push_str("$LOGICAL\nL1, L2, L3, S[3]\n$INTEGER\nN, M\n$LONG\nK\n$TIMER\n");
    text.push_str(&format!("E/TC/DC = {}\nD/TD/DD = {}\n", rng.u8(1..4), rng.u8(1..4)));
    text.push_str("$FLIPFLOP\nQ/QD/CK/PR/CL\n$END\n");
    let mut maker =
        Maker { rng, bits: &["A", "B", "C", "L1", "L2", "L3", "X", "Y", "DC", "DD", "Q", "@IPL"] };
    let mut labels = 0;
    for _ in 0..maker.rng.usize(3..10) {
        maker.statement(&mut text, &bits, 2, &mut labels);
    }
    // Each that may be used is assigned somewhere, so that lints and errors are content.
    text.push_str("TC = L1 & A\nTD = L2\nQD = A\nCK = L3\nPR = F\nCL = B & C\nX = X\nY = Y\n");
    let condition = maker.condition(2);
    (text, condition)
}

struct Maker<'r> {
    rng: &'r mut Rng,
    bits: &'r [&'r str],
}

impl Maker<'_> {
    fn bit(&mut self) -> String {
        let not = if self.rng.bool() { "/" } else { "" };
        format!("{not}{}", self.bits[self.rng.usize(..self.bits.len())])
    }

    fn condition(&mut self, depth: usize) -> String {
        match self.rng.usize(..if depth == 0 { 3 } else { 8 }) {
            0 | 1 => self.bit(),
            2 => {
                let relation = ["=", "<", ">", "<=", ">="][self.rng.usize(..5)];
                format!("(N {relation} {})", self.rng.u8(..5))
            }
            3 => format!("/({} ! {})", self.condition(depth - 1), self.condition(depth - 1)),
            4 => format!("({} = {})", self.condition(depth - 1), self.condition(depth - 1)),
            5 => format!("(N + M {} {})", ["<", "="][self.rng.usize(..2)], self.rng.u8(..6)),
            6 => format!("({} ! {})", self.condition(depth - 1), self.condition(depth - 1)),
            _ => format!("({} & {})", self.condition(depth - 1), self.condition(depth - 1)),
        }
    }

    fn statement(&mut self, text: &mut String, bits: &[&str], depth: usize, labels: &mut usize) {
        let target = bits[self.rng.usize(..bits.len())];
        let condition = self.condition(2);
        match self.rng.usize(..if depth == 0 { 7 } else { 10 }) {
            0..=2 => text.push_str(&format!("{target} = {condition}\n")),
            3 => {
                let formula = [
                    "N = (N + 1) % 4",
                    "N = M * N % 5",
                    "M = N",
                    "M = (M + N) % 3",
                    "N = -N / 2",
                    "K = N - M\nN = K % 7",
                    "M = N & A",
                ][self.rng.usize(..7)];
                text.push_str(&format!("IF ({condition})\n{formula}\nENDIF\n"));
            }
            4 => {
                let pin = ["TC", "TD", "CK", "PR", "CL", "QD"][self.rng.usize(..6)];
                text.push_str(&format!("{pin} = {condition}\n"));
            }
            5 => text.push_str(&format!("S[N % 3 * (N > 0)] = {condition}\n")),
            6 => {
                // Negative and large numbers stop the program, which a run then ends with.
                let index = if self.rng.u8(..4) == 0 { "N" } else { "M % 3 * (M > 0)" };
                text.push_str(&format!("{target} = S[{index}] & {condition}\n"));
            }
            7 => {
                *labels += 1;
                let label = format!("GO{labels}");
                text.push_str(&format!("IF ({condition})\nGOTO {label}\nENDIF\n"));
                self.statement(text, bits, depth - 1, labels);
                text.push_str(&format!("{label}:\n"));
            }
            _ => {
                text.push_str(&format!("IF ({condition})\n"));
                self.statement(text, bits, depth - 1, labels);
                if self.rng.bool() {
                    text.push_str("ELSE\n");
                    self.statement(text, bits, depth - 1, labels);
                }
                text.push_str("ENDIF\n");
            }
        }
    }
}

/// A random program of NCT with the inputs I000, I001 and I002, and a condition about it.
pub(crate) fn nct(rng: &mut Rng) -> (String, String) {
    let mut maker = NctMaker { rng };
    let mut text = String::from(":000 ");
    for _ in 0..maker.rng.usize(..3) {
        maker.statement(&mut text, 1);
    }
    text.push_str("J0\n:001 ");
    for _ in 0..maker.rng.usize(2..9) {
        maker.statement(&mut text, 2);
    }
    text.push_str("J1\n");
    if maker.rng.u8(..6) == 0 {
        text.push_str(":002 ");
        maker.statement(&mut text, 1);
        text.push_str("J2\n");
    }
    text.push_str(":010 ");
    maker.statement(&mut text, 1);
    text.push_str("R\n:011 ");
    maker.statement(&mut text, 1);
    text.push_str("I000 C010 Z R\n");
    let condition = maker.condition(2);
    (text, condition)
}

struct NctMaker<'r> {
    rng: &'r mut Rng,
}

impl NctMaker<'_> {
    fn bit(&mut self) -> String {
        let bits =
            ["I000", "I001", "I002", "F1000", "F1001", "F1102", "Y000", "Y001", "I510", "V001"];
        let not = if self.rng.bool() { "N" } else { "" };
        format!("{not}{}", bits[self.rng.usize(..bits.len())])
    }

    fn condition(&mut self, depth: usize) -> String {
        match self.rng.usize(..if depth == 0 { 2 } else { 5 }) {
            0 | 1 => self.bit(),
            2 => format!("({} A {})", self.inner(depth - 1), self.inner(depth - 1)),
            3 => format!("({} O {})", self.inner(depth - 1), self.inner(depth - 1)),
            _ => format!("({} X {})", self.inner(depth - 1), self.inner(depth - 1)),
        }
    }

    fn inner(&mut self, depth: usize) -> String {
        self.condition(depth)
    }

    fn statement(&mut self, text: &mut String, depth: usize) {
        let targets = ["F1000", "F1001", "F1102", "000", "001", "546"];
        let fewer = usize::from(self.rng.u8(..4) > 0);
        let target = targets[self.rng.usize(..targets.len() - fewer)];
        match self.rng.usize(..if depth == 0 { 4 } else { 7 }) {
            0 => text.push_str(&format!(
                "{} {}{target} Z ",
                self.condition(2),
                ["U", "D"][self.rng.usize(..2)]
            )),
            1 => text.push_str(&format!("{} U{target} E D{target} Z ", self.condition(2))),
            2 => {
                let bit = self.bit();
                let load = match bit.strip_prefix('N') {
                    Some(bit) => format!("NL{bit}"),
                    None => format!("L{bit}"),
                };
                let stored =
                    if target.starts_with('F') { target.to_owned() } else { format!("Y{target}") };
                text.push_str(&format!("{load} S{stored} "));
            }
            3 => {
                let formula = [
                    "LF120 + 1 A 3 SF120 ",
                    "LF120 =2 UF1000 E DF1000 Z ",
                    "LF122 X LF120 A 7 SF122 ",
                    "LQ01 >2 ,0 SQ01 Z ",
                    "I001 UQ01 Z LQ01 >3 ,0 SQ01 Z ",
                    "LT00 =0 ,2 ST00 Z ",
                    "LF120 * 3 A 3 SF122 ",
                ][self.rng.usize(..7)];
                text.push_str(formula);
            }
            4 => text.push_str(&format!(
                "{} C{} Z ",
                self.condition(1),
                ["010", "011"][self.rng.usize(..2)]
            )),
            _ => {
                text.push_str(&format!("{} ", self.condition(2)));
                self.statement(text, depth - 1);
                if self.rng.bool() {
                    text.push_str("E ");
                    self.statement(text, depth - 1);
                }
                text.push_str("Z ");
            }
        }
    }
}

/// The values of literals of a graph, given those of its inputs.
pub(crate) fn values(graph: &plcc_prove::logic::Graph, inputs: &HashMap<u32, bool>) -> Vec<bool> {
    use plcc_prove::logic::Node;
    let mut values: Vec<bool> = vec![];
    for node in 0..graph.len() as u32 {
        values.push(match graph.node(node) {
            Node::False => false,
            Node::Input => inputs.get(&node).copied().unwrap_or(false),
            Node::And(a, b) => {
                let get = |lit: plcc_prove::logic::Lit| {
                    values[lit.node() as usize] != lit.is_complement()
                };
                get(a) && get(b)
            }
        });
    }
    values
}
