//! The messages of Sparkplug B: a payload with metrics, in Protocol Buffers.
//!
//! Only the fields that an edge node with plain values needs are here; others are skipped when a payload is
//! read.

use prost::Message;

/// The types of values that are used, by their numbers in Sparkplug. Numbers of 16 bits with a sign are sent as
/// 32 bits, since implementations do not agree in what the upper half of a negative `Int16` is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum DataType {
    Int32 = 3,
    UInt16 = 6,
    UInt32 = 7,
    UInt64 = 8,
    Double = 10,
    Boolean = 11,
    String = 12,
}

/// A message.
#[derive(Clone, PartialEq, Message)]
pub(super) struct Payload {
    /// In milliseconds since 1970.
    #[prost(uint64, optional, tag = "1")]
    pub(super) timestamp: Option<u64>,
    #[prost(message, repeated, tag = "2")]
    pub(super) metrics: Vec<Metric>,
    /// From 0 to 255: by it a gap is noticed.
    #[prost(uint64, optional, tag = "3")]
    pub(super) seq: Option<u64>,
}

/// A named value.
#[derive(Clone, PartialEq, Message)]
pub(super) struct Metric {
    #[prost(string, optional, tag = "1")]
    pub(super) name: Option<String>,
    #[prost(uint64, optional, tag = "3")]
    pub(super) timestamp: Option<u64>,
    #[prost(uint32, optional, tag = "4")]
    pub(super) datatype: Option<u32>,
    #[prost(bool, optional, tag = "7")]
    pub(super) is_null: Option<bool>,
    #[prost(message, optional, tag = "9")]
    pub(super) properties: Option<PropertySet>,
    #[prost(oneof = "Value", tags = "10, 11, 12, 13, 14, 15")]
    pub(super) value: Option<Value>,
}

/// A value.
#[derive(Clone, PartialEq, prost::Oneof)]
pub(super) enum Value {
    /// Integers of up to 32 bits, those with a sign as two's complement.
    #[prost(uint32, tag = "10")]
    Int(u32),
    #[prost(uint64, tag = "11")]
    Long(u64),
    #[prost(float, tag = "12")]
    Float(f32),
    #[prost(double, tag = "13")]
    Double(f64),
    #[prost(bool, tag = "14")]
    Boolean(bool),
    #[prost(string, tag = "15")]
    String(String),
}

/// Properties of a metric, by their keys.
#[derive(Clone, PartialEq, Message)]
pub(super) struct PropertySet {
    #[prost(string, repeated, tag = "1")]
    pub(super) keys: Vec<String>,
    #[prost(message, repeated, tag = "2")]
    pub(super) values: Vec<PropertyValue>,
}

/// The value of a property; integers and texts are all that is used.
#[derive(Clone, PartialEq, Message)]
pub(super) struct PropertyValue {
    #[prost(uint32, optional, tag = "1")]
    pub(super) datatype: Option<u32>,
    #[prost(uint32, optional, tag = "3")]
    pub(super) int: Option<u32>,
    #[prost(string, optional, tag = "8")]
    pub(super) string: Option<String>,
}

/// The time, in milliseconds since 1970.
pub(super) fn now() -> u64 {
    let since = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
    since.map_or(0, |since| since.as_millis() as u64)
}

impl Metric {
    /// A metric with a value of now.
    pub(super) fn new(name: &str, datatype: DataType, value: Value) -> Self {
        Self {
            name: Some(name.into()),
            timestamp: Some(now()),
            datatype: Some(datatype as u32),
            is_null: None,
            properties: None,
            value: Some(value),
        }
    }

    /// Adds a property.
    pub(super) fn property(&mut self, key: &str, datatype: DataType, value: &Value) {
        let properties = self.properties.get_or_insert_default();
        properties.keys.push(key.into());
        properties.values.push(match value {
            Value::String(text) => PropertyValue {
                datatype: Some(datatype as u32),
                int: None,
                string: Some(text.clone()),
            },
            Value::Int(number) => {
                PropertyValue { datatype: Some(datatype as u32), int: Some(*number), string: None }
            }
            _ => PropertyValue::default(),
        });
    }
}

impl DataType {
    /// The value of a number in this type.
    pub(super) fn value(self, number: f64) -> Value {
        match self {
            Self::Boolean => Value::Boolean(number != 0.0),
            Self::Int32 => Value::Int(number as i32 as u32),
            Self::UInt16 | Self::UInt32 => Value::Int(number as u32),
            Self::UInt64 => Value::Long(number as u64),
            Self::Double | Self::String => Value::Double(number),
        }
    }

    /// The number that a value is which somebody sends for a metric of this type.
    pub(super) fn number(self, value: &Value) -> Option<f64> {
        Some(match (self, value) {
            (Self::Boolean, Value::Boolean(bit)) => f64::from(*bit),
            (Self::Boolean, Value::Int(number @ 0..=1)) => f64::from(*number),
            (Self::Int32, Value::Int(number)) => f64::from(*number as i32),
            (Self::UInt16 | Self::UInt32, Value::Int(number)) => f64::from(*number),
            // Some hosts send all integers in the long field.
            (Self::Int32, Value::Long(number)) => *number as i64 as f64,
            (Self::UInt16 | Self::UInt32, Value::Long(number)) => *number as f64,
            (Self::Double, Value::Double(number)) => *number,
            (Self::Double, Value::Float(number)) => f64::from(*number),
            _ => return None,
        })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::indexing_slicing)]

    use super::*;

    #[test]
    fn payloads_have_the_bytes_that_the_specification_says() {
        let mut metric = Metric::new("A", DataType::Int32, DataType::Int32.value(-2.0));
        metric.timestamp = None;
        metric.property("Quality", DataType::Int32, &Value::Int(500));
        let payload = Payload { timestamp: Some(1), metrics: vec![metric], seq: Some(2) };
        let bytes = payload.encode_to_vec();
        let metric = [0x0A, 1, b'A', 0x20, 3, 0x4A, 16, 0x0A, 7];
        let rest = [0x12, 5, 0x08, 3, 0x18, 0xF4, 3, 0x50, 0xFE, 0xFF, 0xFF, 0xFF, 0x0F];
        let expected = [&[0x08, 1, 0x12, 29][..], &metric, b"Quality", &rest, &[0x18, 2]].concat();
        assert_eq!(bytes, expected);
        assert_eq!(Payload::decode(bytes.as_slice()).unwrap(), payload);
        // A field that is not known here is skipped: an alias.
        let with_alias = [0x12, 5, 0x0A, 1, b'A', 0x10, 5];
        let read = Payload::decode(with_alias.as_slice()).unwrap();
        assert_eq!(read.metrics.first().and_then(|metric| metric.name.as_deref()), Some("A"));
        assert!(Payload::decode(&with_alias[..4]).is_err());
    }

    #[test]
    fn numbers_go_to_metrics_and_back() {
        for (datatype, number) in [
            (DataType::UInt16, 65535.0),
            (DataType::Int32, -70000.0),
            (DataType::UInt32, 4e9),
            (DataType::Double, 0.25),
            (DataType::Boolean, 1.0),
        ] {
            assert_eq!(datatype.number(&datatype.value(number)), Some(number), "{datatype:?}");
        }
        assert_eq!(DataType::Int32.number(&Value::Long(u64::MAX)), Some(-1.0));
        assert_eq!(DataType::Int32.number(&Value::Double(1.0)), None);
        assert_eq!(DataType::Boolean.number(&Value::Int(2)), None);
    }
}
