//! Programs for NCT controls.

mod areas;
mod operands;
mod operations;
mod statements;

use std::fmt::Write as _;

use plcc_random::Rng;

use super::Kind;
use crate::gen_pmi::Case;
use operands::Pool;

/// Writes one program.
struct Writer {
    rng: Rng,
    pool: Pool,
    /// The idioms of a short program, by their numbers; all of them where this is empty.
    idioms: Vec<usize>,
    /// Labels of subroutines that may be called, each after those that it may call itself.
    subroutines: Vec<usize>,
    /// How many labels within modules were written.
    labels: usize,
    /// How many loops are open; each has a counter of its own.
    loops: usize,
    lines: Vec<String>,
    /// How deep conditions are nested.
    depth: usize,
    /// Whether labels may be written: not in rows, where each would be there many times.
    may_have_labels: bool,
    /// Whether the code is a subroutine's, which R may leave.
    in_subroutine: bool,
}

/// Generates a program with its stimulus.
pub fn generate(seed: u64) -> Case {
    let mut rng = Rng::new(seed ^ 0x05EC_0D01);
    let kind = Kind::of(&mut rng);
    let pool = Pool::new(&mut rng, kind == Kind::Few);
    let mut writer = Writer {
        rng,
        pool,
        idioms: vec![],
        subroutines: vec![],
        labels: 0,
        loops: 0,
        lines: vec![],
        depth: 0,
        may_have_labels: true,
        in_subroutine: false,
    };
    if kind == Kind::Few {
        let count = 1 + writer.rng.below(3);
        writer.idioms = (0..count).map(|_| writer.rng.below(Writer::IDIOMS)).collect();
    }
    let mut subroutines = vec![];
    writer.in_subroutine = true;
    for index in 0..writer.rng.below(4) {
        let label = 10 + 3 * index;
        writer.line(format!(":{label:03}"));
        writer.statements(kind, 4);
        writer.line("R".to_owned());
        subroutines.push(std::mem::take(&mut writer.lines));
        writer.subroutines.push(label);
    }
    writer.in_subroutine = false;
    let mut modules = vec![];
    let numbers: &[usize] = if writer.rng.chance(25) { &[1, 2, 0] } else { &[1, 0] };
    for &number in numbers {
        writer.line(format!(":{number:03}"));
        if number == 1 && numbers.len() > 2 {
            writer.line("I510 U546 Z".to_owned());
        }
        // Most short programs have all of their statements in :001.
        if number == 1 || kind != Kind::Few || writer.rng.chance(30) {
            writer.statements(kind, numbers.len());
        }
        writer.line(format!("J{number}"));
        modules.push(std::mem::take(&mut writer.lines));
    }
    // Subroutines stand after the first module or after the last one.
    let at = if writer.rng.chance(30) { 1 } else { modules.len() };
    let (first, last) = modules.split_at(at);
    let mut source = String::new();
    for part in first.iter().chain(&subroutines).chain(last) {
        writer.put(&mut source, part);
    }
    source += ":198\nTOOL T,RANGE,PART NO$\n:199\nSPINDLE,DOOR OPEN,NO OIL,START REQUEST$\n";
    let ticks = 3 + writer.rng.below(14) as u32;
    let stimulus = writer.stimulus(ticks);
    // What indirect stores and areas may write, whether the program names it or not.
    let words = [0..9, 20..32, 100..132, 298..320, 490..512, 994..1000];
    let watch = words.into_iter().flatten().map(|word| format!("F{word:03}")).collect();
    Case { source, stimulus, watch, ticks }
}

impl Writer {
    fn line(&mut self, line: String) {
        self.lines.push(line);
    }

    /// Writes lines, some of them joined: white space means little.
    fn put(&mut self, source: &mut String, lines: &[String]) {
        for line in lines {
            source.push_str(line);
            source.push(if self.rng.chance(30) { ' ' } else { '\n' });
        }
        source.push('\n');
    }

    /// The statements of a module or subroutine, of which there are `parts`.
    fn statements(&mut self, kind: Kind, parts: usize) {
        match kind {
            Kind::Few => {
                // Most conditions are not nested, so that there are few of them.
                self.depth = *self.rng.pick(&[0, 0, 2, 3, 3, 4]);
                for _ in 0..1 + self.rng.below(5) {
                    self.some_idiom();
                }
                self.depth = 0;
            }
            Kind::Rows if self.rng.chance(60) => {
                self.rows();
                self.some_idiom();
            }
            Kind::Rows => self.some_idiom(),
            Kind::Many => {
                let wanted = self.lines.len() + (50 + self.rng.below(250)) / parts;
                while self.lines.len() < wanted {
                    self.some_idiom();
                }
            }
        }
    }

    /// 20 to 60 times the same statements with other numbers.
    fn rows(&mut self) {
        let start = self.lines.len();
        self.may_have_labels = false;
        self.some_idiom();
        self.may_have_labels = true;
        let row: Vec<String> = self.lines.drain(start..).collect();
        let count = (20 + self.rng.below(40)).min(240 / row.len().max(1));
        let letters =
            *self.rng.pick(&["IYVPOUDFQTH", "IVPYUDO", "F", "F,", ",", "YUDQ", "IVYUDF,"]);
        let exception = self.rng.below(count.max(1));
        for index in 0..count {
            let by = if index == exception { self.rng.below(count) } else { index };
            for line in &row {
                self.lines.push(operands::row(line, letters, by));
            }
        }
    }

    fn stimulus(&mut self, ticks: u32) -> String {
        let mut text = "tick,name,value\n".to_owned();
        for tick in 0..ticks {
            for _ in 0..self.rng.below(6) {
                let (name, value) = self.pool.change(&mut self.rng);
                let _ = writeln!(text, "{tick},{name},{value}");
            }
        }
        text
    }
}
