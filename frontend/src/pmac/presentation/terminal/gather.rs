//! Gathering (guide, I19 to I45): the values of chosen addresses, once in every I19 servo cycles.
//!
//! A PMAC stores the values while it runs. Here GATHER and ENDGATHER store only the first and the last tick, and the
//! values come from running these ticks again. So any number of sources costs the control nothing,
//! and what was not chosen before can still be gathered afterwards.

use std::collections::VecDeque;
use std::time::Instant;

use plcc_abi::number;
use plcc_abi::pmac::Controller;

use super::PmacTerminal;
use crate::presentation::{Answer, Desk};

/// How many samples are listed or kept at most.
const MAX_SAMPLES: u64 = 4096;
/// I-variables: the period, the mask of sources, and the address of the first of 24 sources.
const PERIOD: u32 = 19;
const MASK: u32 = 20;
const FIRST_SOURCE: u32 = 21;
const SOURCES: u32 = 24;

/// What was gathered.
#[derive(Clone, Debug, Default)]
pub(super) struct Gather {
    /// How many samples the buffer has room for; `None` if none is defined.
    room: Option<u64>,
    /// The variables that are gathered.
    names: Vec<String>,
    /// The number of servo cycles from one sample to the next.
    period: u64,
    /// The first tick, and the one after the last.
    begun: Option<u64>,
    ended: Option<u64>,
}

/// A list of samples that is being made.
#[derive(Clone, Debug)]
pub(super) struct Listing {
    names: Vec<String>,
    /// The ticks whose values are not shown yet.
    ticks: VecDeque<u64>,
}

/// The variable at a source's address. The guide calls the addresses modified and does not say how; *decided*: as
/// the first hexadecimal digit says, $0 a Y word, $4 an X word, $8 both as an integer, $C both as a number with a fraction.
fn source(address: u32) -> Answer {
    let space = match address >> 20 {
        0x0 => "Y",
        0x4 => "X",
        0x8 => "D",
        0xC => "L",
        _ => {
            return Err(format!(
                "${address:06X} is not a source: it has to begin with $0 (Y), $4 (X), $8 (D) or $C (L)"
            ));
        }
    };
    Ok(format!("{space}:${:X}", address & 0xFFFF))
}

impl PmacTerminal {
    /// The commands of gathering; `None` if the line is none of them. `plain` is the line in capitals without spaces.
    pub(super) fn gather_command(&mut self, desk: &mut dyn Desk, plain: &str) -> Option<Answer> {
        if let Some(size) =
            plain.strip_prefix("DEFINEGATHER").or_else(|| plain.strip_prefix("DEFGAT"))
        {
            return Some(self.define_gather(size));
        }
        if let Some(range) =
            plain.strip_prefix("LISTGATHER").or_else(|| plain.strip_prefix("LISGAT"))
        {
            return Some(self.list_gather(desk, range));
        }
        Some(match plain {
            "GATHER" | "GAT" => self.begin_gather(desk),
            "GATHERTRIGGER" | "GATTRIG" => Err(String::from(
                "there is no trigger input; set a trigger on the scope, which needs no gathering",
            )),
            "ENDGATHER" | "ENDG" => self.end_gather(desk),
            "DELETEGATHER" | "DELGAT" => {
                (self.gather, self.listing) = (Gather::default(), None);
                Ok(String::new())
            }
            _ => return None,
        })
    }

    fn define_gather(&mut self, size: &str) -> Answer {
        let room = match size {
            "" => MAX_SAMPLES,
            _ => size.parse().map_err(|_| String::from("ERR003: DEFINE GATHER takes a number"))?,
        };
        self.gather = Gather { room: Some(room.clamp(1, MAX_SAMPLES)), ..Gather::default() };
        Ok(String::new())
    }

    /// The sources that I20 selects, by their names, and the period of I19.
    fn gather_sources(&mut self, desk: &mut dyn Desk) -> Result<(Vec<String>, u64), String> {
        if self.controller != Some(Controller::Pmac) {
            return Err("I19 to I45 are known of PMAC only, not of Turbo PMAC".into());
        }
        let variables: Vec<String> =
            (PERIOD..FIRST_SOURCE + SOURCES).map(|number| format!("I{number}")).collect();
        let values = desk.read(&variables)?;
        let of = |number: u32| values.get(&format!("I{number}")).copied().unwrap_or(0.0);
        let mask = of(MASK) as u32;
        let selected = (0..SOURCES).filter(|bit| mask >> bit & 1 != 0);
        let names: Result<Vec<String>, String> =
            selected.map(|bit| source(of(FIRST_SOURCE + bit) as u32)).collect();
        let names = names?;
        if names.is_empty() {
            return Err(String::from(
                "I20 selects no source: bit 0 selects that of I21, and so on",
            ));
        }
        Ok((names, of(PERIOD).max(1.0) as u64))
    }

