//! The driver with a control that has three variables.

use std::io::{self, Write};

use plcc_abi::{Dialect, Engine, Outcome, ResumePoint, Scan};

use super::test_control::{Control, ControlNames, SetClock};
use super::*;
use crate::journal::{Destinations, JournalOwner};
use plcc_control::dump;
use plcc_runtime::{Setting, Value, VariableKey};

struct Idle;

impl Engine for Idle {
    fn call(&mut self, _: usize, _: Option<ResumePoint>, _: &mut Scan<'_>) -> Outcome {
        Outcome::End
    }
}

fn stimulus(text: &[u8]) -> Result<Stimulus, Vec<String>> {
    Stimulus::parse(text, &ControlNames::new(), 1_000_000).map_err(|errors| {
        errors.lines.iter().map(|error| format!("{}: {}", error.line, error.message)).collect()
    })
}

struct Output {
    trace: String,
    events: String,
    dump: String,
    end: End,
    log: Vec<(u64, i64)>,
}

fn run(control: &mut Control, table: &str, watch: &[&str], ticks: u64, repeat: bool) -> Output {
    run_with(control, table, watch, ticks, repeat, TraceFormat::default())
}

fn run_with(
    control: &mut Control,
    table: &str,
    watch: &[&str],
    ticks: u64,
    repeat: bool,
    format: TraceFormat,
) -> Output {
    let stimulus = Stimulus::parse(table.as_bytes(), &ControlNames::new(), 1_000_000).unwrap();
    let watch = Watch::parse(watch, &ControlNames::new()).unwrap();
    let (mut trace, mut events, mut text) = (vec![], vec![], vec![]);
    let end = Run {
        player: Player::new(stimulus, repeat),
        watch: watch.clone(),
        trace: Some(&mut trace),
        trace_format: format,
        events: Some(&mut events),
        ticks: Some(ticks),
        ..Run::new(control, &mut Idle)
    }
    .go();
    dump(&mut text, Dialect::Nct, control, &watch, end.ticks, end.stop.as_ref()).unwrap();
    let [trace, events, dump] = [trace, events, text].map(|t| String::from_utf8(t).unwrap());
    let log = control.log.borrow().clone();
    Output { trace, events, dump, end, log }
}

#[test]
fn a_trace_shows_changes() {
    let table = "tick,name,value\n2,A,3\n1,P10,9\n1,A,7\n1,A,8\n";
    let output = run(&mut Control::default(), table, &["P10,A", "arr"], 4, false);
    assert_eq!(
        output.trace,
        "tick,name,value\n0,P10,0\n0,A,0\n0,arr,\"[0,0]\"\n1,P10,9\n1,A,8\n1,arr,\"[8,9]\"\n\
         2,A,3\n2,arr,\"[3,9]\"\n"
    );
    assert_eq!(
        output.events,
        "{\"tick\":2,\"kind\":\"send\",\"text\":\"drei \\u000b\"}\n\
         {\"tick\":3,\"kind\":\"send\",\"text\":\"drei \\u000b\"}\n"
    );
    assert_eq!(
        output.dump,
        "{\"dialect\":\"nct\",\"ticks\":4,\"state\":\"running\",\"stop\":null,\
         \"variables\":{\"A\":3,\"ARR\":[3,9],\"P10\":9}}\n"
    );
}

#[test]
fn a_trace_can_have_the_time() {
    let format = TraceFormat::Csv { time: true };
    let table = "tick,name,value\n2,A,3\n";
    let output = run_with(&mut Control::default(), table, &["A"], 4, false, format);
    assert_eq!(output.trace, "tick,ms,name,value\n0,0,A,0\n2,2,A,3\n");
}

