//! The protocol of the socket: a JSON object a line in both directions. `docs/socket.md` explains it.

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value as Json, json};

/// The version of the protocol, which every request names.
pub const VERSION: u64 = 1;
/// The longest request in bytes, with its line feed.
pub const MAX_REQUEST: usize = 64 << 10;
/// How many variables one request may name, each pattern counted as the variables that it matches.
pub(super) const MAX_NAMES: usize = 10_000;

/// A variable and the value that it shall have.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Assignment {
    pub(crate) name: String,
    /// A number, or a text such as `"$FF"`.
    pub(crate) value: Json,
}

impl Assignment {
    /// The value as the text of a stimulus.
    pub(crate) fn text(&self) -> String {
        match &self.value {
            Json::String(text) => text.clone(),
            Json::Bool(value) => u8::from(*value).to_string(),
            other => other.to_string(),
        }
    }
}

/// What a client asks for. A request without parameters has braces too, since serde does not refuse
/// unknown keys of a variant without them.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(tag = "request", rename_all = "snake_case", deny_unknown_fields)]
pub(crate) enum Request {
    /// What the control is doing.
    Status {},
    /// How long ticks take.
    Stat {},
    /// The program's variables.
    List {
        /// Which; all without it.
        #[serde(default)]
        pattern: Option<String>,
        /// The name after which the list begins.
        #[serde(default)]
        after: Option<String>,
    },
    /// Values.
    Get {
        /// Names, and patterns as in `--watch`.
        names: Vec<String>,
    },
    /// Set variables, as a stimulus does.
    Set { values: Vec<Assignment> },
    /// Force inputs and outputs.
    Force { values: Vec<Assignment> },
    /// End forces.
    Unforce {
        #[serde(default)]
        names: Vec<String>,
        /// All of them.
        #[serde(default)]
        all: bool,
    },
    /// Run another artifact.
    Swap {
        /// Its file, as the control's process finds it.
        path: std::path::PathBuf,
        /// The names of changes that are not refused; `all` for all.
        #[serde(default)]
        accept: Vec<String>,
        /// Only compare.
        #[serde(default)]
        dry_run: bool,
    },
    /// Run the program again that the last swap replaced.
    Rollback {},
    /// Go on with ticks.
    Start {},
    /// Do no more ticks, with outputs at their safe values.
    Stop {},
}

/// What a request needs beyond reading, as `--allow` says it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Permission {
    /// To set variables.
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
    pub const ALL: [(Self, &str); 4] = [
        (Self::Write, "write"),
        (Self::Force, "force"),
        (Self::Swap, "swap"),
        (Self::Stop, "stop"),
    ];

    /// The word for it.
    pub fn name(self) -> &'static str {
        Self::ALL.iter().find(|(one, _)| *one == self).map_or("", |(_, name)| name)
    }
}

impl std::str::FromStr for Permission {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let found = Self::ALL.iter().find(|(_, name)| *name == text);
        found
            .map(|(one, _)| *one)
            .ok_or_else(|| format!("`{text}` is no permission: write, force, swap and stop are"))
    }
}

impl Request {
    /// What a client must be allowed for this.
    pub(crate) fn needs(&self) -> Option<Permission> {
        match self {
            Self::Status {} | Self::Stat {} | Self::List { .. } | Self::Get { .. } => None,
            Self::Swap { dry_run: true, .. } => None,
            Self::Set { .. } => Some(Permission::Write),
            Self::Force { .. } | Self::Unforce { .. } => Some(Permission::Force),
            Self::Swap { .. } | Self::Rollback {} => Some(Permission::Swap),
            Self::Start {} | Self::Stop {} => Some(Permission::Stop),
        }
    }
}

/// Why a request was not carried out.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Failure {
    /// A word by which programs tell failures apart.
    pub(crate) code: &'static str,
    /// A sentence for people.
    pub(crate) message: String,
    /// For `swap`, the comparison that the sentence is about.
    #[serde(flatten)]
    pub(crate) details: Map<String, Json>,
}

impl Failure {
    pub(crate) fn new(code: &'static str, message: impl Into<String>) -> Self {
        Self { code, message: message.into(), details: Map::new() }
    }
}

/// A request with what its reply repeats.
#[derive(Debug)]
pub(crate) struct Envelope {
    pub(crate) id: Json,
    pub(crate) request: Result<Request, Failure>,
}

impl Envelope {
    /// Reads a line.
    pub(crate) fn parse(line: &[u8]) -> Self {
        let bad = |message: String| Failure::new("bad_request", message);
        let mut map = match serde_json::from_slice(line) {
            Ok(Json::Object(map)) => map,
            Ok(_) => {
                let request = Err(bad("a request is a JSON object".into()));
                return Self { id: Json::Null, request };
            }
            Err(error) => {
                let request = Err(bad(format!("the request is no JSON: {error}")));
                return Self { id: Json::Null, request };
            }
        };
        let id = map.remove("id").unwrap_or(Json::Null);
        if !(id.is_null() || id.is_number() || id.is_string()) {
            let request = Err(bad("`id` is a number or a text".into()));
            return Self { id: Json::Null, request };
        }
        let request = match map.remove("version").as_ref().and_then(Json::as_u64) {
            Some(VERSION) => {
                serde_json::from_value(Json::Object(map)).map_err(|error| bad(error.to_string()))
            }
            Some(other) => Err(Failure::new(
                "version",
                format!("version {other} of the protocol is not known; this is version {VERSION}"),
            )),
            None => Err(bad(format!("`version` is missing; it is {VERSION}"))),
        };
        Self { id, request }
    }
}

