//! The simulated machine. What there is of it, the table of names says (`Names::equipment`), for all controls alike; here the
//! values are read, keys are pressed, and ways in a plane are collected.

use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;
use std::time::{Duration, Instant};

use plcc_frontend::presentation::{PanelDraft, Row};
use plcc_runtime::{
    Class, Equipment, Executive, MachineDevice, MachineKey, MachineKind, MachineProgram, Names,
    Purpose, Reading,
};

use super::Session;
use super::samples::{Samples, values};
use crate::Refusal;
use crate::view::{
    AxisView, DeviceLine, DeviceView, MachineView, PanelCell, PathView, ProgramLine, ProgramView,
    TargetKind,
};

/// How much time a way in a plane shows, in nanoseconds.
const PATH_NS: u64 = 10_000_000_000;
/// How many points a way has at most.
const PATH_POINTS: u64 = 2000;
/// How long ticks are run again for one view.
const PATH_TIME: Duration = Duration::from_millis(30);
/// How long ways are collected after the last view of the machine.
const PATH_WANTED: Duration = Duration::from_secs(3);
/// How many lines of a program are shown in front of the one that is carried out, and after it.
const LINES_AROUND: usize = 4;
/// How long a key is pressed: in ticks, and in nanoseconds where those are short (as in a stimulus).
const PRESS_TICKS: u64 = 5;
const PRESS_NS: u64 = 100_000_000;
/// The value that presses a key and lets it go.
pub(super) const PRESS: &str = "press";

/// When a key is let go that was pressed.
#[derive(Debug)]
struct Pressed {
    name: String,
    /// The tick, of a program that is run here.
    tick: u64,
    /// The moment, of a control.
    at: Instant,
}

/// What is known of the machine.
#[derive(Debug, Default)]
pub(super) struct MachineState {
    /// What there is; empty where nothing is simulated.
    equipment: Rc<Equipment>,
    /// The variables of the program.
    declared: Rc<BTreeSet<String>>,
    /// The variables of the ways, and their values.
    paths: Vec<String>,
    samples: Samples,
    /// When the machine was shown last.
    shown_at: Option<Instant>,
    pressed: Vec<Pressed>,
}

impl MachineState {
    pub(super) fn new(names: &dyn Names) -> Self {
        let mut equipment = names.equipment();
        let declared: BTreeSet<String> =
            names.declared().into_iter().map(|(name, _)| name).collect();
        equipment.keys.retain(|key| key.sets.as_ref().is_none_or(|name| declared.contains(name)));
        let paths = equipment.paths.iter().flat_map(|path| path.axes.clone()).collect();
        let (equipment, declared) = (Rc::new(equipment), Rc::new(declared));
        Self { equipment, declared, paths, ..Self::default() }
    }

    /// Whether a machine is simulated.
    pub(super) fn exists(&self) -> bool {
        !self.equipment.is_empty()
    }

    fn is_shown(&self) -> bool {
        self.shown_at.is_some_and(|at| at.elapsed() < PATH_WANTED)
    }

    /// Takes the values after a tick that was run, if it is the next one.
    pub(super) fn take(&mut self, tick: u64, tick_ns: u64, executive: &mut dyn Executive) {
        if self.is_shown() && !self.samples.is_empty() && tick == self.samples.end() {
            self.samples.push(values(&self.paths, executive), path_ticks(tick_ns));
        }
    }
}

/// How many ticks a way has.
fn path_ticks(tick_ns: u64) -> u64 {
    (PATH_NS / tick_ns.max(1)).max(1)
}

