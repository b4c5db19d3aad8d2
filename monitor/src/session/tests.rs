//! The statement displays of the three languages.

use plcc_abi::Dialect;

use crate::testing::{drawn, open, open_with_motors};
use crate::view::{Body, Screen, StatementLayout};
use crate::{Command, View};

const PMI: &str = "\
$INPUT
A=0/0
B=0/1
$OUTPUT
SOL1=1/0
$INTEGER
N
X
$END
? counts
N=N+1
SOL1=A& #
  /B
IF (N>2)
 X=N*10
ELSE
 X=-1
ENDIF
L1:
Y=/SOL1
";

fn all(dialect: Dialect, text: &str, stimulus: &str, tick: u64) -> Vec<String> {
    let mut session = open(dialect, text, stimulus);
    session.run_to(tick);
    session.statements().lines.iter().map(drawn).collect()
}

#[test]
fn pmi_shows_each_value_as_its_statement_saw_it() {
    let lines = all(Dialect::Pmi, PMI, "1,A,1\n", 1);
    assert_eq!(
        lines,
        [
            "N=2=N=1+1",
            "_SOL1_=_A_&_/B_",
            "IF (N=2>2)",
            "~ X=N*10",
            "ELSE",
            " X=-1=-1",
            "ENDIF",
            "L1:",
            "Y=/SOL1",
        ]
    );
    // A scan later the other branch is executed.
    let lines = all(Dialect::Pmi, PMI, "2,B,1\n", 2);
    assert_eq!(lines[1], "SOL1=A&/B");
    assert_eq!(lines[3], " X=30=N=3*10");
    assert_eq!(lines[5], "~ X=-1");
    assert_eq!(lines[8], "_Y_=_/SOL1_");
}

