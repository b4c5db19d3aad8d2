//! Reads a trace in the form of a table, as `--trace` writes it: `tick,name,value` or `tick,ms,name,value`.

use super::{Picture, TimeUnit};

/// At most this many lines that are wrong are told, the others are counted.
const MAX_ERRORS: usize = 20;
/// How many characters of a line are shown at most.
const MAX_SHOWN: usize = 60;

/// A line of a table.
struct Row<'t> {
    tick: u64,
    time: f64,
    name: &'t str,
    values: Vec<f64>,
    is_array: bool,
}

/// Makes a picture of a table.
///
/// # Errors
/// The first lines that are wrong, each with its number and what is wrong, and how many there are besides.
pub(crate) fn read_table(text: &str) -> Result<Picture, Vec<(usize, String)>> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut lines = text.lines().zip(1usize..).filter(|(line, _)| !line.trim().is_empty());
    let header = lines.next().map_or("", |(line, _)| line).trim();
    let unit = match header.to_ascii_lowercase().as_str() {
        "tick,name,value" => TimeUnit::Ticks,
        "tick,ms,name,value" => TimeUnit::Milliseconds,
        _ => {
            let text = format!(
                "the header `tick,name,value` or `tick,ms,name,value` of a trace is expected, not `{}`; \
                 `plcc run --watch NAMES --trace OUT.csv` writes one",
                shown(header)
            );
            return Err(vec![(1, text)]);
        }
    };
    let mut picture = Picture::new(unit);
    let mut errors = vec![];
    let mut more = 0;
    let mut last = 0;
    for (line, number) in lines {
        let row = row(line, unit).and_then(|row| match row.tick >= last {
            true => Ok(row),
            false => Err(format!(
                "tick {} comes after tick {last}; a trace is in the order of ticks",
                row.tick
            )),
        });
        match row {
            Ok(row) => {
                last = row.tick;
                for (index, &value) in row.values.iter().enumerate() {
                    let series = match row.is_array {
                        true => picture.add(&format!("{}[{index}]", row.name)),
                        false => picture.add(row.name),
                    };
                    picture.sample(series, row.tick, row.time, value);
                }
            }
            Err(message) if errors.len() < MAX_ERRORS => errors.push((number, message)),
            Err(_) => more += 1,
        }
    }
    match (errors.last_mut(), more) {
        (None, _) => Ok(picture),
        (Some(_), 0) => Err(errors),
        (Some((_, last)), more) => {
            last.push_str(&format!("\nand {more} more lines are wrong"));
            Err(errors)
        }
    }
}

/// Reads a line. The name is what stands between tick and value, whatever characters it has.
fn row(line: &str, unit: TimeUnit) -> Result<Row<'_>, String> {
    let wrong = || format!("`{}` is not a row of a trace", shown(line));
    let (tick, rest) = line.split_once(',').ok_or_else(wrong)?;
    let tick = tick
        .trim()
        .parse()
        .map_err(|_| format!("`{}` is not a tick: ticks are whole numbers from 0", shown(tick)))?;
    let (time, rest) = match unit {
        TimeUnit::Ticks => (tick as f64, rest),
        TimeUnit::Milliseconds => {
            let (ms, rest) = rest.split_once(',').ok_or_else(wrong)?;
            (
                number(ms)
                    .filter(|ms| *ms >= 0.0)
                    .ok_or_else(|| format!("`{}` is not a time in milliseconds", shown(ms)))?,
                rest,
            )
        }
    };
    let rest = rest.trim_end();
    let quoted = rest.strip_suffix("]\"").and_then(|rest| rest.rsplit_once(",\"["));
    let (name, values, is_array) = match quoted {
        Some((name, elements)) if elements.trim().is_empty() => (name, vec![], true),
        Some((name, elements)) => (name, elements.split(',').collect(), true),
        None => {
            let (name, value) = rest.rsplit_once(',').ok_or_else(wrong)?;
            (name, vec![value], false)
        }
    };
    let value =
        |text: &str| number(text).ok_or_else(|| format!("`{}` is not a number", shown(text)));
    let values = values.into_iter().map(value).collect::<Result<_, _>>()?;
    Ok(Row { tick, time, name: name.trim().trim_matches('"'), values, is_array })
}

/// A number as traces have it.
fn number(text: &str) -> Option<f64> {
    text.trim().parse().ok().filter(|number: &f64| number.is_finite())
}

/// A text, cut where it is long.
fn shown(text: &str) -> String {
    let text = text.trim();
    match text.char_indices().nth(MAX_SHOWN) {
        Some((end, _)) => format!("{}…", text.get(..end).unwrap_or_default()),
        None => text.into(),
    }
}
