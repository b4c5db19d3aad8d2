//! Finds a PMAC's variables by the names that users give them ([`PmacName`]), and reads the values of
//! a stimulus.

use plcc_abi::pmac::name::suggest;
use plcc_abi::pmac::{Kind, Layout, PlcOp, PmacName, PmacNameError, PmacTables, Variable};

use crate::{NameError, ValueError};

/// Finds what a name means.
pub(super) fn find(
    text: &str,
    layout: &Layout,
    tables: &PmacTables,
) -> Result<PmacName, NameError> {
    let unfit = |reason: String| NameError::Unfit { name: text.into(), reason };
    let name = PmacName::parse(text, layout).map_err(|error| match error {
        PmacNameError::Malformed => {
            NameError::Unknown { name: text.into(), suggestion: suggest(text) }
        }
        PmacNameError::Beyond(reason) => unfit(reason),
    })?;
    if let PmacName::Variable(Variable { kind: Kind::L, number, .. }) = name
        && tables.l.binary_search_by_key(&number, |(number, _)| *number).is_err()
    {
        return Err(unfit("is an L-variable that the program does not define".into()));
    }
    if let PmacName::Plc { compiled, number } = name
        && !tables.programs.iter().any(|plc| (plc.compiled, plc.number) == (compiled, number))
    {
        return Err(unfit("is empty: the program has no text for it".into()));
    }
    Ok(name)
}

/// What setting a PLC to a value does, as the on-line commands of these names do: 0 DISABLE, 1 ENABLE, 2
/// PAUSE, 3 RESUME. `None` for other values.
pub(super) fn plc_op(value: f64) -> Option<PlcOp> {
    [(0.0, PlcOp::Disable), (1.0, PlcOp::Enable), (2.0, PlcOp::Pause), (3.0, PlcOp::Resume)]
        .into_iter()
        .find_map(|(number, op)| (number == value).then_some(op))
}

/// A value of a stimulus: an optional sign, then digits with or without a fraction, or `$hex`.
pub(super) fn number(text: &str) -> Result<f64, ValueError> {
    let error = || ValueError {
        value: text.into(),
        reason: "is no number: digits with or without a fraction, or $ and hexadecimal".into(),
    };
    let trimmed = text.trim();
    let (negative, digits) = match trimmed.strip_prefix('-') {
        Some(rest) => (true, rest),
        None => (false, trimmed.strip_prefix('+').unwrap_or(trimmed)),
    };
    let value = match digits.strip_prefix('$') {
        Some(hex) => {
            if hex.is_empty() || !hex.bytes().all(|byte| byte.is_ascii_hexdigit()) {
                return Err(error());
            }
            hex.bytes().fold(0.0, |sum, byte| {
                sum * 16.0 + f64::from(char::from(byte).to_digit(16).unwrap_or(0))
            })
        }
        None => {
            let plain = digits.bytes().all(|byte| byte.is_ascii_digit() || byte == b'.');
            if !plain || !digits.bytes().any(|byte| byte.is_ascii_digit()) {
                return Err(error());
            }
            digits.parse::<f64>().map_err(|_| error())?
        }
    };
    Ok(if negative { -value } else { value })
}

#[cfg(test)]
mod tests {
    use plcc_abi::pmac::{Controller, Definition};

    use super::*;

    fn found(name: &str) -> Result<String, String> {
        let tables = PmacTables { l: vec![(3, Definition::Star)], ..PmacTables::default() };
        find(name, &Layout::new(Controller::Pmac), &tables)
            .map(|name| name.to_string())
            .map_err(|error| error.to_string())
    }

    #[test]
    fn a_wrong_name_is_refused_with_the_reason() {
        for name in
            ["", "P", "P-1", "P1.5", "PUMP", "&2P5", "&Q5", "X:", "X:$G", "Z:0", "P4294967296"]
        {
            assert!(found(name).is_err(), "{name}");
        }
        assert!(found("P1024").is_err_and(|error| error.contains("--controller turbo")));
        assert!(found("&9Q1").is_err());
        assert!(found("X:$10000").is_err());
        assert!(found("L4").is_err_and(|error| error.contains("does not define")));
        assert!(found("P[3]").is_err_and(|error| error.contains("did you mean `P3`?")));
    }

    #[test]
    fn values_of_a_stimulus_are_numbers_of_pmac() {
        for (text, value) in
            [("1", 1.0), ("-2.5", -2.5), ("$FF", 255.0), ("-$a", -10.0), (" .5 ", 0.5), ("+3", 3.0)]
        {
            assert_eq!(number(text), Ok(value));
        }
        for text in ["", "-", "1e5", "0x1", "$", "$G", "1.2.3", "nan", "inf", ".", "1 2", "--1"] {
            assert!(number(text).is_err(), "{text}");
        }
    }
}
