//! Makes blocks of the lines of a part program, with what is wrong in them.

use plcc_abi::Dialect;
use plcc_abi::machine::simulator::Decimal;
use plcc_diag::{Diagnostic, FileId, SourceMap, Span};

use super::arcs::Modal;
use super::block::{Block, Cycle, Motion};
use super::grammar::{Item, items};
use super::words::{Code, Letter};
use crate::length::nanometres;
use crate::setup::Rules;

/// The longest part program, in bytes.
pub const MAX_PART_PROGRAM: u64 = 16 << 20;
/// The most M codes of a block of an NCT control (cnc-side, SIM-7).
const MAX_M: usize = 5;
/// The largest word of an axis, in millionths: 99999.999999.
const MAX_AXIS: i128 = 99_999_999_999;
/// What the largest axis word is in millionths of a unit.
const MILLION: i128 = 1_000_000;

/// A part program that was read.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PartProgram {
    /// Its blocks.
    pub(crate) blocks: Vec<Block>,
}

/// What is wrong with a line: the code, the range of bytes in the line, what, and what to do.
pub(super) struct Mistake {
    code: &'static str,
    at: (usize, usize),
    what: String,
    help: &'static str,
}

/// A line that was read.
struct Line {
    block: Option<Block>,
    warnings: Vec<Mistake>,
}

/// Reads a part program, a file among `sources`. All lines are read, also behind a mistake. Errors and warnings are in
/// the order of the lines.
pub fn read_part_program(
    rules: &Rules,
    sources: &SourceMap,
    file: FileId,
) -> (PartProgram, Vec<Diagnostic>) {
    let starts = &rules.starts;
    let text = sources.text(file);
    let mut program = PartProgram::default();
    let mut diagnostics = vec![];
    let mut modal = Modal { positions: starts.to_vec(), ..Modal::default() };
    let mut last = None;
    let mut start = 0_usize;
    let place = |from: usize, to: usize| Span::new(file, from, to);
    for (line, number) in lines(text).zip(1_u32..) {
        let (line, next) = line;
        if !line.trim().is_empty() {
            last = Some((start, start + line.trim_end().len()));
        }
        match read_line(rules, line, &mut modal) {
            Ok(read) => {
                diagnostics.extend(read.warnings.into_iter().map(
                    |Mistake { code, at, what, help }| {
                        Diagnostic::warning(code, place(start + at.0, start + at.1), what)
                            .help(help)
                    },
                ));
                program.blocks.extend(read.block.map(|block| Block { line: number, ..block }));
            }
            Err(Mistake { code, at, what, help }) => {
                let span = place(start + at.0, start + at.1);
                diagnostics.push(Diagnostic::error(code, span, what).help(help));
            }
        }
        start += next;
    }
    if !program.blocks.iter().any(Block::ends_program) {
        let (from, to) = last.unwrap_or((0, 0));
        let what = "nothing ends this part program";
        let help = "end it with M30 or M2; as it is, its last block ends it as M30 would, and no M is sent";
        diagnostics.push(Diagnostic::warning("SIM-10", place(from, to), what).help(help));
    }
    (program, diagnostics)
}

/// Reads a block that an operator can enter.
///
/// # Errors
/// The code of what is wrong, the column from 1, and a sentence.
pub(crate) fn read_entry(rules: &Rules, text: &str) -> Result<Block, String> {
    let line = text.lines().next().unwrap_or_default();
    match read_line(rules, line, &mut Modal::default()) {
        Ok(read) => Ok(read.block.unwrap_or_default()),
        Err(Mistake { code, at, what, help }) => {
            let column = line.get(..at.0).map_or(0, |before| before.chars().count()) + 1;
            Err(format!("`{line}`, column {column}: {code}: {what}; {help}"))
        }
    }
}

/// The lines of a text, each with its length including its end.
fn lines(text: &str) -> impl Iterator<Item = (&str, usize)> {
    let mut rest = text;
    std::iter::from_fn(move || {
        if rest.is_empty() {
            return None;
        }
        let end = rest.find(['\n', '\r']).unwrap_or(rest.len());
        let (line, tail) = rest.split_at(end);
        let after = match tail.as_bytes() {
            [b'\r', b'\n', ..] => 2,
            [] => 0,
            _ => 1,
        };
        rest = tail.get(after..).unwrap_or_default();
        Some((line, end + after))
    })
}

