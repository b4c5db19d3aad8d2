//! The stimulus (`--stimulus`): a table `tick,name,value` of what the machine and the operator do. It
//! is read and checked as a whole before the first tick, and then played tick by tick.

use std::collections::HashMap;

use crate::{Executive, NameError, Names, Purpose, Setting, VariableKey};

/// At most this many mistakes of a stimulus are reported, the rest is counted.
const MAX_ERRORS: usize = 20;

/// The longest name, in bytes. Longer ones are refused before they are looked up.
const MAX_NAME: usize = 60;

/// How many characters of a line or a value a message shows at most.
const MAX_SHOWN: usize = 60;

/// A row whose name was found and whose value was checked.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Row {
    tick: u64,
    /// The index of its variable in the stimulus's list.
    variable: usize,
    value: Setting,
}

/// A stimulus for one program.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Stimulus {
    /// The variables that it sets, in the order in which they are first named.
    variables: Vec<VariableKey>,
    /// By rising tick; rows of one tick in the order in which they were written.
    rows: Vec<Row>,
}

/// What is wrong with a line of a stimulus.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LineError {
    /// The line, from 1.
    pub line: u64,
    /// What is wrong.
    pub message: String,
}

/// What is wrong with a stimulus: the first lines, and how many more there are.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StimulusError {
    /// The first lines with a mistake.
    pub lines: Vec<LineError>,
    /// How many there are beyond those.
    pub more: usize,
}

impl Stimulus {
    /// Reads a stimulus for ticks of `tick_ns` nanoseconds: UTF-8 with or without a byte order mark, lines that end in LF, CR LF or
    /// CR, empty lines anywhere, fields plain or in double quotes. A Ctrl-Z at the end, which DOS
    /// programs write, is ignored.
    ///
    /// # Errors
    /// A missing header, a row that has no three fields, a tick that is neither a number nor a time, a name that
    /// the program does not have or that can't be set, a value that does not fit.
    pub fn parse(bytes: &[u8], names: &dyn Names, tick_ns: u64) -> Result<Self, StimulusError> {
        let text = String::from_utf8_lossy(bytes);
        let text = text.strip_prefix('\u{FEFF}').unwrap_or(&text);
        let text = text.trim_end().strip_suffix('\u{1A}').unwrap_or(text);
        let mut reader = Reader {
            names,
            tick_ns: tick_ns.max(1),
            known: HashMap::new(),
            numbers: HashMap::new(),
            variables: vec![],
        };
        let mut rows: Vec<Row> = vec![];
        let mut errors = StimulusError { lines: vec![], more: 0 };
        let mut has_header = false;
        for (line, number) in lines(text).zip(1u64..) {
            if line.trim().is_empty() {
                continue;
            }
            let read = match has_header {
                true => reader.rows(line),
                false => header(line).map(|()| [None, None]),
            };
            has_header = true;
            match read {
                Ok(read) => rows.extend(read.into_iter().flatten()),
                Err(message) if errors.lines.len() < MAX_ERRORS => {
                    errors.lines.push(LineError { line: number, message });
                }
                Err(_) => errors.more += 1,
            }
        }
        if !has_header {
            let message = "the header `tick,name,value` is missing".to_owned();
            errors.lines.push(LineError { line: 1, message });
        }
        if !errors.lines.is_empty() {
            return Err(errors);
        }
        if !rows.is_sorted_by_key(|row| row.tick) {
            rows.sort_by_key(|row| row.tick);
        }
        Ok(Self { variables: reader.variables, rows })
    }

    /// The variables that it sets, in the order in which they are first named.
    pub fn variables(&self) -> &[VariableKey] {
        &self.variables
    }

    /// The number of ticks after which the table begins again with `--repeat`: the last tick in it,
    /// plus one. 0 where there are no rows.
    pub fn period(&self) -> u64 {
        self.rows.last().map_or(0, |row| row.tick.saturating_add(1))
    }
}

/// Plays a stimulus tick by tick.
#[derive(Clone, Debug)]
pub struct Player {
    stimulus: Stimulus,
    /// The index of the row that is applied next.
    next: usize,
    /// The tick at which the table was last begun.
    start: u64,
    /// After how many ticks it begins again, if it does.
    period: Option<u64>,
}

impl Player {
    /// Plays a stimulus from tick 0 on, once or, where `repeat` says so, again and again.
    pub fn new(stimulus: Stimulus, repeat: bool) -> Self {
        let period = Some(stimulus.period()).filter(|&period| repeat && period > 0);
        Self { stimulus, next: 0, start: 0, period }
    }

