//! ENABLE, DISABLE, PAUSE and RESUME of PLCs (appendix C). Each sets the state of a PLC as the operator sets a variable:
//! `ENABLE PLC 3` is `PLC3=1`, so it needs `--allow write`, is logged, and is in the record.

use super::PmacTerminal;
use crate::presentation::{Answer, Desk};

/// The last PLC's number.
const LAST: u32 = 31;

impl PmacTerminal {
    /// A command for PLCs; `None` if the line is none. `plain` is the line in capitals without spaces.
    pub(super) fn plc_command(&mut self, desk: &mut dyn Desk, plain: &str) -> Option<Answer> {
        const COMMANDS: [(&str, &str); 8] = [
            ("ENABLE", "1"),
            ("ENA", "1"),
            ("DISABLE", "0"),
            ("DIS", "0"),
            ("PAUSE", "2"),
            ("PAU", "2"),
            ("RESUME", "3"),
            ("RES", "3"),
        ];
        let (rest, value) = COMMANDS.iter().find_map(|(word, value)| {
            Some((plain.strip_prefix(word)?.strip_prefix("PLC")?, *value))
        })?;
        let (kind, list) = match rest.strip_prefix('C') {
            Some(list) => ("PLCC", list),
            None => ("PLC", rest),
        };
        Some(numbers(list).and_then(|numbers| {
            let names = numbers.into_iter().map(|number| format!("{kind}{number}"));
            self.set_plcs(desk, names.collect(), value)
        }))
    }

    /// `^D`: disables all PLCs and PLCCs.
    pub(super) fn disable_all_plcs(&mut self, desk: &mut dyn Desk) -> Answer {
        let names = ["PLC", "PLCC"]
            .iter()
            .flat_map(|kind| (0..=LAST).map(move |number| format!("{kind}{number}")));
        self.set_plcs(desk, names.collect(), "0")
    }

    /// Sets those that the program has; the empty ones have no state.
    fn set_plcs(&mut self, desk: &mut dyn Desk, names: Vec<String>, value: &str) -> Answer {
        let tasks = desk.tasks()?;
        let mut done = vec![];
        for name in names.into_iter().filter(|name| tasks.contains(name)) {
            done.push(desk.set(&name, value)?);
        }
        Ok(done.join("\n"))
    }
}

/// The numbers of a list: `3`, `1,4,7` or `2..5`.
fn numbers(list: &str) -> Result<Vec<u32>, String> {
    let wrong =
        || String::from("ERR003: PLCs are named by numbers from 0 to 31, as in 1,3 or 1..5");
    let number =
        |text: &str| text.parse::<u32>().ok().filter(|number| *number <= LAST).ok_or_else(wrong);
    if let Some((first, last)) = list.split_once("..") {
        let (first, last) = (number(first)?, number(last)?);
        return if first <= last { Ok((first..=last).collect()) } else { Err(wrong()) };
    }
    list.split(',').map(number).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plcs_are_listed_or_given_as_a_range() {
        assert_eq!(numbers("3").unwrap(), [3]);
        assert_eq!(numbers("1,4,7").unwrap(), [1, 4, 7]);
        assert_eq!(numbers("2..5").unwrap(), [2, 3, 4, 5]);
        for wrong in ["", "32", "5..2", "1,", "1-3"] {
            assert!(numbers(wrong).is_err(), "{wrong}");
        }
    }
}
