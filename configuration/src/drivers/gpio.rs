//! Lines of Linux's GPIO character device. An address is `CHIP/LINE[:CIRCUIT]`, such as `gpiochip0/17:pull-up`.

use std::collections::HashMap;
use std::sync::Arc;

pub use super::NoSettings as Settings;
use crate::{Address, Driver, Mistake, Point};

pub(super) const DRIVERS: &[&dyn Driver] = &[&Gpio];

#[derive(Debug)]
struct Gpio;

impl Driver for Gpio {
    fn name(&self) -> &'static str {
        "gpio"
    }

    fn feature(&self) -> Option<&'static str> {
        Some("gpio")
    }

    fn address(&self, text: &str) -> Result<Option<Arc<dyn Address>>, String> {
        Ok(Some(Arc::new(GpioLine::parse(text)?)))
    }

    fn lists_addresses(&self) -> bool {
        true
    }

    /// Finds lines that one entry reads and another drives: a line has one direction.
    fn mistakes(&self, points: &[Point]) -> Vec<Mistake> {
        let own = points.iter().filter_map(|point| Some((point, point.address::<GpioLine>()?)));
        let mut driven: HashMap<String, usize> = HashMap::new();
        for (point, line) in own.clone().filter(|(point, _)| !point.is_input) {
            driven.entry(line.place()).or_insert(point.entry.line);
        }
        let read_and_driven = |(point, line): (&Point, &GpioLine)| {
            let by = driven.get(&line.place())?;
            let name = &point.symbol.name;
            let message = format!("the line of `{name}` is driven by the entry of line {by}");
            Some(Mistake { line: point.entry.line, message })
        };
        own.filter(|(point, _)| point.is_input).filter_map(read_and_driven).collect()
    }
}

/// What is switched on at a line besides its direction. A chip that can't do it refuses the line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Circuit {
    /// Nothing: an input without a resistor of the chip, an output that drives both levels.
    Plain,
    /// An input with the chip's resistor to the supply.
    PullUp,
    /// An input with the chip's resistor to ground.
    PullDown,
    /// An output that drives the low level only.
    OpenDrain,
    /// An output that drives the high level only.
    OpenSource,
}

impl Circuit {
    /// The names in a configuration.
    const NAMES: [(&str, Self); 4] = [
        ("pull-up", Self::PullUp),
        ("pull-down", Self::PullDown),
        ("open-drain", Self::OpenDrain),
        ("open-source", Self::OpenSource),
    ];

    /// Whether an input can have it.
    pub fn is_for_inputs(self) -> bool {
        matches!(self, Self::Plain | Self::PullUp | Self::PullDown)
    }

    /// Whether an output can have it.
    pub fn is_for_outputs(self) -> bool {
        matches!(self, Self::Plain | Self::OpenDrain | Self::OpenSource)
    }
}

/// A line of a chip.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct GpioLine {
    /// The name of the chip in `/dev`, such as `gpiochip0`.
    pub chip: String,
    /// The number of the line, from 0, which is called its offset by libgpiod.
    pub line: u32,
    /// What is switched on at it.
    pub circuit: Circuit,
}

impl GpioLine {
    /// Reads `CHIP/LINE[:CIRCUIT]`, where CHIP is a name in `/dev`, with or without `/dev/` before it.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn parse(text: &str) -> Result<Self, String> {
        let expected =
            || format!("`{text}` is not an address: CHIP/LINE is expected, as in gpiochip0/17");
        let (chip, rest) = text.rsplit_once('/').ok_or_else(expected)?;
        let chip = chip.strip_prefix("/dev/").unwrap_or(chip);
        let (line, circuit) = match rest.split_once(':') {
            Some((line, circuit)) => (line, Some(circuit)),
            None => (rest, None),
        };
        let is_number = !line.is_empty() && line.bytes().all(|byte| byte.is_ascii_digit());
        if chip.is_empty() || chip.contains('/') || !is_number {
            return Err(expected());
        }
        let line = line.parse().map_err(|_| format!("`{line}` is not the number of a line"))?;
        let known = |name| Circuit::NAMES.iter().find(|(known, _)| *known == name);
        let circuit = match circuit {
            None => Circuit::Plain,
            Some(name) => known(name).map(|&(_, circuit)| circuit).ok_or_else(|| {
                let names = Circuit::NAMES.map(|(name, _)| name).join(", ");
                format!("`{name}` can't follow a line; {names} can")
            })?,
        };
        Ok(Self { chip: chip.into(), line, circuit })
    }

    /// The line number `index` (from 0) of a range that begins here; `None` beyond the last number.
    fn after(&self, index: usize) -> Option<Self> {
        let line = self.line.checked_add(u32::try_from(index).ok()?)?;
        Some(Self { line, ..self.clone() })
    }
}

impl Address for GpioLine {
    fn nth(&self, index: usize) -> Option<Arc<dyn Address>> {
        Some(Arc::new(self.after(index)?))
    }

    fn place(&self) -> String {
        format!("gpio {}/{}", self.chip, self.line)
    }

    fn written(&self) -> Option<String> {
        Some(format!("{}/{}", self.chip, self.line))
    }

    fn unfit(&self, is_input: bool, is_bit: bool) -> Option<String> {
        if !is_bit {
            return Some("is a number, which a line of a GPIO chip can't be".into());
        }
        match is_input {
            true if !self.circuit.is_for_inputs() => {
                Some("is given from outside, but open-drain and open-source are for outputs".into())
            }
            false if !self.circuit.is_for_outputs() => {
                Some("goes outside, but pull-up and pull-down are for inputs".into())
            }
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn an_address_names_a_chip_and_a_line() {
        let line = GpioLine::parse("/dev/gpiochip0/17:pull-up").unwrap();
        assert_eq!(line, GpioLine { chip: "gpiochip0".into(), line: 17, circuit: Circuit::PullUp });
        assert_eq!(
            line.after(3).map(|next| (next.line, next.circuit)),
            Some((20, Circuit::PullUp))
        );
        assert_eq!(GpioLine::parse("panel-io/0").unwrap().chip, "panel-io");
        assert_eq!(GpioLine::parse("c/4294967295").unwrap().after(1), None);
        for text in [
            "",
            "gpiochip0",
            "gpiochip0/",
            "/17",
            "gpiochip0/-1",
            "gpiochip0/+1",
            "a/b/1",
            "gpiochip0/4294967296",
            "gpiochip0/1:pullup",
        ] {
            assert!(GpioLine::parse(text).is_err(), "{text}");
        }
    }
}
