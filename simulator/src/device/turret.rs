//! A turret, or a tool magazine: it turns from station to station and shows which one it is at.

use plcc_abi::machine::simulator::{DeviceKind, Located, TurretCode};

use super::{DeviceState, Line, Surroundings};
use crate::access::Access;
use crate::length::ticks;

#[derive(Clone, Debug)]
enum Code {
    None,
    Number(Line),
    Bits(Vec<Line>),
}

#[derive(Clone, Debug)]
pub(super) struct Turret {
    output: Line,
    reverse: Option<Line>,
    stations: u64,
    /// Ticks from station to station.
    ticks: u64,
    first: u64,
    code: Code,
    strobe: Option<Line>,
}

impl Turret {
    pub(super) fn new(
        entry: &DeviceKind,
        tick_ns: u64,
        access: &mut dyn Access,
    ) -> Result<Self, String> {
        let DeviceKind::Turret { output, reverse, stations, station_time, station, code, strobe } =
            entry
        else {
            return Err("this is not a turret".into());
        };
        let code = match code {
            TurretCode::None => Code::None,
            TurretCode::Number(name) => {
                let line = Line::input(access, name)?;
                if (1..=*stations).any(|number| !access.holds(line.handle(), number.into())) {
                    return Err(too_many(name, *stations));
                }
                Code::Number(line)
            }
            TurretCode::Bits(names) => {
                let last = names.last();
                let lines = names.iter().map(|name| Line::input(access, name));
                let lines = lines.collect::<Result<Vec<_>, _>>()?;
                let room = 1_u64.checked_shl(lines.len() as u32).unwrap_or(u64::MAX);
                if let Some(last) = last.filter(|_| u64::from(*stations) >= room) {
                    return Err(too_many(last, *stations));
                }
                Code::Bits(lines)
            }
        };
        let ticks = ticks(*station_time, tick_ns).max(2);
        Ok(Self {
            output: Line::output(access, output)?,
            reverse: reverse.as_ref().map(|name| Line::output(access, name)).transpose()?,
            stations: u64::from(*stations).max(1),
            ticks,
            first: u64::from(station.saturating_sub(1)) * ticks,
            code,
            strobe: strobe.as_ref().map(|name| Line::input(access, name)).transpose()?,
        })
    }

    /// The angle at power-up.
    pub(super) fn first(&self) -> u64 {
        self.first
    }

    /// What it writes, each with the key of the table that names it.
    pub(super) fn inputs(&self) -> Vec<(&'static str, Option<&Line>)> {
        let code = match &self.code {
            Code::None => &[],
            Code::Number(line) => std::slice::from_ref(line),
            Code::Bits(lines) => lines.as_slice(),
        };
        let code = code.iter().map(|line| ("code", Some(line)));
        code.chain([("strobe", self.strobe.as_ref())]).collect()
    }

    pub(super) fn step(
        &self,
        state: &mut DeviceState,
        around: &Surroundings<'_>,
        access: &mut dyn Access,
    ) {
        let whole = self.stations.saturating_mul(self.ticks).max(1);
        if !state.jammed {
            state.at = match state.coils {
                [true, false] => state.at.saturating_add(1),
                [false, true] => state.at.saturating_add(whole - 1),
                _ => state.at,
            } % whole;
        }
        let reverse = self.reverse.as_ref().is_some_and(|line| line.is_on(around, access));
        state.coils = [self.output.is_on(around, access), reverse];
        let at_station = state.at % self.ticks < (self.ticks / 4).max(1);
        let number = if at_station { (state.at / self.ticks + 1) as i64 } else { 0 };
        match &self.code {
            Code::None => {}
            Code::Number(line) => line.write_number(access, number),
            Code::Bits(lines) => {
                for (bit, line) in lines.iter().enumerate() {
                    line.write(access, number >> bit.min(62) & 1 != 0);
                }
            }
        }
        if let Some(strobe) = &self.strobe {
            strobe.write(access, at_station);
        }
    }
}

fn too_many(name: &Located<String>, stations: u32) -> String {
    let Located { value, line } = name;
    format!("line {line}: `{value}` can't show the numbers of {stations} stations; name more lines")
}
