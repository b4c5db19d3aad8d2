//! The terminals that the configuration expects, in their order, so that a terminal that was swapped is refused.

use ethercrab::SubDeviceIdentity;

/// What the configuration says of a terminal.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Expected {
    /// `*`: any terminal.
    Any,
    /// A name, as it stands in the terminal's memory.
    Name(String),
    /// `VENDOR:PRODUCT[:REVISION]`, hexadecimal.
    Numbers(u32, u32, Option<u32>),
}

impl Expected {
    /// Reads an element of `ethercat-terminals`; `None` if it can't be one.
    pub(crate) fn parse(text: &str) -> Option<Self> {
        if text == "*" {
            return Some(Self::Any);
        }
        if !text.contains(':') {
            return (!text.is_empty()).then(|| Self::Name(text.into()));
        }
        let number = |part: &str| {
            let digits = part.strip_prefix("0x").unwrap_or(part);
            let fits = digits.bytes().all(|digit| digit.is_ascii_hexdigit());
            fits.then(|| u32::from_str_radix(digits, 16).ok()).flatten()
        };
        let parts: Option<Vec<u32>> = text.split(':').map(number).collect();
        match *parts?.as_slice() {
            [vendor, product] => Some(Self::Numbers(vendor, product, None)),
            [vendor, product, revision] => Some(Self::Numbers(vendor, product, Some(revision))),
            _ => None,
        }
    }

    fn is(&self, name: &str, found: &SubDeviceIdentity) -> bool {
        match self {
            Self::Any => true,
            Self::Name(wanted) => wanted == name,
            Self::Numbers(vendor, product, revision) => {
                (*vendor, *product) == (found.vendor_id, found.product_id)
                    && revision.is_none_or(|revision| revision == found.revision)
            }
        }
    }

    fn text(&self) -> String {
        match self {
            Self::Any => "any terminal".into(),
            Self::Name(name) => name.clone(),
            Self::Numbers(vendor, product, None) => format!("0x{vendor:x}:0x{product:x}"),
            Self::Numbers(vendor, product, Some(revision)) => {
                format!("0x{vendor:x}:0x{product:x}:0x{revision:x}")
            }
        }
    }
}

/// Compares the terminals that were found with the expected ones.
///
/// # Errors
/// The first difference, for people.
pub(super) fn compare(
    expected: &[Expected],
    found: &[(String, SubDeviceIdentity)],
) -> Result<(), String> {
    for (position, (name, identity)) in found.iter().enumerate() {
        if let Some(wanted) = expected.get(position)
            && !wanted.is(name, identity)
        {
            let SubDeviceIdentity { vendor_id, product_id, revision, .. } = identity;
            return Err(format!(
                "terminal {position} is {name} (0x{vendor_id:x}:0x{product_id:x}:0x{revision:x}), not {}",
                wanted.text()
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
            let expected: Option<Vec<_>> = names.iter().map(|name| Expected::parse(name)).collect();
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
        for text in ["", "2:", "2:x", "1:2:3:4", "2:+3", "100000000:1"] {
            assert_eq!(Expected::parse(text), None, "{text}");
        }
    }
}
