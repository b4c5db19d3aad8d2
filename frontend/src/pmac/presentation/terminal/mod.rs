//! The PMAC terminal: on-line commands (PMAC quick reference, appendix C) for variables, memory, definitions, PLCs,
//! motors, motion programs and gathering.
//!
//! Commands for motors and motion programs act where these are simulated. Each is given by setting its name ([`Online`]), so that it
//! needs `--allow write`, and is in the record and the log. The answers are the guide's; an error begins with ERRnnn where the
//! guide has a number for it.

mod gather;
mod motion;
mod plcs;

use std::time::Instant;

use plcc_abi::number;
use plcc_abi::pmac::motion::registers::motors as last_motor;
use plcc_abi::pmac::{Controller, Kind, Layout, PmacName};

use super::io::{definition, definition_text};
use super::motors::{self, Motor};
use super::text::opened_plc;
use crate::presentation::{Answer, Desk, Terminal};

/// How many values one command shows.
const MAX_VALUES: u32 = 256;

/// What later commands refer to.
#[derive(Debug)]
pub(in crate::pmac) struct PmacTerminal {
    /// The controller of the program; `None` if the program is not known.
    controller: Option<Controller>,
    /// The motor and the coordinate system that are addressed.
    motor: u32,
    system: u32,
    gather: gather::Gather,
    /// The lines of LIST GATHER that are still to come.
    listing: Option<gather::Listing>,
    /// The last line that was not a control character.
    last: String,
}

impl PmacTerminal {
    pub(in crate::pmac) fn new(controller: Option<Controller>) -> Self {
        let gather = gather::Gather::default();
        Self { controller, motor: 1, system: 1, gather, listing: None, last: String::new() }
    }
}

impl Terminal for PmacTerminal {
    fn answer(&mut self, line: &str, desk: &mut dyn Desk) -> Answer {
        let plain = line.to_uppercase().replace(char::is_whitespace, "");
        if let Some(letter) = plain.strip_prefix('^').filter(|rest| rest.chars().count() == 1) {
            return self.control_character(desk, letter);
        }
        self.last = line.to_owned();
        self.command(desk, line, &plain)
    }

    fn further_lines(&mut self, until: Instant, desk: &mut dyn Desk) -> Option<Vec<String>> {
        self.continue_listing(until, desk)
    }
}

impl PmacTerminal {
    /// A command; `plain` is the same in capitals without spaces.
    fn command(&mut self, desk: &mut dyn Desk, line: &str, plain: &str) -> Answer {
        if plain.is_empty() {
            return Ok(String::new());
        }
        if let Some(answer) = self.address(desk, plain) {
            return answer;
        }
        if plain.contains("->") && !plain.ends_with("->") {
            return Err(String::from(
                "definitions are the program's: change them in the source and build it again, or \
                 have the program execute the definition",
            ));
        }
        if let Some((name, value)) = line.split_once('=').filter(|_| !plain.starts_with('J')) {
            return self.assign(desk, name, value);
        }
        if let Some(name) = plain.strip_suffix("->") {
            return self.definition_of(desk, name);
        }
        if let Some(answer) =
            self.gather_command(desk, plain).or_else(|| self.plc_command(desk, plain))
        {
            return answer;
        }
        if let Some(answer) = self.report(desk, plain) {
            return answer;
        }
        if let Some(reason) = refused(plain) {
            return Err(String::from(reason));
        }
        let listed = plain.strip_prefix("LISTPLCC").map(|number| (true, number));
        if let Some((compiled, number)) =
            listed.or_else(|| plain.strip_prefix("LISTPLC").map(|number| (false, number)))
        {
            return self.list_plc(desk, compiled, number);
        }
        if let Some(rest) =
            plain.strip_prefix('R').filter(|rest| rest.contains([':', '$', 'X', 'Y']))
        {
            return self.read_memory(desk, rest);
        }
        if let Some(answer) = self.motion_commands(desk, plain) {
            return answer;
        }
        let names = self.in_system(range_of(plain)?);
        let values = desk.read(&names)?;
        let mut texts = vec![];
        for name in &names {
            match values.get(name) {
                Some(value) => texts.push(number(*value)),
                None => {
                    return Err(format!("ERR003: {}", desk.unknown(name)));
                }
            }
        }
        Ok(texts.join("\n"))
    }

