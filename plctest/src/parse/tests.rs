use super::*;

fn read(text: &str) -> (Script, Vec<String>) {
    let mut sources = SourceMap::new();
    let file = sources.add("a.plctest", text.as_bytes());
    let (script, found) = parse(&sources, file);
    let line = |d: &Diagnostic| {
        let (line, column) = sources.line_col(file, d.span.start);
        assert!(d.help.is_some(), "{}", d.message);
        format!("{line}:{column} {} {}", d.code, d.message)
    };
    (script, found.iter().map(line).collect())
}

const WHOLE: &str = "program \"turret.pmi\"            # relative to the script
machine \"lathe.machine.toml\"
simulate
never CW & CCW
after START, RUN & (A, B), LAMP within 200 ms
test \"the turret finds # station 4\"
  set @NTOOL = 4, X=-1
  pulse @CP103 for 200 ms       # 1, then 0
  pulse @CP104
  wait until TPOS = 4 within 5 s
  expect TUNSOL = 0, LAMP
  hold CLAMP for 1 s
  run 10 ticks
  run 1.5 min
  force DOOR = 0
  release DOOR
  power cycle
  expect message \"TURRET\", stop \"WATCHDOG\", A[1] = (3)
end
";

#[test]
fn every_statement_of_a_script_is_read() {
    let (script, found) = read(WHOLE);
    assert_eq!(found, Vec::<String>::new());
    assert_eq!(script.programs[0].text, "turret.pmi");
    assert_eq!(script.machine.unwrap().text, "lathe.machine.toml");
    assert!(script.simulate.is_some());
    assert_eq!(script.invariants.len(), 2);
    let Body::Response { after, then, within } = &script.invariants[1].body else { panic!() };
    let then: Vec<&str> = then.iter().map(|piece| piece.text.as_str()).collect();
    assert_eq!((after.text.as_str(), then), ("START", vec!["RUN & (A, B)", "LAMP"]));
    assert_eq!(within.ticks(20_000_000), 10);
    let test = &script.tests[0];
    assert_eq!(
        (test.name.text.as_str(), test.line, test.invariants),
        ("the turret finds # station 4", 6, 2)
    );
    assert_eq!(test.statements.len(), 12);
    let text = |piece: &Piece| piece.text.clone();
    let Body::Set(set) = &test.statements[0].body else { panic!() };
    let set: Vec<_> = set.iter().map(|(name, value)| (text(name), text(value))).collect();
    assert_eq!(set, [("@NTOOL".into(), "4".into()), ("X".into(), "-1".into())]);
    let Body::Pulse(names, length) = &test.statements[1].body else { panic!() };
    assert_eq!((text(&names[0]).as_str(), length.unwrap().ticks(20_000_000)), ("@CP103", 10));
    let Body::Expect(expected) = &test.statements[11].body else { panic!() };
    assert!(matches!(&expected[0], Expected::Message(text) if text.text == "TURRET"));
    assert!(matches!(&expected[1], Expected::Stop(text) if text.text == "WATCHDOG"));
    assert!(matches!(&expected[2], Expected::Condition(text) if text.text == "A[1] = (3)"));
}

#[test]
fn line_ends_and_byte_order_marks_do_not_matter() {
    for text in [WHOLE.replace('\n', "\r\n"), WHOLE.replace('\n', "\r"), format!("\u{feff}{WHOLE}")]
    {
        let (script, found) = read(&text);
        assert_eq!(
            (found, script.tests[0].statements.len(), script.tests[0].line),
            (vec![], 12, 6)
        );
    }
}

#[test]
fn a_number_sign_in_a_name_begins_no_comment() {
    for (line, end) in [
        ("expect A # note", 9),
        ("expect TC#COUNT = 5 # note", 20),
        ("expect #1.CMD > 5 #2. note", 18),
        ("#1.First thing", 0),
        ("test \"a # b\" # c", 13),
        ("run 10 ticks#note", 12),
    ] {
        assert_eq!(comment(line), end, "{line}");
    }
}

