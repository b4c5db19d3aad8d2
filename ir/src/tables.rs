//! Hash tables whose keys are numbers that the compiler gave itself, with a fast hash function. A collision only costs
//! time, and nobody outside chooses these keys, so it need not withstand attacks. What a program names is kept in the
//! standard library's tables.

use std::collections::{HashMap, HashSet};

use rustc_hash::FxBuildHasher;

/// A table by keys of the compiler's own.
pub type FastMap<K, V> = HashMap<K, V, FxBuildHasher>;

/// A set of keys of the compiler's own.
pub type FastSet<K> = HashSet<K, FxBuildHasher>;
