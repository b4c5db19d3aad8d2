//! Runs a control and the exported program side by side.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use plcc::compile::check;
use plcc::disk::Disk;
use plcc_abi::Dialect;
use plcc_control::ControlArgs;
use plcc_diag::{Diagnostic, SourceMap, render};
use plcc_frontend::common::{Exported, Held, Options};
use plcc_iec::Type;
use plcc_random::Rng;
use plcc_runtime::{Purpose, Setting, Value, VariableKey};

use crate::matiec;

/// How many scans are compared.
const SCANS: usize = 2000;

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
}

/// How a comparison ended.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Compared {
    /// The values were the same after each scan; says after how many the program was stopped.
    Same { stopped: Option<usize> },
    /// The program can't be exported, for these reasons.
    NotExported(Vec<String>),
}

/// Where a variable is among the values of the exported program.
#[derive(Debug, PartialEq, Eq)]
enum Watched {
    Whole(Vec<usize>),
    Bit(usize, i64),
    Bytes(usize, Option<usize>),
}

impl Watched {
    /// Its values.
    fn values(&self, seen: &[String]) -> Vec<String> {
        let number = |at: usize| seen[at].parse::<i64>().unwrap();
        match self {
            Self::Whole(places) => places.iter().map(|&at| seen[at].clone()).collect(),
            Self::Bit(at, weight) => vec![(number(*at) / weight % 2).to_string()],
            Self::Bytes(low, high) => {
                vec![(number(*low) + 256 * high.map_or(0, number)).to_string()]
            }
        }
    }
}

/// The values of a variable as the control has them.
fn flat(value: &Value, into: &mut Vec<String>) {
    match value {
        Value::Array(values) => values.iter().for_each(|value| flat(value, into)),
        Value::Int(value) => into.push(value.to_string()),
        Value::Float(value) => into.push(format!("{value:?}")),
    }
}

/// Whether two numbers are the same.
fn same(a: &str, b: &str) -> bool {
    a == b || a.parse::<f64>().ok().zip(b.parse::<f64>().ok()).is_some_and(|(a, b)| a == b)
}

/// Compares a program that has no errors.
pub(crate) fn compare(rules: &Rules, sources: &[(&str, &str)], seed: u64) -> Option<Compared> {
    let mut map = SourceMap::new();
    let files: Vec<_> =
        sources.iter().map(|(name, text)| map.add(*name, text.as_bytes())).collect();
    compare_files(rules, &mut map, &files, seed, &Options::default())
}

