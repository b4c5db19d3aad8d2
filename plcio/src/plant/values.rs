//! The points of a control, their values as JSON, and the message with all of them.

use std::time::SystemTime;

use plcc_configuration::Point;
use plcc_configuration::drivers::zenoh::ZenohVariable;
use serde_json::{Map, Value as Json};

use crate::session::Shared;

/// A point that is published or may be written.
pub(super) struct KeyedPoint {
    /// The index in the hub.
    pub(super) index: usize,
    pub(super) name: String,
    /// The key of its value.
    pub(super) key: String,
    pub(super) is_bit: bool,
    /// Whether others may write it: it is given from outside, and follows no variable of another control.
    pub(super) is_written: bool,
}

/// An input that follows a variable of another control.
pub(super) struct FollowedPoint {
    /// The index in the hub.
    pub(super) index: usize,
    /// The name of the other control.
    pub(super) control: String,
    /// The variable of the other control.
    pub(super) variable: String,
}

/// All points of the driver, and the key of their control.
pub(super) struct Points {
    pub(super) shared: Shared,
    /// The key of the control.
    pub(super) base: String,
    pub(super) keyed: Vec<KeyedPoint>,
    pub(super) followed: Vec<FollowedPoint>,
}

/// What the control was doing at a tick, and the value of each point outside, in the order of [`Points::keyed`].
#[derive(PartialEq)]
pub(super) struct Values {
    pub(super) state: &'static str,
    /// The bits of the numbers, so that they can be compared; `None` before the first tick.
    pub(super) values: Vec<Option<u64>>,
}

/// A variable's name as a part of a key: what has a meaning in keys becomes `%` and two hexadecimal digits.
pub(super) fn key_part(name: &str) -> String {
    let mut part = String::new();
    for letter in name.chars() {
        match letter {
            '*' | '$' | '?' | '#' | '/' | '%' => {
                part.push_str(&format!("%{:02X}", u32::from(letter)));
            }
            _ => part.push(letter),
        }
    }
    part
}

/// A value as JSON, which has neither infinity nor NaN: they are `null`.
pub(super) fn json_of(value: f64, is_bit: bool) -> Json {
    match is_bit {
        true => Json::Bool(value != 0.0),
        false if value.fract() == 0.0 && value.abs() < 9e15 => Json::from(value as i64),
        false => Json::from(value),
    }
}

/// The number that a value in JSON is: a number, or `true` or `false` for a bit.
pub(super) fn number_of(value: &Json, is_bit: bool) -> Option<f64> {
    match value {
        Json::Bool(bit) if is_bit => Some(f64::from(*bit)),
        Json::Number(number) => {
            number.as_f64().filter(|number| !is_bit || [0.0, 1.0].contains(number))
        }
        _ => None,
    }
}

impl KeyedPoint {
    /// The last part of its key, which is that of the key to which others write.
    pub(super) fn part(&self) -> &str {
        self.key.rsplit('/').next().unwrap_or_default()
    }
}

impl Points {
    /// The points with these indices of the hub.
    pub(super) fn new(shared: Shared, indices: &[usize]) -> Self {
        let (prefix, name) =
            (&shared.settings.drivers.zenoh.prefix, &shared.settings.drivers.zenoh.name);
        let base = format!("{prefix}/{name}");
        let (mut keyed, mut followed) = (vec![], vec![]);
        for &index in indices {
            let hub = shared.hub();
            let Some(point) = hub.point(index) else { continue };
            let Point { symbol, is_input, .. } = point;
            let name = symbol.name.clone();
            let is_followed = if let Some(from) = point.address::<ZenohVariable>() {
                let (control, variable) = (from.control.clone(), from.variable.clone());
                let variable = variable.unwrap_or_else(|| name.clone());
                followed.push(FollowedPoint { index, control, variable });
                true
            } else {
                false
            };
            let key = format!("{base}/values/{}", key_part(&name));
            let is_bit = symbol.outside().is_bit();
            keyed.push(KeyedPoint {
                index,
                name,
                key,
                is_bit,
                is_written: *is_input && !is_followed,
            });
        }
        Self { shared, base, keyed, followed }
    }

    /// How many ticks were done, what the control is doing, and the value of each point, all of the newest tick.
    pub(super) fn values(&self) -> (Option<u64>, Values) {
        let hub = self.shared.hub();
        let bits = |point: &KeyedPoint| hub.value_outside(point.index).map(f64::to_bits);
        let values = self.keyed.iter().map(bits).collect();
        (hub.tick().map(|tick| tick.ticks), Values { state: hub.control_state().name(), values })
    }

    /// The message with all values.
    pub(super) fn image(&self, ticks: Option<u64>, values: &Values) -> Json {
        let mut by_name = Map::new();
        for (point, bits) in self.keyed.iter().zip(&values.values) {
            let value = bits.map_or(Json::Null, |bits| json_of(f64::from_bits(bits), point.is_bit));
            by_name.insert(point.name.clone(), value);
        }
        let time = humantime::format_rfc3339_micros(SystemTime::now()).to_string();
        serde_json::json!({"time": time, "state": values.state, "tick": ticks, "values": by_name})
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn values_are_json() {
        let texts =
            [(1.0, true), (-700.0, false), (0.25, false), (f64::NAN, false), (1e300, false)]
                .map(|(value, is_bit)| json_of(value, is_bit).to_string());
        assert_eq!(texts, ["true", "-700", "0.25", "null", "1e+300"]);
        let number = |text: &str, is_bit| number_of(&serde_json::from_str(text).unwrap(), is_bit);
        assert_eq!((number("true", true), number("1", true)), (Some(1.0), Some(1.0)));
        assert_eq!((number("-1.5", false), number(" 7 ", false)), (Some(-1.5), Some(7.0)));
        for (text, is_bit) in
            [("true", false), ("2", true), ("\"1\"", false), ("[1]", false), ("null", true)]
        {
            assert_eq!(number(text, is_bit), None, "{text}");
        }
    }

    #[test]
    fn names_are_parts_of_keys() {
        assert_eq!(key_part("@FRO"), "@FRO");
        assert_eq!(key_part("Y:$FFC0,8"), "Y:%24FFC0,8");
        assert_eq!(key_part("100%/*"), "100%25%2F%2A");
    }
}
