//! The I-variables of the guide's appendix B and the suggested M-variables of its appendices E
//! and F, as data: for `plcc explain`, for defaults and ranges, and for notes in listings.
//!
//! `ivars.tsv` has a row for a variable or a family of them. Its names are `I5`, `I22..44`,
//! `I8x` (motor x in the last digit), `Ix11` (motor x in the hundreds), `I900+5` (every fifth,
//! one an encoder) and `Isx11` (coordinate system s of a Turbo PMAC: 51 to 59, 60 to 66 in the
//! hundreds). A range is of integers, of reals (`real -2..2`), or `real` for any value. Defaults
//! that differ from motor to motor stand with `/` between them.

use std::fmt::Write;
use std::sync::OnceLock;

use plcc_abi::pmac::Range;

use crate::common::Controller;

const I_TABLE: &str = include_str!("ivars.tsv");
const M_TABLE: &str = include_str!("mvars.tsv");

/// A row of appendix B.
#[derive(Clone, Debug, PartialEq)]
pub struct IVariable {
    /// The name of the variable or its family.
    pub name: &'static str,
    /// What it takes; `None` for any real number.
    pub range: Option<Range>,
    /// Its default, or one for each member of the family.
    pub defaults: Vec<f64>,
    /// Its unit, or `none`.
    pub unit: &'static str,
    /// What it means.
    pub meaning: &'static str,
    pmac: bool,
    turbo: bool,
}

/// A suggested M-variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MVariable {
    /// Its number.
    pub number: u32,
    /// Its definition, as behind `->`.
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

impl IVariable {
    fn parse(line: &'static str) -> Option<Self> {
        let mut columns = line.split('\t');
        let name = columns.next()?;
        let range = parse_range(columns.next()?)?;
        let defaults = columns.next()?.split('/').map(number).collect::<Option<_>>()?;
        let unit = columns.next()?;
        let (pmac, turbo) = match columns.next()? {
            "both" => (true, true),
            "pmac" => (true, false),
            "turbo" => (false, true),
            _ => return None,
        };
        let meaning = columns.next()?;
        columns.next().is_none().then_some(Self {
            name,
            range,
            defaults,
            unit,
            meaning,
            pmac,
            turbo,
        })
    }

    /// The members' numbers on a controller, in the order of the defaults.
    fn members(&self, controller: Controller) -> Vec<u32> {
        let turbo = controller == Controller::Turbo;
        if if turbo { !self.turbo } else { !self.pmac } {
            return Vec::new();
        }
        let name = self.name.get(1..).unwrap_or_default();
        let motors = if turbo { 32 } else { 8 };
        if let Some(tail) = name.strip_prefix("sx") {
            let tail = tail.parse().unwrap_or(0);
            return (1..=16).map(|system| 5000 + 100 * system + tail).collect();
        }
        if let Some(tail) = name.strip_prefix('x') {
            let tail = tail.parse().unwrap_or(0);
            return (1..=motors).map(|motor| 100 * motor + tail).collect();
        }
        if let Some(head) = name.strip_suffix('x') {
            let head: u32 = head.parse().unwrap_or(0);
            return (1..=8).map(|motor| 10 * head + motor).collect();
        }
        if let Some((first, last)) = name.split_once("..") {
            return (first.parse().unwrap_or(0)..=last.parse().unwrap_or(0)).collect();
        }
        if let Some((first, step)) = name.split_once('+') {
            let first: u32 = first.parse().unwrap_or(0);
            let step: u32 = step.parse().unwrap_or(1);
            return (0..16).map(|encoder| first + step * encoder).collect();
        }
        name.parse().into_iter().collect()
    }

    fn default_of(&self, member: usize) -> f64 {
        self.defaults.get(member).or(self.defaults.last()).copied().unwrap_or(0.0)
    }
}

fn number(text: &str) -> Option<f64> {
    match text.strip_prefix('$') {
        Some(hex) => u32::from_str_radix(hex, 16).ok().map(f64::from),
        None => text.parse().ok(),
    }
}

fn parse_range(text: &str) -> Option<Option<Range>> {
    if text == "real" {
        return Some(None);
    }
    if let Some(text) = text.strip_prefix("real ") {
        let (low, high) = text.split_once("..")?;
        return Some(Some(Range::Real(number(low)?, number(high)?)));
    }
    let (low, high) = text.split_once("..")?;
    Some(Some(Range::Integer(number(low)? as i64, number(high)? as i64)))
}

/// All rows, and for each number of a controller its row and its place in the family.
struct Index {
    rows: Vec<IVariable>,
    pmac: Vec<Option<(u16, u16)>>,
    turbo: Vec<Option<(u16, u16)>>,
}