#[test]
fn views_and_commands_are_json() {
    let mut session = open(Dialect::Pmi, PMI, "");
    session.run_to(1);
    let view = session.view(&Screen::Statements { first: None, count: 3 });
    let text = serde_json::to_string(&view).unwrap();
    assert!(text.contains(r#""body":{"screen":"statements","layout":"values_above""#), "{text}");
    assert_eq!(serde_json::from_str::<View>(&text).unwrap(), view);
    let command: Command = serde_json::from_str(r#"{"command":"go_to_tick","tick":0}"#).unwrap();
    session.apply(command).unwrap();
    assert_eq!(session.status().tick, 0);
    let screen: Screen = serde_json::from_str(r#"{"screen":"statements","count":3}"#).unwrap();
    let Body::Statements(view) = session.view(&screen).body else { panic!() };
    assert_eq!(view.layout, StatementLayout::ValuesAbove);
    let refusal = session.apply(Command::GoToTick { tick: 999_999 }).unwrap_err();
    assert!(refusal.message.starts_with("the ticks from 0 to "), "{refusal}");
}

#[test]
fn statements_are_chosen_by_name_as_in_pmi_5_1() {
    let mut session = open(Dialect::Pmi, PMI, "");
    session.run_to(3);
    session.apply(Command::ClearStatements).unwrap();
    assert_eq!(session.statements().total, 0);
    let find = |names: &[&str], uses, all| Command::FindNames {
        names: names.iter().map(|name| (*name).into()).collect(),
        uses,
        all,
    };
    session.apply(find(&["SOL1", "L1:"], false, true)).unwrap();
    let numbers = |session: &mut crate::Session<'_>| -> Vec<String> {
        session.statements().lines.into_iter().map(|line| line.number).collect()
    };
    assert_eq!(numbers(&mut session), ["12", "19"]);
    session.apply(find(&["X"], false, false)).unwrap();
    assert_eq!(numbers(&mut session), ["12", "15", "19"]);
    session.apply(Command::FindNext).unwrap();
    assert_eq!(numbers(&mut session), ["12", "15", "17", "19"]);
    session.apply(Command::NextStatement).unwrap();
    assert_eq!(session.statements().last_number, "20");
    assert!(session.apply(Command::NextStatement).is_err());
    assert!(session.apply(find(&["NONE"], true, true)).is_err());
}

#[test]
fn a_change_is_found_with_its_statement() {
    let mut session = open(Dialect::Pmi, PMI, "5,A,1\n");
    session.run_to(9);
    session.apply(Command::PreviousChange { name: "SOL1".into() }).unwrap();
    assert_eq!(session.status().tick, 5);
    let view = session.statements();
    assert_eq!(view.lines[view.cursor].number, "12");
}

const NCT: &str = "\
:001
I000
 U000
E
 D000
Z
LQ00 +1 SQ00 ; counts
J1
:000
J0
";

#[test]
fn nct_shows_bits_and_words_at_the_right() {
    let mut session = open(Dialect::Nct, NCT, "2,I000,1\n");
    session.run_to(3);
    let view = session.statements();
    assert_eq!(view.layout, StatementLayout::ValuesRight);
    let line = view.lines.iter().find(|line| line.text().contains("LQ00")).unwrap();
    assert_eq!(line.text().trim(), "LQ00 +1 SQ00");
    let value = line.values.iter().find(|value| value.name == "Q00").unwrap();
    assert_eq!((value.value.as_str(), value.written), ("4 .0004", true));
    let drawn: Vec<String> = view.lines.iter().map(drawn).collect();
    assert_eq!(drawn[1], "_I000_");
    assert!(drawn[4].starts_with('~'), "{drawn:?}");
    session.apply(Command::PutCursor { row: 1 }).unwrap();
    session.apply(Command::Condition).unwrap();
    assert_eq!(session.statements().cursor, 5);
    session.apply(Command::Module { down: true }).unwrap();
    let view = session.statements();
    assert_eq!(view.lines[view.cursor].text(), ":000");
}

const REGISTER_AREAS: &str = "\
:001
.0002 SF220
.0270 SF222
.0274 SF224
.0282 SF226
LF270 +1 SF270
ADD220
.0002 SF120
.0300 SF122
.0004 SF124
.FFFF SF126
.0007 SF302
HF120
J1
:000
J0
";

#[test]
fn nct_statements_with_a_register_area_show_what_they_read_and_write() {
    let mut session = open(Dialect::Nct, REGISTER_AREAS, "");
    session.run_to(3);
    let view = session.statements();
    let of = |text: &str| -> Vec<String> {
        let line = view.lines.iter().find(|line| line.text().contains(text)).unwrap();
        let shown = line.values.iter().map(|value| {
            format!("{}{}{}", value.name, if value.written { ":=" } else { "=" }, value.value)
        });
        shown.collect()
    };
    let values = of("ADD220");
    for expected in ["F220=2 .0002", "F222=624 .0270", "F270=4 .0004", "F282:=4 .0004", "F0046:=0"]
    {
        assert!(values.iter().any(|value| value == expected), "{expected}: {values:?}");
    }
    // The address of the item that was found is BCD.
    let values = of("HF120");
    for expected in ["F302=7 .0007", "F128:=770 .0302", "F0080:=0", "F0081:=0"] {
        assert!(values.iter().any(|value| value == expected), "{expected}: {values:?}");
    }
    // Both are found as the writers of what they write, also of what had the value before.
    let debugger = session.debugger.as_mut().unwrap();
    for (name, line) in [("F282", "ADD220"), ("F128", "HF120"), ("F0081", "HF120")] {
        debugger.go_to_end_of_tick(3).unwrap();
        debugger.go_to_last_writer(name).unwrap();
        let statement = debugger.step_here().unwrap().unwrap().statement;
        let row = session.text.row_of(statement).unwrap();
        assert_eq!(session.text.rows[row].text(), line, "{name}");
    }
}

const PMAC: &str = "\
I5=2
#define COUNT P1
M1->Y:$FFC2,8
OPEN PLC 1 CLEAR
COUNT=COUNT+1
IF (COUNT>2) M1=1 ENDIF
CLOSE
OPEN PLC 2 CLEAR
WHILE (P2<100)
  P2=P2+1
ENDWHILE
CLOSE
ENABLE PLC 1..2
";

#[test]
fn pmac_shows_where_each_plc_waits() {
    use crate::view::TaskState::{Running, Waiting};
    let mut session = open(Dialect::Pmac, PMAC, "");
    session.run_to(8);
    let view = session.statements();
    let line = view.lines.iter().find(|line| line.text() == "COUNT=COUNT+1").unwrap();
    assert_eq!(line.values.len(), 1);
    assert_eq!(line.values[0].name, "P1");
    let waits = view.lines.iter().find(|line| !line.waits.is_empty()).unwrap();
    assert_eq!((waits.text().as_str(), waits.waits[0].as_str()), ("WHILE (P2<100)", "PLC2"));
    let Body::Tasks(tasks) = session.view(&Screen::Tasks).body else { panic!() };
    let names: Vec<_> = tasks.rows.iter().map(|row| (row.name.as_str(), row.state)).collect();
    assert_eq!(names, [("PLC1", Running), ("PLC2", Waiting)]);
    assert!(tasks.rows[0].scans_per_second > 100.0, "{tasks:?}");
    assert!(tasks.facts.iter().any(|fact| fact.title == "I5" && fact.value == "2"), "{tasks:?}");
    let online = |session: &mut crate::Session<'_>, line: &str| {
        session.apply(Command::Online { line: line.into() }).map(|reply| reply.text.unwrap())
    };
    assert_eq!(online(&mut session, "m1->").unwrap(), "Y:$FFC2,8");
    assert_eq!(online(&mut session, "P1..2").unwrap().lines().count(), 2);
    let listed = online(&mut session, "LIST PLC 2").unwrap();
    assert_eq!(listed, "WHILE (P2<100)\n  P2=P2+1\nENDWHILE\nRETURN");
    assert!(online(&mut session, "J+").is_err());
}

/// The panel with a title.
fn panel(session: &mut crate::Session<'_>, title: &str) -> crate::view::Panel {
    let Body::Panels(view) = session.view(&Screen::Panels).body else { panic!() };
    let titles: Vec<String> = view.panels.iter().map(|panel| panel.title.clone()).collect();
    let found = view.panels.into_iter().find(|panel| panel.title == title);
    found.unwrap_or_else(|| panic!("{titles:?}"))
}

const TOUCH: &str = "\
$KEY
TXLOW = \"LOW\"
TXAUTO = \"  AUTO\"
$OUTPUT
LAMP=1/0
$END
@OTX00=TXAUTO
@OTX03=0
@OLT00=@OPB00
@CL101=@CP101
@STTXT[0]=TXLOW
@STVAR[0]=1
@STCNV[0]=2
LAMP=@CP101
";

#[test]
fn pmi_panels_have_buttons_lamps_and_texts_of_keys() {
    let mut session = open(Dialect::Pmi, TOUCH, "1,@CP101,1\n1,@OPB00,1\n1,@MODE,2\n1,@FRO,80\n");
    session.run_to(3);
    let operator = panel(&mut session, "Operator panel");
    assert_eq!((operator.columns, operator.cells.len()), (3, 17));
    let pressed: Vec<&str> = operator
        .cells
        .iter()
        .filter(|cell| cell.pressed == Some(true) && cell.light == Some(true))
        .map(|cell| cell.label.as_str())
        .collect();
    assert_eq!(pressed, ["@CP101"]);
    // "Bottom centered @CP115".
    assert_eq!(
        (operator.cells[15].label.as_str(), operator.cells[16].label.as_str()),
        ("", "@CP115")
    );
    let touch = panel(&mut session, "Operator touch window");
    assert_eq!((touch.cells[0].label.as_str(), touch.cells[0].light), ("  AUTO", Some(true)));
    assert_eq!((touch.cells[3].label.as_str(), touch.cells[3].pressed), ("", None));
    let status = panel(&mut session, "mach stat");
    assert_eq!(
        (status.cells[0].label.as_str(), status.cells[1].value.as_deref()),
        ("LOW", Some("ON"))
    );
    let production = panel(&mut session, "Production");
    let value = |label: &str| {
        let cell = production.cells.iter().find(|cell| cell.label == label).unwrap();
        cell.value.clone().unwrap()
    };
    assert_eq!((value("mode"), value("@FRO %")), ("automatic".into(), "80".into()));
    // A press sets the variable as the operator would.
    session.apply(Command::Follow).unwrap();
    session.apply(Command::Change { name: "@CP101".into(), value: "0".into() }).unwrap();
    let last = session.status().last_tick;
    session.run_to(last + 2);
    assert_eq!(panel(&mut session, "Operator panel").cells[1].light, Some(false));
}

#[test]
fn nct_panels_show_screens_softkeys_and_tables() {
    let text =
        ":001\nU520\nI401 U401 Z\nI710 U710 Z\nJ1\n:000\nJ0\n:197\nMAG RESET$\n:199\nDOOR OPEN$\n";
    let stimulus = "1,I401,1\n1,RH027,260\n1,RH071,30\n1,I710,1\n1,F500,49157\n";
    let mut session = open(Dialect::Nct, text, stimulus);
    session.run_to(3);
    let screen = panel(&mut session, "Screen and messages");
    assert_eq!(screen.cells[0].value.as_deref(), Some("0104h Work offsts"));
    let message = screen.cells.iter().find(|cell| cell.label.contains("DOOR OPEN")).unwrap();
    assert_eq!(message.light, Some(true));
    let softkeys = panel(&mut session, "Operator's panel softkeys");
    let key = |label: &str| softkeys.cells.iter().find(|cell| cell.label == label).unwrap();
    assert_eq!(key("MODES").light, Some(true));
    assert_eq!((key("HNDL").pressed, key("HNDL").light), (Some(true), Some(true)));
    assert_eq!(key("HNDL").variable.as_deref(), Some("I401"));
    assert_eq!(key("MAG RESET").variable.as_deref(), Some("I500"));
    let functions = panel(&mut session, "FUNCTION");
    assert_eq!(functions.cells[1].value.as_deref(), Some("30"));
}

#[test]
fn pmac_panels_show_connectors_and_nothing_that_can_not_move() {
    let mut session = open(Dialect::Pmac, PMAC, "1,Y:$FFC2,258\n");
    session.run_to(3);
    let connectors = panel(&mut session, "Connectors");
    assert_eq!(connectors.cells[1].value.as_deref(), Some("00000010"));
    let Body::Panels(view) = session.view(&Screen::Panels).body else { panic!() };
    assert_eq!(view.panels.len(), 1, "{:?}", view.panels);
}

/// Types a line into the terminal and gives the answer, or the reason for none.
fn typed(session: &mut crate::Session<'_>, line: &str) -> Result<String, String> {
    let reply = session.apply(Command::Online { line: line.into() });
    reply.map(|reply| reply.text.unwrap()).map_err(|refusal| refusal.message)
}

#[test]
fn the_pmac_terminal_reports_motors_from_their_registers() {
    // 96 * 32 units are a count; motor 2 lies $3C or $C0 behind motor 1.
    let stimulus = "1,D:$2B,307200\n1,D:$813,3072\n1,D:$840,6144\n1,Y:$814,1025\n1,X:$818,1\n\
                    1,D:$67,-30720\n1,D:$900,3072\n1,X:$79,262144\n1,X:3,4194304\n1,&2Q5,7\n\
                    1,Y:$82A,16777215\n";
    let mut session = open(Dialect::Pmac, PMAC, stimulus);
    session.run_to(3);
    session.apply(Command::Follow).unwrap();
    for (line, answer) in [
        ("#", "1"),
        ("P", "101"),
        ("F", "2"),
        ("?", "000000000401 (in position, home complete)"),
        ("#2P", "-10"),
        ("#", "2"),
        // In open loop there is no following error.
        ("F", "0"),
        ("?", "040000000000 (open loop)"),
        ("??", "000001000000 (program running)"),
        ("???", "400000000000 (real-time interrupt re-entry)"),
        ("&2", ""),
        ("Q5", "7"),
        ("^P", "101 -10 0 0 0 0 0 0"),
        ("^F", "2 0 0 0 0 0 0 0"),
        ("^Y", "Q5"),
        ("^I", "7"),
        ("type", "PMAC"),
    ] {
        assert_eq!(typed(&mut session, line).unwrap(), answer, "{line}");
    }
    assert!(typed(&mut session, "#1V").unwrap().starts_with('-'));
    assert_eq!(typed(&mut session, "^B").unwrap().lines().count(), 8);
    for (line, reason) in [
        ("J+", "motors"),
        ("^K", "motors"),
        ("OPEN PLC 3", "source"),
        ("DATE", "firmware"),
        ("PC", "motion programs"),
        ("#9", "1 to 8"),
        ("M1->Y:$FFC2,8", "definitions"),
        ("^Z", "serial"),
        ("FOO", "can't be given"),
    ] {
        let refused = typed(&mut session, line).unwrap_err();
        assert!(refused.contains(reason), "{line}: {refused}");
    }
}

/// A motor that jogs at 20 counts/ms, and a motion program.
const AXIS: &str = "I100=1 I122=20 I120=10 I121=0 I119=0.5 I116=50 I117=0.5 I190=1000\n&1\n#1->1000X\n\
OPEN PROG 1 CLEAR\nLINEAR ABS F10\nX5\nCLOSE\nOPEN PROG 2 CLEAR\nWHILE(1<2)\nX5\nX0\nENDWHILE\nCLOSE\nOPEN PLC 1 CLEAR\nP1=P1+1\nCLOSE\n";

/// Goes on by a number of ticks, and follows them.
fn run_on(session: &mut crate::Session<'_>, ticks: u64) {
    session.apply(Command::Follow).unwrap();
    let last = session.status().last_tick;
    while session.status().last_tick < last + ticks {
        session.poll();
    }
}

/// What stands in the terminal.
fn terminal_text(session: &mut crate::Session<'_>) -> String {
    let Body::Terminal(view) = session.view(&Screen::Terminal).body else { panic!() };
    view.lines.iter().map(|line| format!("{}\n", line.text)).collect()
}

#[test]
fn the_pmac_terminal_commands_simulated_motors_and_motion_programs() {
    let mut session = open_with_motors(AXIS, "");
    run_on(&mut session, 3);
    let position = |session: &mut crate::Session<'_>| -> f64 {
        typed(session, "#1P").unwrap().parse().unwrap()
    };
    assert_eq!(position(&mut session), 0.0);
    assert_eq!(typed(&mut session, "#1J+").unwrap(), "");
    run_on(&mut session, 200);
    let moving = position(&mut session);
    assert!(moving > 100.0, "{moving}");
    assert_eq!(typed(&mut session, "V").unwrap(), "20");
    typed(&mut session, "j/").unwrap();
    run_on(&mut session, 100);
    let stopped = position(&mut session);
    run_on(&mut session, 100);
    assert_eq!((position(&mut session), stopped > moving), (stopped, true));
    assert!(typed(&mut session, "?").unwrap().contains("in position"));
    typed(&mut session, "J=-50.5").unwrap();
    run_on(&mut session, 2000);
    assert_eq!(position(&mut session), -50.5);
    // What a motor or a coordinate system refuses is told where it was commanded.
    typed(&mut session, "#2J+").unwrap();
    typed(&mut session, "&1B7R").unwrap();
    run_on(&mut session, 10);
    let told = terminal_text(&mut session);
    assert!(told.contains("ERR013") && told.contains("ERR015"), "{told}");
    typed(&mut session, "&1B2R").unwrap();
    run_on(&mut session, 200);
    assert!(terminal_text(&mut session).contains("started"), "{}", terminal_text(&mut session));
    assert_eq!(typed(&mut session, "%").unwrap(), "100");
    typed(&mut session, "A").unwrap();
    run_on(&mut session, 20);
    assert!(terminal_text(&mut session).contains("stopped"), "{}", terminal_text(&mut session));
    typed(&mut session, "^K").unwrap();
    run_on(&mut session, 3);
    assert!(typed(&mut session, "#1?").unwrap().contains("open loop"));
    // In the past nothing is commanded.
    session.apply(Command::GoToTick { tick: 5 }).unwrap();
    let refused = typed(&mut session, "#1J+").unwrap_err();
    assert!(refused.contains("the past is shown"), "{refused}");
    assert_eq!(typed(&mut session, "P").unwrap(), "0");
    assert!(typed(&mut session, "#1J=*").unwrap_err().contains("COMMAND"));
}

#[test]
fn the_jog_ribbon_moves_simulated_motors_and_only_in_the_present() {
    let mut session = open_with_motors(AXIS, "");
    run_on(&mut session, 3);
    let ribbon = panel(&mut session, "Jog ribbon");
    // One motor is activated.
    assert_eq!((ribbon.columns, ribbon.cells.len()), (6, 12));
    let jog = ribbon.cells.iter().find(|cell| cell.label == "#1J+").unwrap();
    let (name, value) = jog.press().unwrap();
    session.apply(Command::Change { name, value }).unwrap();
    run_on(&mut session, 200);
    let ribbon = panel(&mut session, "Jog ribbon");
    assert_eq!(ribbon.cells[1].value.as_deref(), Some("20"));
    session.apply(Command::GoToTick { tick: 3 }).unwrap();
    let ribbon = panel(&mut session, "Jog ribbon");
    assert!(ribbon.cells.iter().all(|cell| cell.press().is_none()));
    assert_eq!(ribbon.cells[0].value.as_deref(), Some("0"));
}

#[test]
fn the_machine_of_a_pmac_has_motors_programs_and_ways() {
    // So slow that the program still runs, however many ticks are run at a time.
    let slow = AXIS.replace("F10", "F0.2");
    let mut session = open_with_motors(&slow, "3,&1B1,1\n3,&1R,1\n");
    assert!(session.status().has_machine && !open(Dialect::Pmac, PMAC, "").status().has_machine);
    run_on(&mut session, 1500);
    let machine = |session: &mut crate::Session<'_>| {
        let Body::Machine(view) = session.view(&Screen::Machine).body else { panic!() };
        view
    };
    // A way that is followed begins when it is shown.
    machine(&mut session);
    run_on(&mut session, 50);
    let now = machine(&mut session);
    let motors: Vec<&str> = now.axes.iter().map(|axis| axis.name.as_str()).collect();
    assert_eq!(motors, ["#1"]);
    assert!(now.axes[0].actual > Some(100.0), "{now:?}");
    let program = &now.programs[0];
    assert_eq!(
        (program.name.as_str(), program.number, program.base),
        ("&1", Some(1.0), Some(100.0))
    );
    let current: Vec<&str> =
        program.lines.iter().filter(|line| line.current).map(|line| line.text.as_str()).collect();
    assert_eq!(current, ["X5"]);
    assert!(now.paths[0].points.len() > 2, "{now:?}");
    // In the past it is where it was then, and so is its way.
    let past = 200;
    session.apply(Command::GoToTick { tick: past }).unwrap();
    let then = machine(&mut session);
    assert!(then.axes[0].actual < now.axes[0].actual);
    assert_eq!(then.paths[0].ticks.1, past);
    let last = then.paths[0].points.last().unwrap()[0];
    assert!((last - then.axes[0].actual.unwrap() / 1000.0).abs() < 0.05, "{then:?}");
}