#[test]
fn a_trace_can_be_a_value_change_dump() {
    let table = "tick,name,value\n1,A,1\n2,P10,-3\n4,A,5\n";
    let watch = ["A,P10", "ARR"];
    let output = run_with(&mut Control::default(), table, &watch, 6, false, TraceFormat::Vcd);
    let (header, changes) = output.trace.split_once("$enddefinitions $end\n").unwrap();
    let expected = [
        "$timescale 1 us $end",
        "$scope module plc $end",
        "$var wire 1 ! A $end",
        "$var integer 16 \" P10 $end",
        "$var integer 16 # ARR[0] $end",
        "$var integer 16 $ ARR[1] $end",
        "$upscope $end",
    ];
    let lines: Vec<&str> = header.lines().map(str::trim).collect();
    assert_eq!(lines[3..], expected, "{header}");
    let minus_3 = format!("b{}01", "1".repeat(14));
    let expected = format!(
        "#0\n0!\nb0 \"\nb0 #\nb0 $\n#1000\n1!\nb1 #\n#2000\n{minus_3} \"\n{minus_3} $\n\
         #4000\n1!\nb101 #\n#6000\n"
    );
    assert_eq!(changes, expected);
}

#[test]
fn patterns_stand_for_the_variables_of_a_dump() {
    let names = |list: &str| {
        let watch = Watch::parse(&[list], &ControlNames::new());
        watch.map(|watch| watch.names().iter().map(|(name, _)| name.clone()).collect::<Vec<_>>())
    };
    assert_eq!(names("*").unwrap(), ["A", "P10"]);
    assert_eq!(names("P10,*").unwrap(), ["P10", "A"], "each once");
    assert_eq!(names("p?0").unwrap(), ["P10"]);
    let errors = names("A,P1?0,B?").unwrap_err();
    let texts: Vec<String> = errors.iter().map(ToString::to_string).collect();
    assert_eq!(texts.len(), 2, "{texts:?}");
    assert!(texts[0].contains("`P1?0` matches no variable"), "{texts:?}");
}

#[test]
fn the_tick_of_a_stop_is_the_last() {
    let mut control = Control { stops: Some(1), ..Control::default() };
    let output = run(&mut control, "tick,name,value\n1,A,3\n", &["A"], 10, false);
    assert_eq!(output.trace, "tick,name,value\n0,A,0\n1,A,3\n");
    assert!(output.events.ends_with(
        "{\"tick\":1,\"kind\":\"stop\",\"code\":\"HALT\",\"file\":\"a\\\"b.pmi\",\"line\":7}\n"
    ));
    assert_eq!(output.end.ticks, 2);
    assert!(output.dump.contains(
        "\"ticks\":2,\"state\":\"stopped\",\"stop\":{\"tick\":1,\"code\":\"HALT\",\"message\":\"it \\\"halts\\\"\",\"file\":\"a\\\"b.pmi\",\"line\":7},"
    ));
}

#[test]
fn a_stimulus_can_begin_again() {
    let table = "tick,name,value\n0,A,1\n2,A,2\n";
    let output = run(&mut Control::default(), table, &[], 7, true);
    let values: Vec<i64> = output.log.iter().map(|&(_, value)| value).collect();
    assert_eq!(values, [1, 1, 2, 1, 1, 2, 1]);
    assert_eq!(output.trace, "tick,name,value\n");
}

#[test]
fn a_player_goes_on_from_any_tick_as_if_it_had_played_all_before() {
    let table = b"tick,name,value\n0,A,1\n2,A,2\n2,A,3\n5,A,4\n";
    let stimulus = Stimulus::parse(table, &ControlNames::new(), 1_000_000).unwrap();
    for (repeat, beyond) in [(false, [9, 9, 9]), (true, [1, 9, 3])] {
        // What A becomes in each tick from one on; 9 where no row sets it.
        let played = |from: u64| -> Vec<i64> {
            let mut player = Player::new(stimulus.clone(), repeat);
            player.seek(from);
            let value = |tick| {
                let mut control = Control { values: [9, 0], ..Control::default() };
                player.apply(tick, &mut control);
                control.values[0]
            };
            (from..20).map(value).collect()
        };
        let all = played(0);
        assert_eq!((&all[..6], &all[6..9]), (&[1, 9, 3, 9, 9, 4][..], &beyond[..]));
        for from in 1..20 {
            assert_eq!(played(from), all[from as usize..], "from {from}");
        }
    }
}

