//! The resume points of a task, as labels: what an engine that works with labels needs to take
//! [`ResumePoint`]s and to give them.

use alloc::vec::Vec;

use crate::{ResumePoint, Task};

/// The labels at which a task begins and goes on. Built once when a program is loaded, so that a
/// scan neither allocates nor searches linearly.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ResumeLabels {
    /// Where a scan begins that was not suspended.
    entry: u32,
    /// The label of each resume point.
    labels: Vec<u32>,
    /// Each label with its resume point, by rising label.
    points: Vec<(u32, ResumePoint)>,
}

impl ResumeLabels {
    /// The labels of a task. Where two resume points share a label, the first is given for it.
    pub fn new(task: &Task) -> Self {
        let numbered = task.resume_points.iter().zip(0..);
        let mut points: Vec<_> = numbered.map(|(&label, n)| (label, ResumePoint(n))).collect();
        points.sort_unstable();
        points.dedup_by_key(|(label, _)| *label);
        Self { entry: task.entry, labels: task.resume_points.clone(), points }
    }

    /// The label to begin a scan at; `None` for a resume point that the task does not have.
    #[inline]
    pub fn label(&self, from: Option<ResumePoint>) -> Option<u32> {
        match from {
            None => Some(self.entry),
            Some(ResumePoint(number)) => self.labels.get(number as usize).copied(),
        }
    }

    /// The resume point of a label at which a scan was suspended; `None` where it is none of the
    /// task's.
    pub fn point(&self, label: u32) -> Option<ResumePoint> {
        let found = self.points.binary_search_by_key(&label, |(label, _)| *label).ok()?;
        self.points.get(found).map(|(_, point)| *point)
    }

    /// How many resume points the task has.
    pub fn count(&self) -> usize {
        self.labels.len()
    }
}

#[cfg(test)]
mod tests {
    use alloc::vec;

    use super::ResumeLabels;
    use crate::{ResumePoint, Task};

    #[test]
    fn labels_and_points_lead_to_each_other() {
        let task = Task { name: "scan".into(), entry: 4, resume_points: vec![9, 2, 7] };
        let labels = ResumeLabels::new(&task);
        assert_eq!(labels.label(None), Some(4));
        for (number, label) in [(0, 9), (1, 2), (2, 7)] {
            assert_eq!(labels.label(Some(ResumePoint(number))), Some(label));
            assert_eq!(labels.point(label), Some(ResumePoint(number)));
        }
        assert_eq!(labels.label(Some(ResumePoint(3))), None);
        assert_eq!(labels.point(4), None, "the entry is not a resume point");
    }
}
