//! What a PMAC does in a servo cycle (rulings, Time), as blocks of the same CASE as the statements.

use plcc_iec::{Flow, Item, Names, Step, Type, Variable};

use super::Writer;
use super::words::{Address, counted};
use crate::pmac::analyse::load::Loaded;
use crate::pmac::ast::{Stmt, program_name};
use crate::pmac::tasks::TaskKind;

/// A PLC or PLCC with its state in the exported program.
pub(super) struct Plc<'a> {
    pub(super) compiled: bool,
    pub(super) number: u32,
    pub(super) code: &'a [Stmt],
    /// The item of its first statement.
    pub(super) first: usize,
    /// The block that follows its scan.
    pub(super) after: usize,
    /// 0 disabled, 1 enabled, 2 paused.
    pub(super) state: String,
    /// The block at which its next scan goes on, 0 if at its top.
    pub(super) resume: String,
    /// Whether it was enabled since its last scan.
    pub(super) restart: String,
}

/// How many blocks are the control's, besides one for each program: the interrupt, the choice of a program for the background, the end.
pub(super) const OWN_STEPS: usize = 3;

/// All of them.
pub(super) fn steps(code: &[(TaskKind, &[Stmt])]) -> usize {
    code.len() + OWN_STEPS
}

impl<'a> Plc<'a> {
    pub(super) fn new(
        compiled: bool,
        number: u32,
        code: &'a [Stmt],
        first: usize,
        names: &mut Names,
    ) -> Self {
        let name = program_name(compiled, number);
        let mut make = |text: &str| names.make(&format!("{name} {text}"));
        let (state, resume, restart) = (make("STATE"), make("RESUME"), make("RESTART"));
        Self { compiled, number, code, first, after: 0, state, resume, restart }
    }

    pub(super) fn declare(&self, loaded: &Loaded, list: &mut Vec<Variable>) {
        let states = if self.compiled { loaded.plccs } else { loaded.plcs };
        let is_in = |set: u32| set >> self.number & 1 != 0;
        let state = i32::from(is_in(states.enabled)) + 2 * i32::from(is_in(states.paused));
        let name = program_name(self.compiled, self.number);
        let about = format!("{name}: 0 disabled, 1 enabled, 2 paused");
        let initial = vec![state.min(2).to_string()];
        list.push(Variable { initial, ..Variable::local(&self.state, Type::Int, about) });
        let about = format!("the block at which {name} goes on, 0 if at its top");
        list.push(Variable::local(&self.resume, Type::Dint, about));
        let about = format!("{name} begins at its top");
        list.push(Variable::local(&self.restart, Type::Bool, about));
    }
}

