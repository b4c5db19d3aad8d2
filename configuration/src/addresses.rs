//! The points outside that an entry names: the first one of a row, or a list of single points and ranges, `gpiochip0/17,27,22`,
//! `192.168.1.10/1/coil/8..15`.

use std::sync::Arc;

use crate::{Address, Driver};

/// The most points that a list may have.
const MAX_POINTS: usize = 4096;

/// The points that an entry names.
#[derive(Clone, Debug)]
pub(super) enum Addresses {
    /// None: the driver's points have the names of their variables.
    None,
    /// The points from this one on, as many as there are variables.
    From(Arc<dyn Address>),
    /// These.
    List(Vec<Arc<dyn Address>>),
}

impl Addresses {
    /// Reads what stands in an entry.
    ///
    /// # Errors
    /// What is wrong with it.
    pub(super) fn read(driver: &dyn Driver, text: &str) -> Result<Self, String> {
        if driver.lists_addresses() && (text.contains(',') || text.contains("..")) {
            return list(driver, text).map(Self::List);
        }
        Ok(driver.address(text)?.map_or(Self::None, Self::From))
    }

    /// The point number `index`, from 0.
    pub(super) fn get(&self, index: usize) -> Option<Arc<dyn Address>> {
        match self {
            Self::None => None,
            Self::From(first) => first.nth(index),
            Self::List(all) => all.get(index).cloned(),
        }
    }

    /// Why there is no point number `index` for the variable `name` of the entry for `names`.
    pub(super) fn is_too_short(&self, names: &str, name: &str) -> String {
        match self {
            Self::From(first) => first.is_too_long(names, name),
            Self::None | Self::List(_) => {
                format!("`address` has no point for `{name}`: it has one for each line")
            }
        }
    }

    /// How many points it lists; `None` where their number is open.
    pub(super) fn count(&self) -> Option<usize> {
        match self {
            Self::List(all) => Some(all.len()),
            Self::None | Self::From(_) => None,
        }
    }
}

/// The points of a list. What stands in front of the last `/` of the first one need not be written again.
fn list(driver: &dyn Driver, text: &str) -> Result<Vec<Arc<dyn Address>>, String> {
    let begin = text.split(',').next().unwrap_or("");
    let begin = begin.split("..").next().unwrap_or("");
    let prefix = begin.rfind('/').and_then(|at| begin.get(..=at)).unwrap_or("").trim();
    let one = |part: &str| {
        let part = part.trim();
        let full = if part.contains('/') { part.to_owned() } else { format!("{prefix}{part}") };
        driver.address(&full)?.ok_or_else(|| format!("`{full}` is not an address"))
    };
    let mut all: Vec<Arc<dyn Address>> = vec![];
    for part in text.split(',') {
        let Some((first, last)) = part.split_once("..") else {
            all.push(one(part)?);
            continue;
        };
        let (from, to) = (one(first)?, one(last)?.place());
        let range = (0..MAX_POINTS).map_while(|index| from.nth(index));
        let range: Vec<Arc<dyn Address>> = range.collect();
        let count = range.iter().position(|address| address.place() == to);
        let count = count.ok_or_else(|| {
            let (first, last) = (first.trim(), last.trim());
            format!("`address`: no row of points leads from `{first}` to `{last}`")
        })?;
        all.extend(range.into_iter().take(count + 1));
        if all.len() > MAX_POINTS {
            return Err(format!("`address` has more than {MAX_POINTS} points"));
        }
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use crate::drivers;

    fn places(driver: &str, text: &str) -> Result<Vec<String>, String> {
        let driver = drivers::all().find(|known| known.name() == driver).unwrap();
        let addresses = Addresses::read(driver, text)?;
        let count = addresses.count().unwrap_or(2);
        Ok((0..count).map(|index| addresses.get(index).unwrap().place()).collect())
    }

    #[test]
    fn a_point_is_written_as_in_an_entry_of_its_own() {
        for (driver, list, second) in [
            ("gpio", "gpiochip0/17,27", "gpiochip0/27"),
            ("modbus-tcp", "h/1/coil/8..9", "h:502/1/coil/9"),
            ("modbus-tcp", "h/1/holding/7.0..7.1", "h:502/1/holding/7.1"),
            ("modbus-rtu", "/dev/ttyS0/7/discrete/1..2", "/dev/ttyS0/7/discrete/2"),
            ("modbus-server", "coil/0..3", "coil/1"),
            ("ethercat", "eth1/1/in/0.6..1.0", "eth1/1/in/0.7"),
        ] {
            let driver = drivers::all().find(|known| known.name() == driver).unwrap();
            let addresses = Addresses::read(driver, list).unwrap();
            assert_eq!(addresses.get(1).unwrap().written().as_deref(), Some(second));
        }
    }

    #[test]
    fn a_list_has_points_and_ranges() {
        for (driver, list, singles) in [
            ("gpio", "gpiochip0/17,27, 22", &["gpiochip0/17", "gpiochip0/27", "gpiochip0/22"][..]),
            ("gpio", "gpiochip0/3..5:pull-up", &["gpiochip0/3", "gpiochip0/4", "gpiochip0/5"]),
            ("gpio", "gpiochip0/3,gpiochip1/3", &["gpiochip0/3", "gpiochip1/3"]),
            (
                "modbus-tcp",
                "h.x/1/coil/8..9,12",
                &["h.x/1/coil/8", "h.x/1/coil/9", "h.x/1/coil/12"],
            ),
            ("modbus-tcp", "h/1/holding/7.15..8.0", &["h/1/holding/7:bit15", "h/1/holding/8.0"]),
            ("modbus-server", "coil/0..1", &["coil/0", "coil/1"]),
            ("ethercat", "eth1/2/in/0.7..1.0", &["eth1/2/in/0.7", "eth1/2/in/1.0"]),
            ("gpio", "gpiochip0/8", &["gpiochip0/8", "gpiochip0/9"]),
        ] {
            let each = |text: &&str| places(driver, text).unwrap().into_iter().next().unwrap();
            let singles: Vec<String> = singles.iter().map(each).collect();
            assert_eq!(places(driver, list), Ok(singles), "{list}");
        }
    }

    #[test]
    fn what_is_wrong_with_a_list_is_told() {
        for (driver, text, part) in [
            ("gpio", "gpiochip0/17,x", "`gpiochip0/x` is not an address"),
            ("gpio", "gpiochip0/5..3", "no row of points leads from `gpiochip0/5` to `3`"),
            ("modbus-tcp", "h/1/coil/0..9999", "no row of points"),
            ("modbus-tcp", "h/1/holding/7.0..7.16", "bit"),
            ("modbus-tcp", "h/1/coil/7.0", "a single bit has no"),
            ("modbus-tcp", "h/1/holding/7.0:u16", "format"),
            ("opcua", "a,b", "have the names of their variables"),
        ] {
            let error = places(driver, text).unwrap_err();
            assert!(error.contains(part), "{text}: {error}");
        }
    }
}
