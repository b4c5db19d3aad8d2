//! Programs for PMI controls.

mod declarations;
mod expressions;
mod statements;

use std::fmt::Write as _;

use plcc_random::Rng;

use super::Kind;
use crate::gen_pmi::Case;
use declarations::Pool;

/// Writes one program.
struct Writer {
    rng: Rng,
    pool: Pool,
    /// The idioms of a short program, by their numbers; all of them where this is empty.
    idioms: Vec<usize>,
    lines: Vec<String>,
    /// How deep IFs are nested; four levels are the most.
    depth: usize,
    /// How many labels there are.
    labels: usize,
    /// Whether labels may be written: not in rows, where each would be there many times.
    may_have_labels: bool,
}

/// Generates a program with its stimulus.
pub fn generate(seed: u64) -> Case {
    let mut rng = Rng::new(seed ^ 0x05EC_0D02);
    let kind = Kind::of(&mut rng);
    let pool = Pool::new(&mut rng, kind == Kind::Few);
    let mut writer = Writer {
        rng,
        pool,
        idioms: vec![],
        lines: vec![],
        depth: 0,
        labels: 0,
        may_have_labels: true,
    };
    match kind {
        Kind::Few => {
            let count = 1 + writer.rng.below(3);
            writer.idioms = (0..count).map(|_| writer.rng.below(Writer::IDIOMS)).collect();
            // Most IFs are not nested, so that there are few statements.
            writer.depth = *writer.rng.pick(&[0, 2, 3, 3, 4]);
            for _ in 0..1 + writer.rng.below(7) {
                writer.some_idiom();
            }
        }
        Kind::Rows => {
            for _ in 0..1 + writer.rng.below(3) {
                writer.rows();
                writer.some_idiom();
            }
        }
        Kind::Many => {
            let wanted = 50 + writer.rng.below(250);
            while writer.lines.len() < wanted {
                writer.some_idiom();
            }
        }
    }
    let code: String = writer.lines.iter().flat_map(|line| [line, "\n"]).collect();
    let mut source = writer.pool.declarations(&mut writer.rng, &code);
    source += &code;
    let ticks = 4 + writer.rng.below(14) as u32;
    let stimulus = writer.stimulus(ticks, &source);
    Case { source, stimulus, watch: vec![], ticks }
}

impl Writer {
    /// Writes a statement; a long one in several lines.
    fn line(&mut self, text: String) {
        let limit = if self.rng.chance(90) { 68 } else { 30 };
        let mut rest = text.as_str();
        while rest.len() > limit {
            let place = |(at, c): (usize, char)| (at > 10 && "+&!(".contains(c)).then_some(at + 1);
            let Some(at) = rest.char_indices().take(limit).filter_map(place).last() else { break };
            let (first, others) = rest.split_at(at);
            self.lines.push(format!("{first}#"));
            rest = others;
        }
        self.lines.push(rest.to_owned());
    }

    /// 20 to 60 times the same statements with other numbers.
    fn rows(&mut self) {
        let start = self.lines.len();
        self.may_have_labels = false;
        self.some_idiom();
        self.may_have_labels = true;
        let row: Vec<String> = self.lines.drain(start..).collect();
        let count = (20 + self.rng.below(40)).min(240 / row.len().max(1));
        let letters = *self.rng.pick(&["XABLIOQ", "XI", "A", "XO", "IO", "AL", "X ", "A "]);
        let exception = self.rng.below(count.max(1));
        for index in 0..count {
            let by = if index == exception { self.rng.below(count) } else { index };
            for line in &row {
                self.lines.push(declarations::row(line, letters, by));
            }
        }
    }

    fn stimulus(&mut self, ticks: u32, source: &str) -> String {
        let mut text = "tick,name,value\n".to_owned();
        for tick in 0..ticks {
            for _ in 0..self.rng.below(6) {
                let (name, value) = self.pool.change(&mut self.rng, source);
                let _ = writeln!(text, "{tick},{name},{value}");
            }
        }
        text
    }
}