#[test]
fn the_scope_looks_for_triggers_and_goes_with_the_tick() {
    let mut session = open(Dialect::Pmi, PMI, "30,A,1\n40,A,0\n900,A,1\n905,A,0\n");
    session.run_to(2000);
    session.apply(Command::ScopeAdd { names: vec!["A".into()] }).unwrap();
    session.apply(Command::ScopeWidth { ticks: 100 }).unwrap();
    let scope = |session: &mut crate::Session<'_>| {
        let Body::Scope(scope) = session.view(&Screen::Scope { samples: 50 }).body else {
            panic!()
        };
        scope
    };
    // It goes with the tick.
    session.apply(Command::GoToTick { tick: 500 }).unwrap();
    let shown = scope(&mut session);
    assert!((shown.from..=shown.to).contains(&500) && shown.tick == 500, "{shown:?}");
    let times: Vec<&str> = shown.axis.iter().map(|mark| mark.text.as_str()).collect();
    assert_eq!(times, ["9 s", "9.5 s", "10 s", "10.5 s"]);
    // From the tick that is shown on the trigger is looked for.
    session.apply(Command::GoToTick { tick: 10 }).unwrap();
    let trigger = crate::Trigger { expression: "A".into(), edge: crate::Edge::Rising, before: 20 };
    session.apply(Command::ScopeTrigger { trigger: Some(trigger) }).unwrap();
    let met = |session: &mut crate::Session<'_>| loop {
        session.poll();
        if let Some(tick) = scope(session).trigger_tick {
            break tick;
        }
    };
    assert_eq!(met(&mut session), 30);
    session.apply(Command::ScopeNextTrigger).unwrap();
    assert_eq!(met(&mut session), 900);
    // A stretch that the user has chosen goes with the tick too.
    session.apply(Command::ScopeRange { from: 850, to: 949 }).unwrap();
    session.apply(Command::GoToTick { tick: 300 }).unwrap();
    let shown = scope(&mut session);
    assert!((shown.from..=shown.to).contains(&300), "{shown:?}");
}

