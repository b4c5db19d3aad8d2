//! What the languages share: options, files and includes, the machine file.

mod include;
mod loader;
mod lowered;
mod options;
mod suggest;

pub use include::{Included, find_include};
pub use loader::{FileLoader, MemoryLoader};
pub use lowered::Lowered;
pub use options::{Controller, Limits, Options};
pub use plcc_abi::machine::{Machine, MachineError, MachineVariable, VariableClass, VariableType};
pub use plcc_abi::natural_cmp;
pub use suggest::closest;
