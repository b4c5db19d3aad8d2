//! `plcc why`: what holds a value, since when, what changed it, what would switch it; computed by hand.

#![allow(clippy::unwrap_used, clippy::indexing_slicing)]

mod support;

use std::io::{BufRead, BufReader, Write};
use std::os::unix::net::UnixStream;
use std::process::Stdio;

use serde_json::{Value as Json, json};
use support::Folder;
use support::process::{Killed, wait};

/// A spindle: OUT depends on RUN, which holds itself, and on the door behind a timer.
const SPINDLE: &str = "$INPUT\nSTART=0/0\nSTOP=0/1\nDOOR=0/2\n$OUTPUT\nOUT=2/0\n$LOGICAL\nRUN\n\
                       $TIMER\nE/TC/DC = 5\n$INTEGER\nN\n$END\n\
                       RUN = (START ! RUN) & /STOP\n\
                       TC = DOOR\n\
                       OUT = RUN & DC\n\
                       IF (OUT)\nN = N + 1\nENDIF\n";

/// START at tick 3 for two ticks, the door closed from tick 10 to 29.
const SHIFT: &str = "tick,name,value\n3,START,1\n5,START,0\n10,DOOR,1\n30,DOOR,0\n";

fn json_of(folder: &Folder, command: &str) -> Json {
    let done = folder.plcc(&format!("why {command} --message-format json")).exits(0);
    assert_eq!(done.stdout.lines().count(), 1, "{}", done.stdout);
    serde_json::from_str(&done.stdout).unwrap()
}

/// The names of what holds a value, in their order, each with its value.
fn names(of: &Json) -> Vec<(&str, f64)> {
    let causes = of["because"].as_array().unwrap();
    causes
        .iter()
        .map(|cause| (cause["name"].as_str().unwrap(), cause["value"].as_f64().unwrap()))
        .collect()
}

fn lathe() -> Folder {
    Folder::with(&[("a.pmi", SPINDLE), ("a.csv", SHIFT)])
}

#[test]
fn pmi_an_output_is_followed_down_to_inputs() {
    let folder = lathe();
    // The door is closed at tick 10, the timer has run out 5 scans later.
    let why = json_of(&folder, "a.pmi OUT --stimulus a.csv --ticks 40 --tick 20");
    assert_eq!((&why["name"], &why["value"], &why["tick"]), (&json!("OUT"), &json!(1), &json!(20)));
    assert_eq!(
        (&why["since"], &why["file"], &why["line"]),
        (&json!(15), &json!("a.pmi"), &json!(16))
    );
    assert_eq!(why["changed_by"], json!({"kind": "statement", "file": "a.pmi", "line": 16}));
    assert_eq!(names(&why), [("RUN", 1.0), ("DC", 1.0)]);
    let run = &why["because"][0];
    assert_eq!((&run["since"], &run["line"]), (&json!(3), &json!(14)));
    // RUN holds itself: START has been 0 since tick 5, so only STOP would end it.
    assert_eq!(names(run), [("STOP", 0.0)]);
    assert_eq!(run["because"][0]["changed_by"]["kind"], "power-up");
    let delayed = &why["because"][1];
    assert_eq!((&delayed["since"], names(delayed)), (&json!(15), vec![("TC", 1.0)]));
    assert_eq!(names(&delayed["because"][0]), [("DOOR", 1.0)]);
    let door = &delayed["because"][0]["because"][0];
    assert_eq!((&door["since"], &door["changed_by"]), (&json!(10), &json!({"kind": "stimulus"})));
    assert!(door.get("line").is_none() && door["because"] == json!([]));
    assert_eq!(
        why["would"],
        json!([[{"name": "STOP", "value": 1}], [{"name": "DOOR", "value": 0}]])
    );
    let keys: Vec<&String> = why.as_object().unwrap().keys().collect();
    assert_eq!(
        keys,
        ["name", "value", "tick", "since", "file", "line", "because", "changed_by", "would"]
    );
}

