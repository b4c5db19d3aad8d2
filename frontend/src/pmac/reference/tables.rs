//! The I-variables of the guide's appendix B and the suggested M-variables of its appendices E
//! and F, as data: for `plcc explain`, for defaults and ranges, and for comments in listings.
//!
//! `ivars.tsv` has a row for a variable or a family of them. Its names are `I5`, `I22..44`,
//! `I8x` (motor x in the last digit), `Ix11` (motor x in the hundreds), `I900+5` (every fifth,
//! one an encoder) and `Isx11` (coordinate system s of a Turbo PMAC: 51 to 59, 60 to 66 in the
//! hundreds). A range is of integers, of reals (`real -2..2`), or `real` for any value; `real >0`
//! and `real >=0` say what the variable is meant for, and take any value too. Defaults that differ
//! from motor to motor are written with `/` between them. The controller is `both` where Turbo PMAC's
//! variable is the same.

use std::sync::OnceLock;

use plcc_abi::pmac::Range;

use crate::common::tsv::{self, Row, TsvError};
use crate::common::{Controller, natural_cmp};

const I_TABLE: &str = include_str!("ivars.tsv");
const M_TABLE: &str = include_str!("mvars.tsv");
const I_COLUMNS: &[&str] = &["name", "range", "default", "unit", "controller", "meaning"];
const M_COLUMNS: &[&str] = &["number", "definition", "meaning", "appendix"];

/// A row of appendix B.
#[derive(Clone, Debug, PartialEq)]
pub struct IVariable {
    /// The name of the variable or its family.
    pub name: &'static str,
    family: Family,
    /// The range of its values; `None` for any real number.
    pub range: Option<Range>,
    /// The values that it is meant to have, in words.
    pub values: String,
    /// One default for all members of the family, or one for each.
    pub defaults: Vec<f64>,
    /// Its unit, or `none`.
    pub unit: &'static str,
    /// What it means.
    pub meaning: &'static str,
    /// Whether PMAC has it.
    pub pmac: bool,
    /// Whether Turbo PMAC has it, with the same range, default and meaning.
    pub turbo: bool,
}

/// A suggested M-variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MVariable {
    /// Its number.
    pub number: u32,
    /// Its definition, as after `->`.
    pub definition: &'static str,
    /// What it means.
    pub meaning: &'static str,
    /// The appendix that suggests it.
    pub appendix: &'static str,
}

/// How many variables of each kind a controller has.
pub fn count(controller: Controller) -> u32 {
    match controller {
        Controller::Pmac => 1024,
        Controller::Turbo => 8192,
    }
}

/// Which variables a row is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Family {
    /// `I5`.
    One(u32),
    /// `I22..44`.
    Range(u32, u32),
    /// `I8x`: eight motors in the last digit.
    MotorInUnits(u32),
    /// `Ix11`, `Ixx11`: the controller's motors in the hundreds.
    MotorInHundreds(u32),
    /// `Isx11`: sixteen coordinate systems of a Turbo PMAC, from 5100 on.
    SystemInHundreds(u32),
    /// `I900+5`: sixteen encoders, this far apart.
    Encoders(u32, u32),
}

impl Family {
    /// The family of a name, such as `Ix11`; `None` if it is not such a name.
    fn of(name: &str) -> Option<Self> {
        let name = name.strip_prefix('I')?;
        let number = |digits: &str| digits.parse().ok();
        if let Some(tail) = name.strip_prefix("sx") {
            return Some(Self::SystemInHundreds(number(tail)?));
        }
        if let Some(tail) = name.strip_prefix("xx").or_else(|| name.strip_prefix('x')) {
            return Some(Self::MotorInHundreds(number(tail)?));
        }
        if let Some(head) = name.strip_suffix('x') {
            return Some(Self::MotorInUnits(number(head)?));
        }
        if let Some((first, last)) = name.split_once("..") {
            return Some(Self::Range(number(first)?, number(last)?));
        }
        if let Some((first, step)) = name.split_once('+') {
            return Some(Self::Encoders(number(first)?, number(step)?));
        }
        Some(Self::One(number(name)?))
    }

