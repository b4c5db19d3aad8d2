//! Addresses of variables of other controls, which inputs of the driver `zenoh` follow: `CONTROL[/VARIABLE]`, such as
//! `mill/READY`.

use std::sync::Arc;

use super::is_key_part;
use crate::Address;

/// A variable of another control.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct ZenohVariable {
    /// The control's name in keys.
    pub control: String,
    /// The variable; `None` if it has the name of the variable that follows it.
    pub variable: Option<String>,
}

impl ZenohVariable {
    /// Reads `CONTROL[/VARIABLE]`.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn parse(text: &str) -> Result<Self, String> {
        let (control, variable) = match text.split_once('/') {
            Some((control, variable)) => (control, Some(variable)),
            None => (text, None),
        };
        if !is_key_part(control) || variable == Some("") {
            return Err(format!(
                "`{text}` is not an address: CONTROL or CONTROL/VARIABLE is expected, as in mill/READY"
            ));
        }
        Ok(Self { control: control.into(), variable: variable.map(str::to_owned) })
    }
}

impl Address for ZenohVariable {
    /// There is none where the address names a single variable.
    fn nth(&self, index: usize) -> Option<Arc<dyn Address>> {
        (index == 0 || self.variable.is_none()).then(|| Arc::new(self.clone()) as Arc<dyn Address>)
    }

    fn unfit(&self, is_input: bool, _: bool) -> Option<String> {
        let message =
            "goes outside by its own name, but the address names a variable that it would follow";
        (!is_input).then(|| message.into())
    }

    fn is_too_long(&self, names: &str, _: &str) -> String {
        format!("`{names}` is a range, but its address names a single variable")
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn an_address_names_a_control_and_perhaps_a_variable() {
        let mill = ZenohVariable::parse("mill").unwrap();
        assert_eq!((mill.control.as_str(), mill.variable.as_deref()), ("mill", None));
        assert!(mill.nth(7).is_some(), "all have their own names");
        let ready = ZenohVariable::parse("mill/X:$700,3").unwrap();
        assert_eq!(ready.variable.as_deref(), Some("X:$700,3"));
        assert!(ready.nth(0).is_some() && ready.nth(1).is_none());
        for text in ["", "/READY", "mill/", "m*/A", "m$/A", "m?", "#"] {
            assert!(ZenohVariable::parse(text).is_err(), "{text}");
        }
    }
}
