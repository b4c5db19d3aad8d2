//! Requests and replies without a socket and without ticks.

use std::sync::Arc;
use std::time::Instant;

use plcc_abi::{Engine, Outcome, Program, ResumePoint, Scan};
use serde_json::Value as Json;

use super::commands::{RunProgress, queues};
use super::hook::InterfaceHook;
use super::requests::{self, Requests, RunServices};
use crate::Peer;
use crate::journal::{Journal, ScanJournal};
use crate::run::{BeforeTick, Hook, Player, Stimulus};
use plcc_control::Watch;
use plcc_protocol::{
    ErrorCode, Failure, MAX_REQUEST, Permission, RequestLine, TimingSummary, reply,
};
use plcc_record::RecorderProgram;
use plcc_record::ReplaceableExecutive;
use plcc_runtime::Executive;

/// A control that allows everything and runs no ticks. It takes requests one by one and gives the reply to
/// each at once, from the same code as the socket's thread and the thread that runs the ticks. Fuzzing
/// uses it.
pub struct Dialogue {
    requests: Requests,
    hook: InterfaceHook,
    executive: ReplaceableExecutive,
    by: Peer,
}

impl std::fmt::Debug for Dialogue {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Dialogue").finish_non_exhaustive()
    }
}

/// An engine whose scans do nothing.
struct Idle;

impl Engine for Idle {
    fn call(&mut self, _: usize, _: Option<ResumePoint>, _: &mut Scan<'_>) -> Outcome {
        Outcome::End
    }
}

impl Dialogue {
    /// For a program; `make_executive` makes executives of it. An online change finds no artifacts.
    ///
    /// # Errors
    /// Why no executive can be made.
    pub fn new(program: Program, make_executive: requests::MakeExecutive) -> Result<Self, String> {
        let executive = make_executive(&program)?;
        let (scan_end, socket_end) = queues();
        let progress = Arc::new(RunProgress::default());
        let services = RunServices {
            program: Arc::new(program),
            operator: None,
            allow: Permission::ALL.map(|(permission, _)| permission).to_vec(),
            image: None,
            input_rules: vec![],
            set: vec![],
            watched: vec![],
            load: Box::new(|path| Err(format!("{}: there are no artifacts", path.display()))),
            make_executive,
            timing: Box::new(TimingSummary::default),
            recorder_program: Box::new(|number, executive| {
                RecorderProgram::new(number, executive, None)
            }),
            retained: Box::new(|| None),
            record: None,
            journal: Journal::discarding(),
        };
        let requests =
            Requests::new(executive.as_ref(), socket_end, Arc::clone(&progress), services);
        let by = Peer { user: String::new(), uid: 0, pid: 0, command: String::new() };
        Ok(Self {
            requests,
            hook: InterfaceHook::new(Some(scan_end), None, progress, false),
            executive: ReplaceableExecutive::new(executive),
            by,
        })
    }

    /// The reply to a request, each a line.
    pub fn reply(&mut self, line: &[u8]) -> Vec<u8> {
        if line.len() > MAX_REQUEST {
            return reply(
                &Json::Null,
                Err::<(), _>(Failure::new(ErrorCode::TooLarge, "the request is too long")),
            );
        }
        let RequestLine { id, request } = RequestLine::parse(line);
        let outcome = match request {
            Ok(request) => self.requests.handle(request, &self.by),
            Err(failure) => requests::RequestState::Done(Err(failure)),
        };
        if let requests::RequestState::Done(result) = outcome {
            return reply(&id, result);
        }
        loop {
            self.hook.before_tick(&mut BeforeTick {
                tick: 0,
                executive: &mut self.executive,
                engine: &mut Idle,
                player: &mut Player::new(Stimulus::default(), false),
                watch: &mut Watch::default(),
                hold: false,
                journal: &mut ScanJournal::discarding(),
            });
            let answer = match self.requests.next_answer() {
                Some(requests::Answered::Request(result) | requests::Answered::Change(result)) => {
                    Some(result)
                }
                Some(requests::Answered::ChangeWaits) | None => {
                    self.requests.continue_change(Instant::now())
                }
            };
            if let Some(result) = answer {
                return reply(&id, result);
            }
        }
    }

    /// The executive on which the requests act.
    pub fn executive(&mut self) -> &mut dyn Executive {
        &mut self.executive
    }
}