    /// The members' numbers on a controller, in the order of the defaults.
    fn members(self, controller: Controller) -> Vec<u32> {
        let motors = if controller == Controller::Turbo { 32 } else { 8 };
        match self {
            Self::One(number) => vec![number],
            Self::Range(first, last) => (first..=last).collect(),
            Self::MotorInUnits(head) => (1..=8).map(|motor| 10 * head + motor).collect(),
            Self::MotorInHundreds(tail) => (1..=motors).map(|motor| 100 * motor + tail).collect(),
            Self::SystemInHundreds(tail) => {
                (1..=16).map(|system| 5000 + 100 * system + tail).collect()
            }
            Self::Encoders(first, step) => (0..16).map(|encoder| first + step * encoder).collect(),
        }
    }
}

impl IVariable {
    /// A row of `ivars.tsv`.
    fn parse(row: &Row<'static>) -> Result<Self, TsvError> {
        let name = row.text("name")?;
        let family = Family::of(name)
            .ok_or_else(|| row.error("name", format!("`{name}` names no I-variables")))?;
        let range_text = row.text("range")?;
        let range = parse_range(range_text)
            .ok_or_else(|| row.error("range", format!("`{range_text}` is not a range")))?;
        let defaults = row.text("default")?;
        let defaults = defaults.split('/').map(number).collect::<Option<Vec<f64>>>();
        let defaults = defaults.ok_or_else(|| row.error("default", "a default is not a number"))?;
        let controllers =
            [("both", (true, true)), ("pmac", (true, false)), ("turbo", (false, true))];
        let (pmac, turbo) = row.word("controller", &controllers)?;
        Ok(Self {
            name,
            family,
            range,
            values: in_words(range_text, range),
            defaults,
            unit: row.text("unit")?,
            meaning: row.text("meaning")?,
            pmac,
            turbo,
        })
    }

    /// The members' numbers on a controller, in the order of the defaults.
    fn members(&self, controller: Controller) -> Vec<u32> {
        let has = match controller {
            Controller::Pmac => self.pmac,
            Controller::Turbo => self.turbo,
        };
        if has { self.family.members(controller) } else { Vec::new() }
    }

    /// The default of a member of the family; members are counted from 0.
    pub fn default_of(&self, member: usize) -> f64 {
        self.defaults.get(member).or(self.defaults.last()).copied().unwrap_or(0.0)
    }
}

fn number(text: &str) -> Option<f64> {
    match text.strip_prefix('$') {
        Some(hex) => u32::from_str_radix(hex, 16).ok().map(f64::from),
        None => text.parse().ok(),
    }
}

/// The range of a row; `Some(None)` for any real number, `None` for a text that is not a range.
fn parse_range(text: &str) -> Option<Option<Range>> {
    if ["real", "real >0", "real >=0"].contains(&text) {
        return Some(None);
    }
    if let Some(text) = text.strip_prefix("real ") {
        let (low, high) = text.split_once("..")?;
        return Some(Some(Range::Real(number(low)?, number(high)?)));
    }
    let (low, high) = text.split_once("..")?;
    Some(Some(Range::Integer(number(low)? as i64, number(high)? as i64)))
}

/// A range of the table in words.
fn in_words(text: &str, range: Option<Range>) -> String {
    match range {
        Some(Range::Integer(low, high)) if text.contains('$') => {
            format!("integers {low} to ${high:X}, rolls over")
        }
        Some(Range::Integer(low, high)) => format!("integers {low} to {high}, rolls over"),
        Some(Range::Real(low, high)) => format!("floating point {low} to {high}, rolls over"),
        None if text.ends_with(">0") => "positive floating point".to_string(),
        None if text.ends_with(">=0") => "floating point, not negative".to_string(),
        None => "floating point".to_string(),
    }
}

/// All rows, and for each number of a controller its row and its place in the family.
struct Index {
    rows: Vec<IVariable>,
    pmac: Vec<Option<(u16, u16)>>,
    turbo: Vec<Option<(u16, u16)>>,
}

/// The I-variables, which are read from the table at the first call.
fn index() -> &'static Index {
    static INDEX: OnceLock<Index> = OnceLock::new();
    INDEX.get_or_init(|| {
        let rows = tsv::rows("ivars.tsv", I_TABLE, I_COLUMNS);
        let rows: Result<Vec<_>, _> = rows.map(|row| IVariable::parse(&row?)).collect();
        let rows = tsv::built_in(rows);
        let numbers = |controller| {
            let mut numbers = vec![None; count(controller) as usize];
            for (row, variable) in rows.iter().enumerate() {
                for (member, number) in variable.members(controller).into_iter().enumerate() {
                    if let Some(slot) = numbers.get_mut(number as usize) {
                        *slot = Some((row as u16, member as u16));
                    }
                }
            }
            numbers
        };
        let (pmac, turbo) = (numbers(Controller::Pmac), numbers(Controller::Turbo));
        Index { rows, pmac, turbo }
    })
}

