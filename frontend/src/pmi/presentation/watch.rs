//! The rows of an entry of the watch list (PMI 5.2): of an array its elements, of a timer or flip-flop its pins.

use plcc_abi::pmi::{PmiTables, Role, Symbol};

use crate::presentation::{MAX_ROWS, WatchRow};

/// The rows of an entry.
pub(super) fn rows(tables: &PmiTables, entry: &str) -> Result<Vec<WatchRow>, String> {
    let (base, index) = match entry.split_once('[') {
        Some((base, rest)) => (base.trim(), rest.strip_suffix(']').map(str::trim)),
        None => (entry, None),
    };
    let find = |name: &str| tables.symbols.iter().find(|symbol| symbol.name == name);
    let Some(symbol) = find(base) else { return Ok(vec![WatchRow::of(entry)]) };
    if let Some(elements) = symbol.elements {
        let (first, last) = match index {
            None | Some("*") => (0, elements.saturating_sub(1)),
            Some(range) => {
                let (first, last) = range.split_once('-').unwrap_or((range, range));
                let number = |text: &str| text.trim().parse::<u32>().ok();
                let wrong = || format!("`{range}` is neither `*`, N nor M-N");
                (number(first).ok_or_else(wrong)?, number(last).ok_or_else(wrong)?)
            }
        };
        if first > last || last >= elements {
            let end = elements.saturating_sub(1);
            return Err(format!("the elements are {base}[0] to {base}[{end}]"));
        }
        let last = last.min(first + MAX_ROWS - 1);
        return Ok((first..=last).map(|index| WatchRow::of(format!("{base}[{index}]"))).collect());
    }
    let name_at = |offset: u32| {
        let at = |symbol: &&Symbol| symbol.offset == offset && symbol.elements.is_none();
        tables.symbols.iter().find(at).map(|symbol| symbol.name.clone())
    };
    if let Role::TimerControl(timer) = symbol.role
        && let Some(timer) = tables.timers.get(timer as usize)
    {
        let delay = WatchRow::titled(format!("{base}#DELAY"), "delay value");
        let delay = WatchRow { fixed: Some(f64::from(timer.preset)), ..delay };
        let contact = name_at(timer.delayed).map(|name| WatchRow::titled(name, "delayed contact"));
        let mut rows = vec![WatchRow::titled(base, "control contact")];
        rows.extend(contact);
        rows.extend([delay, WatchRow::titled(format!("{base}#COUNT"), "timer counter")]);
        return Ok(rows);
    }
    let flip_flop = tables.flipflops.iter().find(|one| one.q == symbol.offset);
    if let Some(one) = flip_flop {
        let pins = [
            (Some(one.q), "Q"),
            (one.d, "D"),
            (one.clock, "CK"),
            (one.preset, "PR"),
            (one.clear, "CL"),
        ];
        let rows = pins
            .into_iter()
            .filter_map(|(offset, pin)| Some(WatchRow::titled(name_at(offset?)?, pin)));
        return Ok(rows.collect());
    }
    Ok(vec![WatchRow::of(entry)])
}

/// Whether a name means a number of the source: the delay of a timer, or a constant.
pub(super) fn is_in_source(tables: &PmiTables, name: &str) -> bool {
    let base = name.split_once('[').map_or(name, |(base, _)| base);
    let symbol = tables.symbols.iter().find(|symbol| symbol.name == base);
    name.ends_with("#DELAY") || symbol.is_some_and(|symbol| symbol.role == Role::Constant)
}
