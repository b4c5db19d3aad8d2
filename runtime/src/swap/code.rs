//! Which tasks of two programs have the same machine code. Only such a task can go on where it was
//! suspended when the program is replaced: a resume point is the number of a place in the code.

use std::hash::Hasher;

use plcc_abi::{CodeParts, Program, Task};

use crate::fingerprint::Fnv;

/// Numbers that stand for the machine code of a program, as a whole and for each task.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct CodeIdentity {
    whole: u64,
    tasks: Vec<(String, u64)>,
}

impl CodeIdentity {
    /// Of a program and its code.
    ///
    /// A task's code is that from its entry to the entry of the next task. The code holds the numbers
    /// of labels, so that what stands before a task changes its code only where it has more labels or
    /// fewer.
    pub fn of(program: &Program, code: &CodeParts) -> Self {
        let offset =
            |task: &Task| code.labels.get(task.entry as usize).map_or(0, |at| *at as usize);
        let mut entries: Vec<usize> = program.tasks.iter().map(offset).collect();
        entries.sort_unstable();
        let number = |range: std::ops::Range<usize>, task: Option<&Task>| {
            let mut hasher = Fnv::default();
            hasher.write(code.bytes.get(range).unwrap_or_default());
            let points = task.into_iter().flat_map(|task| &task.resume_points);
            points.for_each(|label| hasher.write(&label.to_le_bytes()));
            hasher.finish()
        };
        let of_task = |task: &Task| {
            let start = offset(task);
            let next = entries.iter().copied().find(|&entry| entry > start);
            let range = start..next.unwrap_or(code.bytes.len());
            (task.name.clone(), number(range, Some(task)))
        };
        let tasks = program.tasks.iter().map(of_task).collect();
        Self { whole: number(0..code.bytes.len(), None), tasks }
    }

    /// What is the same in other code.
    pub fn same_as(&self, other: &Self) -> SameCode {
        let same = self.tasks.iter().filter(|task| other.tasks.contains(task));
        let tasks = same.map(|(name, _)| name.clone()).collect();
        SameCode { all: self == other, tasks }
    }
}

/// Which tasks of two programs have the same machine code.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SameCode {
    all: bool,
    tasks: Vec<String>,
}

impl SameCode {
    /// Whether all code is the same.
    pub(crate) fn is_all(&self) -> bool {
        self.all
    }

    /// Whether the code of a task is the same.
    pub(crate) fn has(&self, task: &str) -> bool {
        self.tasks.iter().any(|name| name == task)
    }
}
