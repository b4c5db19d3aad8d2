//! What a run of the simulator is made from: the table with its defaults, and the part program.

use plcc_abi::machine::simulator::{
    AxisEntry, Decimal, Located, SimulatorTable, SpindleEntry, Units,
};
use plcc_abi::pmi::DeclaredCode;
use plcc_abi::{Dialect, Program, Tables};
use plcc_diag::{Diagnostic, FileId, SourceMap};

use crate::history::MAX_LAG;
use crate::length::{MAX_TICKS, nanometres, unit, unit_of_axis};
use crate::part_program::{Block, PartProgram, read_entry, read_part_program};

/// How many axes a control has at most.
const MAX_AXES: [usize; 2] = [32, 8];
/// How many auxiliary axes a PMI control has at most.
const MAX_AUX: usize = 6;
/// The block that can be entered where the table names none (cnc-side 1.24).
const FIRST_ENTRY: &str = "M3 S500";
/// Nanoseconds of a millisecond.
const MS: u64 = 1_000_000;

/// What is needed to read a part program: which words the control of a program takes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Rules {
    pub(crate) dialect: Dialect,
    pub(crate) is_inch: bool,
    /// Nanometres of a unit.
    pub(crate) unit: i128,
    /// The letters of the axes, in their order.
    pub(crate) letters: Vec<Option<char>>,
    /// Where the axes stand at power-up, in nanometres.
    pub(crate) starts: Vec<i128>,
    /// Where their reference points are.
    pub(crate) homes: Vec<i128>,
    /// The letters of A, B and C that are functions.
    pub(crate) misc: String,
    /// How many auxiliary axes there are.
    pub(crate) aux: usize,
    /// The M and G codes that the program declares.
    pub(crate) codes: Vec<DeclaredCode>,
    units: Units,
}

impl Rules {
    /// The rules of the control of a program, with a table.
    pub fn new(table: &SimulatorTable, program: &Program) -> Self {
        let dialect = program.dialect();
        let standard = if dialect == Dialect::Pmi { Units::Inch } else { Units::Millimetre };
        let units = table.units.unwrap_or(standard);
        let codes = match &program.tables {
            Tables::Pmi(tables) => tables.codes.clone(),
            _ => vec![],
        };
        let letters = match table.axes.as_slice() {
            [] => vec![Some('X'), Some('Y'), Some('Z')],
            axes => axes.iter().map(|axis| axis.name.as_ref().map(|name| name.value)).collect(),
        };
        let lengths = |of: fn(&AxisEntry) -> Option<Decimal>| {
            let number = |at: usize| table.axes.get(at).and_then(of).unwrap_or(Decimal::whole(0));
            let named = letters.iter().enumerate();
            named.map(|(at, name)| nanometres(number(at), unit_of_axis(units, *name))).collect()
        };
        Self {
            starts: lengths(|axis| axis.start),
            homes: lengths(|axis| axis.home),
            dialect,
            is_inch: units == Units::Inch,
            unit: unit(units),
            letters,
            misc: table.misc.as_ref().map_or_else(String::new, |misc| misc.value.clone()),
            aux: if dialect == Dialect::Pmi { table.aux.len() } else { 0 },
            codes,
            units,
        }
    }

    /// Nanometres of the unit of an axis.
    pub(crate) fn unit_of(&self, axis: usize) -> i128 {
        unit_of_axis(self.units, self.letters.get(axis).copied().flatten())
    }
}

/// An axis, with its defaults; lengths are nanometres, speeds nanometres a minute.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Axis {
    pub(crate) name: Option<char>,
    /// Nanometres of its unit.
    pub(crate) unit: i128,
    /// Counts a unit.
    pub(crate) counts: i64,
    pub(crate) start: i128,
    /// Where its reference point is.
    pub(crate) home: i128,
    /// The limits of its travel (PMI).
    pub(crate) limits: [i128; 2],
    pub(crate) rapid: i128,
    /// High, medium and low speed by hand.
    pub(crate) jog: [i128; 3],
    /// The speed and the direction of the search for the reference point, and whether a switch shows it (NCT).
    pub(crate) reference_speed: i128,
    pub(crate) reference_positive: bool,
    pub(crate) reference_by_switch: bool,
}

/// A spindle, with its defaults.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Spindle {
    pub(crate) rpm: i64,
    pub(crate) min: i64,
    pub(crate) ramp_ns: u64,
    pub(crate) lag_ns: u64,
    /// How long orientation takes (NCT).
    pub(crate) orient_ns: u64,
    pub(crate) encoder: bool,
}

/// Everything that a run of the simulator is made from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Setup {
    pub(crate) rules: Rules,
    pub(crate) table: SimulatorTable,
    pub(crate) axes: Vec<Axis>,
    pub(crate) spindles: [Spindle; 2],
    pub(crate) entries: Vec<Block>,
    /// The part program, if there is one.
    pub(crate) program: Option<PartProgram>,
    /// Its lines, to be shown.
    pub(crate) part_text: Vec<String>,
    pub(crate) lag_ns: u64,
    pub(crate) stop_ns: u64,
    pub(crate) home_ns: u64,
    pub(crate) machine_on_ns: u64,
    pub(crate) chop_ns: u64,
    pub(crate) feed_max: i128,
    pub(crate) in_position: i64,
    /// Whether parameter 1204 of an NCT control is above 0, and its value.
    pub(crate) rapid_override: Option<i64>,
}