/// The words of one line while it is read.
pub(super) struct Reader<'r> {
    pub(super) rules: &'r Rules,
    pub(super) block: Block,
    pub(super) seen: Vec<char>,
    groups: Vec<i128>,
    warnings: Vec<Mistake>,
    /// Where the first axis word is.
    pub(super) first_axis: Option<(usize, usize)>,
    /// Where the first of I, J, K and R is.
    pub(super) first_arc: Option<(usize, usize)>,
    /// Letters that a G code needs in its block, and where that is.
    pub(super) needs: Vec<(char, (usize, usize))>,
    /// Where G4 is, and P with its time.
    pub(super) dwell: Option<(usize, usize)>,
    pub(super) parameter: Option<((usize, usize), Decimal)>,
    /// Where G61 to G66 is, with the axis.
    pub(super) aux: Option<((usize, usize), u8)>,
    /// X where the table has no such axis.
    pub(super) aux_position: Option<((usize, usize), i128)>,
}

pub(super) fn wrong<T>(
    code: &'static str,
    at: (usize, usize),
    what: impl Into<String>,
    help: &'static str,
) -> Result<T, Box<Mistake>> {
    Err(Box::new(Mistake { code, at, what: what.into(), help }))
}

/// Reads one line. Of several mistakes the first one by its place counts; a wrong line leaves `modal` as it is.
fn read_line(rules: &Rules, line: &str, modal: &mut Modal) -> Result<Line, Mistake> {
    let nothing = || Line { block: None, warnings: vec![] };
    if line.trim_start().starts_with('%') {
        return Ok(nothing());
    }
    let items = items(line);
    let mut reader = Reader {
        rules,
        block: Block::default(),
        seen: vec![],
        groups: vec![],
        warnings: vec![],
        first_axis: None,
        first_arc: None,
        needs: vec![],
        dwell: None,
        parameter: None,
        aux: None,
        aux_position: None,
    };
    let mut words = items.into_iter().peekable();
    // The number of a program.
    words.next_if(|(item, ..)| matches!(item, Item::Word { letter: 'O', .. }));
    if words.peek().is_none() {
        return Ok(nothing());
    }
    let mut mistakes = vec![];
    let (mut is_first, mut is_whole) = (true, true);
    for (item, start, end) in words {
        let at = (start, end);
        let result = match item {
            Item::Bad => wrong(
                "SIM-1",
                at,
                "no word begins here",
                "a word is a letter with a number, as in X12.5; a comment ends with `)`",
            ),
            Item::Skip(number) => reader.skip(is_first, number, at),
            Item::Word { letter, number } => reader.word(letter, number, at),
        };
        is_first = false;
        is_whole &= !matches!(item, Item::Bad);
        mistakes.extend(result.err().map(|mistake| *mistake));
    }
    if let Err(mistake) = reader.complete(modal, !is_whole) {
        mistakes.push(*mistake);
    }
    mistakes.sort_by_key(|mistake| mistake.at);
    if let Some(first) = mistakes.into_iter().next() {
        return Err(first);
    }
    let block = &reader.block;
    modal.motion = block.motion.or(modal.motion);
    modal.plane = block.plane.unwrap_or(modal.plane);
    modal.relative = block.absolute.map_or(modal.relative, |absolute| !absolute);
    modal.feed |= block.feed.is_some();
    if block.dwell.is_none() {
        modal.go_to(block, rules);
    }
    if block.ends_program() {
        *modal = Modal { positions: std::mem::take(&mut modal.positions), ..Modal::default() };
    }
    Ok(Line { block: Some(reader.block), warnings: reader.warnings })
}