#[test]
fn pmi_why_it_did_not_come_and_what_a_timer_waits_for() {
    let folder = lathe();
    // The timer has 2 of its 5 scans left at the end of tick 13: set to 5 in tick 10, then 4, 3, 2.
    let why = json_of(&folder, "a.pmi OUT --stimulus a.csv --ticks 40 --tick 13");
    assert_eq!((&why["value"], &why["since"]), (&json!(0), &json!(0)));
    assert_eq!(why["changed_by"], json!({"kind": "power-up"}));
    assert_eq!(names(&why), [("DC", 0.0)]);
    assert_eq!(names(&why["because"][0]), [("TC", 1.0), ("TC#COUNT", 2.0)]);
    let count = &why["because"][0]["because"][1];
    assert_eq!((&count["since"], &count["changed_by"]["kind"]), (&json!(13), &json!("timer")));
    // No input makes time pass faster.
    assert_eq!(why["would"], json!([]));
    let text = folder.plcc("why a.pmi OUT --stimulus a.csv --ticks 40 --tick 13").exits(0).stdout;
    assert!(text.starts_with("OUT has been 0 since power-up, because DC is 0.\n"), "{text}");
    assert!(text.contains("TC#COUNT has been 2 (0.04 s left) since tick 13 (0.26 s)"), "{text}");
    // In the next scan the timer runs out by itself.
    let why = json_of(&folder, "a.pmi OUT --stimulus a.csv --ticks 40 --tick 14");
    assert_eq!(why["would"], json!([[]]));
}

#[test]
fn pmi_a_statement_that_was_not_executed_is_explained_by_its_condition() {
    let folder = lathe();
    // N counts in the ticks 15 to 29, in which OUT is 1: 15 of them.
    let why = json_of(&folder, "a.pmi N --stimulus a.csv --ticks 40");
    assert_eq!((&why["value"], &why["tick"], &why["since"]), (&json!(15), &json!(39), &json!(29)));
    assert_eq!((&why["line"], names(&why)), (&json!(18), vec![("OUT", 0.0)]));
    // Of RUN and DC it is DC that is missing.
    assert_eq!(names(&why["because"][0]), [("DC", 0.0)]);
    assert_eq!(why["would"], json!([]));
}

#[test]
fn pmi_flip_flops_arrays_and_forms_of_conditions() {
    let text = "$INPUT\nI1=0/0\nI2=0/1\n$FLIPFLOP\nQ/D/CK/PR/CL\n$INTEGER\nA[3],K=2,M\n$LOGICAL\nX,Y\n$END\n\
                D = T\nPR = F\nCL = I2\nCK = I1\n\
                A[1] = 7\nM = A[K - 1]\n\
                IF (M > 5)\nX = Q\nELSE\nX = T\nENDIF\n\
                Y = I1 & I2 ! Q\n";
    let folder =
        Folder::with(&[("f.pmi", text), ("f.csv", "tick,name,value\n2,I1,1\n4,I1,0\n6,I2,1\n")]);
    // The clock rose in tick 2, and CL has cleared it in tick 6.
    let why = json_of(&folder, "f.pmi X --stimulus f.csv --ticks 9");
    assert_eq!((&why["value"], &why["since"], &why["line"]), (&json!(0), &json!(6), &json!(18)));
    assert_eq!(names(&why), [("Q", 0.0), ("M", 7.0)]);
    assert_eq!(names(&why["because"][0]), [("CL", 1.0)]);
    assert_eq!(names(&why["because"][0]["because"][0]), [("I2", 1.0)]);
    // K is a constant; an element of an array is a variable.
    assert_eq!(names(&why["because"][1]), [("A[1]", 7.0)]);
    let why = json_of(&folder, "f.pmi Y --stimulus f.csv --ticks 9");
    assert_eq!(names(&why), [("I1", 0.0), ("Q", 0.0)]);
    assert_eq!(why["would"], json!([[{"name": "I1", "value": 1}]]));
    let refused = folder.plcc("why f.pmi A --ticks 3").exits(2).stderr;
    assert!(refused.contains("`A` is a whole array; name one element, as A[0]"), "{refused}");
    let refused = folder.plcc("why f.pmi XX --ticks 3").exits(2).stderr;
    assert!(refused.contains("no variable named `XX`"), "{refused}");
}

/// An NCT program: a flag that is set and reset at two places, arithmetic in OP, a subroutine, a timer.
const MILL: &str = ":001\n(I000 A NI001) U012 Z\nI001 D012 Z\nLF020 + 2 SF022\nLF022 >5 U013 E D013 Z\n\
                    I002 C010 Z\nJ1\n:000\nJ0\n:010\nI003 UF0303 Z\nR\n";

