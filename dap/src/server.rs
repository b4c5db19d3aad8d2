//! The loop of the adapter: takes requests, runs the program in slices between them, tells the client
//! where it has stopped.

use std::io::{self, Write};
use std::sync::mpsc::{Receiver, TryRecvError};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use plcc_replay::DebugError;
use plcc_replay::Interruption;
use plcc_replay::{Debugger, Direction, Stopped};

use super::protocol::{InitializeArguments, LaunchArguments, Request};
use super::{Launcher, transport};

/// For how long the program runs between two looks at the client's messages.
const SLICE: Duration = Duration::from_millis(20);

/// A run that goes on.
#[derive(Clone, Copy, Debug)]
struct Running {
    direction: Direction,
    begun: Instant,
    first_tick: u64,
}

/// What is remembered for one client.
pub(super) struct Server<'a, W> {
    to: W,
    launcher: &'a dyn Launcher,
    seq: i64,
    pub(super) debugger: Option<Debugger<'a>>,
    pub(super) initialize: InitializeArguments,
    pub(super) launch: LaunchArguments,
    running: Option<Running>,
    /// The variables that can be unfolded: what each number that the client has stands for.
    pub(super) unfolded: Vec<super::answers::Unfolded>,
    /// Why the program has stopped, for `exceptionInfo`.
    pub(super) reason: String,
    /// Where a request has moved to; the client is told after the answer to the request.
    pending: Option<Stopped>,
    is_over: bool,
    interruption: Interruption,
}

type Incoming = io::Result<Option<Value>>;

impl<'a, W: Write> Server<'a, W> {
    pub(super) fn new(to: W, launcher: &'a dyn Launcher, interruption: Interruption) -> Self {
        Self {
            to,
            launcher,
            seq: 0,
            debugger: None,
            initialize: InitializeArguments::default(),
            launch: LaunchArguments::default(),
            running: None,
            unfolded: vec![],
            reason: String::new(),
            pending: None,
            is_over: false,
            interruption,
        }
    }

    /// Serves until the client leaves.
    pub(super) fn serve(mut self, messages: &Receiver<Incoming>) -> io::Result<()> {
        while !self.is_over {
            let message = if self.running.is_some() {
                match messages.try_recv() {
                    Ok(message) => Some(message),
                    Err(TryRecvError::Empty) => {
                        self.run_slice()?;
                        None
                    }
                    Err(TryRecvError::Disconnected) => return Ok(()),
                }
            } else {
                match messages.recv() {
                    Ok(message) => Some(message),
                    Err(_) => return Ok(()),
                }
            };
            match message {
                None => {}
                Some(Ok(Some(message))) => self.message(message)?,
                Some(Ok(None)) => return Ok(()),
                Some(Err(error)) => return Err(error),
            }
        }
        Ok(())
    }

    fn send(&mut self, mut message: Value) -> io::Result<()> {
        self.seq += 1;
        if let Some(object) = message.as_object_mut() {
            object.insert("seq".into(), self.seq.into());
        }
        transport::write(&mut self.to, &message)
    }

    pub(super) fn event(&mut self, event: &str, body: Value) -> io::Result<()> {
        self.send(json!({"type": "event", "event": event, "body": body}))
    }

    /// Writes a line to the client's debug console.
    pub(super) fn tell(&mut self, text: &str) -> io::Result<()> {
        self.event("output", json!({"category": "console", "output": format!("{text}\n")}))
    }

    fn message(&mut self, message: Value) -> io::Result<()> {
        if interrupts(&message) {
            self.interruption.end();
        }
        let request: Request = match serde_json::from_value(message) {
            Ok(request) => request,
            Err(error) => return self.tell(&format!("a message has no valid form: {error}")),
        };
        if request.kind != "request" {
            return Ok(());
        }
        let answer = self.request(&request);
        let mut response = json!({
            "type": "response",
            "request_seq": request.seq,
            "command": request.command,
            "success": answer.is_ok(),
        });
        let (field, value) = match &answer {
            Ok(body) => ("body", body.clone()),
            Err(error) => ("message", Value::from(error.0.clone())),
        };
        if let Some(object) = response.as_object_mut()
            && !value.is_null()
        {
            object.insert(field.into(), value);
            if let Err(error) = &answer {
                // Editors ask by themselves for what they show, also once a step has made it old, and say in its place
                // that there is nothing.
                let shows = !matches!(
                    request.command.as_str(),
                    "evaluate" | "scopes" | "stackTrace" | "variables"
                );
                let body = json!({"error": {"id": 1, "format": error.0, "showUser": shows}});
                object.insert("body".into(), body);
            }
        }
        self.send(response)?;
        self.after_answer(&request, answer.is_ok())
    }

