//! The keys of one table, which are taken one by one; what is left is unknown.

use alloc::{format, string::String, vec::Vec};

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::super::reference::machine_table;
use super::{Decimal, Located};

/// Nanoseconds of a millisecond.
const MILLISECOND: i128 = 1_000_000;
/// The longest time, a day.
const LONGEST: i128 = 86_400_000 * MILLISECOND;
/// The largest number of a length or speed.
const LARGEST: i128 = 1_000_000;

/// The keys of a table that were not taken yet.
pub(super) struct Fields<'a, 't> {
    text: &'a str,
    table: &'a DeTable<'t>,
    /// What the table is called in messages.
    title: &'a str,
    /// The line in which it begins.
    pub(super) line: u32,
    /// The keys that were asked for.
    known: Vec<&'static str>,
}

/// The line of an offset, from 1.
pub(super) fn line(text: &str, offset: usize) -> u32 {
    let before = text.as_bytes().get(..offset).unwrap_or_default();
    before.iter().filter(|byte| **byte == b'\n').count() as u32 + 1
}

/// A text that a table has.
pub(super) type Text = Located<String>;

impl<'a, 't> Fields<'a, 't> {
    pub(super) fn new(
        text: &'a str,
        title: &'a str,
        table: &'a DeTable<'t>,
        offset: usize,
    ) -> Self {
        Self { text, table, title, line: line(text, offset), known: Vec::new() }
    }

    /// The value of a key, if the table has it.
    pub(super) fn take(&mut self, key: &'static str) -> Option<&'a Spanned<DeValue<'t>>> {
        debug_assert!(self.is_in_reference(key), "{}: {key}", self.title);
        self.known.push(key);
        self.table.iter().find(|(name, _)| name.get_ref() == key).map(|(_, value)| value)
    }

    /// Whether editors are told of a key.
    fn is_in_reference(&self, key: &str) -> bool {
        let title = self.title.trim_matches(['[', ']']);
        let is_key = machine_table(title).is_some_and(|table| table.keys.get(key).is_some());
        is_key || machine_table(&format!("{title}.{key}")).is_some()
    }

    /// Says what is wrong with a key's value.
    pub(super) fn wrong(&self, at: &Spanned<DeValue<'_>>, what: &str) -> String {
        format!("line {}: {what}", line(self.text, at.span().start))
    }

    /// Refuses the keys that nobody has asked for.
    pub(super) fn finish(self) -> Result<(), String> {
        let unknown = self.table.iter().find(|(name, _)| !self.known.contains(&&**name.get_ref()));
        let Some((name, _)) = unknown else { return Ok(()) };
        let line = line(self.text, name.span().start);
        let near = crate::closest(name.get_ref(), self.known.iter().copied());
        let near = near.map_or(String::new(), |near| format!("; did you mean `{near}`?"));
        Err(format!("line {line}: `{}` is not a key of {}{near}", name.get_ref(), self.title))
    }

    pub(super) fn text(&mut self, key: &'static str) -> Result<Option<Text>, String> {
        let Some(found) = self.take(key) else { return Ok(None) };
        text_of(self, found, key).map(Some)
    }

    /// A text that must be there.
    pub(super) fn needed(&mut self, key: &'static str) -> Result<Text, String> {
        let missing = format!("line {}: {} needs the key `{key}`", self.line, self.title);
        self.text(key)?.ok_or(missing)
    }

    pub(super) fn flag(&mut self, key: &'static str) -> Result<Option<bool>, String> {
        let Some(found) = self.take(key) else { return Ok(None) };
        let flag = found.get_ref().as_bool();
        let wrong = || self.wrong(found, &format!("{key} is true or false"));
        flag.map(Some).ok_or_else(wrong)
    }