    /// Applies the rows of a tick. It is called for ticks in rising order, from 0. Only ticks before the one
    /// that [`next_after`](Self::next_after) gives may be left out, since they have no rows.
    #[inline]
    pub fn apply(&mut self, tick: u64, executive: &mut dyn Executive) {
        if let Some(period) = self.period
            && tick - self.start >= period
        {
            self.start = tick;
            self.next = 0;
        }
        while let Some(row) = self.stimulus.rows.get(self.next)
            && row.tick <= tick - self.start
        {
            if let Some(&variable) = self.stimulus.variables.get(row.variable) {
                executive.write(variable, row.value);
            }
            self.next += 1;
        }
    }

    /// The rows of a tick, in their order: the variable and its value.
    pub fn rows_of(&self, tick: u64) -> impl Iterator<Item = (VariableKey, Setting)> {
        let tick = self.period.map_or(tick, |period| tick % period);
        let rows = &self.stimulus.rows;
        let from = rows.partition_point(|row| row.tick < tick);
        let rows = rows.iter().skip(from).take_while(move |row| row.tick == tick);
        rows.filter_map(|row| Some((*self.stimulus.variables.get(row.variable)?, row.value)))
    }

    /// Goes on with another program, in which the stimulus's variables have these keys, in the order of
    /// [`Stimulus::variables`]. The former keys are in `keys` afterwards.
    pub fn exchange_keys(&mut self, keys: &mut [VariableKey]) {
        self.stimulus
            .variables
            .iter_mut()
            .zip(keys)
            .for_each(|(own, new)| std::mem::swap(own, new));
    }

    /// Goes on from `tick`, as if everything before it had been applied.
    pub fn seek(&mut self, tick: u64) {
        self.start = self.period.map_or(0, |period| tick / period * period);
        let start = self.start;
        self.next = self.stimulus.rows.partition_point(|row| row.tick < tick - start);
    }

    /// The next tick after `tick` at which something has to be applied, when everything up to `tick` was:
    /// the next row's, or the one at which the table begins again. `u64::MAX` where nothing follows.
    pub fn next_after(&self, tick: u64) -> u64 {
        let next = self.stimulus.rows.get(self.next).map(|row| row.tick);
        let next = next.or(self.period).map_or(u64::MAX, |next| self.start.saturating_add(next));
        next.max(tick.saturating_add(1))
    }
}

/// Lines without their ends.
fn lines(text: &str) -> impl Iterator<Item = &str> {
    let mut rest = Some(text);
    std::iter::from_fn(move || {
        let text = rest?;
        let Some(end) = text.find(['\n', '\r']) else {
            rest = None;
            return Some(text);
        };
        let (line, tail) = text.split_at(end);
        rest = tail.strip_prefix("\r\n").or_else(|| tail.get(1..));
        Some(line)
    })
}

/// The three fields of a line, without blanks and quotes around them; `None` where there are not three.
fn fields(line: &str) -> Option<[&str; 3]> {
    let mut quoted = false;
    let is_end = move |c: char| {
        quoted ^= c == '"';
        c == ',' && !quoted
    };
    let mut parts = line.split(is_end).map(|part| {
        let part = part.trim();
        part.strip_prefix('"').and_then(|part| part.strip_suffix('"')).unwrap_or(part).trim()
    });
    let fields = [parts.next()?, parts.next()?, parts.next()?];
    parts.next().is_none().then_some(fields)
}

/// Checks that a line is the header.
fn header(line: &str) -> Result<(), String> {
    match fields(line) {
        Some([tick, name, value])
            if [tick, name, value]
                .iter()
                .zip(["tick", "name", "value"])
                .all(|(field, word)| field.eq_ignore_ascii_case(word)) =>
        {
            Ok(())
        }
        _ => Err(format!("the header `tick,name,value` is expected, not `{}`", shown(line))),
    }
}

/// A line, cut where it is long.
fn shown(line: &str) -> String {
    match line.trim().char_indices().nth(MAX_SHOWN) {
        Some((end, _)) => format!("{}…", line.trim().get(..end).unwrap_or_default()),
        None => line.trim().to_owned(),
    }
}

/// The units of times, in nanoseconds. Longer names that end as shorter ones do come first.
const UNITS: [(&str, u128); 6] = [
    ("us", 1_000),
    ("ms", 1_000_000),
    ("min", 60_000_000_000),
    ("m", 60_000_000_000),
    ("h", 3_600_000_000_000),
    ("s", 1_000_000_000),
];