/// A reply as a line.
pub(crate) fn reply(id: &Json, result: Result<Json, Failure>) -> Vec<u8> {
    let mut map = Map::new();
    map.insert("version".into(), VERSION.into());
    if !id.is_null() {
        map.insert("id".into(), id.clone());
    }
    match result {
        Ok(result) => {
            map.insert("ok".into(), true.into());
            map.insert("result".into(), result);
        }
        Err(failure) => {
            map.insert("ok".into(), false.into());
            map.insert("error".into(), json!(failure));
        }
    }
    format!("{}\n", Json::Object(map)).into_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(line: &str) -> Result<Request, &'static str> {
        Envelope::parse(line.as_bytes()).request.map_err(|failure| failure.code)
    }

    #[test]
    fn requests_are_read() {
        assert_eq!(parsed(r#"{"version":1,"request":"status"}"#), Ok(Request::Status {}));
        let set = parsed(r#"{"version":1,"request":"set","values":[{"name":"A","value":1}]}"#);
        let assignment = Assignment { name: "A".into(), value: 1.into() };
        assert_eq!(assignment.text(), "1");
        assert_eq!(set, Ok(Request::Set { values: vec![assignment] }));
        let all = Request::Unforce { names: vec![], all: true };
        assert_eq!(parsed(r#"{"version":1,"request":"unforce","all":true}"#), Ok(all));
        let envelope = Envelope::parse(br#"{"id":"x","version":1,"request":"stop"}"#);
        assert_eq!((envelope.id, envelope.request), ("x".into(), Ok(Request::Stop {})));
    }

    /// Requests whose bytes are changed, cut and put together at random are read or refused, and the
    /// reply to either is one line.
    #[test]
    fn damaged_requests_do_no_harm() {
        let whole = [
            r#"{"version":1,"id":"a","request":"get","names":["A","B[3]","X:$0700","SP*"]}"#,
            r#"{"version":1,"request":"set","values":[{"name":"A","value":-1.5e3}]}"#,
            r#"{"version":1,"request":"swap","path":"/x\u0000","accept":["all"],"dry_run":true}"#,
            r#"{"version":1,"id":3,"request":"list","pattern":null,"after":"A"}"#,
        ];
        let mut random = 0x2545_F491_4F6C_DD1D_u64;
        let mut next = |below: usize| {
            random ^= random << 13;
            random ^= random >> 7;
            random ^= random << 17;
            (random >> 20) as usize % below.max(1)
        };
        let mut read = 0;
        for _ in 0..20_000 {
            let mut bytes = whole[next(whole.len())].as_bytes().to_vec();
            for _ in 0..next(4) {
                if bytes.is_empty() {
                    break;
                }
                let at = next(bytes.len());
                match next(4) {
                    0 => bytes[at] = next(256) as u8,
                    1 => drop(bytes.remove(at)),
                    2 => bytes.insert(at, b"\"{}[],:0e\\"[next(10)]),
                    _ => bytes.truncate(at.max(1)),
                }
            }
            let Envelope { id, request } = Envelope::parse(&bytes);
            read += usize::from(request.is_ok());
            let result = request.map(|_| Json::Null);
            let line = reply(&id, result);
            assert_eq!(line.iter().filter(|&&byte| byte == b'\n').count(), 1);
            assert!(serde_json::from_slice::<Json>(&line).is_ok());
        }
        assert!((1000..19_000).contains(&read), "{read}");
    }

    #[test]
    fn what_is_no_request_is_refused() {
        for line in [
            "",
            "[]",
            "{",
            "\u{0}",
            r#"{"version":1,"request":"status","extra":1}"#,
            r#"{"version":1,"request":"stat","names":["A"]}"#,
            r#"{"version":1,"request":"rollback","dry_run":true}"#,
            r#"{"version":1,"request":"start","extra":null}"#,
            r#"{"version":1,"request":"stop","extra":{}}"#,
            r#"{"request":"status"}"#,
            r#"{"version":1}"#,
            r#"{"version":1,"request":"fly"}"#,
            r#"{"version":1,"request":"get"}"#,
            r#"{"version":1,"request":"get","names":[],"more":1}"#,
            r#"{"version":1,"id":{},"request":"status"}"#,
        ] {
            assert_eq!(parsed(line), Err("bad_request"), "{line}");
        }
        assert_eq!(parsed(r#"{"version":2,"request":"status"}"#), Err("version"));
        let deep = format!("{}{}", "[".repeat(60_000), "]".repeat(60_000));
        assert_eq!(parsed(&deep), Err("bad_request"));
    }
}
