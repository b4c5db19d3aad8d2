//! A program, as its control runs it and as it is exported.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use plcc::compile::{Checked, check};
use plcc::disk::Disk;
use plcc_abi::Dialect;
use plcc_abi::machine::Machine;
use plcc_control::ControlArgs;
use plcc_diag::{Diagnostic, FileId, SourceMap, render};
use plcc_frontend::common::{Exported, Held, Options};
use plcc_iec::{Kind, Project, Type};
use plcc_runtime::{Executive, Names, Purpose, Setting, Value, VariableKey};

use crate::driver::places;
use crate::feed::{Feed, Given};

/// How many scans are compared.
pub(crate) const SCANS: usize = 2000;

/// What the languages differ in.
pub(crate) struct Rules {
    pub(crate) dialect: Dialect,
    /// Whether a variable is one that something outside the program sets, which is done at random.
    pub(crate) is_given: fn(&str) -> bool,
    /// The control's name of the line of an input, by its address.
    pub(crate) line: fn(&str) -> String,
    /// The control's name of what the NC gives in a variable of the exported program, if it is such a one.
    pub(crate) from_control: fn(&str) -> Option<String>,
    /// Whether a variable is another one in the exported program after a scan, since it stands for something outside.
    pub(crate) differs: fn(&str) -> bool,
    /// Whether variables of 32 bits are given 0 and 1 alone, since each may be a single bit.
    pub(crate) bits_alone: bool,
    /// Whether it is an output, which is off after a stop.
    pub(crate) is_output: fn(&str, &Exported) -> bool,
    /// The code of the diagnostics that say what can't be exported.
    pub(crate) refusal: &'static str,
}

/// Where a variable is among the values of the exported program.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Watched {
    Whole(Vec<usize>),
    Bit(usize, u32),
    Bytes(usize, Option<usize>),
}

/// The value of a variable, or of an element.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Number {
    Int(i64),
    Float(f64),
}

impl Number {
    pub(crate) fn real(self) -> f64 {
        match self {
            Self::Int(value) => value as f64,
            Self::Float(value) => value,
        }
    }

    /// Whether a text says the same.
    fn is(self, text: &str) -> bool {
        match self {
            Self::Int(value) if text.parse() == Ok(value) => true,
            _ => text.parse() == Ok(self.real()),
        }
    }
}

fn flat(value: &Value, into: &mut Vec<Number>) {
    match value {
        Value::Array(values) => values.iter().for_each(|value| flat(value, into)),
        Value::Int(value) => into.push(Number::Int(*value)),
        Value::Float(value) => into.push(Number::Float(*value)),
    }
}

/// A variable that both have.
pub(crate) struct Common {
    pub(crate) name: String,
    pub(crate) watched: Watched,
    key: VariableKey,
    /// Whether it is an output with an address.
    is_output: bool,
}

impl Common {
    /// Whether its values are those of the control, which are `values`; `text` gives the value of each place of the exported
    /// program, or none where it is not known.
    pub(crate) fn compare<'a>(
        &self,
        values: &[Number],
        text: impl Fn(usize) -> Option<&'a str>,
    ) -> Result<(), String> {
        let wrong = |seen: &str, value: Number| {
            format!("{} is {seen}, and {value:?} in the control", self.name)
        };
        let number = |at: usize| text(at)?.parse::<i64>().ok();
        let computed = match &self.watched {
            Watched::Whole(places) => {
                if places.len() != values.len() {
                    return Err(format!("{} has {} values", self.name, places.len()));
                }
                for (&place, &value) in places.iter().zip(values) {
                    let Some(text) = text(place) else { continue };
                    if !value.is(text) {
                        return Err(wrong(text, value));
                    }
                }
                return Ok(());
            }
            Watched::Bit(at, weight) => number(*at).map(|it| it / i64::from(*weight) % 2),
            Watched::Bytes(low, None) => number(*low),
            Watched::Bytes(low, Some(high)) => {
                number(*low).zip(number(*high)).map(|(low, high)| low + 256 * high)
            }
        };
        match (computed, values) {
            (None, _) => Ok(()),
            (Some(seen), [value]) if value.is(&seen.to_string()) => Ok(()),
            (Some(seen), values) => {
                Err(format!("{} is {seen}, and {values:?} in the control", self.name))
            }
        }
    }
}

