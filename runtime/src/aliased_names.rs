//! A table of names that finds a variable by the names that people gave it, beside that of the language.
//!
//! A control's own table knows nothing of given names. [`with_given`] puts this one around it, and everybody who asks
//! [`Names`] gets it.

use std::sync::Arc;

use plcc_abi::{GivenName, closest};
use plcc_simulator::Equipment;

use crate::given_names::GivenNames;
use crate::names::{Names, Properties};
use crate::safe_outputs::{SafeLines, SafeOutput, SafeOutputs};
use crate::{NameError, Purpose, Setting, ValueError, VariableKey};

/// A table of names with those that people gave.
#[derive(Debug)]
struct WithGiven {
    own: Arc<dyn Names>,
    given: GivenNames,
}

/// The table with the names that people gave.
pub(crate) fn with_given(own: Arc<dyn Names>, given: &[GivenName]) -> Arc<dyn Names> {
    if given.is_empty() {
        return own;
    }
    let canonical = |name: &str| {
        let key = own.find(name, Purpose::Watch).ok()?;
        Some(own.canonical(key))
    };
    let given = GivenNames::with(given, canonical);
    Arc::new(WithGiven { own, given })
}

impl Names for WithGiven {
    /// Finds a variable by its own name, else by an alias.
    fn find(&self, name: &str, purpose: Purpose) -> Result<VariableKey, NameError> {
        self.own.find(name, purpose).or_else(|error| match self.given.replaced(name) {
            Some(own) => self.own.find(&own, purpose).map_err(|error| match error {
                NameError::Unfit { reason, .. } => NameError::Unfit { name: name.into(), reason },
                error @ NameError::Unknown { .. } => error,
            }),
            None => Err(match closest(name, self.given.aliases().map(|(alias, _)| alias)) {
                Some(near) if !matches!(error, NameError::Unknown { suggestion: Some(_), .. }) => {
                    NameError::Unknown { name: name.into(), suggestion: Some(near.into()) }
                }
                _ => error,
            }),
        })
    }

    fn given(&self) -> &GivenNames {
        &self.given
    }

    fn canonical(&self, key: VariableKey) -> String {
        self.own.canonical(key)
    }

    fn properties(&self, key: VariableKey) -> Properties {
        self.own.properties(key)
    }

    fn element(&self, key: VariableKey, index: u32) -> Option<VariableKey> {
        self.own.element(key, index)
    }

    fn parse(&self, key: VariableKey, text: &str) -> Result<Setting, ValueError> {
        self.own.parse(key, text)
    }

    fn declared(&self) -> Vec<(String, VariableKey)> {
        self.own.declared()
    }

    fn patterns(&self) -> Vec<(String, VariableKey)> {
        self.own.patterns()
    }

    fn equipment(&self) -> Equipment {
        self.own.equipment()
    }

    fn outputs(&self) -> Vec<(String, VariableKey)> {
        self.own.outputs()
    }

    fn shown_in_image(&self) -> Vec<VariableKey> {
        self.own.shown_in_image()
    }

    fn is_simulated(&self, key: VariableKey) -> bool {
        self.own.is_simulated(key)
    }

    fn lines(&self, key: VariableKey) -> Vec<VariableKey> {
        self.own.lines(key)
    }

    fn safe_lines(&self, outputs: &SafeOutputs) -> Result<SafeLines, Vec<NameError>> {
        let own = |output: &SafeOutput| {
            let is_own = self.own.find(&output.name, Purpose::Watch).is_ok();
            let name = self.given.replaced(&output.name).filter(|_| !is_own);
            SafeOutput { name: name.unwrap_or_else(|| output.name.clone()), ..output.clone() }
        };
        self.own.safe_lines(&outputs.iter().map(own).collect::<Vec<_>>())
    }

    fn share_forced_bits(&self, a: VariableKey, b: VariableKey) -> bool {
        self.own.share_forced_bits(a, b)
    }
}

