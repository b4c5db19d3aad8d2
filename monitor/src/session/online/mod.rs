//! The PMAC terminal: on-line commands (PMAC quick reference, appendix C) for variables, memory, definitions, PLCs,
//! motors' registers and gathering.
//!
//! Commands for motors and motion programs are refused with the reason: plcc runs the PLC programs of a PMAC, and no servo. Its
//! answers are the guide's; an error begins with ERRnnn where the guide has a number for it.

mod gather;
mod motion;
mod plcs;

use plcc_abi::image::read_u64;
use plcc_abi::pmac::{Controller, Definition, Field, Format, Kind, Layout, PmacName};
use plcc_abi::{Dialect, Tables};
use plcc_runtime::value::number;

use super::Session;
use super::tasks::opened_plc;
use crate::view::{TerminalLine, TerminalView};
use crate::{Refusal, Reply};

/// How many values one command shows.
const MAX_VALUES: u32 = 256;
/// How many lines the terminal keeps.
const MAX_LINES: usize = 1000;

/// What a command answers.
type Answer = Result<String, Refusal>;

pub(super) use motion::{MOTORS, Motor};

/// What was typed and answered, and what later commands refer to.
#[derive(Debug)]
pub(super) struct OnlineState {
    lines: Vec<TerminalLine>,
    /// The motor and the coordinate system that are addressed.
    motor: u32,
    system: u32,
    gather: gather::Gather,
    /// The lines of LIST GATHER that are still to come.
    listing: Option<gather::Listing>,
    /// The last line that was no control character.
    last: String,
}

impl Default for OnlineState {
    fn default() -> Self {
        let (gather, last) = (gather::Gather::default(), String::new());
        Self { lines: vec![], motor: 1, system: 1, gather, listing: None, last }
    }
}

impl OnlineState {
    fn add(&mut self, typed: bool, text: &str) {
        self.lines.extend(text.lines().map(|line| TerminalLine { typed, text: line.into() }));
        let over = self.lines.len().saturating_sub(MAX_LINES);
        self.lines.drain(..over);
    }
}