#[test]
fn nct_flags_are_held_by_the_conditions_around_them() {
    let folder = Folder::with(&[
        ("m.nct", MILL),
        ("m.csv", "tick,name,value\n2,I000,1\n4,I000,0\n6,F020,9\n8,I003,1\n"),
    ]);
    // Nothing has reset it: I001 would.
    let why = json_of(&folder, "m.nct Y012 --stimulus m.csv --ticks 10");
    assert_eq!((&why["value"], &why["since"], &why["line"]), (&json!(1), &json!(2), &json!(2)));
    assert_eq!(why["changed_by"], json!({"kind": "statement", "file": "m.nct", "line": 2}));
    assert_eq!(names(&why), [("I001", 0.0)]);
    assert_eq!(why["would"], json!([[{"name": "I001", "value": 1}]]));
    // Before, I000 was missing.
    let why = json_of(&folder, "m.nct Y012 --stimulus m.csv --ticks 10 --tick 1");
    assert_eq!((&why["value"], names(&why)), (&json!(0), vec![("I000", 0.0)]));
    assert_eq!(why["would"], json!([[{"name": "I000", "value": 1}]]));
    // What is computed in OP is followed to the variables.
    let why = json_of(&folder, "m.nct Y013 --stimulus m.csv --ticks 10");
    assert_eq!(
        (&why["value"], &why["since"], names(&why)),
        (&json!(1), &json!(6), vec![("F022", 11.0)])
    );
    assert_eq!(names(&why["because"][0]), [("F020", 9.0)]);
    assert_eq!(why["because"][0]["because"][0]["changed_by"], json!({"kind": "stimulus"}));
    // The call of the subroutine is missing.
    let why = json_of(&folder, "m.nct F0303 --stimulus m.csv --ticks 10");
    assert_eq!(names(&why), [("I002", 0.0)]);
    assert_eq!(why["would"], json!([[{"name": "I002", "value": 1}]]));
}

/// Two PLCs: the first reads a key, the second switches a lamp. PLC 3 is never enabled.
const PANEL: &str = "#define KEY M11\n#define LAMP M1\nKEY->Y:$FFC2,0\nM12->Y:$FFC2,1\nLAMP->Y:$FFC2,8\nM2->Y:$FFC2,9\n\
                     I5=2\nOPEN PLC 1 CLEAR\nIF (KEY=1 AND M12=1)\nP1=5\nELSE\nP1=0\nENDIF\nCLOSE\n\
                     OPEN PLC 2 CLEAR\nIF (P1>3)\nLAMP=1\nELSE\nLAMP=0\nENDIF\nCLOSE\n\
                     OPEN PLC 3 CLEAR\nM2=1\nCLOSE\nENABLE PLC 1,2\nDISABLE PLC 3\n";

#[test]
fn pmac_a_lamp_is_followed_through_two_plcs() {
    let folder = Folder::with(&[
        ("p.pmc", PANEL),
        ("p.csv", "tick,name,value\n0,M11,0\n0,M12,0\n20,M11,1\n"),
    ]);
    let why = json_of(&folder, "p.pmc M1 --stimulus p.csv --ticks 40");
    assert_eq!((&why["value"], &why["line"]), (&json!(0), &json!(19)));
    assert_eq!(names(&why), [("P1", 0.0)]);
    assert_eq!(names(&why["because"][0]), [("M12", 0.0)]);
    assert_eq!(why["would"], json!([[{"name": "M12", "value": 1}]]));
    // Before the first key both are missing.
    let why = json_of(&folder, "p.pmc M1 --stimulus p.csv --ticks 40 --tick 10");
    assert_eq!(names(&why["because"][0]), [("M11", 0.0), ("M12", 0.0)]);
    assert_eq!(why["would"], json!([[{"name": "M11", "value": 1}, {"name": "M12", "value": 1}]]));
    let text = folder.plcc("why p.pmc M2 --stimulus p.csv --ticks 40").exits(0).stdout;
    assert!(text.contains("PLC3 would give it another value, and does not run."), "{text}");
}

