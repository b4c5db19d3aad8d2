//! Online change: another version of a program takes the place of the one that runs, between two ticks, and takes its
//! state over. Here is what such a change keeps, brings, drops and changes.
//!
//! Variables of the same name belong together; a value is kept where type and number of elements are the same. What
//! changes the meaning of a variable, or the tasks (another type, an input on another line, a task that goes), is
//! refused unless the user accepts it by its name. What is copied where is decided beforehand, as a [`Plan`]; the
//! executive of the new program then only carries it out, without allocating or freeing memory. What is particular
//! to a control is in its folder, in `transfer.rs`.

use std::any::Any;
use std::fmt;
use std::sync::Arc;

/// How the state of one executive becomes that of another one of the same control. Only executives of that control know
/// what is in it.
#[derive(Clone)]
pub struct Plan(Arc<dyn Any + Send + Sync>);

impl Plan {
    /// A plan, as a control writes it.
    pub(crate) fn new(plan: impl Any + Send + Sync) -> Self {
        Self(Arc::new(plan))
    }

    /// The plan as its control wrote it; `None` if another control did.
    pub(crate) fn of_control<T: Any>(&self) -> Option<&T> {
        self.0.downcast_ref()
    }
}

impl fmt::Debug for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Plan")
    }
}

/// How it ended that an executive was to take the state of another one over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[must_use]
pub enum TakeOver {
    /// The state is taken over.
    Done,
    /// Something runs that can't go on in the new program and has to end first; what it is, as the beginning of a
    /// sentence. Nothing is changed, and a later tick may see it done.
    Later(&'static str),
    /// The executives do not belong to the control that the plan is for. Nothing is changed.
    Impossible,
}

/// What becomes of a variable or a task.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// The new program has it, the running one has not: it begins as at power-up.
    New,
    /// The running program has it, the new one has not: its value is lost, but a rollback finds it.
    Gone,
    /// Both have it, and it is something else in the new one.
    Changed,
}

/// A variable or a task that is not the same in both programs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Row {
    /// Its name.
    pub name: String,
    /// What becomes of it.
    pub change: Change,
    /// What it is in the running program.
    pub old: Option<String>,
    /// What it is in the new one.
    pub new: Option<String>,
    /// Whether the change is refused unless its name is accepted.
    pub needs_accept: bool,
}

impl Row {
    /// A row for a variable or task; `old` and `new` describe it as the programs have it, and are `None` where a
    /// program does not have it. No row where the two do not differ. A row of a change needs to be accepted.
    pub(crate) fn of(name: &str, old: Option<String>, new: Option<String>) -> Option<Self> {
        let change = match (&old, &new) {
            (None, None) => return None,
            (Some(old), Some(new)) if old == new => return None,
            (Some(_), Some(_)) => Change::Changed,
            (None, Some(_)) => Change::New,
            (Some(_), None) => Change::Gone,
        };
        Some(Self { name: name.into(), change, old, new, needs_accept: change == Change::Changed })
    }
}

/// Two programs compared.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// How many variables keep their values.
    pub kept: usize,
    /// What is not the same, in natural sort order of the names.
    pub rows: Vec<Row>,
    /// How the state of the running program becomes that of the new one, for
    /// [`Executive::take_over`](crate::Executive::take_over).
    pub plan: Plan,
}

impl Comparison {
    /// The rows that need to be accepted and whose names are not in `accepted`. The name `all` accepts every row,
    /// and letters may be in any case.
    pub fn refused<'a>(&'a self, accepted: &'a [String]) -> impl Iterator<Item = &'a Row> {
        let accepts = |row: &Row| {
            accepted.iter().any(|name| name == "all" || name.eq_ignore_ascii_case(&row.name))
        };
        self.rows.iter().filter(move |row| row.needs_accept && !accepts(row))
    }
}
