//! What a statement accesses: a place in one of the areas of its language.

/// A single variable, an element of an array, or several places beside each other that have a name together, such as a
/// word of bits. Which areas there are, and what is counted in them, the language decides; it has the names
/// ([`Presentation::name`](crate::Presentation::name)).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Accessed {
    /// The area.
    pub area: u32,
    /// The first place in it.
    pub first: u32,
    /// How many places there are, from 1 on.
    pub count: u32,
}

impl Accessed {
    /// One place.
    pub const fn one(area: u32, first: u32) -> Self {
        Self { area, first, count: 1 }
    }

    /// Whether two have a place in common.
    pub fn meets(self, other: Self) -> bool {
        let end = |one: Self| u64::from(one.first) + u64::from(one.count);
        self.area == other.area
            && u64::from(self.first) < end(other)
            && u64::from(other.first) < end(self)
    }
}