#[test]
fn a_source_with_errors_and_wrong_usage() {
    let folder = lathe();
    folder.write("b.pmi", support::BROKEN);
    let failed = folder.plcc("why b.pmi N --ticks 3").exits(1);
    assert!(failed.stderr.contains("PMI-31") && failed.stdout.is_empty(), "{}", failed.stderr);
    let refused = folder.plcc("why a.pmi OUT --ticks 3 --tick 3").exits(2).stderr;
    assert!(refused.contains("the run ends before tick 3"), "{refused}");
    folder.plcc("why a.pmi").exits(2);
    folder.plcc("why missing.pmi N").exits(2);
    // A program that is stopped is explained in the tick in which it was.
    folder.write("s.pmi", support::STOPS);
    let why = json_of(&folder, "s.pmi N --ticks 10");
    assert_eq!((&why["tick"], &why["value"]), (&json!(3), &json!(3)));
    let refused = folder.plcc("why s.pmi N --tick 7").exits(2).stderr;
    assert!(refused.contains("stopped in tick 3"), "{refused}");
}

#[test]
fn a_record_is_explained_as_its_run_was() {
    let folder = lathe();
    folder.plcc("run a.pmi --ticks 40 --stimulus a.csv --record a.plcrec").exits(0);
    let of_source = json_of(&folder, "a.pmi OUT --stimulus a.csv --ticks 40 --tick 20");
    assert_eq!(json_of(&folder, "a.plcrec OUT --tick 20"), of_source);
    let end = json_of(&folder, "a.plcrec OUT");
    assert_eq!(
        (&end["tick"], &end["since"], names(&end)),
        (&json!(39), &json!(30), vec![("DC", 0.0)])
    );
    let refused = folder.plcc("why a.plcrec OUT --tick 41").exits(2).stderr;
    assert!(refused.contains("tick 41"), "{refused}");
}

/// The spindle with a fault, a chain of three contacts, and what people say of an input.
const CHAIN: &str = "$INPUT\nSTART=0/0\nSTOP=0/1\nDOOR=0/2\n$OUTPUT\nOUT=2/0\n$LOGICAL\nREADY\n\
                     $FAULT\nDOPEN = \"DOOR IS OPEN\"\nNOTRDY = \"NOT READY, SEE DOOR\"\n$END\n\
                     READY = START & /STOP & DOOR\n\
                     OUT = READY\nDOPEN = /DOOR\nNOTRDY = /READY\n";

const NAMES: &str = "[names]\n\"DOOR\" = { alias = \"S12_DOOR\", text = \"door closed\", device = \"-S12\", at = \"X11:7\" }\n";

fn chain() -> Folder {
    Folder::with(&[
        ("c.pmi", CHAIN),
        ("c.machine.toml", NAMES),
        ("c.csv", "tick,name,value\n3,START,1\n5,DOOR,1\n7,DOOR,0\n"),
    ])
}

#[test]
fn names_that_people_gave_stand_beside_those_of_the_program() {
    let folder = chain();
    let text = folder.plcc("why c.pmi OUT --stimulus c.csv --ticks 9").exits(0).stdout;
    assert!(
        text.contains("DOOR (S12_DOOR: door closed, -S12, at X11:7) has been 0 since tick 7"),
        "{text}"
    );
    assert!(text.contains("make OUT 1 with DOOR (S12_DOOR) = 1."), "{text}");
    let why = json_of(&folder, "c.pmi OUT --stimulus c.csv --ticks 9");
    let door = &why["because"][0]["because"][0];
    assert_eq!((&door["alias"], &door["text"]), (&json!("S12_DOOR"), &json!("door closed")));
    assert_eq!((&door["device"], &door["at"]), (&json!("-S12"), &json!("X11:7")));
    assert!(door.get("drawing").is_none() && why.get("alias").is_none(), "{why}");
    // The alias is a name to ask for.
    let why = json_of(&folder, "c.pmi S12_DOOR --stimulus c.csv --ticks 9");
    assert_eq!((&why["name"], &why["alias"]), (&json!("DOOR"), &json!("S12_DOOR")));
}

