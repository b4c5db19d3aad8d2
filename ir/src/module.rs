//! A program in IR.
//!
//! A [`Module`] owns everything: the functions, the regions of the process image that they may
//! access, the tasks that can be called from outside, and the sources with their statements, so
//! that listings and line tables can be made without the front end. Nothing in it refers to the
//! language that it came from.

use plcc_abi::{SourceLine, Task, TrapSite};

use crate::{Block, Func, FuncData, Label, PrimaryMap, RegionId, StatementId, Terminator};

/// In how many blocks after a label the first statement is looked for. Blocks without instructions stand
/// where conditional statements end.
const MAX_EMPTY_BLOCKS: usize = 64;

/// A source file, kept for the comments of listings and for line tables.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SourceFile {
    /// Its name as the user gave it.
    pub name: String,
    /// Its decoded text.
    pub text: String,
}

/// A statement of the source.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Statement {
    /// Index into [`Module::files`].
    pub file: u32,
    /// The line at which it starts, from 1.
    pub line: u32,
    /// The byte offset in the file's text at which it starts.
    pub start: u32,
    /// The byte offset after its end.
    pub end: u32,
}

/// A program.
#[derive(Clone, Debug, Default)]
pub struct Module {
    /// The source files.
    pub files: Vec<SourceFile>,
    /// The statements of the sources; a [`StatementId`] is an index into them.
    pub statements: Vec<Statement>,
    /// The places at which the program may be stopped, which
    /// [`Terminator::TrapAt`] names by their numbers here.
    pub trap_sites: Vec<TrapSite>,
    /// The size of the process image in bytes.
    pub image_size: u32,
    /// The parts of the process image that functions may access.
    pub regions: Vec<plcc_abi::Region>,
    /// The regions that hold doubles which are finite and never -0, at offsets that are multiples
    /// of 8, and nothing else. The executive keeps that up, and so must program code. Passes
    /// assume it: with an image that breaks it, results depend on the optimisation.
    pub finite_regions: Vec<RegionId>,
    /// The regions of words of four bytes, at offsets that are multiples of 4, whose highest byte is 0. The
    /// executive keeps that up, and so must program code. Passes assume it, as they do for
    /// [`finite_regions`](Self::finite_regions).
    pub word_regions: Vec<RegionId>,
    /// The tasks, which can be called from outside, each with the label where it starts.
    pub tasks: Vec<Task>,
    /// How many labels there are. They are numbered from 0, and each is at one block of one
    /// function.
    pub label_count: u32,
    /// The functions.
    pub funcs: Vec<FuncData>,
}

impl Module {
    /// The functions, each with the reference to it.
    pub fn funcs(&self) -> impl ExactSizeIterator<Item = (Func, &FuncData)> {
        self.funcs.iter().enumerate().map(|(i, data)| (Func(i as u32), data))
    }

    /// The [length](FuncData::length) of those functions that are executed as a rule: not those of general
    /// code beside specialised code, which are optimised for size.
    pub fn usual_instructions(&self) -> usize {
        let funcs = self.funcs.iter().filter(|func| !func.is_optimized_for_size());
        funcs.map(FuncData::length).sum()
    }

    /// Puts a function in the place of the one that has its name, if there is one. Both have the same labels.
    pub fn replace_function(&mut self, by: &FuncData) {
        if let Some(own) = self.funcs.iter_mut().find(|own| own.name == by.name) {
            *own = by.clone();
        }
    }

    /// For each label the function and the block at which it stands; `None` for one that stands
    /// nowhere, which the [verifier](crate::verify) reports.
    pub fn label_targets(&self) -> PrimaryMap<Label, Option<(Func, Block)>> {
        let mut targets = PrimaryMap::from(vec![None; self.label_count as usize]);
        for (func, data) in self.funcs() {
            for &(label, block) in data.entries() {
                if let Some(slot) = targets.get_mut(label) {
                    *slot = Some((func, block));
                }
            }
        }
        targets
    }

    /// For each label the line of the statement that is executed first when control comes to it; `None` for
    /// a label where none is known.
    pub fn label_lines(&self) -> Vec<Option<SourceLine>> {
        let targets = self.label_targets();
        let line = |target: &Option<(Func, Block)>| self.line_at((*target)?, &targets);
        targets.values().map(line).collect()
    }

    /// The line of the first statement that has instructions in a block of a function or, if it has none, in
    /// the blocks that follow it, in the same function or after a label. `targets` are those of the labels.
    fn line_at(
        &self,
        (mut func, mut block): (Func, Block),
        targets: &PrimaryMap<Label, Option<(Func, Block)>>,
    ) -> Option<SourceLine> {
        for _ in 0..MAX_EMPTY_BLOCKS {
            let body = self.funcs.get(func.index())?;
            let data = body.block(block);
            let mut locs = data.insts.iter().map(|&inst| body.loc(inst));
            if let Some(loc) = locs.find(|&loc| loc != StatementId::NONE) {
                return self.line(loc);
            }
            match data.terminator.as_ref()? {
                Terminator::Goto(label) => (func, block) = (*targets.get(*label)?)?,
                terminator => block = terminator.successor(0)?,
            }
        }
        None
    }

    /// The line at which a statement begins; `None` if there is no such statement.
    pub fn line(&self, loc: StatementId) -> Option<SourceLine> {
        let statement = self.statements.get(loc.index())?;
        Some(SourceLine { file: statement.file, line: statement.line })
    }

    /// The name, offset and size of a region; `None` if there is no such region, as for local bits.
    pub fn region(&self, region: RegionId) -> Option<&plcc_abi::Region> {
        self.regions.get(region.index())
    }

    /// A byte of the process image, as the text form names it: the region, and the offset in it.
    pub fn place_name(&self, offset: usize) -> String {
        let region = self.regions.iter().find(|region| {
            let start = region.offset as usize;
            (start..start + region.size as usize).contains(&offset)
        });
        match region {
            Some(region) => format!("{}:{}", region.name, offset - region.offset as usize),
            None => format!("byte {offset}"),
        }
    }

    /// The first line of a statement's text, for comments; empty if its source is not kept.
    pub fn statement_text(&self, statement: &Statement) -> &str {
        let file = self.files.get(statement.file as usize);
        let text = file.and_then(|f| f.text.get(statement.start as usize..statement.end as usize));
        text.unwrap_or("").lines().next().unwrap_or("").trim()
    }

    /// Whether a label is one of the module's.
    pub fn has_label(&self, label: Label) -> bool {
        label.0 < self.label_count
    }
}
