//! The variables of a program: which there are, and the section that declares those that it names.
//!
//! | names | are |
//! | --- | --- |
//! | `X0` to `X79` | LOGICAL |
//! | `A0` to `A79` | INTEGER |
//! | `L0` to `L79` | LONG |
//! | `I0` to `I63`, `O0` to `O63` | inputs and outputs of one line |
//! | `GI0` to `GI5`, `GO0` to `GO5` | groups of lines: B, BCD, TWOC |
//! | `XA[8]`, `AA[8]`, `LA[8]`, `XC[4]`, `AC[4]`, `LC[4]` | arrays, and constant arrays |
//! | `TC0`, `TD0`, … `TC5`, `TD5` | timers; `FQ0`, `FD0`, `FK0`, `FP0`, `FL0`, … flip-flops |
//! | `MS0` to `MS3`, `FT0` to `FT3` | messages and faults |

use std::fmt::Write as _;

use plcc_random::Rng;

use crate::idioms::renumbered;

/// The variables that a program uses. Few of them, so that idioms meet.
pub(super) struct Pool {
    logicals: Vec<usize>,
    integers: Vec<usize>,
    longs: Vec<usize>,
    inputs: Vec<usize>,
    outputs: Vec<usize>,
}

const INTEGERS: [i64; 14] = [0, 1, 2, 3, 7, 10, 100, 127, 255, 256, 1000, 32766, 32767, 5];
const LONGS: [i64; 8] =
    [32768, 65535, 65536, 100_000, 0x7F_FFFF, 0x0100_0000, 999_999_999, 16_777_215];

/// Executive variables that a program may assign to, and that the stimulus may change.
const LOGICAL_OUT: [&str; 4] = ["@CL100", "@CL107", "@OPSTP", "@BKDLT"];
const LOGICAL_IN: [&str; 6] = ["@CP100", "@CP101", "@CP115", "@ESTOP", "@IPL", "@M03"];

impl Pool {
    pub(super) fn new(rng: &mut Rng, few: bool) -> Self {
        let mut some = |limit: usize| -> Vec<usize> {
            let count = if few { 1 + rng.below(3) } else { 3 + rng.below(8) };
            let first = rng.below(limit);
            (0..count).map(|index| (first + index) % limit).collect()
        };
        Self {
            logicals: some(20),
            integers: some(20),
            longs: some(10),
            inputs: some(16),
            outputs: some(16),
        }
    }

    /// A LOGICAL, without an array's element.
    pub(super) fn logical(&self, rng: &mut Rng) -> String {
        match rng.below(16) {
            0..=3 => format!("I{}", rng.pick(&self.inputs)),
            4..=9 => format!("X{}", rng.pick(&self.logicals)),
            10 | 11 => format!("O{}", rng.pick(&self.outputs)),
            12 => (*rng.pick(&LOGICAL_IN)).to_owned(),
            13 => format!("TD{}", rng.below(3)),
            14 => format!("FQ{}", rng.below(2)),
            _ => (*rng.pick(&["T", "F", "@CL100"])).to_owned(),
        }
    }

    /// A LOGICAL that may be assigned to.
    pub(super) fn logical_out(&self, rng: &mut Rng) -> String {
        match rng.below(16) {
            0..=6 => format!("X{}", rng.pick(&self.logicals)),
            7..=10 => format!("O{}", rng.pick(&self.outputs)),
            11 => (*rng.pick(&LOGICAL_OUT)).to_owned(),
            12 => format!("TC{}", rng.below(3)),
            13 => format!("F{}{}", rng.pick(&["D", "K", "K", "P", "L"]), rng.below(2)),
            14 => (*rng.pick(&["@M03", "@NEWSC"])).to_owned(),
            _ => format!("{}{}", rng.pick(&["MS", "FT"]), rng.below(3)),
        }
    }