/// The most digits of a time.
const MAX_DIGITS: usize = 18;

/// The tick that a field names: its number, or a time with its unit, rounded up to whole ticks.
fn tick_of(field: &str, tick_ns: u64) -> Result<u64, String> {
    let is_digits = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    let wrong = || {
        let field = shown(field);
        format!(
            "`{field}` is not a tick: ticks are whole numbers from 0, or times such as 2s, 1.5s and 40ms"
        )
    };
    if !field.is_empty() && is_digits(field) {
        return field.parse().map_err(|_| format!("tick {} is too large", shown(field)));
    }
    let lower = field.to_ascii_lowercase();
    let time = UNITS.iter().find_map(|(unit, ns)| Some((lower.strip_suffix(unit)?.trim(), *ns)));
    let (number, unit) = time.ok_or_else(wrong)?;
    let (whole, fraction) = number.split_once('.').unwrap_or((number, ""));
    let length = whole.len() + fraction.len();
    if length == 0 || length > MAX_DIGITS || !is_digits(whole) || !is_digits(fraction) {
        return Err(wrong());
    }
    let digits: u128 = format!("{whole}{fraction}").parse().map_err(|_| wrong())?;
    let scale = 10_u128.pow(fraction.len() as u32) * u128::from(tick_ns);
    u64::try_from((digits * unit).div_ceil(scale)).map_err(|_| wrong())
}

/// Reads rows.
struct Reader<'a, 't> {
    names: &'a dyn Names,
    tick_ns: u64,
    /// The spellings that were looked up already, with the indices of their variables, and these.
    known: HashMap<&'t str, (usize, VariableKey)>,
    /// The index of each variable.
    numbers: HashMap<VariableKey, usize>,
    variables: Vec<VariableKey>,
}

impl<'t> Reader<'_, 't> {
    /// The row of a line; two where a key is pressed and let go.
    fn rows(&mut self, line: &'t str) -> Result<[Option<Row>; 2], String> {
        let Some([tick, name, value]) = fields(line) else {
            return Err(format!("`{}` is not a row of three fields tick,name,value", shown(line)));
        };
        let tick = tick_of(tick, self.tick_ns)?;
        if name.len() > MAX_NAME {
            return Err(format!("`{}` is too long for a name", shown(name)));
        }
        let (variable, key) = match self.known.get(name) {
            Some(known) => *known,
            None => {
                let found = self.names.find(name, Purpose::Stimulus);
                let key = found.map_err(|error| match (&error, name.get(..4)) {
                    (NameError::Unknown { .. } | NameError::Unfit { .. }, Some(prefix))
                        if prefix.eq_ignore_ascii_case("KEY.") && !self.names.has_keys() =>
                    {
                        format!("`{}`: keys are there with --simulate alone", shown(name))
                    }
                    _ => error.to_string(),
                })?;
                let variable = *self.numbers.entry(key).or_insert_with(|| {
                    self.variables.push(key);
                    self.variables.len() - 1
                });
                self.known.insert(name, (variable, key));
                (variable, key)
            }
        };
        if value.eq_ignore_ascii_case("press")
            && let Some(press) = self.names.press(key)
        {
            let row = |tick, value| Some(Row { tick, variable, value: Setting::Int(value) });
            return Ok([row(tick, 1), row(tick.saturating_add(press.ticks), 0)]);
        }
        let value = self.names.parse(key, value);
        let value = value.map_err(|mut error| {
            error.value = shown(&error.value);
            format!("{name}: {error}")
        })?;
        Ok([Some(Row { tick, variable, value }), None])
    }
}

#[cfg(test)]
mod tests {
    use super::tick_of;

    #[test]
    fn a_time_is_rounded_up_to_whole_ticks() {
        let tick = |field| tick_of(field, 20_000_000).ok();
        assert_eq!(tick("7"), Some(7));
        assert_eq!(tick("2s"), Some(100));
        assert_eq!(tick("1.5S"), Some(75));
        assert_eq!((tick("40ms"), tick("41ms"), tick("0.001 ms")), (Some(2), Some(3), Some(1)));
        assert_eq!((tick("1min"), tick("1h"), tick("0s")), (Some(3000), Some(180_000), Some(0)));
        for field in ["", "s", "-1s", "1.2.3s", "1e3s", "ten", "1 tick", "9999999999999999999s"] {
            assert_eq!(tick(field), None, "{field}");
        }
    }
}
