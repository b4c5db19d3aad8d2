//! Requests and replies as lines, as the control reads and writes them.

use serde::Serialize;
use serde_json::{Map, Value as Json};

use crate::{ErrorCode, Failure, Request, VERSION};

/// A request with what its reply repeats.
#[derive(Debug)]
pub struct RequestLine {
    /// The client's `id`; null without one.
    pub id: Json,
    /// The request, or why the line is none.
    pub request: Result<Request, Failure>,
}

impl RequestLine {
    /// Reads a line.
    pub fn parse(line: &[u8]) -> Self {
        let bad = |message: String| Failure::new(ErrorCode::BadRequest, message);
        let mut map = match serde_json::from_slice(line) {
            Ok(Json::Object(map)) => map,
            Ok(_) => {
                let request = Err(bad("a request is a JSON object".into()));
                return Self { id: Json::Null, request };
            }
            Err(error) => {
                let request = Err(bad(format!("the request is not JSON: {error}")));
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
                ErrorCode::Version,
                format!("version {other} of the protocol is not known; this is version {VERSION}"),
            )),
            None => Err(bad(format!("`version` is missing; it is {VERSION}"))),
        };
        Self { id, request }
    }
}

/// A reply as a line. Its keys are in alphabetical order.
pub fn reply(id: &Json, result: Result<impl Serialize, Failure>) -> Vec<u8> {
    let mut map = Map::new();
    map.insert("version".into(), VERSION.into());
    if !id.is_null() {
        map.insert("id".into(), id.clone());
    }
    let json = |part: serde_json::Result<Json>| part.unwrap_or_default();
    match result {
        Ok(result) => {
            map.insert("ok".into(), true.into());
            map.insert("result".into(), json(serde_json::to_value(result)));
        }
        Err(failure) => {
            map.insert("ok".into(), false.into());
            map.insert("error".into(), json(serde_json::to_value(failure)));
        }
    }
    let mut reply = Json::Object(map);
    // Where serde_json keeps the order in which keys are inserted, as in `plcc`.
    reply.sort_all_objects();
    format!("{reply}\n").into_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Assignment;

    fn parsed(line: &str) -> Result<Request, ErrorCode> {
        RequestLine::parse(line.as_bytes()).request.map_err(|failure| failure.code)
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
        let envelope = RequestLine::parse(br#"{"id":"x","version":1,"request":"stop"}"#);
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
            let RequestLine { id, request } = RequestLine::parse(&bytes);
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
            assert_eq!(parsed(line), Err(ErrorCode::BadRequest), "{line}");
        }
        assert_eq!(parsed(r#"{"version":2,"request":"status"}"#), Err(ErrorCode::Version));
        let deep = format!("{}{}", "[".repeat(60_000), "]".repeat(60_000));
        assert_eq!(parsed(&deep), Err(ErrorCode::BadRequest));
    }
}