    /// Sends the events that follow the answer to a request. `is_done` says that the request has succeeded.
    fn after_answer(&mut self, request: &Request, is_done: bool) -> io::Result<()> {
        if !is_done {
            return Ok(());
        }
        self.tell_output()?;
        if let Some(stopped) = self.pending.take() {
            self.tell_stopped(&stopped)?;
        }
        match request.command.as_str() {
            "launch" | "attach" => self.event("initialized", json!({})),
            "configurationDone" => {
                let is_recording = self.launch.recording.is_some();
                if self.launch.stop_on_entry || is_recording {
                    if let Some(debugger) = &mut self.debugger {
                        debugger.stay();
                    }
                    self.stopped("entry", "")
                } else {
                    self.begin(Direction::Forward);
                    Ok(())
                }
            }
            "disconnect" | "terminate" => {
                self.is_over = request.command == "disconnect";
                self.running = None;
                self.event("terminated", json!({}))
            }
            "pause" => {
                self.running = None;
                self.stopped("pause", "")
            }
            "setVariable" | "setExpression" => {
                self.event("invalidated", json!({"areas": ["variables"]}))
            }
            _ => Ok(()),
        }
    }

    /// The body of the answer to a request.
    fn request(&mut self, request: &Request) -> Result<Value, DebugError> {
        let arguments = request.arguments.clone();
        match request.command.as_str() {
            "initialize" => {
                self.initialize = read(arguments)?;
                Ok(capabilities())
            }
            "launch" | "attach" => {
                self.launch = read(arguments)?;
                let session = self.launcher.launch(&self.launch).map_err(DebugError)?;
                let mut debugger = Debugger::new(session);
                debugger.interrupt_by(self.interruption.clone());
                if self.launch.recording.is_some() {
                    debugger.go_to_end()?;
                }
                self.debugger = Some(debugger);
                Ok(Value::Null)
            }
            "disconnect" | "terminate" | "configurationDone" | "pause" => Ok(Value::Null),
            "continue" | "reverseContinue" => {
                self.debugger()?.look_for_more()?;
                self.begin(match request.command.as_str() {
                    "continue" => Direction::Forward,
                    _ => Direction::Back,
                });
                Ok(json!({"allThreadsContinued": true}))
            }
            command => {
                let (body, stopped) = self.answer(command, arguments)?;
                if stopped.is_some() {
                    self.running = None;
                    self.pending = stopped;
                }
                Ok(body)
            }
        }
    }

