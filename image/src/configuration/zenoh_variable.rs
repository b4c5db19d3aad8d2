//! Addresses of variables of other controls, which inputs of the driver `zenoh` follow: `CONTROL[/VARIABLE]`, such as
//! `mill/READY`.

/// A variable of another control.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct ZenohVariable {
    /// The control's name in keys.
    pub control: String,
    /// The variable; `None` if it has the name of the variable that follows it.
    pub variable: Option<String>,
}

/// Whether a text can be a part of a key: not empty, and without letters that have a meaning in keys.
pub fn is_key_part(text: &str) -> bool {
    !text.is_empty() && !text.contains(['/', '*', '$', '?', '#'])
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
                "`{text}` is no address: CONTROL or CONTROL/VARIABLE is expected, as in mill/READY"
            ));
        }
        Ok(Self { control: control.into(), variable: variable.map(str::to_owned) })
    }

    /// The variable number `index` (from 0) of a range. `None` where the address names a single variable.
    pub fn nth(&self, index: usize) -> Option<Self> {
        (index == 0 || self.variable.is_none()).then(|| self.clone())
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
        assert_eq!(mill.nth(7), Some(mill.clone()), "all have their own names");
        let ready = ZenohVariable::parse("mill/X:$700,3").unwrap();
        assert_eq!(ready.variable.as_deref(), Some("X:$700,3"));
        assert_eq!((ready.nth(0), ready.nth(1)), (Some(ready.clone()), None));
        for text in ["", "/READY", "mill/", "m*/A", "m$/A", "m?", "#"] {
            assert!(ZenohVariable::parse(text).is_err(), "{text}");
        }
    }
}
