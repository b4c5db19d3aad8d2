//! Which programs a statement such as `ENABLE PLC 1,3..5` names, and where in its text.

use super::ast::PlcSet;
use super::read::cursor::Cursor;

/// The programs that a statement, or the text of a COMMAND, starts or stops: bit n is program n.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Switched {
    plcs: u32,
    plccs: u32,
}

impl Switched {
    /// These programs and those of a set.
    #[must_use]
    pub(super) fn and(self, set: PlcSet) -> Self {
        match set.compiled {
            true => Self { plccs: self.plccs | set.bits, ..self },
            false => Self { plcs: self.plcs | set.bits, ..self },
        }
    }

    /// Whether there is none.
    pub(super) fn is_empty(self) -> bool {
        self == Self::default()
    }

    /// Whether all are PLCCs.
    pub(super) fn is_compiled(self) -> bool {
        self.plcs == 0
    }

    /// The name of the program with a number, if it is one of these.
    fn name(self, compiled: bool, number: u32) -> Option<String> {
        let bits = if compiled { self.plccs } else { self.plcs };
        let is_there = number < u32::BITS && bits & (1 << number) != 0;
        is_there.then(|| plc_name(compiled, number))
    }
}

/// The name of a PLC or PLCC.
pub(super) fn plc_name(compiled: bool, number: u32) -> String {
    format!("{}{number}", if compiled { "PLCC" } else { "PLC" })
}

/// A part of the list after PLC or PLCC: a number, a name that stands for one, the points of a range, which name the
/// programs between its ends, or a comma.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Part {
    /// Where it begins and ends in the text.
    pub(super) from: usize,
    pub(super) to: usize,
    /// The programs; of a comma and of the points of `2..3` there is none.
    pub(super) programs: Vec<String>,
}

/// The next occurrence of PLC or PLCC in a text: where the word ends, and whether it is PLCC.
pub(super) fn program_word(text: &str) -> Option<(usize, bool)> {
    let at = text.as_bytes().windows(3).position(|three| three.eq_ignore_ascii_case(b"PLC"))?;
    let is_compiled = matches!(text.as_bytes().get(at + 3), Some(b'C' | b'c'));
    Some((at + 3 + usize::from(is_compiled), is_compiled))
}

/// The number at a cursor, or that for which the name there stands.
pub(super) fn number(
    cur: &mut Cursor<'_>,
    stands_for: impl Fn(&str) -> Option<u32>,
) -> Option<u32> {
    cur.blanks();
    let rest = cur.rest();
    let end = rest.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(rest.len());
    let word = rest.get(..end).unwrap_or_default();
    if let Some(number) = stands_for(word) {
        cur.pos += end;
        return Some(number);
    }
    cur.integer().and_then(|number| u32::try_from(number).ok())
}

/// The parts of the list with which a text begins, as far as it names programs that are started or stopped there.
pub(super) fn list(
    text: &str,
    compiled: bool,
    switched: Switched,
    stands_for: impl Fn(&str) -> Option<u32> + Copy,
) -> Vec<Part> {
    let mut parts: Vec<Part> = vec![];
    let mut cur = Cursor::new(text);
    let mut comma = None;
    loop {
        cur.blanks();
        let from = cur.pos;
        let Some(first) = number(&mut cur, stands_for) else { return parts };
        let Some(name) = switched.name(compiled, first) else { return parts };
        let sign = |at| Part { from: at, to: at + 1, programs: vec![] };
        parts.extend(comma.map(sign));
        parts.push(Part { from, to: cur.pos, programs: vec![name] });
        let mut ahead = cur;
        if ahead.peek() == b'.' && ahead.byte_at(1) == b'.' {
            let from = ahead.pos;
            ahead.pos += 2;
            let to = ahead.pos;
            ahead.blanks();
            let start = ahead.pos;
            let last = number(&mut ahead, stands_for);
            let named = last.and_then(|last| Some((last, switched.name(compiled, last)?)));
            let Some((last, name)) = named else { return parts };
            let between =
                (first.saturating_add(1)..last).filter_map(|n| switched.name(compiled, n));
            parts.push(Part { from, to, programs: between.collect() });
            let to = ahead.pos;
            parts.push(Part { from: start, to, programs: vec![name] });
            cur = ahead;
        }
        if !cur.eat(b',') {
            return parts;
        }
        comma = Some(cur.pos - 1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_name_programs_up_to_their_end() {
        let bits = |numbers: &[u32]| numbers.iter().fold(0, |bits, number| bits | 1 << number);
        let of = |text: &str, numbers: &[u32]| {
            let set = PlcSet { compiled: false, bits: bits(numbers) };
            let stands_for = |name: &str| (name == "OIL").then_some(9);
            list(text, false, Switched::default().and(set), stands_for)
                .into_iter()
                .map(|it| (text.get(it.from..it.to).unwrap_or_default().to_owned(), it.programs))
                .collect::<Vec<_>>()
        };
        let row = |text: &str, names: &[&str]| {
            (text.to_owned(), names.iter().map(|&name| name.to_owned()).collect::<Vec<_>>())
        };
        assert_eq!(
            of(" 1, $2..5 ,OIL P1=3", &[1, 2, 3, 4, 5, 9]),
            [
                row("1", &["PLC1"]),
                row(",", &[]),
                row("$2", &["PLC2"]),
                row("..", &["PLC3", "PLC4"]),
                row("5", &["PLC5"]),
                row(",", &[]),
                row("OIL", &["PLC9"]),
            ]
        );
        assert_eq!(of("3..4", &[3, 4])[1], row("..", &[]));
        assert_eq!(of("7ENAPLC8", &[7]), [row("7", &["PLC7"])]);
        assert_eq!(of("7", &[8]), []);
        assert_eq!(program_word("enaplcc3"), Some((7, true)));
        assert_eq!(program_word("DISPLAY"), None);
    }
}