/// A program.
pub(crate) struct Case {
    pub(crate) rules: &'static Rules,
    checked: Checked,
    machine: Machine,
    exported: Exported,
    pub(crate) source: String,
    /// What it is called in messages.
    pub(crate) label: String,
    seed: u64,
    pub(crate) common: Vec<Common>,
    inputs: Vec<Input>,
}

/// An input that is given at random.
struct Input {
    given: Given,
    key: VariableKey,
    /// Its place among the values of the exported program.
    place: usize,
}

/// What becomes of a source.
pub(crate) enum Made {
    Case(Box<Case>),
    /// It can't be exported, for these reasons.
    NotExported(Vec<String>),
    /// It has errors.
    Wrong,
}

/// What the control has after a scan.
pub(crate) struct Scan<'a> {
    /// From 0.
    pub(crate) number: usize,
    /// Whether the control has stopped in it.
    pub(crate) stopped: bool,
    /// The values of each common variable.
    pub(crate) values: &'a [Vec<Number>],
}

impl Case {
    /// A program of sources in a map.
    pub(crate) fn of(
        rules: &'static Rules,
        map: &mut SourceMap,
        files: &[FileId],
        label: String,
        seed: u64,
        options: &Options,
    ) -> Made {
        let (checked, found) = check(map, files, rules.dialect, &Disk, options);
        let Some(checked) = checked.filter(|_| !found.iter().any(Diagnostic::is_error)) else {
            return Made::Wrong;
        };
        let exported = match checked.program().export("machine", checked.names()).unwrap() {
            Ok(exported) => exported,
            Err(found) => {
                assert!(found.iter().all(|it| it.code == rules.refusal), "{label}: {found:?}");
                let text = |it: &Diagnostic| render::draw(map, it, false);
                return Made::NotExported(found.iter().map(text).collect());
            }
        };
        let source = files.iter().map(|&file| map.text(file)).collect();
        let machine = options.machine.clone();
        let (common, inputs) = (vec![], vec![]);
        let mut this =
            Self { rules, checked, machine, exported, source, label, seed, common, inputs };
        let names = this.executive().names();
        this.common = this.common(names.as_ref());
        this.inputs = this.inputs(names.as_ref());
        Made::Case(Box::new(this))
    }

    pub(crate) fn project(&self) -> &Project {
        &self.exported.project
    }

    /// Gives the exported program another name.
    pub(crate) fn rename(&mut self, name: String) {
        self.exported.project.name = name;
    }

    fn executive(&self) -> Box<dyn Executive + Send> {
        let lowered = self.checked.lower().unwrap();
        let args = ControlArgs::default();
        plcc_control::executive(&lowered.program, &args, false, Some(&self.machine)).unwrap()
    }

    /// The variables of the control that the exported program has too.
    fn common(&self, names: &dyn Names) -> Vec<Common> {
        let variables = &self.exported.project.variables;
        let number: BTreeMap<String, usize> =
            places(self.project()).iter().zip(0..).map(|(place, at)| (place.name(), at)).collect();
        let at = |place: &str| number.get(place).copied();
        let common = self.exported.names.iter().filter_map(|(name, held)| {
            let is_constant = variables.iter().any(|variable| {
                variable.kind == Kind::Constant && *held == Held::Variable(variable.name.clone())
            });
            // The control does not show constants.
            if is_constant || (self.rules.differs)(name) {
                return None;
            }
            let Ok(key) = names.find(name, Purpose::Watch) else { panic!("{name} is not a name") };
            let watched = match held {
                Held::Variable(place) => match at(place) {
                    Some(at) => Watched::Whole(vec![at]),
                    None => {
                        let element = |element: u32| at(&format!("{place}[{element}]"));
                        Watched::Whole((0..).map_while(element).collect())
                    }
                },
                Held::Bit(place, weight) => Watched::Bit(at(place).unwrap(), *weight),
                Held::Bytes(low, high) => {
                    Watched::Bytes(at(low).unwrap(), high.as_ref().map(|high| at(high).unwrap()))
                }
            };
            assert!(watched != Watched::Whole(vec![]), "{name} is {held:?}, which is not there");
            let is_output = (self.rules.is_output)(name, &self.exported);
            Some(Common { name: name.clone(), watched, key, is_output })
        });
        common.collect()
    }

