//! What `plcc explain` prints of PMAC's variables.

use std::fmt::Write;

use super::tables::{IVariable, count, i_variable, i_variables, m_variable, m_variables};
use crate::common::Controller;
use crate::language::Topic;

/// How many motors appendix E suggests M-variables for.
const MOTORS: u32 = 8;

/// How many motors Turbo PMAC has.
const TURBO_MOTORS: u32 = 32;

/// How the meaning of an M-variable begins that belongs to a coordinate system.
const SYSTEM: &str = "coordinate system";

/// What `plcc explain I5` and `plcc explain M145` print; also of a family (`Ix11`, Turbo PMAC's
/// spelling `Ixx11`) and of a range (`M11..18`). Without a controller it tells about both. `None`
/// for what is not a variable with a meaning.
pub fn explain(name: &str, controller: Option<Controller>) -> Option<String> {
    let mut upper: String = name.chars().filter(|c| !c.is_whitespace()).collect();
    upper.make_ascii_uppercase();
    for (twice, once) in [("IXX", "IX"), ("MXX", "MX")] {
        if let Some(rest) = upper.strip_prefix(twice) {
            upper = format!("{once}{rest}");
        }
    }
    if let Some(row) = i_variables().iter().find(|row| row.name.eq_ignore_ascii_case(&upper)) {
        let source = match (row.pmac, row.turbo) {
            (false, _) => "Turbo PMAC only",
            (true, true) => SAME,
            (true, false) => DIFFERS,
        };
        return Some(page(row.name, row, None, source));
    }
    if let Some(rest) = upper.strip_prefix("MX") {
        return motor_family(rest);
    }
    if let Some(rest) = upper.strip_prefix("MSX") {
        return system_family(rest);
    }
    let (letter, rest) = upper.split_at_checked(1)?;
    let letter = letter.chars().next()?;
    if let Some((first, last)) = rest.split_once("..").or_else(|| rest.split_once('-')) {
        let last = last.strip_prefix(letter).unwrap_or(last);
        return range(letter, number(first)?, number(last)?, controller);
    }
    let number = number(rest)?;
    match letter {
        'I' => one_i(number, controller),
        'M' => one_m(number, controller),
        'P' => general_variable(number, controller, |n| {
            format!("P{n}\n  general variable, the same everywhere, floating point")
        }),
        'Q' => general_variable(number, controller, |n| {
            let cosine = if n == 0 { "; the cosine of ATAN2" } else { "" };
            let what = "general variable of the addressed coordinate system, floating point";
            format!("Q{n}\n  {what}{cosine}")
        }),
        'L' => general_variable(number, controller, |n| {
            format!("L{n}\n  integer of 24 bits in PLCCs, where L{n}->X: or Y: defines it")
        }),
        _ => None,
    }
}

/// The I-variables of appendix B, families by their name, and the M-variables of appendices E and
/// F, as topics of `plcc explain`.
pub(crate) fn topics() -> Vec<Topic> {
    let of_i = i_variables().iter().map(|row| (row.name.to_owned(), row.meaning));
    let of_m = m_variables().iter().map(|row| (format!("M{}", row.number), row.meaning));
    of_i.chain(of_m).map(|(name, meaning)| Topic { name, meaning: meaning.to_owned() }).collect()
}

/// The source of a variable that is the same on both controllers.
const SAME: &str = "PMAC guide, appendix B; the same on Turbo PMAC";
/// The source of a variable of PMAC that may differ on Turbo PMAC.
const DIFFERS: &str = "PMAC guide, appendix B; on Turbo PMAC it may differ";

fn number(digits: &str) -> Option<u32> {
    digits.bytes().all(|b| b.is_ascii_digit()).then(|| digits.parse().ok())?
}

/// The page of a P-, Q- or L-variable; `text` gives its beginning.
fn general_variable(
    number: u32,
    controller: Option<Controller>,
    text: impl Fn(u32) -> String,
) -> Option<String> {
    let only_turbo = number >= count(Controller::Pmac);
    if number >= count(controller.unwrap_or(Controller::Turbo)) {
        return None;
    }
    let source = if only_turbo { "Turbo PMAC only" } else { "PMAC guide, Computational Features" };
    Some(format!("{}\n  {source}\n", text(number)))
}