    /// `#`, `&`, `#2`, `&3`, and such a number before a command: `#2P`. `None` if the line begins with neither.
    fn address(&mut self, desk: &mut dyn Desk, plain: &str) -> Option<Answer> {
        let (is_motor, rest) = match plain.strip_prefix('#') {
            Some(rest) => (true, rest),
            None => (false, plain.strip_prefix('&')?),
        };
        let end = rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len());
        let (digits, command) = rest.split_at_checked(end)?;
        let last = if is_motor { self.last_motor() } else { self.last_system() };
        let slot = if is_motor { &mut self.motor } else { &mut self.system };
        if rest.is_empty() {
            return Some(Ok(slot.to_string()));
        }
        match digits.parse() {
            Ok(number) if (1..=last).contains(&number) => *slot = number,
            _ => {
                let what = if is_motor { "motors" } else { "coordinate systems" };
                return Some(Err(format!("ERR003: the {what} are 1 to {last}")));
            }
        }
        Some(self.command(desk, command, command))
    }

    fn last_motor(&self) -> u32 {
        last_motor(self.controller.unwrap_or_default())
    }

    fn last_system(&self) -> u32 {
        Layout::new(self.controller.unwrap_or_default()).systems()
    }

    /// Q-variables are those of the addressed coordinate system.
    fn in_system(&self, names: Vec<String>) -> Vec<String> {
        let system = self.system;
        let in_system = |name: String| match name.starts_with('Q') && system > 1 {
            true => format!("&{system}{name}"),
            false => name,
        };
        names.into_iter().map(in_system).collect()
    }

    /// `P1=5`, `P1..5=0`, or a name that the program defines.
    fn assign(&mut self, desk: &mut dyn Desk, name: &str, value: &str) -> Answer {
        let plain = name.to_uppercase().replace(char::is_whitespace, "");
        let names = match range_of(&plain) {
            Ok(names) => self.in_system(names),
            Err(_) => vec![name.trim().to_owned()],
        };
        let mut done = vec![];
        for name in &names {
            done.push(desk.set(name, value.trim())?);
        }
        Ok(done.join("\n"))
    }

    /// What reports something of the controller; `None` if the line is not such a command.
    fn report(&mut self, desk: &mut dyn Desk, plain: &str) -> Option<Answer> {
        let (controller, motor, system) = (self.controller, self.motor, self.system);
        let one = |found: Result<Vec<String>, String>| found.map(|lines| lines.join("\n"));
        Some(match plain {
            "P" => self.motor_values(desk, &[motor], |motor| motor.position),
            "V" => self.motor_values(desk, &[motor], |motor| motor.velocity),
            "F" => self.motor_values(desk, &[motor], |motor| motor.following_error),
            "?" => one(motors::motor_statuses(controller, &[motor], &mut |names| desk.read(names))),
            "??" => {
                one(motors::system_statuses(controller, &[system], &mut |names| desk.read(names)))
            }
            "%" => self.time_base(desk),
            "???" => motors::global_status(controller, &mut |names| desk.read(names)),
            "TYPE" => Ok(match self.controller {
                Some(controller) => format!("{controller:?}").to_uppercase(),
                None => "PMAC".into(),
            }),
            "VERSION" | "VER" => Ok(env!("CARGO_PKG_VERSION").into()),
            _ => return None,
        })
    }

    /// A value of each motor, in a row.
    fn motor_values(
        &mut self,
        desk: &mut dyn Desk,
        motors: &[u32],
        value: impl Fn(&Motor) -> f64,
    ) -> Answer {
        let motors = motors::motors(self.controller, motors, &mut |names| desk.read(names))?;
        Ok(motors.iter().map(|motor| number(value(motor))).collect::<Vec<_>>().join(" "))
    }

    /// A control character, by its letter.
    fn control_character(&mut self, desk: &mut dyn Desk, letter: &str) -> Answer {
        let controller = self.controller;
        let all: Vec<u32> = (1..=self.last_motor()).collect();
        let systems: Vec<u32> = (1..=self.last_system()).collect();
        let row = |found: Result<Vec<String>, String>| found.map(|lines| lines.join("\n"));
        match letter {
            "B" => row(motors::motor_statuses(controller, &all, &mut |names| desk.read(names))),
            "C" => {
                row(motors::system_statuses(controller, &systems, &mut |names| desk.read(names)))
            }
            "D" => self.disable_all_plcs(desk),
            "E" => self.gather_once(desk),
            "F" => self.motor_values(desk, &all, |motor| motor.following_error),
            "G" => motors::global_status(controller, &mut |names| desk.read(names)),
            "I" => {
                let line = self.last.clone();
                self.answer(&line, desk)
            }
            "P" => self.motor_values(desk, &all, |motor| motor.position),
            "V" => self.motor_values(desk, &all, |motor| motor.velocity),
            // Each command is answered before the next one is typed.
            "X" => Ok(String::new()),
            "Y" => Ok(self.last.clone()),
            "A" | "K" | "O" | "Q" | "R" | "S" => self.give(desk, &format!("^{letter}")),
            _ => Err(String::from(
                "this character is about the serial line or the dual-ported RAM, which the monitor does not use",
            )),
        }
    }

    fn definition_of(&mut self, desk: &mut dyn Desk, name: &str) -> Answer {
        let own = desk.defined_name(name).unwrap_or_else(|| name.to_owned());
        let number: Option<u32> = own.strip_prefix('M').and_then(|digits| digits.parse().ok());
        let wrong = || format!("ERR003: `{name}` is not an M-variable");
        let number = number.ok_or_else(wrong)?;
        let Some(controller) = self.controller else {
            return Err("without the program its definitions are not known".into());
        };
        let image = desk.image()?;
        Ok(definition_text(definition(&image, &Layout::new(controller), number)))
    }

    fn list_plc(&mut self, desk: &mut dyn Desk, compiled: bool, number: &str) -> Answer {
        if compiled {
            return Err(String::from("ERR003: a PLCC has no text in the control"));
        }
        let wrong = || String::from("ERR003: LIST PLC takes a number from 0 to 31");
        let number: u32 = number.parse().map_err(|_| wrong())?;
        let name = format!("PLC{number}");
        // A program may open the buffer several times; what was downloaded last counts.
        let rows = desk.rows();
        let open = rows.iter().rposition(|row| opened_plc(&row.text()).as_ref() == Some(&name));
        let mut text: Vec<String> = vec![];
        for (at, row) in rows.iter().enumerate().skip(open.unwrap_or(rows.len())) {
            let line = row.text();
            let is_close = has_word(&line, "CLOSE");
            // Statements may stand in the line of OPEN or CLOSE. A line of the preprocessor is not in the buffer.
            let is_within = open != Some(at) && !is_close && !line.trim_start().starts_with('#');
            if is_within || !row.statements.is_empty() {
                text.push(line);
            }
            if is_close {
                break;
            }
        }
        text.push("RETURN".into());
        Ok(text.join("\n"))
    }

    /// `R[H]{address}[,n]`: words of memory.
    fn read_memory(&mut self, desk: &mut dyn Desk, rest: &str) -> Answer {
        let (hexadecimal, rest) = match rest.strip_prefix('H') {
            Some(rest) => (true, rest),
            None => (false, rest),
        };
        let wrong = || String::from("ERR003: memory is read by RX:$address or RHY:$address,n");
        let (address, count) = rest.split_once(',').unwrap_or((rest, "1"));
        let space = address.chars().next().filter(|c| matches!(c, 'X' | 'Y')).ok_or_else(wrong)?;
        let digits = address.get(1..).unwrap_or_default().trim_start_matches(':');
        let first = match digits.strip_prefix('$') {
            Some(digits) => u32::from_str_radix(digits, 16),
            None => digits.parse(),
        };
        let first = first.map_err(|_| wrong())?;
        let count: u32 = count.parse().map_err(|_| wrong())?;
        let last = first.saturating_add(count.clamp(1, MAX_VALUES) - 1);
        let names: Vec<String> =
            (first..=last).map(|address| format!("{space}:${address:X}")).collect();
        let values = desk.read(&names)?;
        let words = names.iter().map(|name| match values.get(name) {
            Some(value) if hexadecimal => format!("{:06X}", *value as i64 & 0xFF_FFFF),
            Some(value) => number(*value),
            None => "?".into(),
        });
        Ok(words.collect::<Vec<_>>().join(" "))
    }
}

