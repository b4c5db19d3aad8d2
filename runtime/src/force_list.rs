//! The list of forces in effect that an executive keeps: bounded, and allocated once, so
//! that forcing allocates nothing in the scan's thread.

use serde::{Deserialize, Serialize};

use crate::variable::MAX_FORCES;

/// Why a bit is not forced to another value than 0 and 1; the end of a sentence that begins with its name.
pub(crate) const ONE_BIT: &str = "is one bit, and can be forced to 0 or 1 only";

/// Forces, each under a key that says which variable is forced.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct ForceList<K, F> {
    list: Vec<(K, F)>,
}

impl<K, F> Default for ForceList<K, F> {
    /// None, with room for all.
    fn default() -> Self {
        Self { list: Vec::with_capacity(MAX_FORCES) }
    }
}

impl<K: PartialEq, F> ForceList<K, F> {
    /// Forgets all forces.
    pub(crate) fn clear(&mut self) {
        self.list.clear();
    }

    /// Adds a force whose key is not in the list, however many there are.
    pub(crate) fn push(&mut self, key: K, force: F) {
        self.list.push((key, force));
    }

    /// Adds a force, or takes it in the place of the one with the same key.
    ///
    /// # Errors
    /// When there are too many.
    pub(crate) fn set(&mut self, key: K, force: F) -> Result<(), &'static str> {
        if let Some((_, old)) = self.list.iter_mut().find(|(known, _)| *known == key) {
            *old = force;
            return Ok(());
        }
        if self.list.len() >= MAX_FORCES {
            return Err(
                "can't be forced: 256 forces are active already; unforce another one first",
            );
        }
        self.list.push((key, force));
        Ok(())
    }

    /// Ends the force of a key, if there is one.
    pub(crate) fn remove(&mut self, key: &K) {
        self.list.retain(|(known, _)| known != key);
    }

    /// The force of a key, if there is one.
    pub(crate) fn get(&self, key: &K) -> Option<&F> {
        self.list.iter().find(|(known, _)| known == key).map(|(_, force)| force)
    }

    /// Whether a key passes a test.
    pub(crate) fn any(&self, test: impl Fn(&K) -> bool) -> bool {
        self.list.iter().any(|(key, _)| test(key))
    }

    /// The same list with room for all forces there can be; `None` where it has more than that.
    pub(crate) fn with_room(mut self) -> Option<Self> {
        self.list.reserve(MAX_FORCES.checked_sub(self.list.len())?);
        Some(self)
    }

    /// The forces with their keys, in the order in which they were first set.
    pub(crate) fn entries(&self) -> impl Iterator<Item = (&K, &F)> {
        self.list.iter().map(|(key, force)| (key, force))
    }

    /// The forces, in the order in which they were first set.
    pub(crate) fn iter(&self) -> impl Iterator<Item = &F> {
        self.list.iter().map(|(_, force)| force)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_list_is_bounded_and_later_forces_take_the_place_of_earlier_ones() {
        let mut forces = ForceList::default();
        for key in 0..MAX_FORCES {
            forces.set(key, 1).unwrap();
        }
        assert!(forces.set(MAX_FORCES, 1).is_err());
        forces.set(3, 2).unwrap();
        forces.remove(&4);
        forces.set(MAX_FORCES, 1).unwrap();
        assert_eq!(forces.iter().filter(|&&force| force == 2).count(), 1);
        assert_eq!(forces.iter().count(), MAX_FORCES);
    }
}