#[cfg(test)]
mod tests {
    use plcc_abi::Program;
    use plcc_abi::nct::NctTables;

    use super::*;
    use crate::names_of;
    use crate::safe_outputs::SafeValue;

    fn names(given: &[(&str, &str, &str)]) -> Arc<dyn Names> {
        let given = given.iter().map(|&(name, alias, text)| GivenName {
            name: name.into(),
            alias: alias.into(),
            text: text.into(),
            ..GivenName::default()
        });
        let region = |name: &str, offset| plcc_abi::Region {
            name: name.into(),
            offset,
            size: 40,
            bits: false,
        };
        names_of(&Program {
            files: vec!["a.plc".into()],
            image_size: 80,
            regions: vec![
                region(plcc_abi::nct::layout::region::LINES_IN, 0),
                region(plcc_abi::nct::layout::region::LINES_OUT, 40),
            ],
            tasks: vec![],
            tables: plcc_abi::Tables::Nct(NctTables {
                named: vec!["I012".parse().unwrap(), "Y013".parse().unwrap()],
                ..NctTables::default()
            }),
            names: given.collect(),
        })
    }

    #[test]
    fn a_variable_is_found_by_its_aliases() {
        let names = names(&[
            ("i012", "DOOR", ""),
            ("Y013", "Lamp", "the lamp"),
            ("Y014", "LAMP", ""),
            ("I012", "GATE", "gate"),
            ("I013", "DOOR", "another"),
            ("X1", "NOTHING", ""),
        ]);
        let found = |name: &str| {
            let found = names.find(name, Purpose::Watch);
            found.map(|key| names.canonical(key)).map_err(|error| error.to_string())
        };
        for (name, canonical) in [
            ("DOOR", "I012"),
            (" door ", "I012"),
            ("GATE", "I012"),
            ("I012", "I012"),
            ("Lamp", "Y013"),
            ("LAMP", "Y014"),
        ] {
            assert_eq!(found(name).as_deref(), Ok(canonical), "{name}");
        }
        assert!(found("lamp").is_err(), "it could be either");
        assert!(found("NOTHING").is_err());
        assert!(found("DOR").is_err_and(|error| error.contains("did you mean `DOOR`?")));
        assert!(found("I018").is_err_and(|error| error.contains("bit above 7")));
        let said = |name: &str| names.given().said_of(name).map(|said| (*said).clone());
        let door = said("I012").unwrap();
        assert_eq!((door.alias.as_str(), door.text.as_str()), ("DOOR", "gate"));
        assert_eq!(said("I013").unwrap().alias, "", "the first one with an alias has it");
        assert_eq!(names.given().aliases_of("I012"), ["DOOR", "GATE"]);
        assert_eq!(names.spelled("gate"), "I012");
        assert_eq!(names.spelled("I013"), "I013");
        let expression =
            names.given().in_expression("door=1&DOOR & /GATE2 ! \"DOOR\" & (GATE)+@DOOR");
        assert_eq!(expression, "I012=1&I012 & /GATE2 ! \"DOOR\" & (I012)+@DOOR");
    }

    #[test]
    fn patterns_match_aliases() {
        let names = names(&[("I012", "DOOR", ""), ("Y015", "DOSE", ""), ("Y014", "DOWN", "")]);
        let matching = |start: &str| {
            let found = names.matching(|name| name.starts_with(start)).into_iter();
            found.map(|(name, _)| name).collect::<Vec<_>>()
        };
        assert_eq!(matching("DO"), ["I012", "Y014", "Y015"], "named ones first");
        assert_eq!(matching("Y"), ["Y013"]);
    }

    #[test]
    fn safe_values_take_aliases() {
        let names = names(&[("O013", "PUMP", "")]);
        let output = SafeOutput { name: "PUMP".into(), value: SafeValue::Value("1".into()) };
        let lines = names.safe_lines(&[output]).unwrap();
        assert!(lines.bytes().iter().any(|byte| byte.offset == 41 && byte.set == 8), "{lines:?}");
    }
}