/// The same with sources in a map. `None` where they have errors.
pub(crate) fn compare_files(
    rules: &Rules,
    map: &mut SourceMap,
    files: &[plcc_diag::FileId],
    seed: u64,
    options: &Options,
) -> Option<Compared> {
    let matiec = matiec::folder()?;
    let (checked, found) = check(map, files, rules.dialect, &Disk, options);
    let checked = checked.filter(|_| !found.iter().any(Diagnostic::is_error))?;
    let exported = match checked.program().export("machine", checked.names()).unwrap() {
        Ok(exported) => exported,
        Err(found) => {
            let text = |it: &Diagnostic| render::draw(map, it, false);
            return Some(Compared::NotExported(found.iter().map(text).collect()));
        }
    };
    let source: String = files.iter().map(|&file| map.text(file)).collect();
    let folder = tempfile::tempdir().unwrap();
    let compiled = matiec::compile(&matiec, &exported.project, folder.path());
    let lowered = checked.lower().unwrap();
    let control = plcc_control::executive(
        &lowered.program,
        &ControlArgs::default(),
        false,
        Some(&options.machine),
    );
    let mut executive = control.unwrap();
    let mut engine = checked.interpreter();
    let names = executive.names();

    // Where each place of the exported program stands among the values.
    let number: BTreeMap<&str, usize> =
        compiled.places.iter().enumerate().map(|(at, place)| (place.as_str(), at)).collect();
    let at = |place: &str| number.get(place).copied();
    let mut watched: Vec<(&str, VariableKey, Watched)> = vec![];
    for (name, held) in &exported.names {
        let is_constant = exported.project.variables.iter().any(|variable| {
            variable.kind == plcc_iec::Kind::Constant
                && *held == Held::Variable(variable.name.clone())
        });
        // The control does not show constants.
        if is_constant {
            continue;
        }
        let Ok(key) = names.find(name, Purpose::Watch) else { panic!("{name} is not a name") };
        let places = match held {
            Held::Variable(place) => match at(place) {
                Some(at) => Watched::Whole(vec![at]),
                None => {
                    let element = |element: u32| at(&format!("{place}[{element}]"));
                    Watched::Whole((0..).map_while(element).collect())
                }
            },
            Held::Bit(place, weight) => Watched::Bit(at(place).unwrap(), i64::from(*weight)),
            Held::Bytes(low, high) => {
                Watched::Bytes(at(low).unwrap(), high.as_ref().map(|high| at(high).unwrap()))
            }
        };
        assert!(places != Watched::Whole(vec![]), "{name} is {held:?}, which is not there");
        watched.push((name, key, places));
    }
    let variable = |place: &str| exported.project.variables.iter().find(|it| it.name == place);
    let mut given: Vec<(Type, VariableKey, usize)> = watched
        .iter()
        .filter(|(name, ..)| (rules.is_given)(name))
        .filter_map(|(name, _, places)| {
            let key = names.find(name, Purpose::Stimulus).ok()?;
            let Watched::Whole(places) = places else { return None };
            let [place] = places[..] else { return None };
            Some((variable(&compiled.places[place])?.ty, key, place))
        })
        .collect();
    given.extend(exported.project.variables.iter().filter_map(|variable| {
        let address = variable.address.as_ref().filter(|place| place.starts_with("%I"))?;
        let name = (rules.line)(address);
        let key = names.find(&name, Purpose::Stimulus);
        let key = key.unwrap_or_else(|error| panic!("{name}: {error}"));
        Some((Type::Bool, key, number[variable.name.as_str()]))
    }));

    given.extend(exported.project.variables.iter().filter_map(|variable| {
        let name = (rules.from_control)(&variable.name)?;
        let key = names.find(&name, Purpose::Stimulus);
        let key = key.unwrap_or_else(|error| panic!("{name}: {error}"));
        Some((variable.ty, key, number[variable.name.as_str()]))
    }));

    let mut rng = Rng::new(seed);
    let mut lines = String::new();
    let mut expected: Vec<Vec<Vec<String>>> = vec![];
    let mut stopped = None;
    for scan in 0..SCANS {
        // A few change in each scan.
        for (ty, key, place) in &given {
            if rng.chance(15) {
                let value = value_for(&mut rng, *ty);
                let is_bit = rules.bits_alone && *ty == Type::Dint;
                let value = if is_bit { value & 1 } else { value };
                executive.write(*key, Setting::Int(value));
                let _ = write!(lines, "{place} {value} ");
            }
        }
        lines.push('\n');
        let result = executive.tick(engine.as_mut(), &mut vec![]);
        let values = watched.iter().map(|(_, key, _)| {
            let mut values = vec![];
            flat(&executive.read(*key), &mut values);
            values
        });
        expected.push(values.collect());
        if result.is_err() {
            stopped = Some(scan);
            break;
        }
    }
    let seen = compiled.run(&lines, folder.path());
    assert_eq!(seen.len(), expected.len(), "scans that were run");
    for (scan, (expected, seen)) in expected.iter().zip(&seen).enumerate() {
        for ((name, _, places), values) in watched.iter().zip(expected) {
            if (rules.differs)(name) || stopped == Some(scan) && (rules.is_output)(name, &exported)
            {
                continue;
            }
            let seen = places.values(seen);
            assert_eq!(seen.len(), values.len(), "{name}");
            for (seen, value) in seen.iter().zip(values) {
                assert!(
                    same(seen, value),
                    "seed {seed}, scan {scan}: {name} is {seen}, and {value} in the control\n{source}\n{}",
                    plcc_iec::structured_text(&exported.project)
                );
            }
        }
    }
    Some(Compared::Same { stopped })
}

/// Whether a variable is an output with an address.
pub(crate) fn is_located_output(name: &str, exported: &Exported) -> bool {
    let held = exported.names.iter().find(|(known, _)| known == name).map(|(_, held)| held);
    let Some(Held::Variable(place)) = held else { return false };
    let variable = exported.project.variables.iter().find(|variable| variable.name == *place);
    variable.and_then(|it| it.address.as_ref()).is_some_and(|place| place.starts_with("%Q"))
}

/// A value for a variable: mostly small, sometimes anything of its type.
fn value_for(rng: &mut Rng, ty: Type) -> i64 {
    let bits = rng.bits() as i64;
    let any = !rng.chance(60);
    match ty {
        Type::Bool => bits & 1,
        Type::Usint => bits & 0xFF,
        Type::Int if any => i64::from(bits as i16),
        Type::Uint if any => i64::from(bits as u16),
        Type::Dint | Type::Lint if any => i64::from(bits as i32),
        Type::Lreal if any => i64::from(bits as i16),
        _ => bits.rem_euclid(12),
    }
}