/// The row of an I-variable and its place in the family, counted from 0. `None` for a number that
/// appendix B does not describe for the controller.
pub fn i_variable(controller: Controller, number: u32) -> Option<(&'static IVariable, usize)> {
    let index = index();
    let numbers = match controller {
        Controller::Pmac => &index.pmac,
        Controller::Turbo => &index.turbo,
    };
    let (row, member) = (*numbers.get(number as usize)?)?;
    Some((index.rows.get(usize::from(row))?, usize::from(member)))
}

/// An I-variable's default: its value before anything is assigned, which `I5=*` restores. It is
/// appendix B's, below I900 on Turbo PMAC too; from there on Turbo PMAC has motors where PMAC has
/// encoders and the MACRO ring. Variables that are not described have the default 0.
pub fn i_default(controller: Controller, number: u32) -> f64 {
    let guide = || i_variable(Controller::Pmac, number).filter(|_| number < 900);
    let row = i_variable(controller, number).or_else(guide);
    row.map_or(0.0, |(row, member)| row.default_of(member))
}

/// An I-variable's range; `None` for any real number.
pub fn i_range(controller: Controller, number: u32) -> Option<Range> {
    i_variable(controller, number)?.0.range
}

/// The ranges of all I-variables that have one, by rising number.
pub fn ranges(controller: Controller) -> Vec<(u32, Range)> {
    (0..count(controller))
        .filter_map(|number| Some((number, i_range(controller, number)?)))
        .collect()
}

/// All rows of appendix B.
pub fn i_variables() -> &'static [IVariable] {
    &index().rows
}

/// All suggested M-variables, by rising number.
pub fn m_variables() -> &'static [MVariable] {
    static ROWS: OnceLock<Vec<MVariable>> = OnceLock::new();
    ROWS.get_or_init(|| {
        tsv::built_in(tsv::load("mvars.tsv", M_TABLE, M_COLUMNS, natural_cmp, |row| {
            let name = row.text("number")?;
            let number = name.strip_prefix('M').and_then(|digits| digits.parse().ok());
            Ok(MVariable {
                number: number.ok_or_else(|| row.error("number", "no M and number"))?,
                definition: row.text("definition")?,
                meaning: row.text("meaning")?,
                appendix: row.word("appendix", &[("E", "E"), ("F", "F")])?,
            })
        }))
    })
}

