//! Whether two versions of a module do the same: what the front end made, and what the passes made of it (translation validation;
//! Pnueli, Siegel and Singerman, 1998; Lopes and others, 2021).
//!
//! Each function is looked at by itself, from each of its labels, with the same image for both versions. It is cut at labels in its midst where both
//! versions come to them alike. Both must come to the same ends on the same conditions, with the same calls of the host in the same
//! order, and leave the same image but for bytes that are overwritten before anything reads them. Of the image only that is known which executive and program keep up
//! (`finite_regions`, `word_regions`, regions of bits).
//!
//! A difference counts only where the interpreter finds it too.

mod apart;
mod claims;
mod classes;
mod concrete;
mod cuts;
mod divide;
mod float;
mod join;
mod known;
mod mend;
mod refute;
mod simulate;
mod special;
mod step;
mod sweep;
mod terms;
mod universe;
mod walk;
mod window;

use std::cell::RefCell;
use std::time::{Duration, Instant};

use plcc_ir::{Block, Func, FuncData, InstData, Label, Module, PrimaryMap, StatementId};
use rustc_hash::FxHashSet;

use crate::scan::{Code, Reason};
use crate::solve::Deadline;

use claims::Pair;
use cuts::{Dead, end_of_row, representatives};
use known::Known;

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
        let pair = Pair {
            validation: self,
            func,
            before,
            after,
            first: representatives(before),
            constants: constants(&[before, after]),
            deadline,
            proved: RefCell::default(),
            known: RefCell::new(Known::new(deadline)),
        };
        let mut seen = FxHashSet::default();
        let mut open = None;
        for &(label, block) in before.entries() {
            let &(_, other) = after.entries().iter().find(|(other, _)| *other == label)?;
            if !seen.insert((end_of_row(before, block), end_of_row(after, other))) {
                continue;
            }
            if deadline.is_over() {
                return Some(pair.time_is_up());
            }
            match pair.from(label) {
                Verdict::Proved => {}
                refuted @ Verdict::Refuted(_) => return Some(refuted),
                Verdict::Undecided(reason) => {
                    open.get_or_insert(reason);
                }
            }
        }
        Some(open.map_or(Verdict::Proved, Verdict::Undecided))
    }

    fn place(&self, loc: StatementId) -> Option<(String, u32)> {
        self.codes.first()?.place(loc)
    }
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