    /// The debugger.
    pub(super) fn debugger(&mut self) -> Result<&mut Debugger<'a>, DebugError> {
        self.debugger.as_mut().ok_or_else(|| DebugError::new("nothing was launched yet"))
    }

    fn begin(&mut self, direction: Direction) {
        let first_tick = self.debugger.as_ref().map_or(0, |debugger| debugger.position().tick);
        self.running = Some(Running { direction, begun: Instant::now(), first_tick });
    }

    /// Runs for one slice of time.
    fn run_slice(&mut self) -> io::Result<()> {
        let (Some(running), Some(debugger)) = (self.running, self.debugger.as_mut()) else {
            self.running = None;
            return Ok(());
        };
        let mut ticks = u64::MAX;
        if self.launch.realtime && running.direction == Direction::Forward {
            let tick_ns = u128::from(debugger.tick_ns().max(1));
            let due = (running.begun.elapsed().as_nanos() / tick_ns) as u64 + 1;
            ticks = due.saturating_sub(debugger.position().tick.saturating_sub(running.first_tick));
            if ticks == 0 {
                std::thread::sleep(Duration::from_millis(1));
                return Ok(());
            }
        }
        let met = debugger.run_for(running.direction, ticks, SLICE);
        self.tell_output()?;
        match met {
            Ok(None) => Ok(()),
            Ok(Some(stopped)) => {
                self.running = None;
                self.tell_stopped(&stopped)
            }
            // The message that interrupts is answered next.
            Err(_) if self.interruption.is_wanted() => Ok(()),
            Err(error) => {
                self.running = None;
                self.tell(&error.0)?;
                self.stopped("pause", &error.0)
            }
        }
    }

    fn tell_output(&mut self) -> io::Result<()> {
        let texts =
            self.debugger.as_mut().map(|debugger| debugger.take_output()).unwrap_or_default();
        for text in texts {
            self.tell(&text)?;
        }
        Ok(())
    }

    /// Tells the client that the program has stopped, and why.
    fn tell_stopped(&mut self, stopped: &Stopped) -> io::Result<()> {
        let (reason, text, ids) = match stopped {
            Stopped::Step => ("step", String::new(), vec![]),
            Stopped::Breakpoint(id) => ("breakpoint", String::new(), vec![*id]),
            Stopped::Data(id, text) => ("data breakpoint", text.clone(), vec![*id]),
            Stopped::Writer(text) => ("goto", text.clone(), vec![]),
            Stopped::Event(text) => ("exception", text.clone(), vec![]),
            Stopped::ProgramStopped(stop) => {
                ("exception", format!("{}: {}", stop.code, stop.message), vec![])
            }
            Stopped::Beginning => ("pause", "the beginning of the run".to_owned(), vec![]),
            Stopped::End => ("pause", "the end of the run".to_owned(), vec![]),
        };
        self.reason.clone_from(&text);
        self.stopped_at(reason, &text, &ids)
    }

    fn stopped(&mut self, reason: &str, text: &str) -> io::Result<()> {
        text.clone_into(&mut self.reason);
        self.stopped_at(reason, text, &[])
    }

    fn stopped_at(&mut self, reason: &str, text: &str, ids: &[i64]) -> io::Result<()> {
        self.unfolded.clear();
        let thread = match &mut self.debugger {
            // Where the tick can't be run, the client is told when it asks for the stack.
            Some(debugger) => debugger.task_here().map_or(1, |task| task as i64 + 1),
            None => 1,
        };
        let mut body = json!({"reason": reason, "threadId": thread, "allThreadsStopped": true});
        if let Some(object) = body.as_object_mut() {
            if !text.is_empty() {
                object.insert("description".into(), text.into());
                object.insert("text".into(), text.into());
            }
            if !ids.is_empty() {
                object.insert("hitBreakpointIds".into(), ids.into());
            }
        }
        self.event("stopped", body)
    }
}

/// Whether a message ends the movement that is being done for an earlier one.
pub(super) fn interrupts(message: &Value) -> bool {
    let command = message.get("command").and_then(Value::as_str);
    matches!(command, Some("pause" | "disconnect" | "terminate"))
}

/// The arguments of a request in the form that it needs; without any, the defaults.
pub(super) fn read<T: serde::de::DeserializeOwned + Default>(
    arguments: Value,
) -> Result<T, DebugError> {
    if arguments.is_null() {
        return Ok(T::default());
    }
    serde_json::from_value(arguments)
        .map_err(|error| DebugError(format!("the arguments have no valid form: {error}")))
}

/// What the adapter can do, as the protocol names it.
fn capabilities() -> Value {
    json!({
        "supportsConfigurationDoneRequest": true,
        "supportsConditionalBreakpoints": true,
        "supportsHitConditionalBreakpoints": true,
        "supportsLogPoints": true,
        "supportsDataBreakpoints": true,
        "supportsBreakpointLocationsRequest": true,
        "supportsStepBack": true,
        "supportsSteppingGranularity": true,
        "supportsSetVariable": true,
        "supportsSetExpression": true,
        "supportsEvaluateForHovers": true,
        "supportsLoadedSourcesRequest": true,
        "supportsExceptionInfoRequest": true,
        "supportsTerminateRequest": true,
        "supportsValueFormattingOptions": true,
        "exceptionBreakpointFilters": [
            {"filter": "stop", "label": "The control stops the program", "default": true},
            {"filter": "fault", "label": "A fault comes", "default": false},
            {"filter": "message", "label": "A message comes, or a text is sent", "default": false},
        ],
    })
}
