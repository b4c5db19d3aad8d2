//! Hash tables of the compiler's own numbers and instructions, with a fast hash function. A program could be written so
//! that its constants collide. That only costs time, and little: most tables hold what is in one function, whose length
//! is limited. What a program names is kept in the standard library's tables.

use std::collections::{HashMap, HashSet};

use rustc_hash::FxBuildHasher;

/// A table by keys of the compiler's own.
pub type FastMap<K, V> = HashMap<K, V, FxBuildHasher>;

/// A set of keys of the compiler's own.
pub type FastSet<K> = HashSet<K, FxBuildHasher>;
