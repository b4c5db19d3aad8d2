//! I5, I8, the timers of servo cycles, and the numbers of the PLCs without text.

use plcc_abi::number;

use crate::presentation::{Fact, Read};

/// What is shown beside the tasks, of which `tasks` are the names; `tick_ns` is the length of a servo cycle.
pub(super) fn facts(tasks: &[String], tick_ns: u64, read: Read<'_>) -> Result<Vec<Fact>, String> {
    let mut facts = vec![];
    let names = ["I5", "I8", "X:$700", "Y:$700", "X:$701", "Y:$701"];
    let names: Vec<String> = names.iter().map(|name| (*name).to_owned()).collect();
    let values = read(&names)?;
    for name in &names {
        let Some(&value) = values.get(name) else { continue };
        let text = match name.starts_with('I') {
            true => number(value),
            // The timers count servo cycles down; 24 bits with a sign.
            false => {
                let signed =
                    if value >= f64::from(1 << 23) { value - f64::from(1 << 24) } else { value };
                format!("{signed} cycles, {:.1} ms", signed * tick_ns as f64 / 1e6)
            }
        };
        facts.push(Fact { title: name.clone(), value: text });
    }
    for (title, kind) in [("empty PLCs", "PLC"), ("empty PLCCs", "PLCC")] {
        let is_empty = |number: &u32| !tasks.contains(&format!("{kind}{number}"));
        let value = ranges((0..32).filter(is_empty));
        facts.push(Fact { title: title.into(), value });
    }
    Ok(facts)
}

/// Numbers as a list of ranges.
fn ranges(numbers: impl Iterator<Item = u32>) -> String {
    let mut found: Vec<(u32, u32)> = vec![];
    for number in numbers {
        match found.last_mut() {
            Some((_, last)) if *last + 1 == number => *last = number,
            _ => found.push((number, number)),
        }
    }
    let text = |&(first, last): &(u32, u32)| match first == last {
        true => first.to_string(),
        false => format!("{first}-{last}"),
    };
    found.iter().map(text).collect::<Vec<_>>().join(" ")
}