/// Why a command is refused that the guide has and this terminal does not; `None` for others.
fn refused(plain: &str) -> Option<&'static str> {
    let begins = |words: &[&str]| words.iter().any(|word| plain.starts_with(word));
    let is = |words: &[&str]| words.contains(&plain);
    if is(&["DATE"]) {
        return Some("there is no firmware with a date; VERSION gives the version of plcc");
    }
    if is(&["SIZE"]) {
        return Some(
            "programs are compiled and need no buffer memory, so there is no free memory to report",
        );
    }
    if is(&["PC", "PE", "PR"]) {
        return Some("&1.PROG and &1.LINE say where motion programs are");
    }
    if begins(&["OPEN", "CLOSE", "CLEAR", "DELETE", "DEL", "UNDEFINE", "UND", "DEFINE", "SAVE"]) {
        return Some(
            "programs and buffers are changed in the source, which is built and swapped in",
        );
    }
    None
}

/// The names of a command that asks for values: `P3`, `P1..5`.
fn range_of(plain: &str) -> Result<Vec<String>, String> {
    let wrong = || {
        format!(
            "`{plain}` can't be given here. The commands are P1 Q1 M1 I1 and ranges as P1..5, M1->, P1=…, \
             RX:$address and RHY:$address,n, LIST PLC n, ENABLE PLC n and the like, #n &n P V F ? ?? ???, \
             J+ J- J/ HM K and other commands for simulated motors, B R A Q for their programs, GATHER and the like, TYPE, VERSION"
        )
    };
    let (first, last) = plain.split_once("..").map_or((plain, None), |(a, b)| (a, Some(b)));
    let layout = Layout::new(Controller::Turbo);
    let Ok(PmacName::Variable(variable)) = PmacName::parse(first, &layout) else {
        return Err(wrong());
    };
    let Some(last) = last else { return Ok(vec![first.to_owned()]) };
    let last: u32 = last.parse().map_err(|_| wrong())?;
    if last < variable.number {
        return Err(wrong());
    }
    let letter = match variable.kind {
        Kind::P => 'P',
        Kind::Q => 'Q',
        Kind::M => 'M',
        Kind::I => 'I',
        Kind::L => 'L',
    };
    let last = last.min(variable.number.saturating_add(MAX_VALUES - 1));
    Ok((variable.number..=last).map(|number| format!("{letter}{number}")).collect())
}

/// Whether a line has a word (in capitals) outside of texts.
fn has_word(line: &str, word: &str) -> bool {
    let outside = line.split('"').step_by(2);
    let mut words = outside.flat_map(|part| part.split(|c: char| !c.is_ascii_alphanumeric()));
    words.any(|found| found.eq_ignore_ascii_case(word))
}
