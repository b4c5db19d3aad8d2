//! Downloads for PMAC and Turbo PMAC.

mod arithmetic;
mod control;
mod expressions;
mod macros;
mod memory;
mod moves;
mod statements;

use std::fmt::Write as _;

use plcc_random::Rng;

use super::Kind;
use crate::gen_pmi::Case;
use memory::Memory;

/// The kinds of programs, which may hold different statements.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Place {
    Plc(usize),
    Plcc(usize),
}

impl Place {
    fn number(self) -> usize {
        match self {
            Self::Plc(number) | Self::Plcc(number) => number,
        }
    }

    fn is_compiled(self) -> bool {
        matches!(self, Self::Plcc(_))
    }
}

/// Writes one download.
struct Writer {
    rng: Rng,
    turbo: bool,
    memory: Memory,
    /// The program that is being written.
    place: Place,
    /// All programs of the download.
    places: Vec<Place>,
    /// Names and what they stand for.
    macros: Vec<(String, String)>,
    /// How many of 100 texts get a name by `#define`.
    macro_percent: usize,
    /// The idioms of a short program, by their numbers; all of them where this is empty.
    idioms: Vec<usize>,
    lines: Vec<String>,
    /// How deep the statement is nested that is being written.
    depth: usize,
    /// The number of the next variable that no other statement uses.
    fresh: usize,
}

/// Generates a download with its stimulus. `turbo` says for which controller.
pub fn generate(seed: u64, turbo: bool) -> Case {
    let mut rng = Rng::new(seed ^ 0x05EC_0D00);
    let kind = Kind::of(&mut rng);
    let memory = Memory::new(&mut rng, turbo, kind == Kind::Few);
    let places = places(&mut rng);
    let macro_percent = if rng.chance(25) { 8 } else { 0 };
    let mut writer = Writer {
        rng,
        turbo,
        memory,
        place: Place::Plc(1),
        places: places.clone(),
        macros: vec![],
        macro_percent,
        idioms: vec![],
        lines: vec![],
        depth: 0,
        fresh: 300,
    };
    if kind == Kind::Few {
        let count = 1 + writer.rng.below(3);
        writer.idioms = (0..count).map(|_| writer.rng.below(Writer::IDIOMS)).collect();
    }
    for place in &places {
        writer.program(*place, kind, places.len());
    }
    writer.finish()
}

/// The programs of a download, mostly one or two.
fn places(rng: &mut Rng) -> Vec<Place> {
    let count = *rng.pick(&[1, 1, 1, 2, 2, 3]);
    let mut places = vec![];
    for _ in 0..count {
        let number = *rng.pick(&[0, 1, 1, 2, 3, 7, 15, 31]);
        let place = if rng.chance(35) { Place::Plcc(number) } else { Place::Plc(number) };
        if !places.contains(&place) {
            places.push(place);
        }
    }
    places
}

impl Writer {
    /// Writes a PLC or PLCC.
    fn program(&mut self, place: Place, kind: Kind, programs: usize) {
        self.place = place;
        let name = if place.is_compiled() { "PLCC" } else { "PLC" };
        let open = match self.rng.below(4) {
            0 => format!("OPEN{name}{} CLEAR", place.number()),
            1 => format!("OPEN {name} {}\nCLEAR", place.number()),
            _ => format!("OPEN {name} {} CLEAR", place.number()),
        };
        self.line(open);
        match kind {
            Kind::Few => {
                // Most statements are not nested, so that there are few of them.
                self.depth = *self.rng.pick(&[0, 1, 2, 2, 3, 3]);
                for _ in 0..1 + self.rng.below(5) {
                    let idiom = self.rng.below(self.idioms.len());
                    let idiom = self.idioms.get(idiom).copied().unwrap_or(0);
                    self.idiom(idiom);
                }
            }
            Kind::Rows => {
                for _ in 0..1 + self.rng.below(3) {
                    self.rows();
                    let idiom = self.rng.below(Self::IDIOMS);
                    self.idiom(idiom);
                }
            }
            Kind::Many => {
                let wanted = self.lines.len() + (50 + self.rng.below(250)) / programs;
                while self.lines.len() < wanted {
                    let idiom = self.rng.below(Self::IDIOMS);
                    self.idiom(idiom);
                }
            }
        }
        self.depth = 0;
        self.line("CLOSE".to_owned());
    }