#[test]
fn a_chain_says_which_of_its_members_are_open() {
    let folder = chain();
    // At first two are open: the stop button, of which the program wants 0, is not among them.
    let why = json_of(&folder, "c.pmi READY --stimulus c.csv --ticks 2");
    assert_eq!(names(&why), [("START", 0.0), ("DOOR", 0.0)]);
    let why = json_of(&folder, "c.pmi READY --stimulus c.csv --ticks 4");
    assert_eq!(names(&why), [("DOOR", 0.0)]);
}

#[test]
fn a_fault_or_message_is_asked_for_by_its_text() {
    let folder = chain();
    let asked = |text: &str, tick: &str| {
        let command = ["why", "c.pmi", text, "--stimulus", "c.csv", "--tick", tick];
        folder.run(&command).exits(0).stdout
    };
    let open = asked("door is open", "9");
    let first = "DOPEN has been 1 since tick 7 (0.14 s), because DOOR (S12_DOOR) is 0.\n";
    assert!(open.starts_with(first), "{open}");
    assert!(open.contains("\n  The control shows the fault \"DOOR IS OPEN\".\n"), "{open}");
    let shut = asked("door is open", "6");
    assert!(shut.contains("\n  While it is 1, the control shows the fault \"DOOR IS OPEN\".\n"));
    // A part of the text is enough, if it is that of one alone.
    assert!(
        asked("not rea", "9")
            .starts_with("NOTRDY has been 1 since tick 7 (0.14 s), because READY is 0.\n")
    );
    let refused = folder.run(&["why", "c.pmi", "oo", "--ticks", "3"]).exits(2).stderr;
    let several = "name one of them: DOPEN (DOOR IS OPEN), NOTRDY (NOT READY, SEE DOOR)";
    assert!(refused.contains(several), "{refused}");
    let refused = folder.run(&["why", "c.pmi", "is it", "--ticks", "3"]).exits(2).stderr;
    assert!(refused.contains("no variable named `is it`"), "{refused}");
    // A message of NCT's :199 is that of Y710 and on.
    let mill = ":001\nI001 U711 E D711 Z\nJ1\n:000\nJ0\n:199 PRESSURE, LUBRICATION $\n";
    folder.write("n.nct", mill);
    let why = folder.run(&["why", "n.nct", "lubrication", "--ticks", "3"]).exits(0).stdout;
    assert!(why.starts_with("Y711 has been 0 since power-up, because I001 is 0.\n"), "{why}");
    assert!(why.contains("the control shows the message \"LUBRICATION\"."), "{why}");
}

/// PLC 1 tells once that the door is open; PLC 2 tells it as long as it is, and gives commands. PLC 3 is never enabled.
const TELLS: &str = "M11->Y:$FFC2,0\nM12->Y:$FFC2,1\nI5=2\nOPEN PLC 1 CLEAR\nIF (M11=1)\nIF (P1=0)\nSEND\"DOOR OPEN\"\nP1=1\nENDIF\n\
                     ELSE\nP1=0\nENDIF\nCLOSE\nOPEN PLC 2 CLEAR\nIF (M12=1 AND P1=1)\nDISPLAY 8\"SHUT IT\"\nCMD\"P5=7\"\nENDIF\nCLOSE\n\
                     OPEN PLC 3 CLEAR\nSEND\"NEVER\"\nSEND\"P1\"\nCLOSE\nENABLE PLC 1,2\nDISABLE PLC 3\n";

