//! The messages between page and server: JSON texts.
//!
//! The page sends `{"id":1,"show":SCREEN}` to choose what it is shown from then on, `{"id":2,"ask":SCREEN}`
//! for a single view, and `{"id":3,"apply":COMMAND}`; it sends the next message after the answer. The
//! server answers with the same id and with `view`, `reply` or `refusal`, and sends `{"id":0,"view":VIEW}`
//! when what is shown has changed.

use serde::{Deserialize, Serialize};

use super::limits::{LONGEST_ANSWER, MAX_LINES, MAX_SAMPLES};
use crate::{Command, Refusal, Reply, Screen, View};

/// What a message of a page asks for.
#[derive(Debug)]
pub(super) enum PageRequest {
    /// Be shown a screen from now on.
    Show(Screen),
    /// See a screen once.
    Ask(Screen),
    /// Have something done.
    Apply(Box<Command>),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Message {
    id: u64,
    show: Option<Screen>,
    ask: Option<Screen>,
    apply: Option<Command>,
}

/// The id of a message that is not valid otherwise, so that the refusal has the same id.
#[derive(Default, Deserialize)]
struct IdAlone {
    id: u64,
}

/// Reads a message: its id and what it asks for. The id is 0 if there is none.
pub(super) fn read(text: &str) -> (u64, Result<PageRequest, Refusal>) {
    let message: Message = match serde_json::from_str(text) {
        Ok(message) => message,
        Err(error) => {
            let IdAlone { id } = serde_json::from_str(text).unwrap_or_default();
            return (id, Err(Refusal::new(format!("this is not a message of the page: {error}"))));
        }
    };
    let request = match (message.show, message.ask, message.apply) {
        (Some(screen), None, None) => Ok(PageRequest::Show(bounded(screen))),
        (None, Some(screen), None) => Ok(PageRequest::Ask(bounded(screen))),
        (None, None, Some(command)) => Ok(PageRequest::Apply(Box::new(command))),
        _ => Err(Refusal::new("a message has one of show, ask and apply")),
    };
    (message.id, request)
}

/// The same screen with no more lines and samples than a view may have.
fn bounded(screen: Screen) -> Screen {
    match screen {
        Screen::Statements { first, count } => {
            Screen::Statements { first, count: count.min(MAX_LINES) }
        }
        Screen::Scope { samples } => Screen::Scope { samples: samples.min(MAX_SAMPLES) },
        other => other,
    }
}

#[derive(Serialize)]
struct Answer<'a> {
    id: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    view: Option<&'a View>,
    #[serde(skip_serializing_if = "Option::is_none")]
    reply: Option<&'a Reply>,
    #[serde(skip_serializing_if = "Option::is_none")]
    refusal: Option<&'a Refusal>,
}

/// The message with a view.
pub(super) fn view(id: u64, view: &View) -> String {
    message(&Answer { id, view: Some(view), reply: None, refusal: None })
}

/// The message with what came of a command.
pub(super) fn result(id: u64, result: &Result<Reply, Refusal>) -> String {
    message(&Answer { id, view: None, reply: result.as_ref().ok(), refusal: result.as_ref().err() })
}

fn message(answer: &Answer<'_>) -> String {
    let reason = match serde_json::to_string(answer) {
        Ok(text) if text.len() <= LONGEST_ANSWER => return text,
        Ok(text) => format!("the answer has {} bytes, more than {LONGEST_ANSWER}", text.len()),
        Err(error) => format!("the answer can't be written as JSON: {error}"),
    };
    let refusal = Refusal::new(reason);
    let short = Answer { id: answer.id, view: None, reply: None, refusal: Some(&refusal) };
    // A number and texts can always be written.
    serde_json::to_string(&short).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_are_read_and_bounded() {
        let (id, content) =
            read(r#"{"id":7,"show":{"screen":"statements","first":null,"count":99999}}"#);
        assert_eq!(id, 7);
        let Ok(PageRequest::Show(Screen::Statements { count, .. })) = content else {
            panic!("{content:?}")
        };
        assert_eq!(count, MAX_LINES);
        let (_, content) = read(r#"{"id":8,"ask":{"screen":"scope","samples":1000000}}"#);
        let Ok(PageRequest::Ask(Screen::Scope { samples })) = content else {
            panic!("{content:?}")
        };
        assert_eq!(samples, MAX_SAMPLES);
        let (_, content) = read(r#"{"id":9,"apply":{"command":"go_to_tick","tick":812}}"#);
        let Ok(PageRequest::Apply(command)) = content else { panic!("{content:?}") };
        assert_eq!(*command, Command::GoToTick { tick: 812 });
    }

    #[test]
    fn other_messages_are_refused() {
        for text in [
            "",
            "[]",
            r#"{"id":1}"#,
            r#"{"id":1,"show":{"screen":"io"},"apply":{"command":"follow"}}"#,
            r#"{"id":1,"show":{"screen":"nothing"}}"#,
            r#"{"id":1,"apply":{"command":"follow"},"more":1}"#,
        ] {
            let (id, content) = read(text);
            assert!(content.is_err(), "{text}");
            assert_eq!(id, u64::from(text.starts_with('{')), "{text}");
        }
    }

    #[test]
    fn an_answer_that_is_too_long_becomes_a_refusal() {
        let reply = Reply { message: None, text: Some("x".repeat(LONGEST_ANSWER + 1)) };
        let text = result(3, &Ok(reply));
        assert!(text.starts_with(r#"{"id":3,"refusal":{"message":"the answer has "#), "{text:.80}");
    }
}