/// The suggested M-variable of a number.
pub fn m_variable(number: u32) -> Option<&'static MVariable> {
    let rows = m_variables();
    let at = rows.binary_search_by_key(&number, |row| row.number).ok()?;
    rows.get(at)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_row_parses_and_no_number_stands_twice() {
        assert_eq!(index().rows.len(), I_TABLE.lines().count() - 1);
        for controller in [Controller::Pmac, Controller::Turbo] {
            let mut numbers: Vec<u32> =
                index().rows.iter().flat_map(|row| row.members(controller)).collect();
            let all = numbers.len();
            numbers.sort_unstable();
            numbers.dedup();
            assert_eq!(numbers.len(), all, "{controller:?}");
            assert!(numbers.iter().all(|number| *number < count(controller)));
        }
        for row in &index().rows {
            assert!(!row.meaning.is_empty() && !row.unit.is_empty());
            let members =
                row.members(Controller::Pmac).len().max(row.members(Controller::Turbo).len());
            assert!(members > 0, "{}", row.name);
            assert!([1, 8, 16].contains(&row.defaults.len()), "{}", row.name);
            if let Some(range) = row.range {
                for default in &row.defaults {
                    assert_eq!(range.convert(*default), *default, "{}", row.name);
                }
            }
        }
    }

    #[test]
    fn the_suggested_definitions_are_sorted_and_well_formed() {
        let rows = m_variables();
        assert_eq!(rows.len(), M_TABLE.lines().count() - 1);
        assert!(rows.windows(2).all(|pair| pair[0].number < pair[1].number));
        for row in rows {
            let (space, rest) = row.definition.split_once(":$").unwrap();
            let mut parts = rest.split(',');
            assert!(u32::from_str_radix(parts.next().unwrap(), 16).unwrap() <= 0xFFFF);
            let fields = parts.count();
            match space {
                "X" | "Y" => assert!((2..=3).contains(&fields), "M{}", row.number),
                "D" | "L" => assert_eq!(fields, 0, "M{}", row.number),
                other => panic!("{other}"),
            }
        }
        // Eight motors of 59 registers each, and appendix F.
        let of = |appendix| rows.iter().filter(|row| row.appendix == appendix).count();
        assert_eq!((of("E"), of("F")), (8 * 59, 102));
    }

    #[test]
    fn motors_have_their_registers_at_equal_distances() {
        let address = |row: &MVariable| {
            let digits = row.definition.split(['$', ',']).nth(1).unwrap();
            u32::from_str_radix(digits, 16).unwrap()
        };
        let field = |row: &MVariable| row.definition.split_once(',').map(|(_, field)| field);
        let axes = [0x81F, 0x820, 0x821, 0x819, 0x81A, 0x81B, 0x81C, 0x81D];
        for first in m_variables().iter().filter(|row| row.number / 100 == 1) {
            for motor in 0..8 {
                let row = m_variable(first.number + 100 * motor).unwrap();
                let start = address(first);
                let expected = match first.number {
                    // Two channels share an integrated circuit.
                    102 => start + motor / 2 * 8 - motor % 2,
                    105 => start + motor / 2 * 8 + motor % 2,
                    104 => start + motor,
                    165 => axes[motor as usize],
                    101..=123 => start + 4 * motor,
                    _ if start < 0x700 => start + 0x3C * motor,
                    _ => start + 0xC0 * motor,
                };
                assert_eq!(address(row), expected, "M{}", row.number);
                assert_eq!(row.definition[..2], first.definition[..2], "M{}", row.number);
                assert_eq!(field(row), field(first), "M{}", row.number);
                let number = (motor + 1).to_string();
                if first.number != 165 {
                    let meaning = first.meaning.replacen('1', &number, 1);
                    assert_eq!(row.meaning, meaning, "M{}", row.number);
                }
            }
        }
    }

    #[test]
    fn variables_are_as_appendix_b_says() {
        let pmac = Controller::Pmac;
        for (number, default) in [
            (3, 1.0),
            (5, 0.0),
            (8, 2.0),
            (10, 3_713_707.0),
            (11, 0.0),
            (100, 1.0),
            (200, 0.0),
            (102, f64::from(0xC003)),
            (803, f64::from(0x727)),
            (115, 0.25),
            (189, 1000.0),
            (89, 0.998_48),
            (900, 7.0),
            (975, 7.0),
            (977, 1.0),
            (22, 0.0),
            (700, 0.0),
            (1023, 0.0),
        ] {
            assert_eq!(i_default(pmac, number), default, "I{number}");
        }
        assert_eq!(i_range(pmac, 3), Some(Range::Integer(0, 3)));
        assert_eq!(i_range(pmac, 44), Some(Range::Integer(0, 0xFF_FFFF)));
        assert_eq!(i_range(pmac, 736), Some(Range::Real(-2.0, 2.0)));
        assert_eq!(i_range(pmac, 116), None);
        assert_eq!(i_range(pmac, 46), None);
        assert_eq!(i_range(pmac, 9999), None);
    }

    #[test]
    fn a_name_that_is_no_family_is_refused() {
        assert_eq!(Family::of("I22..44"), Some(Family::Range(22, 44)));
        for name in ["5", "I", "Ix", "I8y", "I1..", "I900+", "Isx", "Ixx"] {
            assert_eq!(Family::of(name), None, "{name}");
        }
    }

    #[test]
    fn turbo_has_its_timers() {
        let turbo = Controller::Turbo;
        let timer = Some(Range::Integer(-8_388_608, 8_388_607));
        for number in [5111, 5112, 5911, 6011, 6612] {
            assert_eq!(i_range(turbo, number), timer, "I{number}");
        }
        assert_eq!(i_range(turbo, 6712), None);
        assert_eq!(i_range(Controller::Pmac, 5111), None);
        let defaults =
            [(3211, 32000.0), (121, 50.0), (921, 0.0), (900, 0.0), (902, 0.0), (12, 10.0)];
        for (number, default) in defaults {
            assert_eq!(i_default(turbo, number), default, "I{number}");
        }
        // Other values are usual there.
        assert_eq!(i_range(turbo, 172), None);
        assert_eq!(i_range(turbo, 5), Some(Range::Integer(0, 3)));
        assert!(ranges(turbo).windows(2).all(|pair| pair[0].0 < pair[1].0));
    }
}
