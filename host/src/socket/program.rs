//! The program as the socket's thread knows it: its names, by which it finds variables and checks values before the
//! thread that runs the ticks is asked, and the forces as the executive listed them last.

use std::sync::Arc;

use plcc_abi::{OperatorPanel, Program};

use super::commands::Item;
use super::panel::ServedPanel;
use plcc_protocol::{Assignment, ErrorCode, Failure, MAX_NAMES, Variable, Variables};
use plcc_runtime::online_change::{Change, Comparison};
use plcc_runtime::variable::MAX_FORCES;
use plcc_runtime::{Class, Executive, NameError, Names, Properties, Purpose, Setting, VariableKey};

/// A force in effect.
#[derive(Clone, Debug)]
pub(super) struct Force {
    pub(super) name: String,
    pub(super) key: VariableKey,
    pub(super) setting: Setting,
    /// The value as it was given.
    pub(super) text: String,
    /// Who forces it, and since when.
    holder: Option<Holder>,
}

/// Who forces a variable.
#[derive(Clone, Debug)]
pub(super) struct Holder {
    /// The user and the command, for people.
    pub(super) by: String,
    /// The tick before which the force began.
    pub(super) tick: u64,
}

/// What is known of a new force beside its value.
pub(super) struct NewForce {
    pub(super) key: VariableKey,
    /// The value as it was given.
    pub(super) text: String,
    pub(super) holder: Option<Holder>,
}

/// What is to be done to force variables or to end forces, and the new forces.
pub(super) struct ForceChange {
    pub(super) items: Vec<Item>,
    pub(super) new: Vec<NewForce>,
}

/// A name in a request, and which items of its batch belong to it: as many as it has elements.
#[derive(Clone, Debug)]
pub(super) struct Named {
    pub(super) name: String,
    /// `None` for a single variable, the number of elements for an array.
    pub(super) elements: Option<usize>,
}

/// The program that the socket serves, with its names, and the forces in effect.
pub(super) struct ServedProgram {
    pub(super) program: Arc<Program>,
    /// The artifact or source, for people.
    pub(super) title: String,
    pub(super) names: Arc<dyn Names>,
    /// Its operator's screen; `None` where nobody knows it.
    pub(super) panel: Option<ServedPanel>,
    /// What tells it from others.
    pub(super) fingerprint: u64,
    /// As the executive that runs listed them when they changed last.
    forces: Vec<Force>,
    /// Its number in the record of the run.
    pub(super) recorded: u16,
}

/// The failure of a request with a name that can't be used.
fn unknown(error: &NameError) -> Failure {
    Failure::new(ErrorCode::NotFound, error.to_string())
}

fn too_many() -> Failure {
    Failure::new(ErrorCode::TooLarge, format!("one request can name {MAX_NAMES} variables at most"))
}

impl ServedProgram {
    /// `panel` is what the program's control shows to operators, `executive` is one of the program.
    pub(super) fn new(
        program: Arc<Program>,
        panel: Option<&OperatorPanel>,
        executive: &dyn Executive,
    ) -> Self {
        let title = program.files.first().cloned().unwrap_or_default();
        let (names, fingerprint) = (executive.names(), executive.fingerprint());
        let panel = panel.map(|panel| ServedPanel::new(panel, &*names));
        Self { program, title, names, panel, fingerprint, forces: vec![], recorded: 0 }
    }

