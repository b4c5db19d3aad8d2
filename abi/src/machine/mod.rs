//! The machine file (`--machine FILE.toml`): what a particular machine has. Behind the feature
//! `machine`.
//!
//! ```toml
//! # PMI: executive variables of this machine, added or changed. What is not said stays.
//! [variables]
//! "@HOMST" = { type = "integer", class = "rw" }
//! "@MAT" = { type = "integer", size = 1024 }
//!
//! # Any language: which lints are shown, and how.
//! [lints]
//! near-name = "allow"
//!
//! # Any language: names that people gave to variables.
//! [names]
//! I012 = { alias = "DOOR", text = "door closed", device = "-S12", at = "X11:7", drawing = "14.3" }
//! ```

mod names;
mod nct;
pub mod reference;
mod simulated_motors;
pub mod simulator;

use alloc::{
    collections::BTreeMap,
    format,
    string::{String, ToString},
    vec::Vec,
};
use core::fmt;

use serde::Deserialize;

use crate::nct::NctSettings;
use nct::NctFile;
use simulator::SimulatorTable;

pub use names::MachineName;

/// What a machine file says.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Machine {
    /// PMI's executive variables, in the order of their names.
    pub variables: Vec<MachineVariable>,
    /// An NCT control's settings.
    pub nct: NctSettings,
    /// `[lints]`: names of lints and the levels that are chosen for them (`allow`, `warn`, `deny`),
    /// in the order of the names. The compiler checks both.
    pub lints: Vec<(String, String)>,
    /// `[names]`: what people call the variables, in the order of the lines.
    pub names: Vec<MachineName>,
    /// `[simulator]`: the other side of the control, where the file has that table.
    pub simulator: Option<SimulatorTable>,
    /// `[[simulator.motor]]`: a PMAC's motors, by rising number.
    pub motors: Vec<crate::pmac::motion::Plant>,
}

/// An executive variable that the machine file adds or changes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MachineVariable {
    /// Its name in capitals, with the `@`.
    pub name: String,
    /// Its type; without one, that of the built-in table, or LOGICAL for a variable that is new.
    pub ty: Option<VariableType>,
    /// What a program may do with it; without one, what the built-in table says, or read and write.
    pub class: Option<VariableClass>,
    /// How many elements it has as an array; 0 for a variable that is not an array.
    pub size: Option<u32>,
    /// One line of meaning for `plcc explain`.
    pub meaning: Option<String>,
}

/// The type of an executive variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum VariableType {
    /// 0 or 1.
    #[serde(alias = "LOGICAL", alias = "Logical")]
    Logical,
    /// 16 bits.
    #[serde(alias = "INTEGER", alias = "Integer")]
    Integer,
    /// 32 bits.
    #[serde(alias = "LONG", alias = "Long")]
    Long,
}

/// What a program may do with an executive variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
pub enum VariableClass {
    /// It may be read.
    #[serde(rename = "ro", alias = "RO", alias = "read-only")]
    ReadOnly,
    /// It may be read and assigned.
    #[serde(rename = "rw", alias = "RW", alias = "read-write")]
    ReadWrite,
    /// It may be read, and an assignment can only clear it.
    #[serde(rename = "reset", alias = "RESET", alias = "reset-only")]
    ResetOnly,
}

/// Why a machine file is refused.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MachineError(String);

impl fmt::Display for MachineError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl core::error::Error for MachineError {}

#[derive(Deserialize)]
struct File {
    #[serde(default)]
    variables: BTreeMap<String, Entry>,
    #[serde(default)]
    lints: BTreeMap<String, String>,
    #[serde(flatten)]
    nct: NctFile,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    #[serde(rename = "type")]
    ty: Option<VariableType>,
    class: Option<VariableClass>,
    size: Option<u32>,
    meaning: Option<String>,
}

/// The most elements that an executive array may have.
const MAX_SIZE: u32 = 65_535;

impl Machine {
    fn refusal(error: &toml::de::Error) -> MachineError {
        MachineError(error.to_string())
    }

    /// Reads a machine file's text.
    ///
    /// # Errors
    /// Text that is not TOML, a key that nothing knows, a type, class or size that does not exist;
    /// the message names the place.
    pub fn parse(text: &str) -> Result<Self, MachineError> {
        let table: toml::Table = text.parse().map_err(|e| Self::refusal(&e))?;
        let known = |key: &&String| {
            ["variables", "lints", "names", "simulator"].contains(&key.as_str())
                || NctFile::KEYS.contains(&key.as_str())
        };
        if let Some(key) = table.keys().find(|key| !known(key)) {
            return Err(MachineError(format!("`{key}` is not a key of a machine file")));
        }
        let file: File = toml::from_str(text).map_err(|e| Self::refusal(&e))?;
        let nct = file.nct.settings().map_err(MachineError)?;
        let mut variables = Vec::with_capacity(file.variables.len());
        for (written, entry) in file.variables {
            let upper = written.to_ascii_uppercase();
            let name = if upper.starts_with('@') { upper } else { format!("@{upper}") };
            let tail = name.get(1..).unwrap_or("");
            if tail.is_empty() || !tail.bytes().all(|b| b.is_ascii_alphanumeric()) {
                let what =
                    format!("`{written}` is not a variable: letters and digits follow the @");
                return Err(MachineError(what));
            }
            if entry.size.is_some_and(|size| size == 1 || size > MAX_SIZE) {
                let what =
                    format!("{name}: an array has 2 to {MAX_SIZE} elements, 0 is not an array");
                return Err(MachineError(what));
            }
            let Entry { ty, class, size, meaning } = entry;
            variables.push(MachineVariable { name, ty, class, size, meaning });
        }
        variables.sort_by(|a, b| a.name.cmp(&b.name));
        if let Some([a, _]) = variables.array_windows().find(|[a, b]| a.name == b.name) {
            return Err(MachineError(format!("{} is there twice", a.name)));
        }
        let names = names::read(text).map_err(MachineError)?;
        let simulator = simulator::read(text).map_err(MachineError)?;
        let motors = simulated_motors::read(text).map_err(MachineError)?;
        let lints = file.lints.into_iter().collect();
        Ok(Self { variables, nct, lints, names, simulator, motors })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_machine_file_declares_variables() {
        let machine = Machine::parse(
            "[variables]\n\"@homst\" = { type = \"INTEGER\", class = \"rw\" }\nMAT = { size = 9 }\n",
        )
        .unwrap();
        let [homst, mat] = machine.variables.as_slice() else { panic!("two variables") };
        assert_eq!(homst.name, "@HOMST");
        assert_eq!(homst.ty, Some(VariableType::Integer));
        assert_eq!(homst.class, Some(VariableClass::ReadWrite));
        assert_eq!((mat.name.as_str(), mat.size, mat.ty), ("@MAT", Some(9), None));
    }

    #[test]
    fn a_wrong_machine_file_is_refused_with_the_reason() {
        for (text, part) in [
            ("[variables]\n\"@A\" = { kind = 1 }\n", "kind"),
            ("[variables]\n\"@A\" = { size = 1 }\n", "2 to 65535"),
            ("[variables]\n\"@A B\" = {}\n", "is not a variable"),
            ("[variables]\n\"@A\" = {}\nA = {}\n", "twice"),
            ("[variable]\n", "variable"),
        ] {
            let error = Machine::parse(text).unwrap_err().to_string();
            assert!(error.contains(part), "{error}");
        }
    }
}
