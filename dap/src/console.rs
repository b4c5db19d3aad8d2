//! `evaluate`: expressions of the program's language, and the commands of the debug console.

use std::io::Write;

use serde_json::json;

use plcc_replay::DebugError;
use plcc_replay::{Direction, StepKind, Stopped};
use plcc_why::{Question, explain};

use super::answers::Answer;
use super::protocol::EvaluateArguments;
use super::server::Server;

/// What `help` prints.
const HELP: &str = "\
EXPRESSION         its value, in the program's own language
why NAME           says what holds its value, since when, and what would switch it
writer NAME        goes back to the statement that wrote NAME last
change NAME        goes back to the statement that changed NAME last
set NAME=VALUE     sets NAME once, as the operator would; a program that assigns NAME in every scan
                   overwrites it
force NAME=VALUE   holds an input or output from here on
unforce NAME       ends that
tick N             goes to the beginning of tick N
scan, scan back    goes to the next scan of this task, or the one before";

impl<W: Write> Server<'_, W> {
    pub(super) fn evaluate(&mut self, arguments: &EvaluateArguments) -> Answer {
        let text = arguments.expression.trim();
        if arguments.context == "repl"
            && let Some(answer) = self.command(text)
        {
            return answer;
        }
        let debugger = self.debugger()?;
        let mut value = debugger.evaluate(text)?;
        if arguments.format.hex
            && let Some(hex) = debugger.hexadecimal(&value)
        {
            value = hex;
        }
        Ok((json!({"result": value, "variablesReference": 0}), None))
    }

    /// Does a command of the console; `None` if the text is none.
    fn command(&mut self, text: &str) -> Option<Answer> {
        let (word, rest) = text.split_once(' ').unwrap_or((text, ""));
        let rest = rest.trim();
        Some(match (word, rest) {
            ("help", "") => done(HELP, None),
            ("why", name) if !name.is_empty() => self.why(name),
            ("writer", name) if !name.is_empty() => self.writer(name),
            ("change", name) if !name.is_empty() => self.last_change(name),
            ("set", change) if change.contains('=') => self.change(change, false),
            ("force", change) if change.contains('=') => self.change(change, true),
            ("unforce" | "release", name) if !name.is_empty() => self.unforce(name),
            ("tick", number) if !number.is_empty() => self.go_to(number),
            ("scan", "") => self.scan(Direction::Forward),
            ("scan", "back") => self.scan(Direction::Back),
            _ => return None,
        })
    }

    /// Why a variable has its value at the position; the user stays there.
    fn why(&mut self, name: &str) -> Answer {
        let debugger = self.debugger()?;
        let position = debugger.position();
        let (program, history) = debugger.program_and_history();
        let question = Question { step: Some(position.step), ..Question::new(name, position.tick) };
        let explanation = explain(program, history, &question)?;
        done(explanation.to_string().trim_end(), None)
    }

    fn writer(&mut self, name: &str) -> Answer {
        let stopped = self.debugger()?.go_to_last_writer(name)?;
        let position = self.debugger()?.position();
        let text = format!("{name} was written in tick {}", position.tick);
        done(&text, Some(stopped))
    }

    fn last_change(&mut self, name: &str) -> Answer {
        let stopped = self.debugger()?.go_to_last_change(name)?;
        let position = self.debugger()?.position();
        let text = format!("{name} was changed in tick {}", position.tick);
        done(&text, Some(stopped))
    }

    fn change(&mut self, change: &str, force: bool) -> Answer {
        let (name, value) = change.split_once('=').unwrap_or((change, ""));
        let (name, value) = (name.trim(), value.trim());
        let tick = self.debugger()?.change(name, Some(value), force)?;
        let text = match force {
            true => format!("{name} is forced to {value} from tick {tick} on"),
            false => format!(
                "{name} becomes {value} before tick {tick}; where the program assigns it in every \
                 scan, only `force` holds"
            ),
        };
        done(&text, None)
    }

    fn unforce(&mut self, name: &str) -> Answer {
        let tick = self.debugger()?.change(name, None, true)?;
        done(&format!("{name} is not forced from tick {tick} on"), None)
    }

    fn go_to(&mut self, number: &str) -> Answer {
        let tick = number.parse();
        let tick = tick.map_err(|_| DebugError(format!("`{number}` is not a tick")))?;
        self.debugger()?.go_to_tick(tick)?;
        done(&format!("tick {tick}"), Some(Stopped::Step))
    }

    fn scan(&mut self, direction: Direction) -> Answer {
        let stopped = self.debugger()?.step(StepKind::Scan, direction)?;
        let tick = self.debugger()?.position().tick;
        done(&format!("tick {tick}"), Some(stopped))
    }
}

fn done(text: &str, stopped: Option<Stopped>) -> Answer {
    Ok((json!({"result": text, "variablesReference": 0}), stopped))
}
