//! A whole program in IR.

use plcc_abi::Task;

use crate::{Block, Func, FuncData, Label, Region};

/// A source file, kept for comments and line tables.
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
    /// The line it starts at, from 1.
    pub line: u32,
    /// Its text: byte offsets in the file's text.
    pub start: u32,
    /// Behind its last byte.
    pub end: u32,
}

/// A program: regions of the image, functions, and where tasks start.
#[derive(Clone, Debug, Default)]
pub struct Module {
    /// The sources.
    pub files: Vec<SourceFile>,
    /// The statements that [`SourceLoc`](crate::SourceLoc)s number.
    pub statements: Vec<Statement>,
    /// Length of the process image in bytes.
    pub image_size: u32,
    /// The parts of the image that functions may touch.
    pub regions: Vec<plcc_abi::Region>,
    /// What can be called from outside.
    pub tasks: Vec<Task>,
    /// How many labels there are; each belongs to one block of one function.
    pub label_count: u32,
    /// The functions.
    pub funcs: Vec<FuncData>,
}

impl Module {
    /// The functions with their names.
    pub fn funcs(&self) -> impl ExactSizeIterator<Item = (Func, &FuncData)> {
        self.funcs.iter().enumerate().map(|(i, data)| (Func(i as u32), data))
    }

    /// For each label the function and block it stands at.
    pub fn label_targets(&self) -> Vec<Option<(Func, Block)>> {
        let mut targets = vec![None; self.label_count as usize];
        for (func, data) in self.funcs() {
            for &(label, block) in data.entries() {
                if let Some(slot) = targets.get_mut(label.index()) {
                    *slot = Some((func, block));
                }
            }
        }
        targets
    }

    /// A region's name, offset and size.
    pub fn region(&self, region: Region) -> Option<&plcc_abi::Region> {
        self.regions.get(region.index())
    }

    /// The text of a statement, one line of it, for comments.
    pub fn statement_text(&self, statement: &Statement) -> &str {
        let file = self.files.get(statement.file as usize);
        let text = file.and_then(|f| f.text.get(statement.start as usize..statement.end as usize));
        text.unwrap_or("").lines().next().unwrap_or("").trim()
    }

    /// Whether a label stands somewhere.
    pub fn has_label(&self, label: Label) -> bool {
        label.0 < self.label_count
    }
}