impl Setup {
    /// The setup of a program with a table and the values of the control's NC parameters, for ticks of `tick_ns`
    /// nanoseconds.
    ///
    /// # Errors
    /// What of the table does not fit this control, with its line where it has one.
    pub fn new(
        table: &SimulatorTable,
        program: &Program,
        parameters: &[(u16, i64)],
        tick_ns: u64,
    ) -> Result<Self, String> {
        let rules = Rules::new(table, program);
        let is_pmi = rules.dialect == Dialect::Pmi;
        let [pmi, nct] = MAX_AXES;
        let most = if is_pmi { pmi } else { nct };
        if rules.letters.len() > most {
            let line = table.axes.get(most).map_or(0, |axis| axis.line);
            return Err(format!("line {line}: this control has {most} axes at most"));
        }
        if table.aux.len() > MAX_AUX {
            return Err(format!("there are {MAX_AUX} entries [[simulator.aux]] at most"));
        }
        let lags = table.spindles.iter().map(|spindle| spindle.lag);
        for lag in lags.chain([table.lag]).flatten() {
            if lag / tick_ns.max(1) > MAX_LAG {
                return Err(format!("lag_ms is more than {MAX_LAG} ticks"));
            }
        }
        let default = AxisEntry::default();
        let number = |axis: usize| table.axes.get(axis).unwrap_or(&default);
        let axes = (0..rules.letters.len()).map(|at| Self::axis(&rules, at, number(at))).collect();
        let entries = match &table.blocks {
            None => vec![read_entry(&rules, FIRST_ENTRY).unwrap_or_default()],
            Some(blocks) if rules.dialect == Dialect::Nct => {
                let read = |Located { value, line }: &Located<String>| {
                    read_entry(&rules, value).map_err(|why| format!("line {line}: {why}"))
                };
                blocks.iter().map(read).collect::<Result<_, _>>()?
            }
            Some(_) => vec![],
        };
        let entries = (1..).zip(entries).map(|(line, block)| Block { line, ..block }).collect();
        let feed_max = table.feed_max.unwrap_or(Decimal::whole(6000));
        let rapid_override = parameters.iter().rfind(|(number, _)| *number == 1204);
        Ok(Self {
            spindles: table.spindles.each_ref().map(|entry| Self::spindle_of(is_pmi, entry)),
            axes,
            entries,
            program: None,
            part_text: vec![],
            lag_ns: table.lag.unwrap_or(40 * MS),
            stop_ns: table.stop.unwrap_or(100 * MS),
            home_ns: table.home.unwrap_or(1000 * MS),
            chop_ns: table.chop.unwrap_or(200 * MS),
            machine_on_ns: table.machine_on.unwrap_or(2000 * MS),
            feed_max: nanometres(feed_max, rules.unit),
            in_position: table.in_position.unwrap_or(10),
            rapid_override: rapid_override.map(|(_, value)| *value).filter(|value| *value > 0),
            table: table.clone(),
            rules,
        })
    }

    fn axis(rules: &Rules, at: usize, entry: &AxisEntry) -> Axis {
        let is_pmi = rules.dialect == Dialect::Pmi;
        let unit = rules.unit_of(at);
        let length = |number: Option<Decimal>, default: i128| {
            nanometres(number.unwrap_or(Decimal::whole(default)), unit)
        };
        Axis {
            name: rules.letters.get(at).copied().flatten(),
            unit,
            counts: entry.counts.unwrap_or(if is_pmi { 10_000 } else { 1000 }),
            start: length(entry.start, 0),
            home: length(entry.home, 0),
            limits: [length(entry.min, -20), length(entry.max, 20)],
            jog: match entry.jog {
                Some(speeds) => speeds.map(|speed| nanometres(speed, unit)),
                None if is_pmi => [300, 60, 15].map(|speed| speed * unit),
                None => [3000 * unit; 3],
            },
            reference_speed: length(entry.reference_speed, 1500),
            reference_positive: entry.reference_positive.unwrap_or(true),
            reference_by_switch: entry.reference_by_switch.unwrap_or(false),
            rapid: length(entry.rapid, if is_pmi { 300 } else { 9000 }).max(1),
        }
    }

    fn spindle_of(is_pmi: bool, entry: &SpindleEntry) -> Spindle {
        Spindle {
            rpm: entry.rpm.unwrap_or(if is_pmi { 5500 } else { 6000 }),
            min: entry.min.unwrap_or(0),
            ramp_ns: entry.ramp.unwrap_or(2000 * MS).min(MAX_TICKS * MS),
            lag_ns: entry.lag.unwrap_or(100 * MS),
            orient_ns: entry.orient.unwrap_or(500 * MS),
            encoder: entry.encoder.unwrap_or(true),
        }
    }

    /// The spindle with this number, 0 or 1.
    pub(crate) fn spindle(&self, number: usize) -> &Spindle {
        let [first, second] = &self.spindles;
        if number == 0 { first } else { second }
    }

    /// The blocks that can be entered, as they are written.
    pub(crate) fn entry_texts(&self) -> Vec<String> {
        let named = self.table.blocks.iter().flatten().map(|block| block.value.clone());
        let named: Vec<String> = named.collect();
        match (self.rules.dialect, &self.table.blocks) {
            (Dialect::Nct, None) => vec![FIRST_ENTRY.to_owned()],
            (Dialect::Nct, Some(_)) => named,
            _ => vec![],
        }
    }

    /// The name of the part program that the table has.
    pub fn named_part_program(table: &SimulatorTable) -> Option<&str> {
        table.part_program.as_ref().map(|name| name.value.as_str())
    }

    /// Reads the part program. With an error in it nothing can be run.
    pub fn read_part_program(&mut self, sources: &SourceMap, file: FileId) -> Vec<Diagnostic> {
        let (program, diagnostics) = read_part_program(&self.rules, sources, file);
        self.program = Some(program);
        let lines = sources.text(file).lines();
        self.part_text =
            lines.map(|line| plcc_abi::printable(line).trim_end().to_owned()).collect();
        diagnostics
    }
}