    fn begin_gather(&mut self, desk: &mut dyn Desk) -> Answer {
        if self.gather.room.is_none() {
            return Err(String::from("ERR003: DEFINE GATHER comes before GATHER"));
        }
        desk.tasks()?;
        let (names, period) = self.gather_sources(desk)?;
        let begun = Some(desk.next_tick());
        let room = self.gather.room;
        self.gather = Gather { room, names, period, begun, ended: None };
        Ok(String::new())
    }

    /// Ends gathering and shows what was gathered on the scope.
    fn end_gather(&mut self, desk: &mut dyn Desk) -> Answer {
        let gather = &mut self.gather;
        let Some(begun) = gather.begun else {
            return Err(String::from("nothing is being gathered"));
        };
        let room = gather.room.unwrap_or(MAX_SAMPLES).saturating_mul(gather.period);
        let ended = *gather.ended.get_or_insert(desk.next_tick().min(begun.saturating_add(room)));
        let names = gather.names.clone();
        if ended > begun {
            desk.show_on_scope(&names, begun, ended - 1)?;
        }
        Ok(format!("ticks {begun} to {}, on the scope", ended.saturating_sub(1)))
    }

    /// `LIST GATHER [start][,length]`: a line a sample, with the values of the sources in the order of I21 to I44. The lines
    /// come as the ticks are run again, a few at a time, so that a long list holds nobody up.
    fn list_gather(&mut self, desk: &mut dyn Desk, range: &str) -> Answer {
        let wrong = || String::from("ERR003: LIST GATHER takes a start and a length");
        let number_of = |text: &str, without: u64| match text {
            "" => Ok(without),
            _ => text.parse::<u64>().map_err(|_| wrong()),
        };
        let (start, length) = range.split_once(',').unwrap_or((range, ""));
        let (start, length) = (number_of(start, 0)?, number_of(length, MAX_SAMPLES)?);
        let Gather { names, period, begun, ended, .. } = self.gather.clone();
        let Some(begun) = begun else { return Err(String::from("nothing was gathered")) };
        let end = ended.unwrap_or(desk.next_tick());
        let ticks = (0..length.min(MAX_SAMPLES))
            .map_while(|sample| {
                let tick = start.checked_add(sample)?.checked_mul(period)?.checked_add(begun)?;
                (tick < end).then_some(tick)
            })
            .collect::<Vec<u64>>();
        self.listing = Some(Listing { names, ticks: ticks.into() });
        Ok(String::new())
    }

    /// Runs further ticks of a list again and gives their lines, until a moment, but at least one of them. `None` if there
    /// are none.
    pub(super) fn continue_listing(
        &mut self,
        until: Instant,
        desk: &mut dyn Desk,
    ) -> Option<Vec<String>> {
        let mut listing = self.listing.take()?;
        let mut lines = vec![];
        while let Some(tick) = listing.ticks.pop_front() {
            let values = match desk.values_after(tick, &listing.names) {
                Ok(values) => values,
                Err(error) => {
                    lines.push(error);
                    return Some(lines);
                }
            };
            let values = values.iter().map(|value| match value.is_nan() {
                true => "?".to_owned(),
                false => number(*value),
            });
            lines.push(values.collect::<Vec<_>>().join(" "));
            if Instant::now() >= until {
                break;
            }
        }
        self.listing = Some(listing).filter(|listing| !listing.ticks.is_empty());
        Some(lines)
    }

    /// `^E`: the present values of the sources.
    pub(super) fn gather_once(&mut self, desk: &mut dyn Desk) -> Answer {
        let (names, _) = self.gather_sources(desk)?;
        let values = desk.read(&names)?;
        let value = |name: &String| values.get(name).map_or_else(|| "?".into(), |v| number(*v));
        Ok(names.iter().map(value).collect::<Vec<_>>().join(" "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_source_is_read_from_its_first_digit() {
        for (address, name) in [
            (0x00_0814, "Y:$814"),
            (0x40_003D, "X:$3D"),
            (0x80_002B, "D:$2B"),
            (0xC0_081F, "L:$81F"),
        ] {
            assert_eq!(source(address).unwrap(), name);
        }
        assert!(source(0x10_0000).is_err());
    }
}