/// The page of an I-variable, with both meanings if it means something else on Turbo PMAC.
fn one_i(number: u32, controller: Option<Controller>) -> Option<String> {
    let on = |of| i_variable(of, number).filter(|_| controller.is_none_or(|asked| asked == of));
    let name = format!("I{number}");
    let tell = |(row, member), source| page(&name, row, Some(member), source);
    let only_turbo = |row: &IVariable| match row.pmac {
        true => "on Turbo PMAC; the PMAC guide, appendix B, has it for its eight motors",
        false => "Turbo PMAC only",
    };
    match (on(Controller::Pmac), on(Controller::Turbo)) {
        (Some(pmac), Some(turbo)) if pmac == turbo => Some(tell(pmac, SAME)),
        (Some(pmac), Some(turbo)) => {
            let source = only_turbo(turbo.0);
            Some(tell(pmac, "PMAC guide, appendix B") + &tell(turbo, source))
        }
        (Some(pmac), None) if pmac.0.turbo => Some(tell(pmac, SAME)),
        (Some(pmac), None) => Some(tell(pmac, DIFFERS)),
        (None, Some(turbo)) if i_variable(Controller::Pmac, number) == Some(turbo) => {
            Some(tell(turbo, SAME))
        }
        (None, Some(turbo)) => Some(tell(turbo, only_turbo(turbo.0))),
        // The guide describes the PMAC alone. For Turbo PMAC its text is given with a warning.
        (None, None) if controller == Some(Controller::Turbo) => {
            Some(tell(i_variable(Controller::Pmac, number)?, DIFFERS))
        }
        (None, None) => None,
    }
}

/// The page of an M-variable.
fn one_m(number: u32, controller: Option<Controller>) -> Option<String> {
    if controller != Some(Controller::Pmac)
        && let Some((meaning, family)) = turbo_m(number)
    {
        return Some(format!(
            "M{number} (one of {family})\n  {meaning}\n  on Turbo PMAC, with a definition of its \
             own\n  PMAC guide, appendix E\n"
        ));
    }
    let row = m_variable(number)?;
    let usually = match controller {
        Some(Controller::Turbo) if row.meaning.starts_with(SYSTEM) => {
            format!("on Turbo PMAC usually M{}, with a definition of its own", number + 5000)
        }
        Some(Controller::Turbo) => "on Turbo PMAC, with a definition of its own".to_string(),
        _ => format!("usually M{number}->{}", row.definition),
    };
    let source = format!("PMAC guide, appendix {}", row.appendix);
    Some(format!("M{number}\n  {}\n  {usually}\n  {source}\n", row.meaning))
}

/// The customary meaning of an M-variable of Turbo PMAC that PMAC does not have, and the name of
/// its family: M901 to M3299 belong to motors 9 to 32, M5180 to M6698 to coordinate systems 1 to
/// 16.
fn turbo_m(number: u32) -> Option<(String, String)> {
    let (hundreds, tail) = (number / 100, number % 100);
    let of_system = m_variable(100 + tail)?.meaning.starts_with(SYSTEM);
    match hundreds {
        9..=TURBO_MOTORS if !of_system => {
            Some((for_motor(tail, &hundreds.to_string())?, format!("Mx{tail:02}")))
        }
        51..=66 if of_system => {
            Some((for_motor(tail, &(hundreds - 50).to_string())?, format!("Msx{tail:02}")))
        }
        _ => None,
    }
}

/// What `M11..18` or `I1..8` prints: a line for each variable of the range that has a meaning.
fn range(letter: char, first: u32, last: u32, controller: Option<Controller>) -> Option<String> {
    let mut text = format!("{letter}{first}..{last}\n");
    let before = text.len();
    for number in first..=last.min(count(Controller::Turbo) - 1) {
        match letter {
            'I' => {
                let pmac = || i_variable(Controller::Pmac, number);
                let turbo = || i_variable(Controller::Turbo, number);
                let found = match controller {
                    Some(Controller::Turbo) => turbo().or_else(pmac),
                    Some(Controller::Pmac) => pmac(),
                    None => pmac().or_else(turbo),
                };
                if let Some((row, member)) = found {
                    let member = Some(member);
                    let (meaning, values) =
                        (meaning_of_member(row, member), accepted_values(row, member));
                    let _ = writeln!(text, "  I{number}: {meaning} ({values})");
                }
            }
            'M' => {
                if let Some(row) = m_variable(number) {
                    let _ = match controller {
                        Some(Controller::Turbo) => writeln!(text, "  M{number}: {}", row.meaning),
                        _ => writeln!(text, "  M{number}->{}: {}", row.definition, row.meaning),
                    };
                }
            }
            _ => return None,
        }
    }
    (text.len() > before).then_some(text)
}

