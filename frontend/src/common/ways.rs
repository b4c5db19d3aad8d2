//! Where control can go behind a statement.

/// Where control can go behind a statement: the numbers of the statements that may follow it, as an
/// [`Observer`](super::Observer) is told them. None follows where the task ends.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Ways {
    /// The statements that may follow in the same subroutine. Of a condition, first the one that follows if it holds. One
    /// behind the last statement is the end of the task.
    pub to: Vec<u32>,
    /// The first statements of the subroutines that are called; behind the subroutine control goes to one of `to`.
    pub calls: Vec<u32>,
}

impl Ways {
    /// Of a statement behind which control goes to these.
    pub fn to(to: impl Into<Vec<u32>>) -> Self {
        Self { to: to.into(), calls: vec![] }
    }
}