#[test]
fn a_stimulus_may_have_any_line_ends_quotes_and_blanks() {
    let plain = stimulus(b"tick,name,value\n1,A,2\n0,P10,3\n").unwrap();
    for other in [
        &b"\xEF\xBB\xBFtick,name,value\r\n1,A,2\r\n\r\n0,P10,3"[..],
        b"tick,name,value\r\n1,A,2\r\n0,P10,3\r\n\x1A",
        b"Tick, Name ,Value\r1,\"A\",2\r0,P10,3\r",
        b"tick,name,value\n 1 , A , 2 \n\n0,\"P10\",\"3\"\n",
    ] {
        assert_eq!(stimulus(other), Ok(plain.clone()));
    }
    assert_eq!(plain.period(), 2);
    assert_eq!(stimulus(b"tick,name,value\n").unwrap().period(), 0);
}

#[test]
fn every_wrong_line_is_named() {
    let errors = stimulus(
        b"tick,name,value\n0,A,1\n-1,A,1\n1,B,1\n\n1,A,x\n1,A\n1,A,1,1\n99999999999999999999,A,1\n",
    )
    .unwrap_err();
    let numbers: Vec<&str> = errors.iter().filter_map(|e| e.split(':').next()).collect();
    assert_eq!(numbers, ["3", "4", "6", "7", "8", "9"], "{errors:?}");
    assert!(errors[1].contains("did you mean `A`?"), "{errors:?}");
    assert!(errors[2].contains("`x` is not an integer"), "{errors:?}");
    for text in ["", "\n\n", "0,A,1\n", "tick;name;value\n"] {
        assert!(stimulus(text.as_bytes()).unwrap_err()[0].contains("header"), "{text}");
    }
    assert!(stimulus(b"tick,name,value\n0,\xFF,1\n").is_err());
}

#[test]
fn a_huge_stimulus_with_mistakes_everywhere_is_cut_short() {
    let mut text = b"tick,name,value\n".to_vec();
    text.extend(b"0,B,1\n".repeat(1000));
    let errors = Stimulus::parse(&text, &ControlNames::new(), 1_000_000).unwrap_err();
    assert_eq!((errors.lines.len(), errors.more), (20, 980));
}

#[test]
fn a_value_may_have_any_length() {
    let long = |end: &str| format!("tick,name,value\n0,A,{}{end}\n", "0".repeat(1000));
    assert_eq!(stimulus(long("2").as_bytes()), stimulus(b"tick,name,value\n0,A,2\n"));
    let errors = stimulus(long("x").as_bytes()).unwrap_err();
    assert!(errors[0].contains("is not an integer") && errors[0].len() < 200, "{errors:?}");
}

struct Full;

