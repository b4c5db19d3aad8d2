//! The PMAC terminal: on-line commands that look at variables, memory and programs (PMAC quick reference,
//! On-line Commands). Those that would act on programs or motors can't be given over a control's socket.

use plcc_abi::image::read_u64;
use plcc_abi::pmac::{Controller, Definition, Field, Format, Kind, Layout, PmacName};
use plcc_abi::{Dialect, Tables};
use plcc_runtime::value::number;

use super::Session;
use crate::view::{TerminalLine, TerminalView};
use crate::{Refusal, Reply};

/// How many values one command shows.
const MOST_VALUES: u32 = 256;
/// How many lines the terminal keeps.
const MOST_LINES: usize = 1000;

/// What was typed and answered.
#[derive(Debug, Default)]
pub(super) struct OnlineState {
    lines: Vec<TerminalLine>,
}

impl OnlineState {
    fn add(&mut self, typed: bool, text: &str) {
        self.lines.extend(text.lines().map(|line| TerminalLine { typed, text: line.into() }));
        let over = self.lines.len().saturating_sub(MOST_LINES);
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

    fn answer(&mut self, line: &str) -> Result<String, Refusal> {
        let plain = line.to_uppercase().replace(char::is_whitespace, "");
        if plain.is_empty() {
            return Ok(String::new());
        }
        if let Some((name, value)) = line.split_once('=') {
            let reply = self.change(name.trim(), value.trim())?;
            return Ok(reply.message.unwrap_or_default());
        }
        if let Some(name) = plain.strip_suffix("->") {
            return self.definition_of(name);
        }
        match plain.as_str() {
            "TYPE" => {
                let Some(Tables::Pmac(tables)) = self.tables() else { return Ok("PMAC".into()) };
                return Ok(format!("{:?}", tables.controller).to_uppercase());
            }
            "VERSION" | "VER" => return Ok(env!("CARGO_PKG_VERSION").into()),
            _ => {}
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
        let names = range_of(&plain)?;
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
        let task = {
            let tasks = &self.debugger()?.program().tables().tasks;
            tasks.iter().position(|task| task.name == name)
        };
        let rows = (0..self.text.rows.len()).filter(|&row| {
            task.is_some()
                && self.plc_of_row(row) == task
                && self.text.rows.get(row).is_some_and(|row| !row.statements.is_empty())
        });
        let lines = rows.filter_map(|row| Some(self.text.rows.get(row)?.text()));
        let mut text: Vec<String> = lines.collect();
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
        let last = first.saturating_add(count.clamp(1, MOST_VALUES) - 1);
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

/// The names of a command that asks for values: `P3`, `P1..5`.
fn range_of(plain: &str) -> Result<Vec<String>, Refusal> {
    let wrong = || {
        Refusal::new(format!(
            "`{plain}` can't be given here. There are: P1 Q1 M1 I1 and ranges as P1..5, M1->, P1=…, \
             RX:$address and RHY:$address,n, LIST PLC n, TYPE, VERSION"
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
    let last = last.min(variable.number.saturating_add(MOST_VALUES - 1));
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
