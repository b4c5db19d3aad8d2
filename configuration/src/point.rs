//! A variable and its point outside.

use std::any::Any;
use std::fmt;
use std::sync::Arc;

use plcc_image::latch::Rule;
use plcc_image::{Number, Symbol};

use crate::Entry;

/// How the point of an address holds numbers: the name of the format, and the lowest and the highest number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ValueFormat {
    /// The name in an address.
    pub name: &'static str,
    /// The lowest number that it can hold.
    pub low: f64,
    /// The highest one.
    pub high: f64,
}

/// Where a point lies outside.
pub trait Address: Any + fmt::Debug + Send + Sync {
    /// The address number `index` (from 0) of a range that begins here; `None` beyond the last one.
    fn nth(&self, index: usize) -> Option<Arc<dyn Address>>;

    /// A text for the place, which is the same for two addresses of one place.
    fn place(&self) -> String {
        format!("{self:?}")
    }

    /// The address of this one point for people, as it would be written in an entry of its own, without a format; `None` where it
    /// has none of its own.
    fn written(&self) -> Option<String> {
        None
    }

    /// Why a variable can't be there, if it can't; the reason follows the variable's name. `is_input` says that values go from here to
    /// the variable, `is_bit` that it is a bit.
    fn unfit(&self, is_input: bool, is_bit: bool) -> Option<String>;

    /// How numbers are held here, and how they could be held instead; `None` where that does not limit them, or for a bit.
    fn formats(&self) -> Option<(ValueFormat, Vec<ValueFormat>)> {
        None
    }

    /// Why a range can't begin here that has more points than there are from here on: the reason for the variable `name` of the
    /// range `names`.
    fn is_too_long(&self, _names: &str, name: &str) -> String {
        format!("the address of `{name}` is beyond the last number")
    }
}

/// A variable and its point outside.
#[derive(Clone, Debug)]
pub struct Point {
    /// The entry that it belongs to.
    pub entry: Entry,
    /// The variable.
    pub symbol: Symbol,
    /// The point, for drivers whose points have addresses.
    pub address: Option<Arc<dyn Address>>,
    /// Whether values go from the point outside to the variable (`direction = "in"`), rather than from the
    /// variable to the point.
    pub is_input: bool,
}

impl Point {
    /// The address, if it is of this kind.
    pub fn address<A: Address>(&self) -> Option<&A> {
        let address: &dyn Any = self.address.as_deref()?;
        address.downcast_ref()
    }

    /// What the configuration says of the variable as an input.
    pub fn rule(&self) -> Rule {
        let timeout_ns = u64::try_from(self.entry.timeout.as_nanos()).unwrap_or(u64::MAX);
        Rule { safe: self.entry.safe, timeout_ns }
    }

    /// The value of the variable for a value of the point outside: inverted, or scaled and rounded, as the entry
    /// says. `None` if the variable can't have it, or it is not a finite number.
    pub fn inside(&self, outside: f64) -> Option<Number> {
        if !outside.is_finite() {
            return None;
        }
        let place = self.symbol.outside();
        let value = if place.is_bit() {
            Number::Int(((outside != 0.0) != self.entry.invert).into())
        } else {
            let value = outside * self.entry.scale + self.entry.offset;
            match place.range() {
                Some(_) if value.abs() < 9e15 => Number::Int(value.round() as i64),
                _ => Number::Float(value),
            }
        };
        self.symbol.takes(value).then_some(value)
    }

    /// The value of the point outside for a value of the variable, the reverse of [`inside`](Self::inside).
    pub fn outside(&self, inside: Number) -> f64 {
        if self.symbol.outside().is_bit() {
            f64::from((inside.float() != 0.0) != self.entry.invert)
        } else {
            (inside.float() - self.entry.offset) / self.entry.scale
        }
    }
}