#[test]
fn statements_have_the_comments_of_the_source() {
    let mut session =
        open(Dialect::Pmi, "$OUTPUT\nB=1/0 ? a lamp\n$END\nB=T ? the lamp is on\n", "");
    session.run_to(1);
    let line = session.statements().lines.remove(0);
    assert_eq!((line.text().trim(), line.comment.as_str()), ("B=T", "the lamp is on"));
}

#[test]
fn the_pmac_terminal_enables_and_disables_plcs() {
    let mut session = open(Dialect::Pmac, PMAC, "");
    session.run_to(5);
    session.apply(Command::Follow).unwrap();
    typed(&mut session, "DISABLE PLC 1").unwrap();
    typed(&mut session, "pau plc 2..9").unwrap();
    let last = session.status().last_tick;
    session.run_to(last + 4);
    assert_eq!(
        typed(&mut session, "PLC1").unwrap_err().split('.').next(),
        Some("`PLC1` can't be given here")
    );
    let Body::Tasks(tasks) = session.view(&Screen::Tasks).body else { panic!() };
    let states: Vec<_> = tasks.rows.iter().map(|row| row.state).collect();
    assert_eq!(states, [crate::view::TaskState::Disabled, crate::view::TaskState::Paused]);
    session.apply(Command::Follow).unwrap();
    typed(&mut session, "ENA PLC 1,2").unwrap();
    typed(&mut session, "^D").unwrap();
    typed(&mut session, "RES PLC 2").unwrap();
    typed(&mut session, "ENABLE PLC 1").unwrap();
    let last = session.status().last_tick;
    session.run_to(last + 4);
    let Body::Tasks(tasks) = session.view(&Screen::Tasks).body else { panic!() };
    // What is disabled does not resume.
    let states: Vec<_> = tasks.rows.iter().map(|row| row.state).collect();
    assert_eq!(states, [crate::view::TaskState::Running, crate::view::TaskState::Disabled]);
    assert!(typed(&mut session, "ENABLE PLC 40").is_err());
}

