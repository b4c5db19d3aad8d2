//! Requests to a run whose thread carries out no command.

use std::time::Duration;

use plcc_abi::pmi::{Format, Lines, PORTS, PmiTables, Role, Symbol, Type};
use plcc_abi::{Program, Tables, Task};
use serde_json::{Value as Json, json};

use super::commands::{Answer, Command, ScanEnd, queues};
use super::requests::{Answered, RequestState, Requests, RunServices};
use crate::Peer;
use crate::journal::Journal;
use plcc_protocol::{Assignment, ErrorCode, Permission, Request, TimingSummary};
use plcc_record::RecorderProgram;
use plcc_runtime::pmi::{PmiExecutive, PmiOptions};

fn program() -> Program {
    let lines = Lines { port: 0, low: 0, count: 1, format: Format::Bit };
    let symbol = Symbol {
        name: "LAMP".into(),
        ty: Type::Logical,
        offset: 0,
        elements: None,
        role: Role::Output(lines),
        dumped: true,
        retained: false,
    };
    let tables = PmiTables { symbols: vec![symbol], ports: 8, ..PmiTables::default() };
    Program {
        files: vec!["lamp.pmi".into()],
        image_size: 8 + PORTS,
        regions: vec![],
        tasks: vec![Task { name: "scan".into(), entry: 0, resume_points: vec![] }],
        tables: Tables::Pmi(tables),
        names: vec![],
    }
}

fn status(requests: &mut Requests) -> Json {
    let by = Peer { user: "somebody".into(), uid: 1, pid: 1, command: "test".into() };
    match requests.handle(Request::Status {}, &by) {
        RequestState::Done(Ok(status)) => status,
        _ => panic!("the status is always told"),
    }
}

/// Requests to a run of the program, and the end of its queues that the thread which runs the ticks has.
pub(super) fn requests() -> (Requests, ScanEnd) {
    let program = program();
    let executive = PmiExecutive::new(&program, PmiOptions::default()).unwrap();
    let (scan_end, socket_end) = queues();
    let services = RunServices {
        program: std::sync::Arc::new(program),
        operator: None,
        allow: vec![Permission::Force, Permission::Stop],
        image: None,
        input_rules: vec![],
        set: vec![],
        watched: vec![],
        load: Box::new(|_| Err(String::new())),
        make_executive: Box::new(|_| Err(String::new())),
        timing: Box::new(TimingSummary::default),
        recorder_program: Box::new(|number, executive| {
            RecorderProgram::new(number, executive, None)
        }),
        retained: Box::new(|| None),
        record: None,
        journal: Journal::discarding(),
    };
    let progress = std::sync::Arc::default();
    (Requests::new(&executive, socket_end, progress, services), scan_end)
}

#[test]
fn a_force_that_finds_no_room_in_the_queue_is_not_in_effect() {
    let (mut requests, mut scan_end) = requests();
    let by = Peer { user: "somebody".into(), uid: 1, pid: 1, command: "test".into() };
    let force =
        || Request::Force { values: vec![Assignment { name: "LAMP".into(), value: 1.into() }] };
    assert!(matches!(requests.handle(force(), &by), RequestState::Pending));
    assert!(requests.is_exclusive(), "until the thread that runs the ticks has answered");
    assert_eq!(status(&mut requests)["forces"], json!([]));
    let mut command = scan_end.commands.pop().unwrap();
    let Command::Force(batch) = &mut command else { panic!("{command:?}") };
    // As the thread that runs the ticks lists them.
    batch.forces.extend(batch.items.iter().filter_map(|item| Some((item.key, item.setting?))));
    scan_end.answers.push(Answer { command, tick: 1, took: Duration::ZERO }).unwrap();
    assert!(
        matches!(requests.next_answer(), Some(Answered::Request(Ok(_))))
            && !requests.is_exclusive()
    );
    while matches!(requests.handle(Request::Stop {}, &by), RequestState::Pending) {}
    for request in [Request::Unforce { names: vec![], all: true }, force()] {
        let RequestState::Done(Err(failure)) = requests.handle(request, &by) else {
            panic!("done")
        };
        assert_eq!(failure.code, ErrorCode::Busy);
        assert_eq!(status(&mut requests)["forces"], json!([{"name": "LAMP", "value": "1"}]));
    }
}
