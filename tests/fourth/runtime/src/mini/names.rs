//! The names of a program's variables.

use plcc_abi::DialectVariable;
use plcc_abi::mini::{Kind, MiniTables, Symbol};
use plcc_abi::place::{Direction, Place, Type};

use crate::names::{Class, Names, Properties};
use crate::safe_outputs::{SafeLines, SafeOutputs, SafeValue, does_not_fit};
use crate::{NameError, Purpose, Setting, ValueError, VariableKey};

/// All names of a program.
#[derive(Debug)]
pub(super) struct MiniNames {
    symbols: Vec<Symbol>,
}

/// The key of a variable, by its index.
pub(super) fn key(index: u32) -> VariableKey {
    VariableKey(DialectVariable::Mini(index))
}

/// The index of a key's variable; `None` for the key of another control.
pub(super) fn index(key: VariableKey) -> Option<u32> {
    let DialectVariable::Mini(index) = key.0 else { return None };
    Some(index)
}

impl MiniNames {
    pub(super) fn new(tables: &MiniTables) -> Self {
        Self { symbols: tables.symbols.clone() }
    }

    pub(super) fn symbol(&self, key: VariableKey) -> Option<&Symbol> {
        self.symbols.get(index(key)? as usize)
    }

    fn chosen(&self, test: impl Fn(&Symbol) -> bool) -> Vec<(String, VariableKey)> {
        let symbols = self.symbols.iter().zip(0..).filter(|(symbol, _)| test(symbol));
        let mut named: Vec<_> = symbols.map(|(one, index)| (one.name.clone(), key(index))).collect();
        named.sort_by(|a, b| plcc_abi::natural_cmp(&a.0, &b.0));
        named
    }

    /// The outputs, all off.
    pub(super) fn all_off(&self) -> SafeLines {
        let mut lines = SafeLines::default();
        for symbol in self.symbols.iter().filter(|symbol| symbol.kind == Kind::Output) {
            lines.set(symbol.offset, 0xFF, 0);
        }
        lines
    }
}

impl Names for MiniNames {
    /// An input or output is a line itself.
    fn lines(&self, key: VariableKey) -> Vec<VariableKey> {
        let is_wired = self.symbol(key).is_some_and(|symbol| symbol.kind != Kind::Number);
        if is_wired { vec![key] } else { vec![] }
    }

    fn find(&self, name: &str, _: Purpose) -> Result<VariableKey, NameError> {
        let upper = name.trim().to_uppercase();
        let found = self.symbols.iter().position(|symbol| symbol.name == upper);
        let unknown = || NameError::Unknown { name: name.into(), suggestion: None };
        found.map(|index| key(index as u32)).ok_or_else(unknown)
    }

    fn canonical(&self, key: VariableKey) -> String {
        self.symbol(key).map_or_else(String::new, |symbol| symbol.name.clone())
    }

    fn properties(&self, key: VariableKey) -> Properties {
        let Some(symbol) = self.symbol(key) else {
            return Properties::internal(Class::Integer, None);
        };
        let (class, ty) = match symbol.kind {
            Kind::Number => (Class::Integer, Type::Long),
            Kind::Input | Kind::Output => (Class::Logical, Type::Logical),
        };
        let own = Properties::internal(class, Some(Place::bytes(symbol.offset, ty)));
        match symbol.kind {
            Kind::Number => own,
            Kind::Input => Properties { direction: Direction::Input, can_be_forced: true, ..own },
            Kind::Output => Properties { direction: Direction::Output, can_be_forced: true, ..own },
        }
    }

    fn element(&self, _: VariableKey, _: u32) -> Option<VariableKey> {
        None
    }

    fn parse(&self, _: VariableKey, text: &str) -> Result<Setting, ValueError> {
        let unfit = |_| ValueError { value: text.into(), reason: "is not an integer".into() };
        text.trim().parse().map(Setting::Int).map_err(unfit)
    }

    fn declared(&self) -> Vec<(String, VariableKey)> {
        self.chosen(|_| true)
    }

    fn outputs(&self) -> Vec<(String, VariableKey)> {
        self.chosen(|symbol| symbol.kind == Kind::Output)
    }

    fn shown_in_image(&self) -> Vec<VariableKey> {
        (0..self.symbols.len() as u32).map(key).collect()
    }

    fn safe_lines(&self, outputs: &SafeOutputs) -> Result<SafeLines, Vec<NameError>> {
        self.all_off().with(outputs, |lines, output| {
            let key = self.find(&output.name, Purpose::Watch)?;
            let symbol = self.symbol(key).filter(|symbol| symbol.kind == Kind::Output);
            let reason = || NameError::Unfit {
                name: output.name.clone(),
                reason: "is no output".into(),
            };
            let symbol = symbol.ok_or_else(reason)?;
            let on = match &output.value {
                SafeValue::Value(text) if text == "1" => 1,
                SafeValue::Value(text) if text != "0" => {
                    return Err(does_not_fit(&output.name, text));
                }
                _ => 0,
            };
            lines.apply(&output.value, symbol.offset, 0xFF, on);
            Ok(())
        })
    }

    fn share_forced_bits(&self, _: VariableKey, _: VariableKey) -> bool {
        false
    }
}
