//! Why a request was not carried out.

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value as Json};

/// A word by which programs tell failures apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ErrorCode {
    /// The line is not a request.
    BadRequest,
    /// The request is of another version.
    Version,
    /// The request is too long or names too much.
    TooLarge,
    /// It is not allowed.
    Denied,
    /// There is no such variable, a pattern matches none, or the variable is not forced.
    NotFound,
    /// The value is not a number, or the variable can't take it.
    BadValue,
    /// It can't be done.
    Refused,
    /// Too many requests wait for the next tick.
    Busy,
    /// A mistake in the control itself.
    Internal,
    /// A word that this version does not know.
    #[serde(other)]
    Other,
}

/// Why a request was not carried out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Failure {
    /// By which programs tell failures apart.
    pub code: ErrorCode,
    /// A sentence for people.
    pub message: String,
    /// For `swap`, the [`Comparison`](crate::Comparison) that the sentence is about.
    #[serde(flatten)]
    pub details: Map<String, Json>,
}

impl Failure {
    /// A failure without details.
    pub fn new(code: ErrorCode, message: impl Into<String>) -> Self {
        Self { code, message: message.into(), details: Map::new() }
    }
}
