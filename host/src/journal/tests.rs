//! Journals whose destinations are pipes.

use std::io::{BufRead, BufReader, Read, pipe};
use std::os::fd::OwnedFd;

use plcc_runtime::EventBody;

use super::*;

fn file(pipe: impl Into<OwnedFd>) -> File {
    File::from(pipe.into())
}

#[test]
fn every_entry_is_a_line_of_the_log_and_a_sentence() {
    for realtime in [false, true] {
        let ((mut log, to_log), (mut console, to_console)) = (pipe().unwrap(), pipe().unwrap());
        let to = Destinations {
            log: Some(file(to_log)),
            console: Some(file(to_console)),
            ..Destinations::default()
        };
        let (owner, mut scan) = JournalOwner::start(to, realtime).unwrap();
        owner.journal().note("begin");
        scan.begin_tick(41);
        let late = Duration::from_micros(40_250);
        scan.write(41, EntryKind::Overrun { late, skipped: 2 });
        let journal = owner.journal();
        std::thread::spawn(move || journal.warn("from another thread")).join().unwrap();
        owner.finish().unwrap();
        drop(scan);
        let (mut lines, mut sentences) = (String::new(), String::new());
        log.read_to_string(&mut lines).unwrap();
        console.read_to_string(&mut sentences).unwrap();
        let expected = "note: begin\n\
            warning: tick 41: an overrun: the tick began 40.2 ms late, and 2 ticks were skipped\n\
            warning: from another thread\n";
        assert_eq!(sentences, expected, "realtime {realtime}");
        let lines: Vec<serde_json::Value> =
            lines.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
        let kinds: Vec<_> = lines.iter().map(|line| line["kind"].as_str().unwrap()).collect();
        assert_eq!(kinds, ["note", "overrun", "warning"]);
        assert!(lines[0].get("tick").is_none());
        assert_eq!(lines[1]["tick"], 41);
        assert_eq!(lines[1]["late_ms"], 40.25);
        assert_eq!(lines[1]["skipped"], 2);
        assert_eq!(lines[2]["tick"], 41);
        let time = lines[0]["time"].as_str().unwrap();
        assert!(time.ends_with('Z') && time.len() == 27, "{time}");
    }
}

/// Neither the scan's thread nor another one waits, the end of the run comes, and the other
/// destination gets everything.
#[test]
fn a_destination_that_nobody_reads_holds_up_nothing() {
    let ((_unread, to_console), (mut log, to_log)) = (pipe().unwrap(), pipe().unwrap());
    let to = Destinations {
        log: Some(file(to_log)),
        console: Some(file(to_console)),
        ..Destinations::default()
    };
    let reader = std::thread::spawn(move || {
        let mut lines = String::new();
        log.read_to_string(&mut lines).unwrap();
        lines
    });
    let (owner, scan) = JournalOwner::start(to, true).unwrap();
    let text = "x".repeat(1000);
    for _ in 0..3000 {
        owner.journal().note(text.clone());
        std::thread::yield_now();
        while owner.journal().backlog() > 1000 {
            std::thread::sleep(Duration::from_millis(1));
        }
    }
    owner.finish().unwrap();
    drop(scan);
    let lines = reader.join().unwrap();
    assert_eq!(lines.lines().filter(|line| line.contains("\"note\"")).count(), 3000);
    let lost = "\"kind\":\"lost\",\"output\":\"standard error\"";
    assert!(lines.lines().any(|line| line.contains(lost)), "what is lost is told in the log");
}

#[test]
fn entries_of_the_scan_that_do_not_fit_are_counted_and_told() {
    let (log, to_log) = pipe().unwrap();
    let to = Destinations { log: Some(file(to_log)), ..Destinations::default() };
    let (owner, mut scan) = JournalOwner::start(to, true).unwrap();
    let written = SCAN_QUEUE as u64 * 20;
    let reader = std::thread::spawn(move || {
        let lines = BufReader::new(log).lines();
        let (mut found, mut lost) = (0, 0);
        for line in lines {
            let line: serde_json::Value = serde_json::from_str(&line.unwrap()).unwrap();
            match line["kind"].as_str().unwrap() {
                "overrun" => found += 1,
                "lost" => lost += line["count"].as_u64().unwrap(),
                other => panic!("{other}"),
            }
        }
        (found, lost)
    });
    for tick in 0..written {
        scan.write(tick, EntryKind::Overrun { late: Duration::ZERO, skipped: 0 });
    }
    owner.finish().unwrap();
    drop(scan);
    let (found, lost) = reader.join().unwrap();
    assert_eq!(found + lost, written);
    assert!(lost > 0, "so many entries at once do not fit");
}

#[test]
fn a_log_that_cannot_be_written_is_an_error_in_simulated_time_only() {
    let Ok(full) = File::options().write(true).open("/dev/full") else { return };
    let to = |file: &File| Destinations {
        log: Some(file.try_clone().unwrap()),
        ..Destinations::default()
    };
    let (owner, _scan) = JournalOwner::start(to(&full), false).unwrap();
    owner.journal().note("lost");
    assert_eq!(owner.finish(), Err("the disk is full".into()));
    let (owner, _scan) = JournalOwner::start(to(&full), true).unwrap();
    owner.journal().note("lost");
    assert_eq!(owner.finish(), Ok(()));
}

/// What the program tells people is for them alone, and a limited number of sentences a second.
#[test]
fn faults_are_sentences_and_no_lines_of_the_log() {
    let ((mut log, to_log), (mut console, to_console)) = (pipe().unwrap(), pipe().unwrap());
    let to = Destinations {
        log: Some(file(to_log)),
        console: Some(file(to_console)),
        removes_progress: true,
        ..Destinations::default()
    };
    let (owner, mut scan) = JournalOwner::start(to, true).unwrap();
    for tick in 0..50 {
        let state = if tick % 2 == 0 { "on" } else { "off" };
        let event = EventBody::Fault { name: "FLT1".into(), state, text: "OIL LOW".into() };
        scan.write(tick, EntryKind::announced(&event).unwrap());
    }
    owner.finish().unwrap();
    drop(scan);
    let (mut lines, mut sentences) = (String::new(), String::new());
    log.read_to_string(&mut lines).unwrap();
    console.read_to_string(&mut sentences).unwrap();
    assert_eq!(lines, "");
    let sentences: Vec<&str> =
        sentences.lines().map(|line| line.strip_prefix("\r\x1b[K").unwrap()).collect();
    assert_eq!(sentences[0], "fault: tick 0: OIL LOW (FLT1)");
    assert_eq!(sentences[1], "fault: tick 1: no longer: OIL LOW (FLT1)");
    let shown = sentences.len() - 1;
    let more = format!("note: {} more faults and messages came and went", 50 - shown);
    assert!(shown < 50 && sentences[shown].starts_with(&more), "{sentences:?}");
}