    /// An INTEGER, without an array's element.
    pub(super) fn integer(&self, rng: &mut Rng) -> String {
        match rng.below(12) {
            0 => format!("GI{}", rng.below(6)),
            1 => format!("GO{}", rng.below(6)),
            2 => (*rng.pick(&["@FRO", "@MODE", "@SSO"])).to_owned(),
            3..=4 => self.small(rng),
            _ => format!("A{}", rng.pick(&self.integers)),
        }
    }

    pub(super) fn integer_out(&self, rng: &mut Rng) -> String {
        match rng.below(10) {
            0 | 1 => format!("GO{}", rng.below(6)),
            2 => "@FRO".to_owned(),
            _ => format!("A{}", rng.pick(&self.integers)),
        }
    }

    /// A LONG, without an array's element.
    pub(super) fn long(&self, rng: &mut Rng) -> String {
        match rng.below(8) {
            0 => (*rng.pick(&["@SCODE", "KEY1"])).to_owned(),
            1 => rng.pick(&LONGS).to_string(),
            _ => format!("L{}", rng.pick(&self.longs)),
        }
    }

    pub(super) fn long_out(&self, rng: &mut Rng) -> String {
        format!("L{}", rng.pick(&self.longs))
    }

    /// A literal that is an INTEGER.
    pub(super) fn small(&self, rng: &mut Rng) -> String {
        match rng.below(3) {
            0 => rng.pick(&INTEGERS).to_string(),
            1 => rng.below(32768).to_string(),
            _ => rng.below(10).to_string(),
        }
    }

    /// A row of the stimulus for `source`. M codes are known only where a program declares them.
    pub(super) fn change(&self, rng: &mut Rng, source: &str) -> (String, String) {
        match rng.below(12) {
            0..=4 => {
                let input = rng.pick(&self.inputs);
                (format!("PORT{}.{}", input / 8, input % 8), rng.below(2).to_string())
            }
            5 => ("@CP100".to_owned(), rng.below(2).to_string()),
            6 => (format!("PORT{}.{}", 40 + rng.below(6), rng.below(8)), rng.below(2).to_string()),
            7 if source.contains("@M03") => ("@M03".to_owned(), "1".to_owned()),
            8 => ("@FRO".to_owned(), rng.below(300).to_string()),
            9 => ("@SCODE".to_owned(), rng.pick(&LONGS).to_string()),
            10 => ("@CP101".to_owned(), rng.below(2).to_string()),
            _ => ("@MODE".to_owned(), rng.below(4).to_string()),
        }
    }