impl Session<'_> {
    pub(super) fn terminal_view(&mut self) -> Result<TerminalView, Refusal> {
        self.require_pmac()?;
        Ok(TerminalView { lines: self.online.lines.clone() })
    }

    fn require_pmac(&self) -> Result<(), Refusal> {
        match self.dialect() {
            Some(Dialect::Pmac) | None => Ok(()),
            Some(_) => Err(Refusal::new("only a PMAC has a terminal")),
        }
    }

    pub(super) fn online(&mut self, line: &str) -> Result<Reply, Refusal> {
        self.require_pmac()?;
        self.online.add(true, line);
        let answer = self.answer(line.trim());
        match &answer {
            Ok(text) => self.online.add(false, text),
            Err(refusal) => self.online.add(false, &refusal.message),
        }
        answer.map(|text| Reply { message: None, text: Some(text) })
    }

    fn answer(&mut self, line: &str) -> Answer {
        let plain = line.to_uppercase().replace(char::is_whitespace, "");
        if let Some(letter) = plain.strip_prefix('^').filter(|rest| rest.chars().count() == 1) {
            return self.control_character(letter);
        }
        self.online.last = line.to_owned();
        self.command(line, &plain)
    }

    /// A command; `plain` is the same in capitals without spaces.
    fn command(&mut self, line: &str, plain: &str) -> Answer {
        if plain.is_empty() {
            return Ok(String::new());
        }
        if let Some(answer) = self.address(plain) {
            return answer;
        }
        if plain.contains("->") && !plain.ends_with("->") {
            return Err(Refusal::new(
                "definitions are the program's: change them in the source and build it again, or \
                 have the program execute the definition",
            ));
        }
        if let Some((name, value)) = line.split_once('=').filter(|_| !plain.starts_with('J')) {
            return self.assign(name, value);
        }
        if let Some(name) = plain.strip_suffix("->") {
            return self.definition_of(name);
        }
        if let Some(answer) = self.gather_command(plain).or_else(|| self.plc_command(plain)) {
            return answer;
        }
        if let Some(answer) = self.report(plain) {
            return answer;
        }
        if let Some(reason) = refused(plain) {
            return Err(Refusal::new(reason));
        }
        let listed = plain.strip_prefix("LISTPLCC").map(|number| (true, number));
        if let Some((compiled, number)) =
            listed.or_else(|| plain.strip_prefix("LISTPLC").map(|number| (false, number)))
        {
            return self.list_plc(compiled, number);
        }
        if let Some(rest) =
            plain.strip_prefix('R').filter(|rest| rest.contains([':', '$', 'X', 'Y']))
        {
            return self.read_memory(rest);
        }
        let names = self.in_system(range_of(plain)?);
        let moment = self.read(&names)?;
        let mut texts = vec![];
        for name in &names {
            match moment.values.get(name) {
                Some(value) => texts.push(number(*value)),
                None => {
                    return Err(Refusal::new(format!("ERR003: {}", self.unknown(name).message)));
                }
            }
        }
        Ok(texts.join("\n"))
    }

    /// `#`, `&`, `#2`, `&3`, and such a number before a command: `#2P`. `None` if the line begins with neither.
    fn address(&mut self, plain: &str) -> Option<Answer> {
        let (is_motor, rest) = match plain.strip_prefix('#') {
            Some(rest) => (true, rest),
            None => (false, plain.strip_prefix('&')?),
        };
        let end = rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len());
        let (digits, command) = rest.split_at_checked(end)?;
        let slot = if is_motor { &mut self.online.motor } else { &mut self.online.system };
        if rest.is_empty() {
            return Some(Ok(slot.to_string()));
        }
        match digits.parse() {
            Ok(number @ 1..=MOTORS) => *slot = number,
            _ => {
                let what = if is_motor { "motors" } else { "coordinate systems" };
                return Some(Err(Refusal::new(format!("ERR003: the {what} are 1 to {MOTORS}"))));
            }
        }
        Some(self.command(command, command))
    }

    /// Q-variables are those of the addressed coordinate system.
    fn in_system(&self, names: Vec<String>) -> Vec<String> {
        let system = self.online.system;
        let in_system = |name: String| match name.starts_with('Q') && system > 1 {
            true => format!("&{system}{name}"),
            false => name,
        };
        names.into_iter().map(in_system).collect()
    }

    /// `P1=5`, `P1..5=0`, or a name that the program defines.
    fn assign(&mut self, name: &str, value: &str) -> Answer {
        let plain = name.to_uppercase().replace(char::is_whitespace, "");
        let names = match range_of(&plain) {
            Ok(names) => self.in_system(names),
            Err(_) => vec![name.trim().to_owned()],
        };
        let mut done = vec![];
        for name in &names {
            done.push(self.change(name, value.trim())?.message.unwrap_or_default());
        }
        Ok(done.join("\n"))
    }

    /// What reports something of the controller; `None` if the line is no such command.
    fn report(&mut self, plain: &str) -> Option<Answer> {
        let (motor, system) = (self.online.motor, self.online.system);
        let one = |found: Result<Vec<String>, Refusal>| found.map(|lines| lines.join("\n"));
        Some(match plain {
            "P" => self.motor_values(&[motor], |motor| motor.position),
            "V" => self.motor_values(&[motor], |motor| motor.velocity),
            "F" => self.motor_values(&[motor], |motor| motor.following_error),
            "?" => one(self.motor_statuses(&[motor])),
            "??" => one(self.system_statuses(&[system])),
            "???" => self.global_status(),
            "TYPE" => Ok(match self.tables() {
                Some(Tables::Pmac(tables)) => format!("{:?}", tables.controller).to_uppercase(),
                _ => "PMAC".into(),
            }),
            "VERSION" | "VER" => Ok(env!("CARGO_PKG_VERSION").into()),
            _ => return None,
        })
    }

    /// A value of each motor, in a row.
    fn motor_values(&mut self, motors: &[u32], value: impl Fn(&Motor) -> f64) -> Answer {
        let motors = self.motors(motors)?;
        Ok(motors.iter().map(|motor| number(value(motor))).collect::<Vec<_>>().join(" "))
    }

    /// A control character, by its letter.
    fn control_character(&mut self, letter: &str) -> Answer {
        let all: Vec<u32> = (1..=MOTORS).collect();
        let row = |found: Result<Vec<String>, Refusal>| found.map(|lines| lines.join("\n"));
        match letter {
            "B" => row(self.motor_statuses(&all)),
            "C" => row(self.system_statuses(&all)),
            "D" => self.disable_all_plcs(),
            "E" => self.gather_once(),
            "F" => self.motor_values(&all, |motor| motor.following_error),
            "G" => self.global_status(),
            "I" => {
                let line = self.online.last.clone();
                self.answer(&line)
            }
            "P" => self.motor_values(&all, |motor| motor.position),
            "V" => self.motor_values(&all, |motor| motor.velocity),
            // Each command is answered before the next one is typed.
            "X" => Ok(String::new()),
            "Y" => Ok(self.online.last.clone()),
            "A" | "K" | "O" | "Q" | "R" | "S" | "L" | "U" => Err(Refusal::new(NO_MOTION)),
            _ => Err(Refusal::new(
                "this character is about the serial line or the dual-ported RAM, which the monitor does not use",
            )),
        }
    }

    fn definition_of(&mut self, name: &str) -> Result<String, Refusal> {
        let own = self.defined_name(name).unwrap_or_else(|| name.to_owned());
        let number: Option<u32> = own.strip_prefix('M').and_then(|digits| digits.parse().ok());
        let wrong = || Refusal::new(format!("ERR003: `{name}` is no M-variable"));
        let number = number.ok_or_else(wrong)?;
        let Some(Tables::Pmac(tables)) = self.tables() else {
            return Err(Refusal::new("without the program its definitions are not known"));
        };
        let controller = tables.controller;
        let image = self.debugger()?.history_mut().executive().image();
        Ok(definition_text(definition(image, controller, number)))
    }

    fn list_plc(&mut self, compiled: bool, number: &str) -> Result<String, Refusal> {
        if compiled {
            return Err(Refusal::new("ERR003: a PLCC has no text in the control"));
        }
        let wrong = || Refusal::new("ERR003: LIST PLC takes a number from 0 to 31");
        let number: u32 = number.parse().map_err(|_| wrong())?;
        let name = format!("PLC{number}");
        // A program may open the buffer several times; what was downloaded last counts.
        let rows = &self.text.rows;
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
    fn read_memory(&mut self, rest: &str) -> Result<String, Refusal> {
        let (hexadecimal, rest) = match rest.strip_prefix('H') {
            Some(rest) => (true, rest),
            None => (false, rest),
        };
        let wrong = || Refusal::new("ERR003: memory is read by RX:$address or RHY:$address,n");
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
        let moment = self.read(&names)?;
        let words = names.iter().map(|name| match moment.values.get(name) {
            Some(value) if hexadecimal => format!("{:06X}", *value as i64 & 0xFF_FFFF),
            Some(value) => number(*value),
            None => "?".into(),
        });
        Ok(words.collect::<Vec<_>>().join(" "))
    }
}