impl Writer<'_> {
    /// The time of a servo cycle, as I10 says it, in microseconds.
    pub(super) fn cycle_us(&self) -> u64 {
        let units = self.initial('I', 10);
        let units = if units > 0.0 { units } else { 3_713_707.0 };
        ((units / 8388.608).round() as u64).max(1)
    }

    /// Puts the block after its scan into each program.
    pub(super) fn chained(mut plcs: Vec<Plc<'_>>) -> Vec<Plc<'_>> {
        let count = plcs.len();
        let compiled = plcs.iter().position(|plc| plc.compiled && plc.number > 0);
        let end = end_block(count);
        let background = compiled.map_or(end, call_block);
        let choose = choose_block(count);
        let compiled_zero = plcs.iter().position(|plc| plc.compiled && plc.number == 0);
        for (at, plc) in plcs.iter_mut().enumerate() {
            plc.after = match (plc.compiled, plc.number) {
                (false, 0) => compiled_zero.map_or(choose, call_block),
                (true, 0) => choose,
                (false, _) => background,
                (true, _) if at + 1 < count => call_block(at + 1),
                (true, _) => end,
            };
        }
        plcs
    }

    pub(super) fn steps_of_control(&self) -> Vec<Item> {
        let own = &self.own;
        let count = self.plcs.len();
        let runs = self.initial('I', 5) as u32;
        let choose = choose_block(count);
        let zero = self.plcs.iter().position(|plc| plc.number == 0);
        let interrupt = zero.filter(|_| matches!(runs, 1 | 3)).map_or(choose, call_block);
        let mut begin = self.time();
        begin.push(format!("{} := {choose};", own.next));
        begin.push(format!("IF {} = 0 THEN", own.until));
        begin.push(format!("  {} := {};", own.until, self.initial('I', 8) as u32));
        begin.push(format!("  {} := {interrupt};", own.next));
        begin.extend(self.watchdog(true).into_iter().map(|line| format!("  {line}")));
        begin.push("ELSE".into());
        begin.push(format!("  {0} := {0} - 1;", own.until));
        begin.push("END_IF;".into());
        let mut items = vec![step("a servo cycle begins", begin)];
        for plc in &self.plcs {
            let name = program_name(plc.compiled, plc.number);
            items.push(step(&format!("a scan of {name}, if it is enabled"), self.call(plc)));
        }
        items.push(step("a background program", self.choose(matches!(runs, 2 | 3))));
        let mut end = self.watchdog(false);
        end.push(format!("{} := 0;", own.next));
        items.push(step("the servo cycle ends", end));
        items
    }

    /// Begins a scan, or goes on with one.
    fn call(&self, plc: &Plc<'_>) -> Vec<String> {
        let own = &self.own;
        let Plc { state, resume, restart, .. } = plc;
        vec![
            format!("{} := {};", own.next, plc.after),
            format!("IF {state} = 1 THEN"),
            format!("  {} := {};", own.next, plc.first + 1),
            format!("  IF ({resume} <> 0) AND NOT {restart} THEN"),
            format!("    {} := {resume};", own.next),
            "  END_IF;".into(),
            format!("  {resume} := 0;"),
            format!("  {restart} := FALSE;"),
            "END_IF;".into(),
        ]
    }

    /// The next enabled PLC after the last one, around; then all PLCCs.
    fn choose(&self, runs: bool) -> Vec<String> {
        let own = &self.own;
        let count = self.plcs.len();
        if !runs {
            return vec![format!("{} := {};", own.next, end_block(count))];
        }
        let compiled = self.plcs.iter().position(|plc| plc.compiled && plc.number > 0);
        let plcs: Vec<_> =
            self.plcs.iter().enumerate().filter(|(_, it)| !it.compiled && it.number > 0).collect();
        let next = compiled.map_or(end_block(count), call_block);
        let mut lines = vec![format!("{} := {next};", own.next), format!("{} := 0;", own.chosen)];
        for is_behind in [true, false] {
            for (_, plc) in &plcs {
                let behind = match is_behind {
                    true => format!(" AND ({} < {})", own.last, plc.number),
                    false => String::new(),
                };
                lines.push(format!("IF ({} = 0){behind} AND ({} = 1) THEN", own.chosen, plc.state));
                lines.push(format!("  {} := {};", own.chosen, plc.number));
                lines.push("END_IF;".into());
            }
        }
        if !plcs.is_empty() {
            lines.push(format!("IF {} <> 0 THEN", own.chosen));
            lines.push(format!("  {} := {};", own.last, own.chosen));
            lines.push("END_IF;".into());
            lines.push(format!("CASE {} OF", own.chosen));
            for (at, plc) in &plcs {
                lines.push(format!("  {}:", plc.number));
                lines.push(format!("    {} := {};", own.next, call_block(*at)));
            }
            lines.push("END_CASE;".into());
        }
        lines
    }

    fn word(&self, address: Address) -> Option<&str> {
        self.words.words.get(&address).map(String::as_str)
    }

    /// X:0 counts servo cycles; the timers go down to the least number of 24 bits. Those of a Turbo PMAC are I-variables.
    fn time(&self) -> Vec<String> {
        let mut lines = vec![];
        if let Some(cycles) = self.word((false, 0)) {
            lines.push(format!("{cycles} := ({cycles} + 1) MOD 16777216;"));
        }
        let timers = counted(self.loaded.layout.controller);
        let timers = timers.into_iter().filter(|(_, address)| matches!(address, 0x700 | 0x701));
        for name in timers.filter_map(|address| self.word(address)) {
            lines.push(format!("IF {name} = 0 THEN"));
            lines.push(format!("  {name} := 16777215;"));
            lines.push(format!("ELSIF {name} <> 8388608 THEN"));
            lines.push(format!("  {name} := {name} - 1;"));
            lines.push("END_IF;".into());
        }
        if self.loaded.layout.controller == plcc_abi::pmac::Controller::Turbo {
            let timers = self.reals.iter().filter(|((kind, number), _)| {
                let system = u32::from(*number).checked_sub(5000).map_or(0, |rest| rest / 100);
                let is_one = matches!(number % 100, 11 | 12);
                *kind == 'I' && is_one && (1..=self.loaded.layout.systems()).contains(&system)
            });
            for (_, name) in timers {
                lines.push(format!("{name} := {name} - 1.0;"));
                lines.push(format!("IF {name} < -8388608.0 THEN"));
                lines.push(format!("  {name} := -8388608.0;"));
                lines.push("END_IF;".into());
            }
        }
        lines
    }

    /// The watchdog's register: an interrupt lowers it, housekeeping sets it again.
    fn watchdog(&self, lowers: bool) -> Vec<String> {
        let Some(name) = self.word((true, 0x1F)) else { return vec![] };
        match lowers {
            false => vec![format!("{name} := 4095;")],
            true => vec![
                format!("IF {name} > 8 THEN"),
                format!("  {name} := {name} - 8;"),
                "ELSE".into(),
                format!("  {name} := 0;"),
                "END_IF;".into(),
            ],
        }
    }

    /// The whole body.
    pub(super) fn body(&self, flow: &Flow<'_>) -> Vec<String> {
        let mut lines = vec![format!("{} := 1;", self.own.next)];
        lines.extend(flow.text(&format!("{} <> 0", self.own.next), &[]));
        lines
    }
}

/// The block that calls the program at an index.
fn call_block(at: usize) -> usize {
    at + 2
}

fn choose_block(count: usize) -> usize {
    call_block(count)
}

fn end_block(count: usize) -> usize {
    choose_block(count) + 1
}

fn step(text: &str, lines: Vec<String>) -> Item {
    Item { comments: vec![text.to_owned()], behind: String::new(), step: Step::Leave(lines) }
}