fn index() -> &'static Index {
    static INDEX: OnceLock<Index> = OnceLock::new();
    INDEX.get_or_init(|| {
        let rows: Vec<_> = I_TABLE.lines().skip(1).filter_map(IVariable::parse).collect();
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

/// The row of an I-variable and its place in the family, from 0.
pub fn i_variable(controller: Controller, number: u32) -> Option<(&'static IVariable, usize)> {
    let index = index();
    let numbers = match controller {
        Controller::Pmac => &index.pmac,
        Controller::Turbo => &index.turbo,
    };
    let (row, member) = (*numbers.get(number as usize)?)?;
    Some((index.rows.get(usize::from(row))?, usize::from(member)))
}

/// An I-variable's value before anything is assigned, which `I5=*` brings back.
pub fn i_default(controller: Controller, number: u32) -> f64 {
    i_variable(controller, number).map_or(0.0, |(row, member)| row.default_of(member))
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

fn m_table() -> &'static [MVariable] {
    static ROWS: OnceLock<Vec<MVariable>> = OnceLock::new();
    ROWS.get_or_init(|| {
        let parse = |line: &'static str| {
            let mut columns = line.split('\t');
            let number = columns.next()?.strip_prefix('M')?.parse().ok()?;
            let definition = columns.next()?;
            let meaning = columns.next()?;
            let appendix = columns.next()?;
            columns.next().is_none().then_some(MVariable { number, definition, meaning, appendix })
        };
        M_TABLE.lines().skip(1).filter_map(parse).collect()
    })
}

/// The suggested M-variable of a number.
pub fn m_variable(number: u32) -> Option<&'static MVariable> {
    let rows = m_table();
    let at = rows.binary_search_by_key(&number, |row| row.number).ok()?;
    rows.get(at)
}

/// What `plcc explain I5` and `plcc explain M145` print; also of a family, as `Ix11`.
pub fn explain(name: &str) -> Option<String> {
    let upper = name.trim().to_ascii_uppercase();
    let mut chars = upper.chars();
    let letter = chars.next()?;
    let digits = chars.as_str();
    if letter == 'I' && !digits.is_empty() && !digits.bytes().all(|b| b.is_ascii_digit()) {
        let row = index().rows.iter().find(|row| row.name.eq_ignore_ascii_case(&upper))?;
        return Some(describe(row.name, row, None));
    }
    if letter == 'M'
        && let Some(rest) = digits.strip_prefix('X')
    {
        return motor_family(rest);
    }
    let number: u32 = digits.parse().ok()?;
    match letter {
        'I' => {
            let pmac = i_variable(Controller::Pmac, number);
            let (row, member) = pmac.or_else(|| i_variable(Controller::Turbo, number))?;
            Some(describe(&format!("I{number}"), row, Some(member)))
        }
        'M' => {
            let Some(row) = m_variable(number) else {
                return turbo_motor(number);
            };
            Some(format!(
                "M{number}\n  {}\n  usually M{number}->{}\n  PMAC guide, appendix {}\n",
                row.meaning, row.definition, row.appendix
            ))
        }
        'P' if number < count(Controller::Turbo) => Some(format!(
            "P{number}\n  general variable, the same everywhere, floating point\n  \
             PMAC guide, Computational Features\n"
        )),
        'Q' if number < count(Controller::Turbo) => Some(format!(
            "Q{number}\n  general variable of the addressed coordinate system, floating point{}\n  \
             PMAC guide, Computational Features\n",
            if number == 0 { "; the cosine of ATAN2" } else { "" }
        )),
        _ => None,
    }
}

/// The meaning of an M-variable of motor 1 or its channel, for another motor.
fn for_motor(rest: u32, motor: &str) -> Option<String> {
    let row = m_variable(100 + rest).filter(|row| rest < 100 && row.appendix == "E")?;
    let (what, meaning) = row.meaning.split_once(" 1:")?;
    Some(format!("{what} {motor}:{meaning}"))
}

/// `Mx45`, with the definitions of all motors.
fn motor_family(rest: &str) -> Option<String> {
    let rest = rest.parse().ok().filter(|_| rest.len() == 2)?;
    let meaning = for_motor(rest, "x")?;
    let members = (1..=8).filter_map(|motor| m_variable(100 * motor + rest));
    let definitions: Vec<String> =
        members.map(|row| format!("M{}->{}", row.number, row.definition)).collect();
    Some(format!(
        "Mx{rest:02}\n  {meaning}\n  usually {}\n  PMAC guide, appendix E\n",
        definitions.join(", ")
    ))
}