#[test]
fn the_pmac_terminal_gathers_from_ticks_that_are_run_again() {
    let stimulus = "0,I19,2\n0,I20,3\n0,I21,$400000\n0,I22,$C00700\n";
    let mut session = open(Dialect::Pmac, PMAC, stimulus);
    session.run_to(9);
    assert!(typed(&mut session, "GATHER").unwrap_err().contains("DEFINE GATHER"));
    typed(&mut session, "DEFINE GATHER 100").unwrap();
    let begun = session.status().last_tick + 1;
    typed(&mut session, "GATHER").unwrap();
    session.apply(Command::Follow).unwrap();
    session.run_to(begun + 6);
    let answer = typed(&mut session, "ENDGATHER").unwrap();
    assert!(answer.starts_with(&format!("ticks {begun} to ")), "{answer}");
    // X:0 counts servo cycles: behind tick n it is n + 1.
    let first = |line: &str| line.split(' ').next().unwrap().parse::<u64>().unwrap();
    // The lines come by and by, at least one at each poll; so a long list holds up no display.
    let lines = |session: &mut crate::Session<'_>| {
        let Body::Terminal(view) = session.view(&Screen::Terminal).body else { panic!() };
        let from = view.lines.iter().rposition(|line| line.typed).unwrap();
        view.lines[from + 1..].iter().map(|line| first(&line.text)).collect::<Vec<u64>>()
    };
    assert_eq!(typed(&mut session, "LIST GATHER 1,2").unwrap(), "");
    assert!(lines(&mut session).is_empty());
    let past = std::time::Instant::now();
    assert!(session.continue_answer(past));
    assert_eq!(lines(&mut session), [begun + 3]);
    assert!(session.poll());
    assert_eq!(lines(&mut session), [begun + 3, begun + 5]);
    assert!(!session.continue_answer(past));
    let Body::Scope(scope) = session.view(&Screen::Scope { samples: 10 }).body else { panic!() };
    let names: Vec<_> = scope.channels.iter().map(|channel| channel.name.as_str()).collect();
    assert_eq!((names, scope.from), (vec!["X:$0", "L:$700"], begun));
    assert_eq!(typed(&mut session, "^E").unwrap().split(' ').count(), 2);
    typed(&mut session, "DEL GAT").unwrap();
    assert!(typed(&mut session, "LIST GATHER").is_err());
}