impl Reader<'_> {
    fn skip(
        &mut self,
        is_first: bool,
        number: Option<u32>,
        at: (usize, usize),
    ) -> Result<(), Box<Mistake>> {
        let is_nct = self.rules.dialect == Dialect::Nct;
        let is_taken = match number {
            None => true,
            Some(number) => is_nct && (1..=9).contains(&number),
        };
        if !is_first || !is_taken {
            let help =
                "write `/` without a number in front of a block; an NCT control also has /1 to /9";
            return wrong("SIM-12", at, "`/` can't be here, or not with this number", help);
        }
        self.block.skip = number.unwrap_or(1) as u8;
        Ok(())
    }

    fn word(
        &mut self,
        letter: char,
        number: Option<Decimal>,
        at: (usize, usize),
    ) -> Result<(), Box<Mistake>> {
        let Some(kind) = self.rules.letter(letter) else {
            let what = format!("this control has no word {letter}");
            let help = "write a word that the control has, or give the axis in [[simulator.axis]]";
            self.seen.push(letter);
            return wrong("SIM-2", at, what, help);
        };
        let repeats = matches!(kind, Letter::Code | Letter::Function);
        if !repeats && self.seen.contains(&letter) {
            let what = format!("{letter} is in this block already");
            return wrong("SIM-3", at, what, "remove one of the two");
        }
        self.seen.push(letter);
        let out_of_range =
            |help| wrong("SIM-4", at, format!("the number of {letter} is out of range"), help);
        let Some(number) = number else {
            return out_of_range("a number has at most 9 digits before its point and 6 after it");
        };
        let whole = |most: i128| number.integer().filter(|n| (0..=most).contains(n));
        let at_word = at;
        let most = self.rules.largest();
        let small = if most > 65_535 {
            "it is whole, from 0 to 2147483647"
        } else {
            "it is whole, from 0 to 65535"
        };
        match kind {
            Letter::Code => {
                if number.is_negative() {
                    return out_of_range("a G code is not negative");
                }
                return self.code(number, at);
            }
            Letter::Function => {
                let Some(m) = whole(self.rules.largest_m()) else {
                    return out_of_range(
                        "M is whole, up to 299 on a PMI control and 999 on others",
                    );
                };
                return self.function(m as u16, at);
            }
            Letter::Axis(axis) => {
                if number.times(MILLION).is_none_or(|n| n.abs() > MAX_AXIS) {
                    return out_of_range("an axis goes to 99999.999999 at most");
                }
                let unit = self.rules.unit_of(axis);
                self.first_axis.get_or_insert(at);
                self.block.axes.push((axis, nanometres(number, unit)));
            }
            Letter::AuxPosition => {
                if number.times(MILLION).is_none_or(|n| n.abs() > MAX_AXIS) {
                    return out_of_range("an axis goes to 99999.999999 at most");
                }
                self.aux_position = Some((at, nanometres(number, self.rules.unit)));
            }
            Letter::Centre(at) => {
                if number.times(MILLION).is_none_or(|n| n.abs() > MAX_AXIS) {
                    return out_of_range("an axis goes to 99999.999999 at most");
                }
                self.first_arc.get_or_insert(at_word);
                if let Some(slot) = self.block.centre.get_mut(at) {
                    *slot = Some(nanometres(number, self.rules.unit));
                }
            }
            Letter::Radius => {
                if number.times(MILLION).is_none_or(|n| n.abs() > MAX_AXIS) {
                    return out_of_range("R goes to 99999.999999 at most");
                }
                self.first_arc.get_or_insert(at_word);
                self.block.radius = Some(nanometres(number, self.rules.unit));
            }
            Letter::Feed => {
                let feed = nanometres(number, self.rules.unit);
                // A wrong F is a mistake of its own; none is missing then.
                self.block.feed = Some(feed);
                if number.is_negative() || number.is_zero() || feed == 0 {
                    return out_of_range("F is above 0");
                }
            }
            Letter::Misc(misc) => {
                let Some(value) = whole(most) else { return out_of_range(small) };
                if let Some(slot) = self.block.functions.get_mut(misc) {
                    *slot = Some(value as u32);
                }
            }
            Letter::Speed | Letter::Tool => {
                let Some(value) = whole(most) else { return out_of_range(small) };
                let slot = match kind {
                    Letter::Speed => &mut self.block.s,
                    _ => &mut self.block.t,
                };
                *slot = Some(value as u32);
            }
            Letter::Number => {
                if whole(999_999_999).is_none() {
                    return out_of_range("N is whole and not negative");
                }
            }
            Letter::Parameter => {
                if number.is_negative() {
                    return out_of_range("P is a time in seconds, from 0 on");
                }
                self.parameter = Some((at, number));
            }
        }
        Ok(())
    }

    fn code(&mut self, number: Decimal, at: (usize, usize)) -> Result<(), Box<Mistake>> {
        let with_fraction = self.rules.code_with_fraction(number);
        let Some(number) = number.integer().or(with_fraction.map(|_| 81)) else {
            let help = "G codes are whole numbers, but for G81.1 of an NCT control";
            return wrong("SIM-4", at, "the number of G is out of range", help);
        };
        let code = with_fraction.map(|code| (code, None)).or_else(|| self.rules.code(number));
        let Some((code, declared)) = code else {
            let what = format!("G{number} is not simulated");
            let help = "see the list of what is taken in the book, \"A machine on the desk\"; codes of a PMI program are declared after $GCODE";
            return wrong("SIM-5", at, what, help);
        };
        let group = code.group(number);
        if self.groups.contains(&group) {
            let what = format!("G{number} is a second code of its group in this block");
            return wrong("SIM-6", at, what, "put it into a block of its own");
        }
        self.groups.push(group);
        let takes_axes = matches!(code, Code::Home | Code::Tap | Code::Dwell);
        if takes_axes && (self.block.cycle.is_some() || self.dwell.is_some()) {
            let what = format!("G{number} and the G code before it want the axes of this block");
            return wrong("SIM-6", at, what, "put it into a block of its own");
        }
        match code {
            Code::Rapid => self.block.motion = Some(Motion::Rapid),
            Code::Line => self.block.motion = Some(Motion::Line),
            Code::Arc(true) => self.block.motion = Some(Motion::Clockwise),
            Code::Arc(false) => self.block.motion = Some(Motion::Counterclockwise),
            Code::Plane(plane) => self.block.plane = Some(plane),
            Code::Absolute(absolute) => self.block.absolute = Some(absolute),
            Code::Dwell => self.dwell = Some(at),
            Code::Thread => {
                self.block.motion = Some(Motion::Thread);
                self.needs.push(('F', at));
            }
            Code::Home => self.block.cycle = Some(Cycle::Home),
            Code::Tap => {
                self.block.cycle = Some(Cycle::Tap);
                self.needs.push(('Z', at));
            }
            Code::Chopping(on) => self.block.chopping = Some(on),
            Code::Aux(axis) => self.aux = Some((at, axis)),
            Code::Nothing(_) | Code::Declared => {}
        }
        self.declared(declared);
        Ok(())
    }

    /// Notes a code that the program declares, once.
    fn declared(&mut self, code: Option<u16>) {
        if let Some(code) = code.filter(|code| !self.block.codes.contains(code)) {
            self.block.codes.push(code);
        }
    }

    fn function(&mut self, m: u16, at: (usize, usize)) -> Result<(), Box<Mistake>> {
        let declared = self.rules.declared('M', m.into());
        if matches!(m, 96..=99) && declared.is_none() {
            let help =
                "subprograms and interrupt macros are not simulated; write their blocks here";
            return wrong("SIM-5", at, format!("M{m} is not simulated"), help);
        }
        let is_pmi = self.rules.dialect == Dialect::Pmi;
        if !is_pmi && self.block.m.len() >= MAX_M {
            let help =
                "a block of an NCT control has five M codes at most; put it into the next one";
            return wrong("SIM-7", at, format!("M{m} is the sixth M code of this block"), help);
        }
        if is_pmi && declared.is_none() && !matches!(m, 0 | 1 | 2 | 30 | 90) {
            let what = format!("nothing happens at M{m}, since the program does not declare it");
            self.warnings.push(Mistake {
                code: "SIM-11",
                at,
                what,
                help: "declare it after $MCODE, as in @M08/P",
            });
        }
        self.block.m.push(m);
        self.declared(declared);
        Ok(())
    }
}
