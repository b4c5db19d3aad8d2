//! The terminals that the configuration expects, in their order, so that a terminal that was swapped is refused.

use ethercrab::SubDeviceIdentity;
use plcc_configuration::drivers::ethercat::ExpectedTerminal;

/// Whether a terminal is what is expected.
fn is(expected: &ExpectedTerminal, name: &str, found: &SubDeviceIdentity) -> bool {
    match expected {
        ExpectedTerminal::Any => true,
        ExpectedTerminal::Name(wanted) => wanted == name,
        ExpectedTerminal::Numbers(vendor, product, revision) => {
            (*vendor, *product) == (found.vendor_id, found.product_id)
                && revision.is_none_or(|revision| revision == found.revision)
        }
    }
}

/// Compares the terminals that were found with the expected ones.
///
/// # Errors
/// The first difference, for people.
pub(super) fn compare(
    expected: &[ExpectedTerminal],
    found: &[(String, SubDeviceIdentity)],
) -> Result<(), String> {
    for (position, (name, identity)) in found.iter().enumerate() {
        if let Some(wanted) = expected.get(position)
            && !is(wanted, name, identity)
        {
            let SubDeviceIdentity { vendor_id, product_id, revision, .. } = identity;
            return Err(format!(
                "terminal {position} is {name} (0x{vendor_id:x}:0x{product_id:x}:0x{revision:x}), not {wanted}"
            ));
        }
    }
    match found.len() == expected.len() || expected.is_empty() {
        true => Ok(()),
        false => Err(format!("there are {} terminals, not {}", found.len(), expected.len())),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn swapped_missing_and_further_terminals_are_refused() {
        let identity = |product_id| SubDeviceIdentity {
            vendor_id: 2,
            product_id,
            revision: 0x0011_0000,
            serial: 0,
        };
        let found = [
            ("EK1100".to_owned(), identity(0x044c_2c52)),
            ("EL1008".to_owned(), identity(0x03f0_3052)),
            ("EL2008".to_owned(), identity(0x07d8_3052)),
        ];
        let check = |names: &[&str]| {
            let expected: Option<Vec<_>> =
                names.iter().map(|name| ExpectedTerminal::parse(name)).collect();
            compare(&expected.unwrap(), &found)
        };
        assert_eq!(check(&[]), Ok(()));
        assert_eq!(check(&["EK1100", "*", "0x2:0x07d83052"]), Ok(()));
        assert_eq!(check(&["EK1100", "2:3f03052:110000", "EL2008"]), Ok(()));
        let swapped = "terminal 1 is EL1008 (0x2:0x3f03052:0x110000), not EL2008";
        assert_eq!(check(&["EK1100", "EL2008", "EL1008"]), Err(swapped.into()));
        assert!(check(&["*", "2:3f03052:120000", "*"]).is_err());
        assert_eq!(check(&["EK1100"]), Err("there are 3 terminals, not 1".into()));
        assert_eq!(check(&["*"; 4]), Err("there are 3 terminals, not 4".into()));
    }
}
