//! The program as the socket's thread knows it: an executive of its own, which never runs, finds
//! variables by their names and checks values before the thread that runs the ticks is asked.

use std::sync::Arc;

use plcc_abi::Program;
use serde_json::{Value as Json, json};

use super::commands::Item;
use super::protocol::{Assignment, Failure, MAX_NAMES};
use plcc_runtime::online_change::{Change, Comparison};
use plcc_runtime::variable::MAX_FORCES;
use plcc_runtime::{Executive, NameError, Purpose, Setting, Value, Variable, VariableKey};

/// A force in effect.
#[derive(Clone, Debug)]
pub(super) struct Force {
    pub(super) name: String,
    pub(super) key: VariableKey,
    pub(super) setting: Setting,
    /// The value as it was given.
    pub(super) text: String,
}

/// What is to be done to force variables or to end forces, and the forces in effect when it is done.
pub(super) struct ForceChange {
    pub(super) items: Vec<Item>,
    pub(super) forces: Vec<Force>,
}

/// A name in a request, and which items of its batch belong to it: as many as it has elements.
#[derive(Clone, Debug)]
pub(super) struct Named {
    pub(super) name: String,
    /// `None` for a single variable, the number of elements for an array.
    pub(super) elements: Option<usize>,
}

/// The program that the socket serves, with the executive in which names are looked up, and the forces
/// in effect.
pub(super) struct Served {
    pub(super) program: Arc<Program>,
    /// The artifact or source, for people.
    pub(super) title: String,
    pub(super) executive: Box<dyn Executive + Send>,
    pub(super) forces: Vec<Force>,
    /// Its number in the record of the run.
    pub(super) recorded: u16,
}

/// The failure of a request with a name that can't be used.
fn unknown(error: &NameError) -> Failure {
    Failure::new("not_found", error.to_string())
}

fn too_many() -> Failure {
    Failure::new("too_large", format!("one request can name {MAX_NAMES} variables at most"))
}

impl Served {
    pub(super) fn new(program: Arc<Program>, executive: Box<dyn Executive + Send>) -> Self {
        let title = program.files.first().cloned().unwrap_or_default();
        Self { program, title, executive, forces: vec![], recorded: 0 }
    }

    /// The variables that names and patterns stand for, in this order.
    ///
    /// # Errors
    /// When nothing has a name, or no name matches a pattern, or there are more than [`MAX_NAMES`].
    fn find_all(&mut self, names: &[String]) -> Result<Vec<(String, Variable)>, Failure> {
        let mut found: Vec<(String, Variable)> = vec![];
        for name in names {
            if name.contains(['*', '?']) {
                let pattern = wildmatch::WildMatch::new_case_insensitive(name);
                let before = found.len();
                let declared = self.executive.declared().into_iter();
                found.extend(declared.filter(|(name, _)| pattern.matches(name)));
                if found.len() == before {
                    let text = format!("no variable has a name that matches `{name}`");
                    return Err(Failure::new("not_found", text));
                }
            } else {
                let variable = self.executive.find(name, Purpose::Watch);
                found.push((name.clone(), variable.map_err(|error| unknown(&error))?));
            }
            if found.len() > MAX_NAMES {
                return Err(too_many());
            }
        }
        Ok(found)
    }

    /// What is to be read for some names.
    pub(super) fn items_to_read(
        &mut self,
        names: &[String],
    ) -> Result<(Vec<Named>, Vec<Item>), Failure> {
        let (mut named, mut items) = (vec![], vec![]);
        for (name, variable) in self.find_all(names)? {
            let keys = self.executive.keys(variable);
            let is_array = matches!(self.executive.get(variable), Value::Array(_));
            named.push(Named { name, elements: is_array.then_some(keys.len()) });
            items.extend(keys.into_iter().map(|key| Item::new(key, None)));
            if items.len() > MAX_NAMES {
                return Err(too_many());
            }
        }
        Ok((named, items))
    }

    fn setting(&self, variable: Variable, assignment: &Assignment) -> Result<Setting, Failure> {
        let parsed = self.executive.parse(variable, &assignment.text());
        parsed.map_err(|error| Failure::new("bad_value", format!("{}: {error}", assignment.name)))
    }

    /// What is to be written for some assignments.
    pub(super) fn items_to_write(
        &mut self,
        assignments: &[Assignment],
    ) -> Result<Vec<Item>, Failure> {
        let mut items = vec![];
        for assignment in assignments {
            let variable = self.executive.find(&assignment.name, Purpose::Stimulus);
            let variable = variable.map_err(|error| unknown(&error))?;
            let setting = self.setting(variable, assignment)?;
            let keys = self.executive.keys(variable).into_iter();
            items.extend(keys.map(|key| Item::new(key, Some(setting))));
        }
        Ok(items)
    }