/// `M3245`: what appendix E suggests for the first eight motors is customary for all 32 of Turbo.
fn turbo_motor(number: u32) -> Option<String> {
    let motor = Some(number / 100).filter(|motor| (9..=32).contains(motor))?;
    let meaning = for_motor(number % 100, &motor.to_string())?;
    Some(format!(
        "M{number} (one of Mx{:02})\n  {meaning}\n  on Turbo PMAC, with a definition of its own\n  \
         PMAC guide, appendix E\n",
        number % 100
    ))
}

fn describe(name: &str, row: &IVariable, member: Option<usize>) -> String {
    let mut text = name.to_string();
    if row.name != name {
        let _ = write!(text, " (one of {})", row.name);
    }
    let _ = write!(text, "\n  {}\n  ", row.meaning);
    let _ = match row.range {
        Some(Range::Integer(low, high)) => write!(text, "integers {low} to {high}, rolls over"),
        Some(Range::Real(low, high)) => write!(text, "{low} to {high}, rolls over"),
        None => write!(text, "floating point"),
    };
    text.push_str(", default ");
    let hex = row.unit.contains("address");
    let show = |value: f64| match hex && value != 0.0 {
        true => format!("${:X}", value as u32),
        false => value.to_string(),
    };
    match member {
        Some(member) => text.push_str(&show(row.default_of(member))),
        None => {
            let all: Vec<_> = row.defaults.iter().map(|value| show(*value)).collect();
            text.push_str(&all.join(", "));
        }
    }
    if row.unit != "none" {
        let _ = write!(text, "\n  unit: {}", row.unit);
    }
    let source = match (row.pmac, row.turbo) {
        (false, _) => "Turbo PMAC only",
        (true, true) => "PMAC guide, appendix B; the same on Turbo PMAC",
        (true, false) => "PMAC guide, appendix B; on Turbo PMAC it may differ",
    };
    let _ = write!(text, "\n  {source}\n");
    text
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
            assert!([1, 8].contains(&row.defaults.len()), "{}", row.name);
            if let Some(range) = row.range {
                for default in &row.defaults {
                    assert_eq!(range.convert(*default), *default, "{}", row.name);
                }
            }
        }
    }

    #[test]
    fn the_suggested_definitions_are_sorted_and_well_formed() {
        let rows = m_table();
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
        // Eight motors of 53 registers each, and appendix F.
        let motors = rows.iter().filter(|row| row.appendix == "E").count();
        assert_eq!(motors % 8, 0);
    }

    #[test]
    fn variables_are_as_appendix_b_says() {
        let pmac = Controller::Pmac;
        for (number, default) in [
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
    fn turbo_has_its_timers() {
        let turbo = Controller::Turbo;
        let timer = Some(Range::Integer(-8_388_608, 8_388_607));
        for number in [5111, 5112, 5911, 6011, 6612] {
            assert_eq!(i_range(turbo, number), timer, "I{number}");
        }
        assert_eq!(i_range(turbo, 6712), None);
        assert_eq!(i_range(Controller::Pmac, 5111), None);
        assert_eq!(i_default(turbo, 3211), 32000.0);
        assert_eq!(i_range(turbo, 5), Some(Range::Integer(0, 3)));
        assert!(ranges(turbo).windows(2).all(|pair| pair[0].0 < pair[1].0));
    }

    #[test]
    fn explains_what_users_ask_for() {
        let text = explain("i5").unwrap();
        assert!(text.contains("which PLCs run") && text.contains("integers 0 to 3"), "{text}");
        let text = explain("I302").unwrap();
        assert!(text.contains("(one of Ix02)") && text.contains("default $C00B"), "{text}");
        assert!(explain("Ix11").unwrap().contains("following error"));
        assert!(explain("I5111").unwrap().contains("Turbo PMAC only"));
        let text = explain("M145").unwrap();
        assert!(
            text.contains("homing is complete") && text.contains("M145->Y:$814,10,1"),
            "{text}"
        );
        let text = explain("mx45").unwrap();
        assert!(text.contains("motor x: homing is complete") && text.contains("M845->"), "{text}");
        let text = explain("M3245").unwrap();
        assert!(text.contains("motor 32: homing is complete") && text.contains("Mx45"), "{text}");
        for name in ["Mx4", "Mx445", "Mx99", "M3299", "M3345", "M950", "Mx"] {
            assert_eq!(explain(name), None, "{name}");
        }
        assert!(explain("Q0").unwrap().contains("ATAN2"));
        for name in ["", "I", "I46", "M1000", "X5", "I99999999999", "PUMP", "Ié"] {
            assert_eq!(explain(name), None, "{name}");
        }
    }
}