/// Shares of time add up to all of it, and every executed line is there.
#[test]
fn lines_have_the_time_that_the_interpreter_took() {
    let mut session = open(Dialect::Pmi, PMI, "1,A,1\n");
    session.run_to(20);
    let timing = |session: &mut crate::Session<'_>| {
        let Body::Timing(timing) = session.view(&Screen::Timing).body else { panic!() };
        timing
    };
    // Of a few scans nothing is said.
    let few = timing(&mut session);
    assert!(few.lines.is_empty() && few.ticks < few.enough, "{few:?}");
    run_on(&mut session, 400);
    let timing = loop {
        let found = timing(&mut session);
        if found.ticks >= found.enough {
            break found;
        }
    };
    let of = |number: &str| {
        let line = timing.lines.iter().find(|line| line.number == number);
        line.map_or(0, |line| line.executions)
    };
    // Each scan executes line 11 once, and one of 15 and 17.
    assert_eq!((of("11"), of("15") + of("17")), (timing.ticks, timing.ticks), "{timing:?}");
    assert!(timing.lines.is_sorted_by(|a, b| a.nanoseconds >= b.nanoseconds), "{timing:?}");
    let shares: f64 = timing.lines.iter().map(|line| line.share).sum();
    let time: f64 = timing.lines.iter().map(|line| line.nanoseconds).sum();
    assert!(time == 0.0 || (shares - 1.0).abs() < 1e-9, "{timing:?}");
}