    /// The inputs that are given at random.
    fn inputs(&self, names: &dyn Names) -> Vec<Input> {
        let places = places(self.project());
        let input = |place: usize, key: VariableKey| {
            let variable = places[place].variable;
            let is_bit = self.rules.bits_alone && variable.ty == Type::Dint;
            let given = Given { name: variable.name.clone(), ty: variable.ty, is_bit };
            Input { given, key, place }
        };
        let commons = self.common.iter().filter(|it| (self.rules.is_given)(&it.name));
        let mut inputs: Vec<Input> = commons
            .filter_map(|it| {
                let key = names.find(&it.name, Purpose::Stimulus).ok()?;
                let Watched::Whole(places) = &it.watched else { return None };
                let [place] = places[..] else { return None };
                Some(input(place, key))
            })
            .collect();
        let find = |name: &str| {
            let key = names.find(name, Purpose::Stimulus);
            key.unwrap_or_else(|error| panic!("{name}: {error}"))
        };
        for (at, place) in places.iter().enumerate() {
            let address = place.variable.address.as_ref();
            if let Some(address) = address.filter(|place| place.starts_with("%I")) {
                inputs.push(input(at, find(&(self.rules.line)(address))));
            }
            if let Some(name) = (self.rules.from_control)(&place.variable.name) {
                inputs.push(input(at, find(&name)));
            }
        }
        inputs
    }

    /// The inputs.
    pub(crate) fn given(&self) -> Vec<Given> {
        self.inputs.iter().map(|it| it.given.clone()).collect()
    }

    /// The seed of the inputs.
    pub(crate) fn seed(&self) -> u64 {
        self.seed
    }

    /// The inputs of all scans: a line for each scan, of the numbers of values and the values.
    pub(crate) fn lines(&self) -> String {
        let mut feed = Feed::new(self.seed);
        let mut lines = String::new();
        for _ in 0..SCANS {
            for Input { given, place, .. } in &self.inputs {
                if let Some(value) = feed.value(given) {
                    let _ = write!(lines, "{place} {value} ");
                }
            }
            lines.push('\n');
        }
        lines
    }

    /// Runs the control with these inputs, until it stops.
    pub(crate) fn run(
        &self,
        mut each: impl FnMut(&Scan) -> Result<(), String>,
    ) -> Result<(), String> {
        let mut executive = self.executive();
        let mut engine = self.checked.interpreter();
        let mut feed = Feed::new(self.seed);
        for number in 0..SCANS {
            for Input { given, key, .. } in &self.inputs {
                if let Some(value) = feed.value(given) {
                    executive.write(*key, Setting::Int(value));
                }
            }
            let stopped = executive.tick(engine.as_mut(), &mut vec![]).is_err();
            let values = self.common.iter().map(|common| {
                let mut values = vec![];
                flat(&executive.read(common.key), &mut values);
                values
            });
            let values: Vec<Vec<Number>> = values.collect();
            each(&Scan { number, stopped, values: &values })?;
            if stopped {
                break;
            }
        }
        Ok(())
    }
}

impl Scan<'_> {
    /// Compares the values with those of the exported program; `text` gives the value of each of its places.
    pub(crate) fn compare<'a>(
        &self,
        case: &Case,
        text: impl Fn(usize) -> Option<&'a str>,
    ) -> Result<(), String> {
        for (common, values) in case.common.iter().zip(self.values) {
            if self.stopped && common.is_output {
                continue;
            }
            let compared = common.compare(values, &text);
            compared.map_err(|error| format!("scan {}: {error}", self.number))?;
        }
        Ok(())
    }
}

/// Whether a variable is an output with an address.
pub(crate) fn is_located_output(name: &str, exported: &Exported) -> bool {
    let held = exported.names.iter().find(|(known, _)| known == name).map(|(_, held)| held);
    let Some(Held::Variable(place)) = held else { return false };
    let variable = exported.project.variables.iter().find(|variable| variable.name == *place);
    variable.and_then(|it| it.address.as_ref()).is_some_and(|place| place.starts_with("%Q"))
}