    /// Forces variables.
    ///
    /// # Errors
    /// A name is unknown or an array's, or a value is none, or two forces would hold the same bits. Other
    /// reasons are found by the executive that runs.
    pub(super) fn force(&mut self, assignments: &[Assignment]) -> Result<ForceChange, Failure> {
        let refused = |text| Failure::new("refused", text);
        let (mut items, mut forces) = (vec![], self.forces.clone());
        for assignment in assignments {
            let variable = self.executive.find(&assignment.name, Purpose::Watch);
            let variable = variable.map_err(|error| unknown(&error))?;
            let setting = self.setting(variable, assignment)?;
            let [key] = self.executive.keys(variable)[..] else {
                return Err(refused(format!("{} is an array; name an element", assignment.name)));
            };
            let name = self.executive.canonical(variable);
            let shares = |other: &&Force| {
                other.key != key && self.executive.shares_forced_bits(other.key, key)
            };
            if let Some(other) = forces.iter().find(shares) {
                let other = &other.name;
                return Err(refused(format!(
                    "`{name}` shares bits with `{other}`, which is forced; end that force first"
                )));
            }
            let before = self.forces.iter().find(|old| old.key == key).map(|old| old.setting);
            items.push(Item { before, ..Item::new(key, Some(setting)) });
            forces.retain(|old| old.key != key);
            forces.push(Force { name, key, setting, text: assignment.text() });
            if forces.len() > MAX_FORCES || items.len() > MAX_FORCES {
                let text = format!("at most {MAX_FORCES} variables can be forced");
                return Err(refused(text));
            }
        }
        Ok(ForceChange { items, forces })
    }

    /// Ends the forces of some variables, or all. Gives the names of the variables, too.
    ///
    /// # Errors
    /// A name is unknown, or its variable is not forced.
    pub(super) fn unforce(
        &mut self,
        names: &[String],
        all: bool,
    ) -> Result<(Vec<String>, ForceChange), Failure> {
        let mut keys = vec![];
        for name in names {
            let variable = self.executive.find(name, Purpose::Watch);
            let variable = variable.map_err(|error| unknown(&error))?;
            let found = self.executive.keys(variable);
            if !self.forces.iter().any(|force| found.contains(&force.key)) {
                return Err(Failure::new("not_found", format!("`{name}` is not forced")));
            }
            keys.extend(found);
        }
        let ends = |force: &Force| all || keys.contains(&force.key);
        let (ended, forces): (Vec<Force>, Vec<Force>) = self.forces.iter().cloned().partition(ends);
        let item =
            |force: &Force| Item { before: Some(force.setting), ..Item::new(force.key, None) };
        let items = ended.iter().map(item).collect();
        let names = ended.into_iter().map(|force| force.name).collect();
        Ok((names, ForceChange { items, forces }))
    }

    /// Checks that no force passes to another input or output of the same name when the program is replaced: what
    /// held an input would switch a physical output then. `comparison` is that with the new program.
    ///
    /// # Errors
    /// Which one would.
    pub(super) fn check_forces(&self, comparison: &Comparison) -> Result<(), String> {
        for force in &self.forces {
            // The elements of an array have one row.
            let variable = force.name.split('[').next().unwrap_or_default();
            let mut rows = comparison.rows.iter().filter(|row| row.name == variable);
            if let Some(row) = rows.find(|row| row.change == Change::Changed) {
                let (old, new) = (row.old.as_deref(), row.new.as_deref());
                return Err(format!(
                    "{} is forced, and the new program has it as {} instead of {}; end its force",
                    force.name,
                    new.unwrap_or_default(),
                    old.unwrap_or_default()
                ));
            }
        }
        Ok(())
    }

    /// The forces of another program as forces of this one, by their names. `force` puts them into effect.
    ///
    /// # Errors
    /// Which one can't be taken over, and why.
    pub(super) fn take_forces(
        &mut self,
        other: &Self,
        mut force: impl FnMut(VariableKey, Setting) -> Result<(), &'static str>,
    ) -> Result<(), String> {
        self.forces.clear();
        for old in &other.forces {
            let missing = |why: String| {
                let name = &old.name;
                format!(
                    "{name} is forced, and the new program can't do that ({why}); end its force"
                )
            };
            let variable = self.executive.find(&old.name, Purpose::Watch);
            let variable = variable.map_err(|error| missing(error.to_string()))?;
            let [key] = self.executive.keys(variable)[..] else {
                return Err(missing("it is an array".into()));
            };
            force(key, old.setting).map_err(|why| missing(format!("it {why}")))?;
            self.forces.push(Force { key, ..old.clone() });
        }
        Ok(())
    }

    /// The forces as a part of a reply.
    pub(super) fn forces_json(&self) -> Json {
        let entries = self.forces.iter().map(|f| json!({"name": f.name, "value": f.text}));
        Json::Array(entries.collect())
    }

    /// The variables whose names match a pattern, those behind the name `after`, at most `count`. The second
    /// value says whether there are more.
    pub(super) fn list(
        &mut self,
        pattern: Option<&str>,
        after: Option<&str>,
        count: usize,
    ) -> (Vec<Json>, bool) {
        let pattern = wildmatch::WildMatch::new_case_insensitive(pattern.unwrap_or("*"));
        let mut declared = self.executive.declared();
        declared.retain(|(name, _)| pattern.matches(name));
        let start = after.map_or(0, |after| {
            declared.iter().position(|(name, _)| name == after).map_or(0, |at| at + 1)
        });
        let more = declared.len() > start + count;
        let shown = declared.into_iter().skip(start).take(count);
        let entry = |(name, variable): (String, Variable)| {
            let elements = match self.executive.get(variable) {
                Value::Array(values) => Some(values.len()),
                _ => None,
            };
            json!({
                "name": name,
                "logical": self.executive.is_logical(variable),
                "elements": elements,
            })
        };
        (shown.map(entry).collect(), more)
    }
}
