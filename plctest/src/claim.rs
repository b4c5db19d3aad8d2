//! What a script says of all ticks: `never`, `always` and `after`.

use plcc_runtime::Executive;

use crate::condition::Condition;
use crate::script::Length;

/// What is said of all ticks.
#[derive(Clone, Debug)]
pub enum Claim {
    /// Conditions at the end of each tick.
    Each {
        /// What each of them has to be.
        holds: bool,
        /// The conditions.
        conditions: Vec<Condition>,
    },
    /// When one condition becomes true, others are true together at the end of that tick or soon after it.
    Response {
        /// What becomes true: it did not hold at the end of the tick before, or there was none.
        after: Box<Condition>,
        /// What has to be true then.
        then: Vec<Condition>,
        /// How soon.
        within: Length,
    },
}

/// What is remembered of a claim from tick to tick since power-up.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub struct Progress {
    /// Whether the first condition of a response held at the end of the last tick.
    held: bool,
    /// How many ticks it has been waited for the others.
    waited: Option<u64>,
}

/// How a claim is broken.
#[derive(Clone, Debug)]
pub struct Breach<'c> {
    /// The condition.
    pub condition: &'c Condition,
    /// What is wrong, for people.
    pub message: String,
    /// Whether it is that the condition has no value.
    pub has_no_value: bool,
}

impl<'c> Breach<'c> {
    fn new(condition: &'c Condition, message: String) -> Self {
        Self { condition, message, has_no_value: false }
    }

    fn no_value(condition: &'c Condition, why: &str) -> Self {
        let message = format!("`{}` has no value: {why}", condition.text);
        Self { condition, message, has_no_value: true }
    }
}

impl Claim {
    /// Its conditions.
    pub fn conditions(&self) -> impl Iterator<Item = &Condition> {
        let (first, others) = match self {
            Self::Each { conditions, .. } => (None, conditions),
            Self::Response { after, then, .. } => (Some(&**after), then),
        };
        first.into_iter().chain(others)
    }

    /// How it is broken by the tick that was run last. It has to be asked after each tick.
    pub fn breach(&self, progress: &mut Progress, executive: &dyn Executive) -> Option<Breach<'_>> {
        match self {
            Self::Each { holds, conditions } => {
                conditions.iter().find_map(|condition| match (condition.holds(executive), holds) {
                    (Ok(found), holds) if found == *holds => None,
                    (Err(why), _) => Some(Breach::no_value(condition, &why)),
                    (Ok(_), true) => {
                        Some(Breach::new(condition, format!("`{}` does not hold", condition.text)))
                    }
                    (Ok(_), false) => {
                        Some(Breach::new(condition, format!("`{}` holds", condition.text)))
                    }
                })
            }
            Self::Response { after, then, within } => {
                let within = within.ticks(executive.tick_ns());
                response(progress, after, then, within, executive)
            }
        }
    }
}

fn response<'c>(
    progress: &mut Progress,
    after: &'c Condition,
    then: &'c [Condition],
    within: u64,
    executive: &dyn Executive,
) -> Option<Breach<'c>> {
    let holds = match after.holds(executive) {
        Ok(holds) => holds,
        Err(why) => return Some(Breach::no_value(after, &why)),
    };
    let begins = holds && !std::mem::replace(&mut progress.held, holds);
    let waited = progress.waited.map(|waited| waited + 1).or(begins.then_some(0))?;
    progress.waited = None;
    for condition in then {
        match condition.holds(executive) {
            Ok(true) => {}
            Err(why) => return Some(Breach::no_value(condition, &why)),
            Ok(false) if waited < within => {
                progress.waited = Some(waited);
                return None;
            }
            Ok(false) => {
                let since = match waited {
                    0 => format!("where `{}` becomes true", after.text),
                    1 => format!("1 tick after `{}` became true", after.text),
                    _ => format!("{waited} ticks after `{}` became true", after.text),
                };
                let message = format!("`{}` does not hold {since}", condition.text);
                return Some(Breach::new(condition, message));
            }
        }
    }
    None
}