/// The meaning of an M-variable of motor 1 or its channel, for another motor.
fn for_motor(rest: u32, motor: &str) -> Option<String> {
    let row = m_variable(100 + rest).filter(|row| rest < 100 && row.appendix == "E")?;
    // The axes' target positions belong to a coordinate system, not to the number's motor.
    let (what, meaning) = row.meaning.split_once(" 1:").filter(|_| rest != 65)?;
    Some(format!("{what} {motor}:{meaning}"))
}

/// `Mx45`, with the definitions of all motors.
fn motor_family(rest: &str) -> Option<String> {
    let tail = number(rest).filter(|_| rest.len() == 2)?;
    let members: Vec<_> = (1..=MOTORS).filter_map(|motor| m_variable(100 * motor + tail)).collect();
    if members.is_empty() {
        return None;
    }
    let meaning = match tail {
        65 => "coordinate system 1: target position of axis X, Y, Z, A, B, C, U, V".to_string(),
        _ => for_motor(tail, "x")?,
    };
    let definitions: Vec<String> =
        members.iter().map(|row| format!("M{}->{}", row.number, row.definition)).collect();
    Some(format!(
        "Mx{tail:02}\n  {meaning}\n  usually {}\n  PMAC guide, appendix E\n",
        definitions.join(", ")
    ))
}

/// `Msx80`, customary on Turbo PMAC: M5180 to M6680.
fn system_family(rest: &str) -> Option<String> {
    let tail = number(rest).filter(|_| rest.len() == 2)?;
    m_variable(100 + tail).filter(|row| row.meaning.starts_with(SYSTEM) && tail != 65)?;
    let meaning = for_motor(tail, "s")?;
    Some(format!(
        "Msx{tail:02}\n  {meaning}\n  on Turbo PMAC M51{tail:02} to M66{tail:02}, with definitions \
         of its own\n  PMAC guide, appendix E\n"
    ))
}

/// The meaning of an I-variable. Of a member of a family, counted from 0, it has the motor's number
/// (or that of the coordinate system, the encoder, …) in place of the letter.
pub(super) fn meaning_of_member(row: &IVariable, member: Option<usize>) -> String {
    let mut text = row.meaning.to_string();
    let Some(member) = member else { return text };
    for family in ["motor x", "coordinate system x", "coordinate system s", "encoder n", "source n"]
    {
        if let Some(stem) = family.get(..family.len() - 1)
            && text.contains(family)
        {
            text = text.replacen(family, &format!("{stem}{}", member + 1), 1);
        }
    }
    text
}

/// The values that an I-variable accepts, and its default.
pub(super) fn accepted_values(row: &IVariable, member: Option<usize>) -> String {
    let hex = row.unit.contains("address");
    let show = |value: f64| match hex && value != 0.0 {
        true => format!("${:X}", value as u32),
        false => value.to_string(),
    };
    let default = match member {
        Some(member) => show(row.default_of(member)),
        None => {
            let all: Vec<_> = row.defaults.iter().map(|value| show(*value)).collect();
            all.join(", ")
        }
    };
    format!("{}, default {default}", row.values)
}