#[test]
fn pmac_a_text_is_asked_for_by_its_words() {
    let stimulus = "tick,name,value\n0,M11,0\n0,M12,0\n20,M11,1\n60,M11,0\n";
    let folder = Folder::with(&[("t.pmc", TELLS), ("t.csv", stimulus)]);
    let asked = |text: &str, more: &[&str]| {
        let command = ["why", "t.pmc", text, "--stimulus", "t.csv", "--ticks", "80"];
        let json = ["--message-format", "json"];
        let done = folder.run(&[&command[..], more, &json].concat()).exits(0);
        let people = folder.run(&[&command[..], more].concat()).exits(0).stdout;
        (serde_json::from_str::<Json>(&done.stdout).unwrap(), people)
    };
    // It was sent once, when the door opened; what is told now is about that tick.
    let (why, text) = asked("door op", &[]);
    let sent = why["since"].as_u64().unwrap();
    assert!((20..24).contains(&sent), "{sent}");
    assert_eq!((&why["name"], &why["value"]), (&json!("SEND\"DOOR OPEN\""), &json!(1)));
    assert_eq!((&why["file"], &why["line"]), (&json!("t.pmc"), &json!(7)));
    assert_eq!(why["changed_by"], json!({"kind": "statement", "file": "t.pmc", "line": 7}));
    let mut held = names(&why);
    held.sort_by_key(|held| held.0);
    assert_eq!(held, [("M11", 1.0), ("P1", 0.0)]);
    assert_eq!(why["would"], json!([]));
    assert!(
        text.starts_with(&format!("SEND\"DOOR OPEN\" was executed in tick {sent} (")),
        "{text}"
    );
    // In a later tick it is not sent again: that is held by P1, which the statement after it has set.
    let (why, text) = asked("SEND\"DOOR OPEN\"", &["--tick", "50"]);
    assert_eq!((&why["value"], &why["since"], &why["tick"]), (&json!(0), &json!(sent), &json!(50)));
    assert_eq!(names(&why), [("P1", 1.0)]);
    assert!(text.contains(&format!("was executed last in tick {sent} (")), "{text}");
    // Never told: the other key is missing, and would do it.
    let (why, text) = asked("shut it", &["--tick", "50"]);
    assert_eq!((&why["value"], &why["changed_by"]["kind"]), (&json!(0), &json!("power-up")));
    assert_eq!(names(&why), [("M12", 0.0)]);
    assert_eq!(why["would"], json!([[{"name": "M12", "value": 1}]]));
    assert!(
        text.starts_with(
            "DISPLAY 8\"SHUT IT\" has not been executed since power-up, because M12 is 0.\n"
        ),
        "{text}"
    );
    assert!(text.ends_with("The next scan would execute it with M12 = 1.\n"), "{text}");
    let (command, _) = asked("\"P5=7\"", &["--tick", "50"]);
    assert_eq!((&command["name"], names(&command)), (&json!("CMD\"P5=7\""), names(&why)));
    // A PLC that does not run; in quotes it is a text, although a variable has the name.
    for text in ["never", "\"P1\"", "t.pmc:21"] {
        let (why, people) = asked(text, &[]);
        assert_eq!((&why["value"], names(&why)), (&json!(0), vec![]), "{text}");
        assert!(people.contains("It is in PLC3, which does not run."), "{people}");
    }
    assert_eq!(asked("P1", &["--tick", "50"]).0["name"], "P1");
    let refused = folder.run(&["why", "t.pmc", "\"DOOR\"", "--ticks", "3"]).exits(2).stderr;
    assert!(refused.contains("\"DOOR\""), "{refused}");
    let refused = folder.run(&["why", "t.pmc", "P", "--ticks", "3"]).exits(2).stderr;
    assert!(refused.contains("no variable named"), "{refused}");
    let refused = folder.run(&["why", "t.pmc", "t", "--ticks", "3"]).exits(2).stderr;
    assert!(refused.contains("no variable named"), "{refused}");
    // A record knows the same.
    folder.plcc("run t.pmc --ticks 80 --stimulus t.csv --record t.plcrec").exits(0);
    let (of_source, _) = asked("door op", &[]);
    assert_eq!(json_of(&folder, "t.plcrec DOOR"), of_source);
}

#[test]
fn pmac_several_statements_with_one_text_are_asked_for_together() {
    let program = "M11->Y:$FFC2,0\nI5=2\nOPEN PLC 1 CLEAR\nIF (M11=1)\nSEND\"STOP\"\nELSE\nIF (P1>5)\nSEND\"STOP\"\nENDIF\nENDIF\n\
                   SEND\"STOPPED\"\nCLOSE\nENABLE PLC 1\n";
    let folder =
        Folder::with(&[("t.pmc", program), ("t.csv", "tick,name,value\n0,M11,0\n9,P1,6\n")]);
    // The one that was executed is explained.
    let why = json_of(&folder, "t.pmc STOP --stimulus t.csv --ticks 20");
    let mut held = names(&why);
    held.sort_by_key(|held| held.0);
    assert_eq!((&why["line"], held), (&json!(8), vec![("M11", 0.0), ("P1", 6.0)]));
    // Where none was, what kept each of them; any of the inputs would do.
    let why = json_of(&folder, "t.pmc STOP --stimulus t.csv --tick 5");
    let mut held = names(&why);
    held.sort_by_key(|held| held.0);
    assert_eq!(held, [("M11", 0.0), ("P1", 0.0)]);
    let why = json_of(&folder, "t.pmc t.pmc:5 --stimulus t.csv --ticks 20");
    assert_eq!((&why["value"], names(&why)), (&json!(0), vec![("M11", 0.0)]));
    let refused = folder.plcc("why t.pmc sto --ticks 3").exits(2).stderr;
    assert!(refused.contains("name one of them: t.pmc:5 (STOP), t.pmc:11 (STOPPED)"), "{refused}");
}