impl Session<'_> {
    pub(super) fn machine_view(&mut self) -> Result<MachineView, Refusal> {
        if !self.machine.exists() {
            return Err(Refusal::new(no_machine()));
        }
        self.machine.shown_at = Some(Instant::now());
        let equipment = Rc::clone(&self.machine.equipment);
        let declared = Rc::clone(&self.machine.declared);
        let names = self.debugger()?.history_mut().executive().names();
        let program = self.debugger()?.program().shared();
        let drafts = program.panels(&[], &mut |names| self.read_values(names));
        let drafts = drafts.map_err(Refusal::new)?;
        let keys = &equipment.keys;
        let lights = Lights::new(&drafts, keys, &declared);
        let wanted: Vec<String> = names_of(&equipment).into_iter().chain(lights.names()).collect();
        let moment = self.read(&wanted)?;
        let value = |name: &str| moment.values.get(name).copied();
        let past = self.is_past();
        let of = |reading: &Reading| reading.value(value);
        let axes = equipment.axes.iter().filter(|axis| {
            axis.active.as_ref().is_none_or(|name| value(name).is_some_and(|on| on != 0.0))
        });
        let axes = axes.map(|axis| AxisView {
            name: axis.name.clone(),
            unit: axis.unit.into(),
            actual: of(&axis.actual),
            commanded: axis.commanded.as_ref().and_then(of),
            error: axis.error.as_ref().and_then(of),
            travel: axis.travel,
        });
        let axes = axes.collect();
        let devices = equipment.devices.iter().map(|it| device(it, &value, past)).collect();
        let is_number = |name: &str| {
            let found = names.find(name, Purpose::Watch);
            found.is_ok_and(|found| names.properties(found).class != Class::Logical)
        };
        let keys = keys.iter().map(|key| key_cell(key, &lights, &value, &is_number, past));
        let keys = keys.collect();
        let programs = equipment.programs.iter().map(|it| self.program_view(it, &value)).collect();
        let lamps = lights.alone.iter().map(|(label, name)| PanelCell {
            label: label.clone(),
            light: value(name).map(|value| value != 0.0),
            ..PanelCell::default()
        });
        let lamps = lamps.collect();
        let text = moment.text.clone();
        let paths = self.paths(&equipment)?;
        Ok(MachineView { moment: text, axes, devices, keys, lamps, programs, paths })
    }

    fn program_view(
        &self,
        program: &MachineProgram,
        value: &dyn Fn(&str) -> Option<f64>,
    ) -> ProgramView {
        let line = value(&program.line);
        let of = |name: &Option<String>| value(name.as_ref()?);
        let (number, base) = (of(&program.number), of(&program.base));
        let at = line.map(|line| line.abs() as usize).filter(|at| *at > 0);
        let lines = match line {
            // An entered block.
            Some(line) if line < 0.0 => lines_around(&program.entries, at),
            _ if program.text.is_empty() => at.map_or(vec![], |at| self.lines_around(at)),
            _ => lines_around(&program.text, at),
        };
        ProgramView { name: program.name.clone(), number, base, line, lines }
    }

    /// The lines of the monitored program around the one with a number.
    fn lines_around(&self, number: usize) -> Vec<ProgramLine> {
        let rows = &self.text.rows;
        let number_of = |row: &Row| row.number.parse::<u32>().ok();
        let is_it = |row: &Row| number_of(row).is_some_and(|own| own as usize == number);
        let Some(at) = rows.iter().position(is_it) else { return vec![] };
        let (before, from) = rows.split_at(at);
        let before: Vec<&Row> =
            before.iter().rev().filter(|row| number_of(row).is_some()).take(LINES_AROUND).collect();
        let all = before.into_iter().rev().chain(from);
        let line = |row: &Row| {
            let number = number_of(row)?;
            Some(ProgramLine {
                number,
                text: row.text().trim_end().to_owned(),
                current: is_it(row),
            })
        };
        all.filter_map(line).take(2 * LINES_AROUND + 1).collect()
    }

    /// The ways up to the tick that is shown, as far as its ticks could be run again.
    fn paths(&mut self, equipment: &Equipment) -> Result<Vec<PathView>, Refusal> {
        if equipment.paths.is_empty() || self.time.run_until == 0 {
            return Ok(vec![]);
        }
        let most = path_ticks(self.debugger()?.tick_ns());
        let last = self.time.shown;
        let history_first = self.debugger()?.history().first();
        let first = (last + 1).saturating_sub(most).max(history_first).max(self.first());
        let (samples, following) = (&self.machine.samples, self.time.following);
        // While the newest ticks are followed, a way begins with the newest one and grows with them: others can be run again no
        // faster than they come.
        let is_wrong = match following {
            true => samples.end() + most / 10 < last,
            false => samples.first > first,
        };
        if is_wrong || samples.end() < first || samples.is_empty() {
            self.machine.samples = Samples::from(if following { last } else { first });
        }
        let until = Instant::now() + PATH_TIME;
        while self.machine.samples.end() <= last && Instant::now() < until {
            if !self.run_again(self.machine.samples.end()) {
                break;
            }
            if let Some(debugger) = &mut self.debugger {
                let row = values(&self.machine.paths, debugger.history_mut().executive());
                self.machine.samples.push(row, most);
            }
        }
        let samples = &self.machine.samples;
        let (first, end) = (first.max(samples.first), samples.end().min(last + 1));
        let count = end.saturating_sub(first);
        let step = count.div_ceil(PATH_POINTS).max(1) as usize;
        let paths = equipment.paths.iter().enumerate().map(|(at, path)| {
            let point =
                |tick| Some([samples.value(tick, 2 * at)?, samples.value(tick, 2 * at + 1)?]);
            let ticks = (first..end).step_by(step).chain(end.checked_sub(1).filter(|_| count > 0));
            let mut points: Vec<[f64; 2]> = ticks.filter_map(point).collect();
            points.dedup();
            PathView { name: path.name.clone(), points, ticks: (first, end.saturating_sub(1)) }
        });
        Ok(paths.collect())
    }

    /// Presses a key, and lets it go a moment later.
    pub(super) fn press(&mut self, name: &str) -> Result<u64, Refusal> {
        let tick = self.act(name, Some("1"), false)?;
        let tick_ns = self.debugger()?.tick_ns().max(1);
        let ticks = PRESS_TICKS.max(PRESS_NS.div_ceil(tick_ns));
        self.machine.pressed.retain(|pressed| pressed.name != name);
        self.machine.pressed.push(Pressed {
            name: name.to_owned(),
            tick: tick + ticks,
            at: Instant::now() + Duration::from_nanos(tick_ns.saturating_mul(ticks)),
        });
        Ok(tick)
    }

    /// Lets keys go whose time has come.
    pub(super) fn let_keys_go(&mut self) {
        let is_program = self.kind == TargetKind::Program;
        let run_until = self.time.run_until;
        let is_due = |pressed: &Pressed| match is_program {
            true => run_until >= pressed.tick,
            false => Instant::now() >= pressed.at,
        };
        let (due, waits): (Vec<_>, Vec<_>) =
            std::mem::take(&mut self.machine.pressed).into_iter().partition(is_due);
        self.machine.pressed = waits;
        for Pressed { name, .. } in due {
            if let Err(refusal) = self.act(&name, Some("0"), false) {
                self.time.note = Some(format!("{name} stays pressed: {}", refusal.message));
            }
        }
    }
}