    /// 20 to 60 times the same statements with other numbers.
    fn rows(&mut self) {
        let start = self.lines.len();
        let idiom = self.rng.below(Self::IDIOMS);
        self.idiom(idiom);
        let row: Vec<String> = self.lines.drain(start..).collect();
        if row.is_empty() {
            return;
        }
        let count = (20 + self.rng.below(40)).min(240 / row.len());
        let letters = *self.rng.pick(&["M", "P", "MP", "MPL", "ML", " ", "M ", "MP "]);
        let other = self.rng.below(count);
        for index in 0..count {
            for line in &row {
                // Rows of real ladders have an exception here and there.
                let by = if index == other { self.rng.below(count) } else { index };
                self.lines.push(Memory::row(line, letters, by));
            }
        }
    }

    fn line(&mut self, line: String) {
        self.lines.push(line);
    }

    /// Puts the download together, and makes its stimulus.
    fn finish(mut self) -> Case {
        let mut source = String::new();
        if self.rng.chance(30) {
            source += "CLOSE\n";
        }
        self.write_macros(&mut source);
        let rti = *self.rng.pick(&[0, 0, 0, 1, 2]);
        let i5 = if self.rng.chance(95) { 3 } else { 2 };
        let _ = writeln!(source, "I5={i5}\nI8={rti}");
        if self.rng.chance(10) {
            source += "I15=1\n";
        }
        for line in self.memory.definitions() {
            source += &line;
            source.push('\n');
        }
        for _ in 0..self.rng.below(6) {
            let target = self.memory.number(&mut self.rng);
            let value = self.memory.value(&mut self.rng);
            let _ = writeln!(source, "{target}={value}");
        }
        if self.rng.chance(20) {
            source += *self.rng.pick(&[
                "P4..12=3\n",
                "I122,4,100=32\n",
                "M70..72=5\n",
                "P1..3=1 M10=1\n",
            ]);
        }
        // PLCs above may be written without a CLEAR, so what follows a CLOSE is on-line text.
        for line in &self.lines {
            source += line;
            source.push('\n');
        }
        let ticks = 4 + self.rng.below(14) as u32;
        let stimulus = self.stimulus(ticks);
        Case { source, stimulus, watch: vec![], ticks }
    }

    /// What the machine does: mostly bits, sometimes words, seldom numbers and states of programs.
    fn stimulus(&mut self, ticks: u32) -> String {
        let mut text = "tick,name,value\n".to_owned();
        for tick in 0..ticks {
            for _ in 0..self.rng.below(5) {
                let (name, value) = match self.rng.below(20) {
                    0..=8 => {
                        let name = self.memory.bit(&mut self.rng);
                        (name, self.rng.below(2).to_string())
                    }
                    9..=12 => {
                        let name = self.memory.word(&mut self.rng);
                        (name, self.memory.whole(&mut self.rng))
                    }
                    13..=17 => {
                        let name = self.memory.number(&mut self.rng);
                        (name, self.memory.value(&mut self.rng))
                    }
                    18 => {
                        let at = self.rng.below(self.places.len());
                        let place = self.places.get(at).copied().unwrap_or(Place::Plc(1));
                        let name = if place.is_compiled() { "PLCC" } else { "PLC" };
                        let states = if place.is_compiled() { 2 } else { 4 };
                        let value = self.rng.below(states).to_string();
                        (format!("{name}{}", place.number()), value)
                    }
                    _ => self.memory.memory_change(&mut self.rng),
                };
                let _ = writeln!(text, "{tick},{name},{value}");
            }
        }
        text
    }
}