/// The next reply of a control to a request.
fn ask(folder: &Folder, request: Json) -> Json {
    let mut stream = UnixStream::connect(folder.path().join("socket")).unwrap();
    writeln!(stream, "{request}").unwrap();
    let mut line = String::new();
    BufReader::new(stream).read_line(&mut line).unwrap();
    serde_json::from_str(&line).unwrap()
}

#[test]
fn a_control_without_a_record_is_explained_by_what_it_tells() {
    let folder = chain();
    let options = ["run", "c.pmi", "--realtime", "--socket", "socket", "--allow", "write,force"];
    let mut run = folder.command(&options);
    let _control = Killed::spawn(run.stderr(Stdio::null()).stdout(Stdio::null()));
    wait("the control's socket", || UnixStream::connect(folder.path().join("socket")).ok());
    let values = json!([{"name": "DOOR", "value": "1"}]);
    let forced = ask(&folder, json!({"version": 1, "request": "force", "values": values}));
    assert_eq!(forced["ok"], true, "{forced}");
    let status = ask(&folder, json!({"version": 1, "request": "status"}));
    let holder = &status["result"]["forced_by"][0];
    assert_eq!((&holder["name"], &holder["ticks"]), (&json!("DOOR"), &forced["result"]["ticks"]));
    // The value alone is known without the program.
    let alone = folder.plcc("why socket OUT").exits(0);
    assert_eq!(alone.stdout, "OUT is 0 now.\n");
    assert!(alone.stderr.contains("name its source after the socket"), "{}", alone.stderr);
    let by = holder["by"].as_str().unwrap();
    let text = folder.plcc("why socket DOOR").exits(0).stdout;
    let said = "DOOR (S12_DOOR: door closed, -S12, at X11:7) has been 1 since tick";
    assert!(text.starts_with(said) && text.contains(&format!("by {by}.")), "{text}");
    // With it, what holds the value; since when is not known.
    let why = json_of(&folder, "socket c.pmi OUT");
    assert_eq!((&why["value"], &why["changed_by"]), (&json!(0), &json!({"kind": "unknown"})));
    assert_eq!(names(&why["because"][0]), [("START", 0.0)]);
    assert_eq!(
        (&why["since"], &why["would"]),
        (&why["tick"], &json!([[{"name": "START", "value": 1}]]))
    );
    let text = folder.run(&["why", "socket", "c.pmi", "door is open"]).exits(0).stdout;
    assert!(text.starts_with("DOPEN is 0 now, because DOOR (S12_DOOR) is 1.\n"), "{text}");
    assert!(text.contains(&format!("forced by {by}\n")), "{text}");
    let refused = folder.run(&["why", "socket", "\"DOOR IS OPEN\""]).exits(2).stderr;
    assert!(refused.contains("the texts of a program are in its source"), "{refused}");
    let refused = folder.plcc("why socket c.pmi OUT --tick 3").exits(2).stderr;
    assert!(refused.contains("name that with --record"), "{refused}");
    // Variables are compared; a control says nothing else of its program.
    folder.write("other.pmi", CHAIN.replace("READY\n$FAULT", "READY, MORE\n$FAULT"));
    let refused = folder.plcc("why socket other.pmi OUT").exits(2).stderr;
    assert!(refused.contains("other.pmi is another program than the one"), "{refused}");
}

