//! Values of variables at the moment that is shown: from the control itself while the newest tick is
//! shown, else from the run or recording.

use std::collections::BTreeMap;

use plcc_abi::Dialect;
use plcc_frontend::{Language, language};
use serde_json::Value as Json;

use super::Session;
use crate::{Format, Refusal};

/// The values of variables after one tick.
#[derive(Clone, Debug, Default)]
pub(super) struct Moment {
    /// When that was, for people: the number of the tick.
    pub(super) text: String,
    /// Whether they come from the control itself, and so are not those of the tick that is shown.
    pub(super) live: bool,
    pub(super) values: BTreeMap<String, f64>,
}

impl Session<'_> {
    /// Whether values come from the control itself.
    pub(super) fn is_live(&self) -> bool {
        let connected = self.link.as_ref().is_some_and(|link| link.status().is_some());
        connected && (self.time.following || self.debugger.is_none())
    }

    /// The values of variables that are not arrays: from the control while the newest tick is shown, else from the
    /// run or recording. A name that has no value is left out.
    pub(super) fn read(&mut self, names: &[String]) -> Result<Moment, Refusal> {
        if names.is_empty() {
            return Ok(Moment { text: format!("tick {}", self.time.shown), ..Moment::default() });
        }
        if self.is_live()
            && let Some(link) = &mut self.link
        {
            let wanted: Vec<String> =
                names.iter().filter(|name| !self.unreadable.contains(*name)).cloned().collect();
            let (first, found) = match link.get(&wanted) {
                Ok(found) => found,
                Err(_) => {
                    // One of them is none of the control's variables: find out which.
                    let mut found = plcc_protocol::Values::default();
                    let mut first = None;
                    for name in &wanted {
                        match link.get(std::slice::from_ref(name)) {
                            Ok((ticks, one)) => {
                                first.get_or_insert(ticks);
                                found.ticks = one.ticks;
                                found.values.extend(one.values);
                            }
                            Err(_) if link.status().is_some() => {
                                self.unreadable.insert(name.clone());
                            }
                            Err(error) => return Err(error),
                        }
                    }
                    (first.unwrap_or(found.ticks), found)
                }
            };
            let number = |value: &Json| value.as_f64();
            let values = found
                .values
                .iter()
                .filter_map(|(name, value)| Some((name.clone(), number(value)?)));
            let mut moment = Moment {
                text: match first == found.ticks {
                    true => format!("the control, {first} ticks done"),
                    // More than the control gives of one moment.
                    false => {
                        format!("the control, read while it did ticks {first} to {}", found.ticks)
                    }
                },
                live: true,
                values: values.collect(),
            };
            // Constants are not among the control's variables.
            if self.debugger.is_some() && moment.values.len() < names.len() {
                let missing: Vec<String> = names
                    .iter()
                    .filter(|name| !moment.values.contains_key(*name))
                    .cloned()
                    .collect();
                if let Ok(known) = self.read_run(&missing) {
                    moment.values.extend(known.values);
                }
            }
            return Ok(moment);
        }
        self.read_run(names)
    }

    /// The same for what a language shows: the values alone, and a text as the error.
    pub(super) fn read_values(
        &mut self,
        names: &[String],
    ) -> Result<BTreeMap<String, f64>, String> {
        self.read(names).map(|moment| moment.values).map_err(|refusal| refusal.message)
    }

    /// The values at the end of the tick that is shown, of the run or recording.
    fn read_run(&mut self, names: &[String]) -> Result<Moment, Refusal> {
        let (tick, executive_tick) = (self.time.shown, self.executive_tick);
        if executive_tick != Some(tick) {
            self.executive_tick = None;
        }
        let debugger = self.debugger()?;
        if tick >= debugger.history().known() {
            return Err(Refusal::new("no tick was run yet"));
        }
        let text = format!("the end of tick {tick}");
        if executive_tick == Some(tick) {
            return Ok(Moment { text, live: false, values: debugger.numbers_now(names) });
        }
        debugger.go_to_end_of_tick(tick)?;
        Ok(Moment { text, live: false, values: debugger.numbers(names)? })
    }

    /// The process image at the end of the tick that is shown; `None` if it was not run yet.
    pub(super) fn shown_image(&mut self) -> Result<Option<Vec<u8>>, Refusal> {
        let (tick, executive_tick) = (self.time.shown, self.executive_tick);
        let debugger = self.debugger()?;
        if tick >= debugger.history().known() {
            return Ok(None);
        }
        if executive_tick == Some(tick) {
            return Ok(Some(debugger.history_mut().executive().image().to_vec()));
        }
        debugger.go_to_end_of_tick(tick)?;
        let image = debugger.image()?;
        self.executive_tick = None;
        Ok(Some(image))
    }

    /// The language; of a control without a record as the control says it.
    pub(super) fn dialect(&self) -> Option<Dialect> {
        if let Some(debugger) = &self.debugger {
            return Some(debugger.program().tables().dialect());
        }
        let name = &self.link.as_ref()?.status()?.dialect;
        Dialect::ALL.iter().copied().find(|dialect| dialect.name() == name)
    }

    /// The same as what it is to be asked.
    pub(super) fn language(&self) -> Option<&'static dyn Language> {
        self.dialect().map(language)
    }
}

/// A number in a format, as a language writes it.
pub(super) fn formatted(value: f64, format: Format, language: Option<&dyn Language>) -> String {
    let numbers = language.map(Language::numbers);
    let is_integer = value.fract() == 0.0 && value.abs() < 9.0e18;
    match (format, numbers.filter(|_| is_integer)) {
        (Format::Hexadecimal, Some(numbers)) => numbers.hexadecimal(value as i64),
        (Format::Binary, Some(numbers)) => numbers.binary(value as i64),
        _ => plcc_runtime::value::number(value),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn formatted(value: f64, format: Format, dialect: Option<Dialect>) -> String {
        super::formatted(value, format, dialect.map(language))
    }

    #[test]
    fn numbers_are_written_as_the_languages_do() {
        let hexadecimal = |value, dialect| formatted(value, Format::Hexadecimal, Some(dialect));
        assert_eq!(hexadecimal(-1.0, Dialect::Pmi), "FFFFh");
        assert_eq!(hexadecimal(70000.0, Dialect::Pmi), "00011170h");
        assert_eq!(hexadecimal(255.0, Dialect::Nct), ".00FF");
        assert_eq!(hexadecimal(-2.0, Dialect::Pmac), "$FFFFFE");
        assert_eq!(hexadecimal(0.5, Dialect::Pmac), "0.5");
        assert_eq!(formatted(5.0, Format::Binary, Some(Dialect::Nct)), "0000 0000 0000 0101");
        assert_eq!(
            formatted(1e300, Format::Binary, Some(Dialect::Pmac)),
            formatted(1e300, Format::Decimal, None)
        );
    }
}
