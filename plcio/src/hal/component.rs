//! The process with the component.

use std::ffi::OsStr;
use std::io::{self, BufRead, BufReader, Write};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, sync_channel};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;

/// What the process runs.
const PROGRAM: &str = include_str!("component.py");
/// How many lines may wait: the component sends the next one when it has got an answer.
const LINES: usize = 4;

/// How long the process has to leave HAL in order. One that is killed stays in HAL's lists.
const TIME_TO_LEAVE: Duration = Duration::from_secs(2);

/// The process. It ends when this is dropped.
pub(super) struct Component {
    process: Child,
    input: Option<ChildStdin>,
}

impl Component {
    /// Starts it. The lines that it writes come by the receiver.
    ///
    /// # Errors
    /// When Python can't be started.
    pub(super) fn start(
        python: impl AsRef<OsStr>,
        setup: &Value,
    ) -> io::Result<(Self, Receiver<String>)> {
        let mut command = Command::new(python);
        command.args(["-c", PROGRAM]).stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut process = command.spawn()?;
        let (input, output) = (process.stdin.take(), process.stdout.take());
        let (send, lines) = sync_channel(LINES);
        let mut component = Self { process, input };
        let read = move || {
            let lines = output.into_iter().flat_map(|output| BufReader::new(output).lines());
            for line in lines.map_while(Result::ok) {
                if send.send(line).is_err() {
                    return;
                }
            }
        };
        std::thread::Builder::new().name("hal lines".into()).spawn(read)?;
        component.answer(&setup.to_string())?;
        Ok((component, lines))
    }

    /// Waits for the end of a process that has closed its output, and says how it ended.
    pub(super) fn end(&mut self) -> String {
        match self.process.wait() {
            Ok(status) => format!("the component has ended: {status}"),
            Err(error) => error.to_string(),
        }
    }

    /// Sends it a line. It never has more than one that it has not read, so that this does not wait.
    ///
    /// # Errors
    /// When the process has ended.
    pub(super) fn answer(&mut self, line: &str) -> io::Result<()> {
        let input = self.input.as_mut().ok_or(io::ErrorKind::BrokenPipe)?;
        input.write_all(format!("{line}\n").as_bytes())
    }
}

impl Drop for Component {
    fn drop(&mut self) {
        // It makes its outputs safe and leaves HAL when its input ends, or when it gets this signal; also if
        // somebody has stopped it.
        drop(self.input.take());
        let id = i32::try_from(self.process.id()).ok().and_then(Pid::from_raw);
        for signal in [Signal::TERM, Signal::CONT] {
            let _ = id.map(|id| kill_process(id, signal));
        }
        let end = Instant::now() + TIME_TO_LEAVE;
        while matches!(self.process.try_wait(), Ok(None)) && Instant::now() < end {
            std::thread::sleep(Duration::from_millis(5));
        }
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}