    /// The specification section for all that `code` names.
    pub(super) fn declarations(&self, rng: &mut Rng, code: &str) -> String {
        let is_word = |c: char| c.is_ascii_alphanumeric() || c == '@';
        let words: Vec<&str> = code.split(|c: char| !is_word(c)).collect();
        // The numbers that follow a name, each once, in order.
        let named = |name: &str| -> Vec<usize> {
            let numbers = words.iter().filter_map(|word| word.strip_prefix(name)?.parse().ok());
            let mut numbers: Vec<usize> = numbers.collect();
            numbers.sort_unstable();
            numbers.dedup();
            numbers
        };
        let mut text = String::new();
        let section = |text: &mut String, name: &str, lines: Vec<String>| {
            if !lines.is_empty() {
                let _ = writeln!(text, "{name}\n{}", lines.join("\n"));
            }
        };
        let each = |name: &str, line: &dyn Fn(usize) -> String| -> Vec<String> {
            named(name).into_iter().map(line).collect()
        };
        let group = |first: usize, number: usize| {
            let kind = ["B", "BCD", "TWOC", "B", "TWOC", "BCD"][number % 6];
            let (low, high) = [(0, 7), (0, 7), (0, 7), (2, 5), (1, 3), (4, 7)][number % 6];
            format!("{}/{low}-{high}/{kind}", first + number)
        };
        let mut inputs = each("I", &|n| format!("I{n}={}/{}", n / 8, n % 8));
        inputs.extend(each("GI", &|n| format!("GI{n}={}", group(40, n))));
        section(&mut text, "$INPUT", inputs);
        let mut outputs = each("O", &|n| format!("O{n}={}/{}", 10 + n / 8, n % 8));
        outputs.extend(each("GO", &|n| format!("GO{n}={}", group(50, n))));
        section(&mut text, "$OUTPUT", outputs);
        let mut integers = each("A", &|n| format!("A{n}"));
        let array = |name: &str, line: &str| words.contains(&name).then(|| line.to_owned());
        integers.extend(array("AA", "AA[8]"));
        integers.extend(array("AC", "AC[4]=[1,-7,300,2]"));
        section(&mut text, "$INTEGER", integers);
        let mut longs = each("L", &|n| format!("L{n}"));
        longs.extend(array("LA", "LA[8]"));
        longs.extend(array("LC", "LC[4]=[70000,-200000,3,65536]"));
        section(&mut text, "$LONG", longs);
        // A LOGICAL that is assigned to need not be declared. A line that goes on may begin like an assignment.
        let statements = code.replace("#\n", "#");
        let declared = |n: &usize| {
            let start = format!("X{n}=");
            let assigned = statements.lines().any(|line| line.starts_with(&start));
            !assigned || n.is_multiple_of(3)
        };
        let mut logicals: Vec<String> =
            named("X").into_iter().filter(declared).map(|n| format!("X{n}")).collect();
        logicals.extend(array("XA", "XA[8]"));
        logicals.extend(array("XC", "XC[4]=[T,F,F,T]"));
        section(&mut text, "$LOGICAL", logicals);
        let mut timers = named("TC");
        timers.extend(named("TD"));
        timers.sort_unstable();
        timers.dedup();
        let timers = timers
            .iter()
            .map(|n| format!("{}/TC{n}/TD{n}={}", ["E", "D"][n % 2], 1 + rng.below(4)));
        section(&mut text, "$TIMER", timers.collect());
        let mut flops: Vec<usize> =
            ["FQ", "FD", "FK", "FP", "FL"].iter().flat_map(|name| named(name)).collect();
        flops.sort_unstable();
        flops.dedup();
        let flops = flops.iter().map(|n| format!("FQ{n}/FD{n}/FK{n}/FP{n}/FL{n}"));
        section(&mut text, "$FLIPFLOP", flops.collect());
        section(&mut text, "$MESSAGE", each("MS", &|n| format!("MS{n}=\"DOOR {n} OPEN\"")));
        let value = |n: usize| match integers_of(&words) {
            Some(name) => format!("FT{n}=\"AXIS\",{name},\"IN\""),
            None => format!("FT{n}=\"NO OIL\""),
        };
        section(&mut text, "$FAULT", each("FT", &value));
        section(
            &mut text,
            "$KEY",
            array("KEY1", "KEY0=\"AUTO\"\nKEY1=\"ZERO SET\"").into_iter().collect(),
        );
        section(&mut text, "$MCODE", array("@M03", "@M03/P").into_iter().collect());
        text + "$END\n"
    }
}

/// An INTEGER of the program that a fault's text may show.
fn integers_of<'a>(words: &[&'a str]) -> Option<&'a str> {
    let is = |word: &&&str| word.strip_prefix('A').is_some_and(|n| n.parse::<usize>().is_ok());
    words.iter().find(is).copied()
}

/// A line with the numbers of the next row: those of variables with one of `letters`, and constants where it has a
/// blank.
pub(super) fn row(line: &str, letters: &str, by: usize) -> String {
    renumbered(line, |letter, old| match letter {
        _ if !letters.contains(letter) => old,
        'I' | 'O' => (old + by) % 64,
        // An index of a constant must stay in its array.
        ' ' if line.contains('[') => old,
        ' ' => (old + by) % 32768,
        _ => (old + by) % 80,
    })
}