    /// One of two words; whether it is the second one.
    pub(super) fn choice(
        &mut self,
        key: &'static str,
        words: [&str; 2],
    ) -> Result<Option<bool>, String> {
        let Some(found) = self.take(key) else { return Ok(None) };
        let [first, second] = words;
        match found.get_ref().as_str() {
            Some(word) if word == first => Ok(Some(false)),
            Some(word) if word == second => Ok(Some(true)),
            _ => Err(self.wrong(found, &format!("{key} is \"{first}\" or \"{second}\""))),
        }
    }

    /// A number, by its digits.
    pub(super) fn number(&mut self, key: &'static str) -> Result<Option<Decimal>, String> {
        let Some(found) = self.take(key) else { return Ok(None) };
        number_of(self, found, key).map(Some)
    }

    /// A number above 0.
    pub(super) fn positive(&mut self, key: &'static str) -> Result<Option<Decimal>, String> {
        let number = self.number(key)?;
        if number.is_some_and(|number| number.is_negative() || number.is_zero()) {
            let at = self.take(key).map_or(self.line, |at| line(self.text, at.span().start));
            return Err(format!("line {at}: {key} is above 0"));
        }
        Ok(number)
    }

    /// A whole number in a range.
    pub(super) fn integer(
        &mut self,
        key: &'static str,
        low: i64,
        high: i64,
    ) -> Result<Option<i64>, String> {
        let Some(found) = self.take(key) else { return Ok(None) };
        let number = decimal(found.get_ref()).and_then(Decimal::integer);
        let number = number.and_then(|number| i64::try_from(number).ok());
        let number = number.filter(|number| (low..=high).contains(number));
        let wrong = || self.wrong(found, &format!("{key} is a whole number from {low} to {high}"));
        number.map(Some).ok_or_else(wrong)
    }

    /// A time in milliseconds, as nanoseconds.
    pub(super) fn time(&mut self, key: &'static str) -> Result<Option<u64>, String> {
        let Some(found) = self.take(key) else { return Ok(None) };
        let time = decimal(found.get_ref()).and_then(|number| number.times(MILLISECOND));
        let time = time.filter(|time| (0..=LONGEST).contains(time));
        let wrong =
            || self.wrong(found, &format!("{key} is a number of milliseconds from 0 to 86400000"));
        time.map(|time| Some(time as u64)).ok_or_else(wrong)
    }

    /// A list of texts.
    pub(super) fn texts(&mut self, key: &'static str) -> Result<Option<Vec<Text>>, String> {
        let Some(found) = self.take(key) else { return Ok(None) };
        let list = found.get_ref().as_array();
        let list = list.ok_or_else(|| self.wrong(found, &format!("{key} is a list of texts")))?;
        list.iter().map(|item| text_of(self, item, key)).collect::<Result<_, _>>().map(Some)
    }
}

/// The digits of a number; `None` for anything else, and for what is not written in decimal.
fn decimal(value: &DeValue<'_>) -> Option<Decimal> {
    let digits = match value {
        DeValue::Integer(integer) if integer.radix() == 10 => integer.as_str(),
        DeValue::Float(float) => float.as_str(),
        _ => return None,
    };
    Decimal::parse(digits)
}

/// A number for a length or a speed.
pub(super) fn number_of(
    fields: &Fields<'_, '_>,
    at: &Spanned<DeValue<'_>>,
    key: &str,
) -> Result<Decimal, String> {
    let number = decimal(at.get_ref());
    let fits = |number: &Decimal| number.times(1).is_some_and(|n| n.abs() <= LARGEST);
    let wrong = || fields.wrong(at, &format!("{key} is a number from -{LARGEST} to {LARGEST}"));
    number.filter(fits).ok_or_else(wrong)
}

pub(super) fn text_of(
    fields: &Fields<'_, '_>,
    at: &Spanned<DeValue<'_>>,
    key: &str,
) -> Result<Text, String> {
    let text = at.get_ref().as_str();
    let text = text.ok_or_else(|| fields.wrong(at, &format!("{key} is a text in quotes")))?;
    Ok(Located { value: text.into(), line: line(fields.text, at.span().start) })
}