#[test]
fn an_answer_is_coloured_where_that_is_wanted() {
    let folder = chain();
    let plain = folder.plcc("why c.pmi OUT --ticks 3").exits(0).stdout;
    let coloured = folder.plcc("--color always why c.pmi OUT --ticks 3").exits(0).stdout;
    assert!(coloured.starts_with("\u{1b}[1mOUT\u{1b}[0m has been "), "{coloured:?}");
    let mut bare = String::new();
    for (number, part) in coloured.split("\u{1b}[").enumerate() {
        bare.push_str(if number == 0 { part } else { part.split_once('m').unwrap().1 });
    }
    assert_eq!(bare, plain);
}

#[test]
fn to_set_the_variable_itself_is_not_an_answer() {
    let source = "$INPUT\nDONE=0/0\n$MCODE\n@M06/P\n$END\nIF (DONE)\n @M06 = F\nENDIF\n";
    let folder =
        Folder::with(&[("m.pmi", source), ("m.csv", "tick,name,value\n3,@M06,1\n5,DONE,0\n")]);
    let why = json_of(&folder, "m.pmi @M06 --stimulus m.csv --ticks 9");
    assert_eq!((&why["value"], &why["since"]), (&json!(1), &json!(3)));
    assert_eq!(why["would"], json!([[{"name": "DONE", "value": 1}]]));
}

#[test]
fn a_control_with_a_record_is_explained_at_the_present_tick() {
    let folder = chain();
    let options = ["run", "c.pmi", "--realtime", "--socket", "socket", "--allow", "write,force"];
    let mut run = folder.command(&options);
    run.args(["--record", "r.plcrec"]);
    let _control = Killed::spawn(run.stderr(Stdio::null()).stdout(Stdio::null()));
    wait("the control's socket", || UnixStream::connect(folder.path().join("socket")).ok());
    wait("the record", || folder.run(&["replay", "r.plcrec"]).status.eq(&0).then_some(()));
    // What has just happened is not in the record yet.
    let values = json!([{"name": "START", "value": "1"}]);
    let set = ask(&folder, json!({"version": 1, "request": "set", "values": values}));
    let tick = set["result"]["ticks"].as_u64().unwrap();
    wait("the tick", || {
        let status = ask(&folder, json!({"version": 1, "request": "status"}));
        (status["result"]["ticks"].as_u64() > Some(tick)).then_some(())
    });
    let why = json_of(&folder, "socket START");
    assert!(why["tick"].as_u64() >= Some(tick), "{why}");
    // Who gives an input its value, a record does not say.
    assert_eq!((&why["value"], &why["since"]), (&json!(1), &json!(tick)));
    assert_eq!(why["changed_by"], json!({"kind": "input"}));
    // A force holds the lines of an output, and not its variable.
    let values = json!([{"name": "OUT", "value": "1"}]);
    let forced = ask(&folder, json!({"version": 1, "request": "force", "values": values}));
    assert!(forced.get("error").is_none(), "{forced}");
    let said = folder.run(&["why", "socket", "OUT"]).exits(0).stderr;
    assert!(said.contains("note: OUT is forced to 1"), "{said}");
}

/// Line 13 holds the 0, though the variable had it before: it would overwrite what line 10 gives.
#[test]
fn what_gives_the_value_again_that_was_there_is_explained_by_its_condition() {
    let source = "$INPUT\nSAFE=0/0\nREQ=0/1\n$OUTPUT\nOUT=2/0\n$INTEGER\nDIR\n$END\nIF (REQ & SAFE)\n DIR = 1\n\
                  ENDIF\nIF (/SAFE)\n DIR = 0\nENDIF\nOUT = DIR /= 0\n";
    let folder = Folder::with(&[("d.pmi", source), ("d.csv", "tick,name,value\n2,REQ,1\n")]);
    let why = json_of(&folder, "d.pmi OUT --stimulus d.csv --ticks 9");
    assert_eq!(names(&why), [("DIR", 0.0)]);
    assert_eq!(why["because"][0]["line"], 13);
    assert_eq!(names(&why["because"][0]), [("SAFE", 0.0)]);
    assert_eq!(why["would"], json!([[{"name": "SAFE", "value": 1}]]));
}

#[test]
fn a_line_is_asked_for_by_the_name_that_drawings_have() {
    let folder = chain();
    let by_line = json_of(&folder, "c.pmi PORT2.0 --ticks 9");
    assert_eq!(by_line, json_of(&folder, "c.pmi OUT --ticks 9"));
    assert_eq!(by_line["name"], "OUT");
}