const TIMER: &str = "\
$TIMER
E/TC/DC=3
$FLIPFLOP
Q/D/CK/PR/CL
$INPUT
A=0/0
$OUTPUT
B=1/0
$INTEGER
N
$FAULT
F1 = \"TOO MANY\", N
$END
TC=A
D=T
CK=A
B=A
N=N+1
F1=(N>3)
";

#[test]
fn timers_unfold_and_inputs_are_forced() {
    let mut session = open(Dialect::Pmi, TIMER, "1,A,1\n");
    session.run_to(2);
    session.apply(Command::Watch { names: vec!["TC".into(), "Q".into(), "N".into()] }).unwrap();
    let Body::Variables(view) = session.view(&Screen::Variables).body else { panic!() };
    let row = |row: &crate::view::VariableRow| {
        let title = row.title.clone().unwrap_or_default();
        format!("{} {title} {}", row.name, row.value.as_deref().unwrap_or("?"))
    };
    let rows: Vec<String> = view.rows.iter().map(row).collect();
    assert_eq!(
        rows,
        [
            "TC control contact 1",
            "DC delayed contact 0",
            "TC#DELAY delay value 3",
            "TC#COUNT timer counter 2",
            "Q Q 1",
            "D D 1",
            "CK CK 1",
            "PR PR 0",
            "CL CL 0",
            "N  3",
        ]
    );
    // The counter is a variable; the delay is a number of the source, and the control to change it in is missing.
    let set = |name: &str, value: &str| Command::Change { name: name.into(), value: value.into() };
    let last = session.status().last_tick;
    session.apply(set("TC#COUNT", "100")).unwrap();
    let refusal = session.apply(set("TC#DELAY", "5")).unwrap_err();
    assert!(refusal.message.contains("TC#DELAY is in the source"), "{refusal}");
    session.apply(Command::Follow).unwrap();
    session.run_to(last + 2);
    let Body::Variables(view) = session.view(&Screen::Variables).body else { panic!() };
    let count =
        view.rows.iter().find(|row| row.name == "TC#COUNT").and_then(|row| row.value.clone());
    assert!(count.unwrap().parse::<i32>().unwrap() > 90);
    // Nothing is forced before the warning was confirmed.
    let force = Command::Force { name: "A".into(), value: "0".into() };
    let refusal = session.apply(force.clone()).unwrap_err();
    assert!(refusal.warning.unwrap().contains("completely bypassed"));
    session.apply(Command::ConfirmWarning).unwrap();
    session.apply(force).unwrap();
    session.apply(Command::Force { name: "B".into(), value: "1".into() }).unwrap();
    session.apply(Command::Follow).unwrap();
    let last = session.status().last_tick;
    session.run_to(last + 2);
    let Body::Io(io) = session.view(&Screen::Io).body else { panic!() };
    let output = &io.windows[0].rows[0];
    // The program assigns 0, the line is 1 (PMI 5.3).
    assert_eq!((output.logical.as_str(), output.physical.as_deref()), ("0", Some("1")));
    let input = &io.windows[1].rows[0];
    assert_eq!((input.logical.as_str(), input.forced.as_deref()), ("0", Some("0")));
    assert_eq!(session.status().forces.len(), 2);
    session.apply(Command::ReleaseAll).unwrap();
    assert!(session.status().forces.is_empty());
    let Body::Events(events) = session.view(&Screen::Events).body else { panic!() };
    assert_eq!(events.active.len(), 1);
    assert!(events.active[0].text.starts_with("TOO MANY "), "{events:?}");
    // The indicator around every screen.
    assert_eq!(session.status().announced, 1);
    session.apply(Command::GoToTick { tick: 0 }).unwrap();
    assert_eq!(session.status().announced, 0);
}

