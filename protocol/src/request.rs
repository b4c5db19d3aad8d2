//! What a client asks for, and what it must be allowed for that.

use std::path::PathBuf;
use std::str::FromStr;

use serde::{Deserialize, Serialize};
use serde_json::Value as Json;

/// How many seconds an online change waits at most where its request does not say it.
pub const DEFAULT_WAIT: f64 = 20.0;
/// How many seconds a request can have it wait at most.
pub const MAX_WAIT: f64 = 86_400.0;

/// A variable and the value that it shall have.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Assignment {
    /// The variable.
    pub name: String,
    /// A number, or a text such as `"$FF"`.
    pub value: Json,
}

impl Assignment {
    /// An assignment of a value as a stimulus has it.
    pub fn new(name: impl Into<String>, value: impl Into<String>) -> Self {
        Self { name: name.into(), value: Json::String(value.into()) }
    }

    /// The value as the text of a stimulus.
    pub fn text(&self) -> String {
        match &self.value {
            Json::String(text) => text.clone(),
            Json::Bool(value) => u8::from(*value).to_string(),
            other => other.to_string(),
        }
    }
}

/// What a client asks for. A request without parameters has braces too, since serde does not refuse
/// unknown keys of a variant without them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "request", rename_all = "snake_case", deny_unknown_fields)]
pub enum Request {
    /// What the control is doing: a [`Status`](crate::Status).
    Status {},
    /// How long ticks take: a [`Stat`](crate::Stat).
    Stat {},
    /// The program's variables: a part of them ([`Variables`](crate::Variables)).
    List {
        /// Which; all without it.
        #[serde(default)]
        pattern: Option<String>,
        /// The name after which the list begins.
        #[serde(default)]
        after: Option<String>,
    },
    /// Values: [`Values`](crate::Values).
    Get {
        /// Names, and patterns as in `--watch`.
        names: Vec<String>,
    },
    /// Set variables, as a stimulus does: [`Done`](crate::Done).
    Set {
        /// The variables and their values.
        values: Vec<Assignment>,
    },
    /// The operator's screen: an [`OperatorScreen`](crate::OperatorScreen).
    Operator {},
    /// Press a key of the operator's screen, or release it: [`Done`](crate::Done).
    Press {
        /// The key's variable.
        name: String,
        /// Whether it is pressed.
        on: bool,
    },
    /// Force inputs and outputs: [`Done`](crate::Done).
    Force {
        /// The variables and their values.
        values: Vec<Assignment>,
    },
    /// End forces: [`Done`](crate::Done).
    Unforce {
        /// The variables.
        #[serde(default)]
        names: Vec<String>,
        /// All of them.
        #[serde(default)]
        all: bool,
    },
    /// Run another artifact: an [`OnlineChange`](crate::OnlineChange), with `dry_run` only its
    /// [`Comparison`](crate::Comparison).
    Swap {
        /// Its file, as the control's process finds it.
        path: PathBuf,
        /// The names of changes that are not refused; `all` for all.
        #[serde(default)]
        accept: Vec<String>,
        /// Only compare.
        #[serde(default)]
        dry_run: bool,
        /// How many seconds the change waits at most for what has to end before it; [`DEFAULT_WAIT`] without it.
        #[serde(default)]
        wait: Option<f64>,
    },
    /// Run the program again that the last swap replaced: an [`OnlineChange`](crate::OnlineChange).
    Rollback {
        /// As for a swap.
        #[serde(default)]
        wait: Option<f64>,
    },
    /// Give up the online change that waits: [`Done`](crate::Done).
    Cancel {},
    /// Go on with ticks: [`Done`](crate::Done).
    Start {},
    /// Do no more ticks, with outputs at their safe values: [`Done`](crate::Done).
    Stop {},
}

/// What a request needs beyond reading, as `--allow` says it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Permission {
    /// To press the keys of the operator's screen, and nothing else.
    Operate,
    /// To set variables, and to press keys.
    Write,
    /// To force inputs and outputs, and to end forces.
    Force,
    /// To replace the program.
    Swap,
    /// To stop and start it.
    Stop,
}

impl Permission {
    /// All permissions, with the words of `--allow`.
    pub const ALL: [(Self, &str); 5] = [
        (Self::Operate, "operate"),
        (Self::Write, "write"),
        (Self::Force, "force"),
        (Self::Swap, "swap"),
        (Self::Stop, "stop"),
    ];

    /// Whether it is among what a client is allowed, by itself or by what includes it.
    pub fn is_in(self, allowed: &[Self]) -> bool {
        allowed.contains(&self) || self == Self::Operate && allowed.contains(&Self::Write)
    }

    /// The word for it.
    pub fn name(self) -> &'static str {
        Self::ALL.iter().find(|(one, _)| *one == self).map_or("", |(_, name)| name)
    }
}

impl FromStr for Permission {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let found = Self::ALL.iter().find(|(_, name)| *name == text);
        found.map(|(one, _)| *one).ok_or_else(|| {
            format!("`{text}` is not a permission; these are: operate, write, force, swap, stop")
        })
    }
}

impl Request {
    /// What a client must be allowed for this.
    pub fn needs(&self) -> Option<Permission> {
        match self {
            Self::Status {} | Self::Stat {} | Self::Operator {} => None,
            Self::List { .. } | Self::Get { .. } => None,
            Self::Swap { dry_run: true, .. } => None,
            Self::Press { .. } => Some(Permission::Operate),
            Self::Set { .. } => Some(Permission::Write),
            Self::Force { .. } | Self::Unforce { .. } => Some(Permission::Force),
            Self::Swap { .. } | Self::Rollback { .. } | Self::Cancel {} => Some(Permission::Swap),
            Self::Start {} | Self::Stop {} => Some(Permission::Stop),
        }
    }
}