    /// The variables that names and patterns stand for, in this order.
    ///
    /// # Errors
    /// When nothing has a name, or no name matches a pattern, or there are more than [`MAX_NAMES`].
    fn find_all(&self, names: &[String]) -> Result<Vec<(String, VariableKey)>, Failure> {
        let mut found: Vec<(String, VariableKey)> = vec![];
        for name in names {
            if name.contains(['*', '?']) {
                let pattern = wildmatch::WildMatch::new_case_insensitive(name);
                let before = found.len();
                found.extend(self.names.matching(|name| pattern.matches(name)));
                if found.len() == before {
                    let text = format!("no variable has a name that matches `{name}`");
                    return Err(Failure::new(ErrorCode::NotFound, text));
                }
            } else {
                let variable = self.names.find(name, Purpose::Watch);
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
        &self,
        names: &[String],
    ) -> Result<(Vec<Named>, Vec<Item>), Failure> {
        let (mut named, mut items) = (vec![], vec![]);
        for (name, variable) in self.find_all(names)? {
            let keys = self.names.elements(variable);
            let is_array = self.names.properties(variable).elements.is_some();
            named.push(Named { name, elements: is_array.then_some(keys.len()) });
            items.extend(keys.into_iter().map(|key| Item::new(key, None)));
            if items.len() > MAX_NAMES {
                return Err(too_many());
            }
        }
        Ok((named, items))
    }

    fn setting(&self, variable: VariableKey, assignment: &Assignment) -> Result<Setting, Failure> {
        let parsed = self.names.parse(variable, &assignment.text());
        parsed.map_err(|error| {
            Failure::new(ErrorCode::BadValue, format!("{}: {error}", assignment.name))
        })
    }

    /// What is to be written for some assignments.
    pub(super) fn items_to_write(&self, assignments: &[Assignment]) -> Result<Vec<Item>, Failure> {
        let mut items = vec![];
        for assignment in assignments {
            let variable = self.names.find(&assignment.name, Purpose::Stimulus);
            let variable = variable.map_err(|error| unknown(&error))?;
            let setting = self.setting(variable, assignment)?;
            items.push(Item::new(variable, Some(setting)));
        }
        Ok(items)
    }

    /// Forces variables.
    ///
    /// # Errors
    /// A name is unknown or an array's, or a value is none, or two forces would hold the same bits. Other
    /// reasons are found by the executive that runs.
    pub(super) fn force(&self, assignments: &[Assignment]) -> Result<ForceChange, Failure> {
        let refused = |text| Failure::new(ErrorCode::Refused, text);
        let (mut items, mut new) = (vec![], vec![]);
        let mut forced: Vec<VariableKey> = self.forces.iter().map(|force| force.key).collect();
        for assignment in assignments {
            let variable = self.names.find(&assignment.name, Purpose::Watch);
            let key = variable.map_err(|error| unknown(&error))?;
            let setting = self.setting(key, assignment)?;
            if self.names.properties(key).elements.is_some() {
                return Err(refused(format!("{} is an array; name an element", assignment.name)));
            }
            let shares =
                |other: &&VariableKey| **other != key && self.names.share_forced_bits(**other, key);
            if let Some(other) = forced.iter().find(shares) {
                let (name, other) = (self.names.canonical(key), self.names.canonical(*other));
                return Err(refused(format!(
                    "`{name}` shares bits with `{other}`, which is forced; end that force first"
                )));
            }
            let before = self.forces.iter().find(|old| old.key == key).map(|old| old.setting);
            items.push(Item { before, ..Item::new(key, Some(setting)) });
            new.push(NewForce { key, text: assignment.text(), holder: None });
            forced.retain(|old| *old != key);
            forced.push(key);
            if forced.len() > MAX_FORCES || items.len() > MAX_FORCES {
                let text = format!("at most {MAX_FORCES} variables can be forced");
                return Err(refused(text));
            }
        }
        Ok(ForceChange { items, new })
    }

    /// Notes the forces as an executive lists them. `new` are those that were not in effect before.
    pub(super) fn set_forces(&mut self, listed: Vec<(VariableKey, Setting)>, new: &[NewForce]) {
        let force = |(key, setting): (VariableKey, Setting)| {
            let given = new.iter().rev().find(|new| new.key == key);
            let before = self.forces.iter().find(|old| old.key == key && old.setting == setting);
            let known = given.map(|new| (&new.text, &new.holder));
            let known = known.or(before.map(|old| (&old.text, &old.holder)));
            let (text, holder) =
                known.map_or((None, None), |(text, holder)| (Some(text.clone()), holder.clone()));
            let text = text.unwrap_or_else(|| setting.to_string());
            Force { name: self.names.canonical(key), key, setting, text, holder }
        };
        self.forces = listed.into_iter().map(force).collect();
    }

    /// Ends the forces of some variables, or all. Gives the names of the variables, too.
    ///
    /// # Errors
    /// A name is unknown, or its variable is not forced.
    pub(super) fn unforce(
        &self,
        names: &[String],
        all: bool,
    ) -> Result<(Vec<String>, ForceChange), Failure> {
        let mut keys = vec![];
        for name in names {
            let variable = self.names.find(name, Purpose::Watch);
            let variable = variable.map_err(|error| unknown(&error))?;
            let found = self.names.elements(variable);
            if !self.forces.iter().any(|force| found.contains(&force.key)) {
                return Err(Failure::new(ErrorCode::NotFound, format!("`{name}` is not forced")));
            }
            keys.extend(found);
        }
        let ends = |force: &Force| all || keys.contains(&force.key);
        let ended: Vec<&Force> = self.forces.iter().filter(|force| ends(force)).collect();
        let item =
            |force: &&Force| Item { before: Some(force.setting), ..Item::new(force.key, None) };
        let items = ended.iter().map(item).collect();
        let names = ended.into_iter().map(|force| force.name.clone()).collect();
        Ok((names, ForceChange { items, new: vec![] }))
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

    /// Puts the forces of another program into effect in an executive of this one, by their names.
    ///
    /// # Errors
    /// Which one can't be taken over, and why.
    pub(super) fn take_forces(
        &mut self,
        other: &Self,
        executive: &mut dyn Executive,
    ) -> Result<(), String> {
        let mut new = vec![];
        for old in &other.forces {
            let missing = |why: String| {
                let name = &old.name;
                format!(
                    "{name} is forced, and the new program can't do that ({why}); end its force"
                )
            };
            let variable = self.names.find(&old.name, Purpose::Watch);
            let key = variable.map_err(|error| missing(error.to_string()))?;
            if self.names.properties(key).elements.is_some() {
                return Err(missing("it is an array".into()));
            }
            let sides = [other.names.properties(old.key), self.names.properties(key)];
            let [was, is] = sides.map(|properties| properties.direction);
            if was != is {
                return Err(missing(format!("it is {} there and {} here", is.name(), was.name())));
            }
            let forced = executive.force(key, Some(old.setting));
            forced.map_err(|why| missing(format!("it {why}")))?;
            new.push(NewForce { key, text: old.text.clone(), holder: old.holder.clone() });
        }
        self.set_forces(executive.forces(), &new);
        Ok(())
    }

    /// The forces as a part of a reply.
    pub(super) fn shown_forces(&self) -> Vec<plcc_protocol::Force> {
        let shown = |force: &Force| plcc_protocol::Force {
            name: force.name.clone(),
            value: force.text.clone(),
        };
        self.forces.iter().map(shown).collect()
    }

    /// Who forces what, where that is known, as a part of a reply.
    pub(super) fn holders(&self) -> Vec<plcc_protocol::ForcedBy> {
        let shown = |force: &Force| {
            let holder = force.holder.as_ref()?;
            let (by, ticks) = (holder.by.clone(), holder.tick);
            Some(plcc_protocol::ForcedBy { name: force.name.clone(), by, ticks })
        };
        self.forces.iter().filter_map(shown).collect()
    }

    /// The variables whose names match a pattern, those behind the name `after`, at most `count`.
    pub(super) fn list(
        &self,
        pattern: Option<&str>,
        after: Option<&str>,
        count: usize,
    ) -> Variables {
        let pattern = wildmatch::WildMatch::new_case_insensitive(pattern.unwrap_or("*"));
        let declared = self.names.matching(|name| pattern.matches(name));
        let start = after.map_or(0, |after| {
            declared.iter().position(|(name, _)| name == after).map_or(0, |at| at + 1)
        });
        let more = declared.len() > start + count;
        let shown = declared.into_iter().skip(start).take(count);
        let entry = |(name, variable): (String, VariableKey)| {
            let Properties { class, elements, .. } = self.names.properties(variable);
            let said = self.names.said_of(variable);
            let (alias, text) = said.map(|said| (said.alias.clone(), said.summary())).unzip();
            let (alias, text) = (alias.unwrap_or_default(), text.unwrap_or_default());
            Variable { name, logical: class == Class::Logical, elements, alias, text }
        };
        Variables { variables: shown.map(entry).collect(), more }
    }
}