/// The lines of a text around the one with a number, which is counted from 1; the first ones without.
fn lines_around(text: &[String], number: Option<usize>) -> Vec<ProgramLine> {
    let current = number.map(|number| number - 1).filter(|at| *at < text.len());
    let first = current.unwrap_or(0).saturating_sub(LINES_AROUND);
    let lines = text.iter().enumerate().skip(first).take(2 * LINES_AROUND + 1);
    let line = |(at, text): (usize, &String)| ProgramLine {
        number: at as u32 + 1,
        text: text.clone(),
        current: Some(at) == current,
    };
    lines.map(line).collect()
}

/// Why there is no machine.
pub(crate) fn no_machine() -> String {
    "no machine is simulated here: start the control, or the monitor's program, with --simulate"
        .into()
}

/// The lamps of panels: those of a key by the key's variable, and others with their labels.
struct Lights {
    by_button: BTreeMap<String, String>,
    alone: Vec<(String, String)>,
}

impl Lights {
    fn new(drafts: &[PanelDraft], keys: &[MachineKey], declared: &BTreeSet<String>) -> Self {
        let mut lights = Self { by_button: BTreeMap::new(), alone: vec![] };
        let is_key = |button: &String| keys.iter().any(|key| key.sets.as_ref() == Some(button));
        for cell in drafts.iter().flat_map(|draft| &draft.cells) {
            let Some(light) = cell.light.clone().filter(|light| declared.contains(light)) else {
                continue;
            };
            match &cell.button {
                Some(button) if is_key(button) => {
                    lights.by_button.entry(button.clone()).or_insert(light);
                }
                _ if lights.alone.iter().all(|(_, known)| *known != light) => {
                    lights.alone.push((cell.label.clone(), light));
                }
                _ => {}
            }
        }
        lights
    }

    fn names(&self) -> impl Iterator<Item = String> + use<'_> {
        self.by_button.values().chain(self.alone.iter().map(|(_, light)| light)).cloned()
    }
}