#[test]
fn every_mistake_is_told_at_its_place() {
    let head = "program \"a.pmi\"\n";
    for (line, message) in [
        ("tset \"x\"", "2:1 TEST-1 no statement begins with `tset`"),
        ("Test \"x\"", "2:1 TEST-1 no statement begins with `Test`"),
        ("?", "2:1 TEST-1 no statement begins with `?`"),
        ("set A = 1", "2:1 TEST-2 this belongs in a test, but no test begins above it"),
        ("end", "2:1 TEST-2 no test begins above this `end`"),
        ("test \"\"\nend", "2:1 TEST-1 a test needs a name"),
        ("test \"a\"", "2:7 TEST-2 this test has no `end`"),
        ("test \"a\"\nend\ntest \"a\"\nend", "4:7 TEST-2 the test in line 2 has this name, too"),
        ("test \"a\"\ntest \"b\"\nend", "3:1 TEST-2 the test in line 2 has no `end`"),
        (
            "test \"a\"\nprogram \"b.pmi\"\nend",
            "3:1 TEST-2 this belongs above the tests, but is in the test of line 2",
        ),
        ("test \"a\"\nset A\nend", "3:5 TEST-1 `A` has no `=` with a value after it"),
        ("test \"a\"\nset A=1,\nend", "3:8 TEST-1 nothing stands beside this comma"),
        (
            "test \"a\"\nexpect message \"x\nend",
            "3:8 TEST-1 this text in quotes is not closed, or something follows it",
        ),
        (
            "after A within 2 s",
            "2:7 TEST-1 a second condition, which has to follow, belongs after a comma",
        ),
        ("after A, within 2 s", "2:8 TEST-1 nothing stands beside this comma"),
        ("after A, B", "2:10 TEST-1 `within` is expected here, not the end of the line"),
        ("after A, B within", "2:17 TEST-1 a blank is expected here, not the end of the line"),
        ("after", "2:5 TEST-1 a blank is expected here, not the end of the line"),
        ("aftr A, B within 2 s", "2:1 TEST-1 no statement begins with `aftr`"),
        (
            "after A, B within 2",
            "2:19 TEST-1 `.`, a blank or a unit: ticks, ms, s or min is expected here, not the end of the line",
        ),
        (
            "test \"a\"\nafter A, B within 2 s\nend",
            "3:1 TEST-2 this belongs above the tests, but is in the test of line 2",
        ),
        ("machine \"a\"\nmachine \"b\"", "3:1 TEST-2 the script names a machine file already"),
    ] {
        assert_eq!(read(&format!("{head}{line}\n")).1, [message], "{line}");
    }
    for (line, start) in [
        ("wait until A within 5", "3:21 TEST-1 "),
        ("wait until A", "3:12 TEST-1 "),
        ("wait A", "3:6 TEST-1 "),
        ("run 5 hours", "3:7 TEST-1 a unit: ticks, ms, s or min is expected here"),
        ("run 1.5 ticks", "3:5 TEST-1 ticks are whole numbers"),
        ("power", "3:5 TEST-1 "),
        ("hold A", "3:6 TEST-1 "),
        ("set", "3:3 TEST-1 "),
        ("run 5 ticks more", "3:13 TEST-1 "),
    ] {
        let found = read(&format!("{head}test \"a\"\n{line}\nend\n")).1;
        assert!(found.len() == 1 && found[0].starts_with(start), "{line}: {found:?}");
    }
    assert_eq!(
        read("test \"a\"\nend\n").1,
        ["1:1 TEST-2 the script does not say which program it tests"]
    );
}

#[test]
fn long_texts_of_anything_are_refused_and_do_no_harm() {
    for part in [
        "wait until ",
        "set A = ",
        "\u{0}\u{1}",
        "é",
        "test \"a\"\n",
        "#\n",
        "x\n",
        "(",
        "\"",
        "expect ,,\n",
        " ",
    ] {
        let (_, found) = read(&part.repeat((1 << 16) / part.len()));
        assert!(!found.is_empty(), "{part:?}");
    }
}