/// What `plcc explain` prints of an I-variable or a family of them.
fn page(name: &str, row: &IVariable, member: Option<usize>, source: &str) -> String {
    let mut text = name.to_string();
    if row.name != name {
        let _ = write!(text, " (one of {})", row.name);
    }
    let _ =
        write!(text, "\n  {}\n  {}", meaning_of_member(row, member), accepted_values(row, member));
    if row.unit != "none" {
        let _ = write!(text, "\n  unit: {}", row.unit);
    }
    let _ = write!(text, "\n  {source}\n");
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn says(name: &str, controller: Option<Controller>, parts: &[&str]) {
        let text = explain(name, controller).unwrap_or_else(|| panic!("{name} is unknown"));
        for part in parts {
            assert!(text.contains(part), "`{part}` is not in\n{text}");
        }
    }

    #[test]
    fn i_variables_are_explained() {
        says("i5", None, &["which PLCs run", "integers 0 to 3"]);
        says("I302", None, &["(one of Ix02)", "motor 3: address of its DAC", "default $C00B"]);
        says("I302", None, &["integers 0 to $FFFFFF"]);
        says("Ix11", None, &["motor x: following error"]);
        says("I122", None, &["motor 1: jog speed", "positive floating point, default 32"]);
        says("I98", None, &["motor 8: gear ratio"]);
        says("I90", None, &["floating point, not negative, default 0"]);
        says("I22", None, &["(one of I21..44)", "source 2"]);
        says("I687", None, &["coordinate system 6: acceleration time"]);
        says("I905", None, &["encoder 2: how", "default 7"]);
    }

    #[test]
    fn variables_of_one_controller_are_explained_for_it_alone() {
        let (pmac, turbo) = (Some(Controller::Pmac), Some(Controller::Turbo));
        says("I5111", None, &["Turbo PMAC only", "coordinate system 1: PLC timer 1"]);
        says("I6612", turbo, &["coordinate system 16: PLC timer 2"]);
        assert_eq!(explain("I5111", pmac), None);
        // The number belongs to encoder 1 of the one, to motor 9 of the other.
        says("I900", None, &["encoder 1: how", "(one of Ix00)", "motor 9: active"]);
        assert!(!explain("I900", pmac).unwrap().contains("motor"));
        assert!(!explain("I900", turbo).unwrap().contains("encoder"));
        // PMAC has no tenth motor.
        says("I1023", None, &["motor 10: homing speed", "on Turbo PMAC"]);
        assert_eq!(explain("I1023", pmac), None);
        for controller in [None, pmac, turbo] {
            says("I8", controller, &["the same on Turbo PMAC"]);
            says("I13", controller, &["on Turbo PMAC it may differ"]);
        }
        says("P1024", None, &["Turbo PMAC only"]);
        assert_eq!(explain("P1024", pmac), None);
    }

    #[test]
    fn m_variables_are_explained() {
        says("M145", None, &["homing is complete", "M145->Y:$814,10,1"]);
        says("mx45", None, &["motor x: homing is complete", "M845->"]);
        says("M3245", None, &["motor 32: homing is complete", "Mx45"]);
        says("Mx04", None, &["channel x: the encoder's", "M804->X:$727,0,24,S"]);
        says("Mx65", None, &["axis X, Y, Z, A, B, C, U, V", "M265->L:$820"]);
        says("Mxx03", None, &["channel x", "M103->"]);
        says("M5180", None, &["coordinate system 1: a motion program", "on Turbo PMAC"]);
        says("M6698", None, &["coordinate system 16: time base in force"]);
        says("msx80", None, &["coordinate system s: a motion program", "M5180 to M6680"]);
        says("M180", Some(Controller::Turbo), &["usually M5180"]);
        for name in ["M980", "M5145", "M6780", "M5165", "Msx45", "Msx65", "Msx8"] {
            assert_eq!(explain(name, None), None, "{name}");
        }
        // Its memory is not PMAC's.
        let text = explain("M145", Some(Controller::Turbo)).unwrap();
        assert!(!text.contains("$814") && text.contains("homing is complete"), "{text}");
        assert_eq!(explain("M3245", Some(Controller::Pmac)), None);
    }

    #[test]
    fn names_may_be_spelled_in_many_ways() {
        for name in ["I22", "i22", "I022", " I 22 "] {
            says(name, None, &["I22 (one of"]);
        }
        for name in ["Ix22", "IX22", "ixx22"] {
            says(name, None, &["Ix22\n"]);
        }
        for name in ["M11..12", "m11-m12", "M11 .. M12"] {
            let text = "M11..12\n  M11->Y:$FFC2,0,1: machine input 1\n  \
                        M12->Y:$FFC2,1,1: machine input 2\n";
            assert_eq!(explain(name, None).as_deref(), Some(text));
        }
        says("I5..8", None, &["I8: real-time interrupt", "(integers 0 to 255, rolls over"]);
        says("Q0", None, &["ATAN2"]);
        says("L5", None, &["24 bits"]);
    }

    #[test]
    fn what_nobody_gives_a_meaning_is_unknown() {
        for name in ["", "I", "I46", "M1000", "X5", "I99999999999", "PUMP", "Ié", "é1", "I+5"] {
            assert_eq!(explain(name, None), None, "{name}");
        }
        for name in ["Mx4", "Mx445", "Mx99", "M3299", "M3345", "M950", "Mx", "M950..1023"] {
            assert_eq!(explain(name, None), None, "{name}");
        }
        for name in ["M12..11", "M..", "I1..", "P1..5", "M0..4294967296", "M18..x"] {
            assert_eq!(explain(name, None), None, "{name}");
        }
    }
}