/// A name of a line without the sign of inversion.
fn plain(name: &str) -> &str {
    name.strip_prefix('!').unwrap_or(name).trim()
}

/// The variables whose values are shown.
fn names_of(equipment: &Equipment) -> Vec<String> {
    let mut names: Vec<String> = vec![];
    for axis in &equipment.axes {
        let readings = [Some(&axis.actual), axis.commanded.as_ref(), axis.error.as_ref()];
        names.extend(readings.into_iter().flatten().flat_map(|reading| reading.names.clone()));
        names.extend(axis.active.clone());
    }
    for device in &equipment.devices {
        names.push(device.at.clone());
        names.extend(device.lines.iter().map(|(_, name)| plain(name).to_owned()));
    }
    for key in &equipment.keys {
        names.extend(key.sets.clone());
        names.extend(key.selections.iter().map(|name| (*name).to_owned()));
    }
    for program in &equipment.programs {
        names.push(program.line.clone());
        names.extend([&program.number, &program.base].into_iter().flatten().cloned());
    }
    names
}

fn device(device: &MachineDevice, value: &dyn Fn(&str) -> Option<f64>, past: bool) -> DeviceView {
    let at = value(&device.at);
    let whole = match device.kind {
        MachineKind::Relay | MachineKind::Switch => 1.0,
        MachineKind::Cylinder | MachineKind::Pump { .. } => 1000.0,
        MachineKind::Turret { stations, step } => f64::from(stations) * step as f64,
    };
    let text = at.map_or_else(|| "?".into(), |at| state_of(device.kind, at));
    let lines = device.lines.iter().map(|(role, name)| DeviceLine {
        role: (*role).into(),
        name: name.clone(),
        value: value(plain(name)),
    });
    DeviceView {
        name: device.name.clone(),
        kind: device.kind.name().into(),
        part: at.map(|at| (at / whole).clamp(0.0, 1.0)),
        text,
        stations: match device.kind {
            MachineKind::Turret { stations, .. } => Some(stations),
            _ => None,
        },
        lines: lines.collect(),
        jam: (!past).then(|| device.jam.clone()),
    }
}

/// Where a small machine is, in words.
fn state_of(kind: MachineKind, at: f64) -> String {
    match kind {
        MachineKind::Relay if at != 0.0 => "closed".into(),
        MachineKind::Relay => "open".into(),
        MachineKind::Switch if at != 0.0 => "pressed".into(),
        MachineKind::Switch => "not pressed".into(),
        MachineKind::Cylinder if at >= 1000.0 => "extended".into(),
        MachineKind::Cylinder if at <= 0.0 => "retracted".into(),
        MachineKind::Cylinder | MachineKind::Pump { .. } => format!("{:.0} %", at / 10.0),
        MachineKind::Turret { stations, step } => {
            let step = step.max(1) as f64;
            let station = (at / step).floor();
            let next = (station as u32 + 1) % stations.max(1) + 1;
            // A station is the first quarter of the way to the next one (cnc-side 4.4).
            match at - station * step < (step / 4.0).floor().max(1.0) {
                true => format!("station {}", station + 1.0),
                false => format!("between {} and {next}", station + 1.0),
            }
        }
    }
}

fn key_cell(
    key: &MachineKey,
    lights: &Lights,
    value: &dyn Fn(&str) -> Option<f64>,
    is_number: &dyn Fn(&str) -> bool,
    past: bool,
) -> PanelCell {
    let name = format!("KEY.{}", key.name);
    let sets = key.sets.as_deref();
    let takes_number = sets.is_some_and(is_number);
    let is_on = |name: &str| value(name).is_some_and(|value| value != 0.0);
    let counts = key.selections.is_empty() || key.selections.iter().any(|flag| is_on(flag));
    let light = sets.and_then(|sets| lights.by_button.get(sets));
    PanelCell {
        label: key.name.clone(),
        value: sets.filter(|_| takes_number).and_then(value).map(plcc_runtime::value::number),
        light: light.map(|light| is_on(light)),
        pressed: sets.filter(|_| !takes_number).map(is_on),
        variable: (!past && sets.is_some()).then(|| name.clone()),
        dim: past || !counts,
        command: (!past && !takes_number).then(|| (name, PRESS.to_owned())),
    }
}