impl Write for Full {
    fn write(&mut self, _: &[u8]) -> io::Result<usize> {
        Err(io::ErrorKind::StorageFull.into())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[test]
fn a_full_disk_ends_the_run() {
    let mut control = Control::default();
    let watch = Watch::parse(&["A"], &ControlNames::new()).unwrap();
    let end =
        Run { watch, trace: Some(&mut Full), ticks: Some(5), ..Run::new(&mut control, &mut Idle) }
            .go();
    assert!(matches!(end.failure, Some(RunError::Trace(_))));
}

#[test]
fn the_interrupt_flag_ends_the_run() {
    let mut control = Control::default();
    let flag = AtomicBool::new(true);
    let end = Run {
        clock: Some(&SystemClock),
        interrupt: Some(&flag),
        ..Run::new(&mut control, &mut Idle)
    }
    .go();
    assert!(end.interrupted);
    assert_eq!(control.made_safe, 1);
    assert_eq!(end.ticks, 0);
}

/// Sets `P10` to the tick's number before each tick, and keeps what `A` is after it.
#[derive(Default)]
struct Follower {
    seen: Vec<(u64, Value, bool)>,
}

impl Hook for Follower {
    fn before_tick(&mut self, now: &mut BeforeTick<'_>) {
        now.executive.write(ControlNames::key("P10"), Setting::Int(now.tick as i64));
    }

    fn after_tick(&mut self, now: &mut AfterTick<'_>) {
        self.seen.push((now.ticks, now.executive.read(ControlNames::key("A")), now.stop.is_some()));
    }
}

#[test]
fn hooks_are_called_before_the_stimulus_and_after_each_tick() {
    let mut control = Control { stops: Some(2), ..Control::default() };
    let table = b"tick,name,value\n1,A,5\n1,P10,9\n";
    let stimulus = Stimulus::parse(table, &ControlNames::new(), 1_000_000).unwrap();
    let watch = Watch::parse(&["P10"], &ControlNames::new()).unwrap();
    let (mut hook, mut trace) = (Follower::default(), vec![]);
    Run {
        player: Player::new(stimulus, false),
        watch,
        trace: Some(&mut trace),
        hooks: vec![&mut hook],
        ..Run::new(&mut control, &mut Idle)
    }
    .go();
    assert_eq!(trace, b"tick,name,value\n0,P10,0\n1,P10,9\n2,P10,2\n");
    let five = Value::Int(5);
    assert_eq!(hook.seen, [(1, Value::Int(0), false), (2, five.clone(), false), (3, five, true)]);
}

/// Runs ten ticks of a millisecond, of which the third takes 4.5 ms, with a stimulus of every tick.
fn run_late(overrun: OverrunPolicy, journal: ScanJournal) -> (Control, End, String, String) {
    let mut control = Control { durations: vec![0, 0, 4], ..Control::default() };
    let clock = control.clock.clone();
    let table: String = (0..10).map(|tick| format!("{tick},A,{}\n", tick + 10)).collect();
    let table = format!("tick,name,value\n{table}5,P10,7\n");
    let stimulus = Stimulus::parse(table.as_bytes(), &ControlNames::new(), 1_000_000).unwrap();
    let watch = Watch::parse(&["A,P10"], &ControlNames::new()).unwrap();
    let (mut trace, mut events) = (vec![], vec![]);
    let end = Run {
        player: Player::new(stimulus, false),
        watch,
        trace: Some(&mut trace),
        trace_format: TraceFormat::Csv { time: true },
        events: Some(&mut events),
        ticks: Some(10),
        clock: Some(&clock),
        overrun,
        journal,
        ..Run::new(&mut control, &mut Idle)
    }
    .go();
    let [trace, events] = [trace, events].map(|text| String::from_utf8(text).unwrap());
    (control, end, trace, events)
}

#[test]
fn skipped_ticks_count_and_their_stimulus_acts() {
    let (mut log, to_log) = io::pipe().unwrap();
    let log_file = std::fs::File::from(std::os::fd::OwnedFd::from(to_log));
    let to = Destinations { log: Some(log_file), ..Destinations::default() };
    let (owner, journal) = JournalOwner::start(to, true).unwrap();
    let (control, end, trace, _) = run_late(OverrunPolicy::Skip, journal);
    owner.finish().unwrap();
    assert_eq!((end.ticks, control.skipped, control.tick), (10, 3, 10));
    let scanned: Vec<u64> = control.log.borrow().iter().map(|&(tick, _)| tick).collect();
    assert_eq!(scanned, [0, 1, 2, 6, 7, 8, 9], "tick 3 was due with 4, 5 and 6 due too");
    assert!(trace.contains("\n2,2,A,12\n6,6,A,16\n6,6,P10,7\n7,7,A,17\n"), "{trace}");
    let punctuality = end.punctuality;
    assert_eq!((punctuality.overruns, punctuality.skipped), (1, 3));
    assert_eq!(punctuality.latest, Duration::from_millis(3));
    let mut text = String::new();
    io::Read::read_to_string(&mut log, &mut text).unwrap();
    let entry: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(entry["kind"], "overrun");
    assert_eq!((&entry["tick"], &entry["skipped"]), (&6.into(), &3.into()));
    assert_eq!(entry["late_ms"], 3.0);
}

#[test]
fn ticks_can_be_made_up_for() {
    let (control, end, ..) = run_late(OverrunPolicy::CatchUp(2), ScanJournal::discarding());
    let scanned: Vec<u64> = control.log.borrow().iter().map(|&(tick, _)| tick).collect();
    assert_eq!(scanned, [0, 1, 2, 4, 5, 6, 7, 8, 9]);
    assert_eq!((end.ticks, end.punctuality.overruns), (10, 1));
}

#[test]
fn an_overrun_can_stop_the_program() {
    let (control, end, trace, events) = run_late(OverrunPolicy::Stop, ScanJournal::discarding());
    assert_eq!(control.log.borrow().len(), 3, "the late tick is not scanned");
    assert_eq!(control.made_safe, 1);
    assert_eq!((end.ticks, end.stop.map(|stop| stop.code)), (4, Some("OVERRUN".into())));
    assert_eq!(events, "{\"tick\":3,\"kind\":\"stop\",\"code\":\"OVERRUN\"}\n");
    assert!(trace.ends_with("2,2,A,12\n"), "{trace}");
}

/// Has the program stand still before tick 2, for three rounds, the first of which takes 4.5 ms.
struct Holding {
    clock: SetClock,
    rounds: u32,
}

impl Hook for Holding {
    fn before_tick(&mut self, now: &mut BeforeTick<'_>) {
        if now.tick == 2 && self.rounds < 3 {
            let time = if self.rounds == 0 { 4500 } else { 0 };
            self.clock.sleep(Duration::from_micros(time));
            self.rounds += 1;
            now.hold = true;
        }
    }
}

#[test]
fn no_tick_is_skipped_while_the_program_stands_still() {
    for overrun in [OverrunPolicy::Skip, OverrunPolicy::Stop] {
        let mut control = Control::default();
        let clock = control.clock.clone();
        let mut hook = Holding { clock: clock.clone(), rounds: 0 };
        let end = Run {
            ticks: Some(8),
            clock: Some(&clock),
            overrun,
            hooks: vec![&mut hook],
            ..Run::new(&mut control, &mut Idle)
        }
        .go();
        assert_eq!(hook.rounds, 3);
        assert_eq!((control.skipped, control.log.borrow().len(), end.ticks), (0, 8, 8));
        assert!(end.stop.is_none());
        let Punctuality { overruns, skipped, .. } = end.punctuality;
        assert_eq!((overruns, skipped), (0, 0));
    }
}

#[test]
fn a_stimulus_that_repeats_is_applied_to_skipped_ticks_too() {
    let mut control = Control::default();
    let stimulus =
        Stimulus::parse(b"tick,name,value\n0,A,1\n2,A,2\n4,A,5\n", &ControlNames::new(), 1_000_000)
            .unwrap();
    let mut player = Player::new(stimulus.clone(), true);
    player.apply(0, &mut control);
    assert_eq!(player.next_after(0), 2);
    player.apply(2, &mut control);
    player.apply(4, &mut control);
    assert_eq!(player.next_after(4), 5, "the table begins again");
    player.apply(5, &mut control);
    assert_eq!((player.next_after(5), control.values[0]), (7, 1));
    let mut once = Player::new(stimulus, false);
    once.apply(4, &mut control);
    assert_eq!(once.next_after(4), u64::MAX);
}

/// Both ends of a pipe, the one to write to as a file.
fn pipe_file() -> (io::PipeReader, std::fs::File) {
    let (reader, writer) = io::pipe().unwrap();
    (reader, std::fs::File::from(std::os::fd::OwnedFd::from(writer)))
}

#[test]
fn queues_give_the_same_trace_and_events_as_writing_at_once() {
    let table = "tick,name,value\n1,A,1\n2,P10,-3\n4,A,3\n";
    for format in
        [TraceFormat::Csv { time: false }, TraceFormat::Csv { time: true }, TraceFormat::Vcd]
    {
        let watch = ["A,P10", "ARR"];
        let expected = run_with(&mut Control::default(), table, &watch, 6, false, format);
        let mut control = Control::default();
        let stimulus = Stimulus::parse(table.as_bytes(), &ControlNames::new(), 1_000_000).unwrap();
        let watch = Watch::parse(&watch, &ControlNames::new()).unwrap();
        let ((mut trace, to_trace), (mut events, to_events)) = (pipe_file(), pipe_file());
        let journal = crate::journal::Journal::discarding();
        let mut queues = ReportQueues::new();
        queues.write_trace(to_trace, &watch, format, &control, &journal).unwrap();
        queues.write_events(to_events, &watch, control.names(), &journal).unwrap();
        Run {
            player: Player::new(stimulus, false),
            watch,
            queues: Some(&mut queues),
            ticks: Some(6),
            ..Run::new(&mut control, &mut Idle)
        }
        .go();
        queues.finish();
        let (mut rows, mut lines) = (String::new(), String::new());
        io::Read::read_to_string(&mut trace, &mut rows).unwrap();
        io::Read::read_to_string(&mut events, &mut lines).unwrap();
        assert_eq!((rows, lines), (expected.trace, expected.events));
    }
}

#[test]
fn an_array_that_an_online_change_makes_longer_or_shorter_is_traced_whole() {
    let mut control = Control::default();
    let watch = Watch::parse(&["ARR"], &ControlNames::new()).unwrap();
    let (mut trace, to_trace) = pipe_file();
    let journal = crate::journal::Journal::discarding();
    let mut queues = ReportQueues::new();
    queues.write_trace(to_trace, &watch, TraceFormat::default(), &control, &journal).unwrap();
    for further in [vec![], vec![7, 8], vec![9, 8], vec![5]] {
        control.further = further;
        let (queues, ticks) = (Some(&mut queues), Some(2));
        Run { queues, ticks, watch: watch.clone(), ..Run::new(&mut control, &mut Idle) }.go();
    }
    queues.finish();
    let mut rows = String::new();
    io::Read::read_to_string(&mut trace, &mut rows).unwrap();
    let row = |array: &str| format!("0,ARR,\"[{array}]\"\n");
    let expected: String = ["0,0", "0,0,7,8", "0,0,9,8", "0,0,5"].map(row).concat();
    assert_eq!(rows, format!("tick,name,value\n{expected}"));
}

/// Sets `A`, whose key this is, to the number of ticks.
struct Counting {
    a: VariableKey,
}

impl Hook for Counting {
    fn before_tick(&mut self, now: &mut BeforeTick<'_>) {
        now.executive.write(self.a, Setting::Int(now.tick as i64 + 1));
    }
}

#[test]
fn a_trace_that_nobody_reads_loses_rows_and_is_right_again_afterwards() {
    let mut control = Control::default();
    let watch = Watch::parse(&["A"], &ControlNames::new()).unwrap();
    let (trace, to_trace) = pipe_file();
    let (mut log, to_log) = pipe_file();
    let to = Destinations { log: Some(to_log), ..Destinations::default() };
    let (owner, scan) = JournalOwner::start(to, true).unwrap();
    let mut queues = ReportQueues::new();
    let format = TraceFormat::default();
    queues.write_trace(to_trace, &watch, format, &control, &owner.journal()).unwrap();
    let mut counting = Counting { a: ControlNames::key("A") };
    Run {
        queues: Some(&mut queues),
        ticks: Some(200_000),
        hooks: vec![&mut counting],
        watch: watch.clone(),
        ..Run::new(&mut control, &mut Idle)
    }
    .go();
    // Now somebody reads; `A` does not change any more.
    let reader = std::thread::spawn(move || {
        let mut rows: Vec<String> = vec![];
        for row in io::BufRead::lines(io::BufReader::new(trace)) {
            rows.push(row.unwrap());
        }
        rows
    });
    while queues.has_unsent() {
        let (ticks, watch) = (Some(1), watch.clone());
        Run { queues: Some(&mut queues), ticks, watch, ..Run::new(&mut control, &mut Idle) }.go();
        std::thread::yield_now();
    }
    queues.finish();
    owner.finish().unwrap();
    drop(scan);
    let rows = reader.join().unwrap();
    assert_eq!(rows[0], "tick,name,value");
    let (last, counted) = rows[1..].split_last().unwrap();
    assert!(counted.len() > 60_000 && counted.len() < 200_000, "{} rows", counted.len());
    for row in counted {
        let (tick, value) = row.split_once(",A,").unwrap();
        assert_eq!(tick.parse::<u64>().unwrap() + 1, value.parse::<u64>().unwrap(), "{row}");
    }
    assert!(last.ends_with(",A,200000"), "{last}");
    let mut text = String::new();
    io::Read::read_to_string(&mut log, &mut text).unwrap();
    let lost = text.lines().map(|line| serde_json::from_str::<serde_json::Value>(line).unwrap());
    let lost: u64 = lost
        .filter(|entry| entry["kind"] == "lost" && entry["output"] == "trace")
        .map(|entry| entry["count"].as_u64().unwrap())
        .sum();
    // The last value of the 200 000 was lost, too, and came later.
    assert_eq!(lost + counted.len() as u64, 200_000);
}