/// The memory of a PMAC from $C040 on to Y:$F000 is not memory of inputs and outputs.
#[test]
fn what_is_an_input_or_output_of_a_pmac_is_so_everywhere() {
    let program = "M1->Y:$FFC2,8\nM2->Y:$FFC0,0\nM3->X:$D200,0,16\nM4->Y:$C03F,2\nM5->X:$F000,1\n\
                   OPEN PLC 1 CLEAR\nIF (M2=1) M1=1 ENDIF\nP1=M3+M4+M5\nCLOSE\n";
    let mut session = open(Dialect::Pmac, program, "");
    session.run_to(1);
    let Body::Io(io) = session.view(&Screen::Io).body else { panic!() };
    let names = |window: usize| -> Vec<&str> {
        io.windows[window].rows.iter().map(|row| row.name.as_str()).collect()
    };
    assert_eq!((names(0), names(1)), (vec!["M1"], vec!["M2", "M4"]));
}

#[test]
fn the_scope_triggers_on_what_it_does_not_show() {
    let mut session = open(Dialect::Pmi, PMI, "40,A,1\n");
    session.apply(Command::ScopeAdd { names: vec!["N".into(), "SOL1".into()] }).unwrap();
    session.apply(Command::ScopeWidth { ticks: 20 }).unwrap();
    let trigger = crate::Trigger { expression: "A".into(), edge: crate::Edge::Rising, before: 5 };
    session.apply(Command::ScopeTrigger { trigger: Some(trigger) }).unwrap();
    session.run_to(70);
    let Body::Scope(view) = session.view(&Screen::Scope { samples: 100 }).body else { panic!() };
    assert_eq!((view.trigger_tick, view.from, view.to), (Some(40), 35, 54));
    assert_eq!((view.channels[1].samples[4].last, view.channels[1].samples[5].last), (0.0, 1.0));
    assert_eq!(view.channels[0].samples[0].last, 36.0);
    session.apply(Command::ScopeRange { from: 38, to: 41 }).unwrap();
    let reply = session.apply(Command::ScopeExport { format: crate::ExportFormat::Csv }).unwrap();
    assert_eq!(
        reply.text.unwrap(),
        "tick,seconds,N,SOL1\n38,0.76,39,0\n39,0.78,40,0\n40,0.8,41,1\n41,0.82,42,1\n"
    );
}

#[test]
fn watch_lists_have_an_end_and_a_name() {
    let program = "I5=2\nOPEN PLC 1 CLEAR\nP1=P1+1\nCLOSE\nENABLE PLC 1\n";
    let mut session = open(Dialect::Pmac, program, "");
    session.run_to(2);
    let watch =
        |names: &[&str]| Command::Watch { names: names.iter().map(|&n| n.into()).collect() };
    // A name that nothing has leaves the list as it was.
    session.apply(watch(&["P1", "P9999"])).unwrap_err();
    let rows = |session: &mut crate::Session<'_>| {
        let Body::Variables(view) = session.view(&Screen::Variables).body else { panic!() };
        view.rows.len()
    };
    assert_eq!(rows(&mut session), 0);
    session.apply(watch(&["P0..1000"])).unwrap();
    let refusal = session.apply(watch(&["Q0..1000"])).unwrap_err();
    assert!(refusal.message.contains("at most 2000 rows"), "{refusal}");
    assert_eq!(rows(&mut session), 1001);
    for list in ["", " ", "a\nb", &"x".repeat(65)] {
        session.apply(Command::ChooseList { list: list.into() }).unwrap_err();
        session.apply(Command::ScopeSave { name: list.into() }).unwrap_err();
    }
    session.apply(Command::ChooseList { list: " second ".into() }).unwrap();
    session.apply(watch(&["Q0..1000"])).unwrap();
}

/// What a control allows is not known before it answers.
#[test]
fn nothing_is_said_of_what_a_control_allows_that_does_not_answer() {
    let mut session = crate::Session::open(crate::Target {
        kind: crate::view::TargetKind::Control,
        name: "gone.sock".into(),
        run: None,
        socket: Some("/nonexistent/gone.sock".into()),
        state_folder: None,
        speed: 1.0,
        operator: false,
        rebuilder: None,
    });
    let force = Command::Force { name: "A".into(), value: "1".into() };
    let refusal = session.apply(force).unwrap_err();
    assert!(refusal.message.ends_with("there is no such socket"), "{refusal}");
}

/// ELSE and ENDIF are not statements of their own, and belong to the text.
#[test]
fn list_plc_gives_every_line_of_the_plc_that_was_opened_last() {
    let program = "I5=2\nOPEN PLC 3 CLEAR\nP2=1\nCLOSE\nOPEN PLC 3 CLEAR\nIF (P1>2)\n P1=0\n#define A P1\nELSE\n \
                   A=A+1\nENDIF\nCLOSE\nOPEN PLC 4 CLEAR P3=1 CLOSE\nENABLE PLC 3,4\n";
    let mut session = open(Dialect::Pmac, program, "");
    let mut list = |number: u32| {
        let line = format!("LIST PLC {number}");
        session.apply(Command::Online { line }).unwrap().text.unwrap()
    };
    assert_eq!(list(3), "IF (P1>2)\n P1=0\nELSE\n A=A+1\nENDIF\nRETURN");
    assert_eq!(list(4), "OPEN PLC 4 CLEAR P3=1 CLOSE\nRETURN");
    assert_eq!(list(5), "RETURN");
}