/// Why commands for motors and motion programs are refused.
const NO_MOTION: &str = "plcc runs the PLC programs of a PMAC, not its motors and motion programs: nothing would move. \
The registers of motors can be read (P, V, F, ?)";

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
    if is(&["PC", "PE", "PR", "%"]) {
        return Some("there are no motion programs, so there is no line or feed rate to report");
    }
    if begins(&["OPEN", "CLOSE", "CLEAR", "DELETE", "DEL", "UNDEFINE", "UND", "DEFINE", "SAVE"]) {
        return Some(
            "programs and buffers are changed in the source, which is built and swapped in",
        );
    }
    if is(&["A", "B", "H", "HM", "HMZ", "K", "Q", "R", "S", "/", "\\", "<", ">"])
        || begins(&["J+", "J-", "J/", "J=", "J:", "J^", "O", "%", "HOME", "$", "MOVETIME"])
    {
        return Some(NO_MOTION);
    }
    None
}

/// The names of a command that asks for values: `P3`, `P1..5`.
fn range_of(plain: &str) -> Result<Vec<String>, Refusal> {
    let wrong = || {
        Refusal::new(format!(
            "`{plain}` can't be given here. The commands are P1 Q1 M1 I1 and ranges as P1..5, M1->, P1=…, \
             RX:$address and RHY:$address,n, LIST PLC n, ENABLE PLC n and the like, #n &n P V F ? ?? ???, \
             GATHER and the like, TYPE, VERSION"
        ))
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

/// The definition of an M-variable in an image. Its number wraps.
pub(super) fn definition(image: &[u8], controller: Controller, number: u32) -> Definition {
    let layout = Layout::new(controller);
    let number = number & (layout.count - 1);
    Definition::decode(read_u64(image, layout.definition_offset(number)))
}

/// A definition as a PMAC answers it.
pub(super) fn definition_text(definition: Definition) -> String {
    let field = |space: char, address: u32, field: Field| {
        let format = match field.format {
            Format::U => "",
            Format::S => ",S",
            Format::D => ",D",
            Format::C => ",C",
        };
        match field.width {
            1 => format!("{space}:${address:X},{}", field.offset),
            24 if field.offset == 0 => format!("{space}:${address:X},24{format}"),
            width => format!("{space}:${address:X},{},{width}{format}", field.offset),
        }
    };
    match definition {
        Definition::Star => "*".into(),
        Definition::X { address, field: bits } => field('X', address, bits),
        Definition::Y { address, field: bits } => field('Y', address, bits),
        Definition::D { address } => format!("D:${address:X}"),
        Definition::Dp { address } => format!("DP:${address:X}"),
        Definition::L { address } => format!("L:${address:X}"),
        Definition::F { address } => format!("F:${address:X}"),
        Definition::Tw { address } => format!("TW:{address}"),
    }
}

/// Whether a line has a word (in capitals) outside of texts.
fn has_word(line: &str, word: &str) -> bool {
    let outside = line.split('"').step_by(2);
    let mut words = outside.flat_map(|part| part.split(|c: char| !c.is_ascii_alphanumeric()));
    words.any(|found| found.eq_ignore_ascii_case(word))
}
