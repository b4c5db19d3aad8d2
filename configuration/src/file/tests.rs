//! What whole files say, and what is found wrong in them.
#![allow(clippy::unwrap_used, clippy::indexing_slicing)]

use super::*;

fn read(text: &str) -> (Configuration, Findings) {
    Configuration::read(text, Path::new("etc/lathe.toml"))
}

/// What is wrong with a control's part of a file.
fn mistakes(text: &str) -> Vec<(usize, String)> {
    let (_, findings) = read(text);
    let all = findings.for_control().into_iter();
    all.map(|Mistake { line, message }| (line, message)).collect()
}

#[test]
fn keys_are_typed() {
    let text = "artifact = \"lathe.plcx\"\nretain = \"/var/lathe\"\nperiod = 2.5\n\
                log = 'lathe.jsonl'\nrestart = 3\nallow = \"stop\"\nsocket = \"s\"\n[safe]\nPUMP = \"hold\"\n\
                \"PORT1.0\" = 1\n";
    let (configuration, findings) = read(text);
    assert_eq!(findings.for_control(), []);
    assert_eq!(configuration.artifact, Some("etc/lathe.plcx".into()));
    assert_eq!(configuration.retain, Some("/var/lathe".into()));
    assert_eq!(configuration.log, Some("etc/lathe.jsonl".into()));
    assert_eq!(configuration.record_path(), Path::new("/var/lathe.plcrec"));
    assert_eq!(configuration.period, Some(Duration::from_micros(2500)));
    assert_eq!((configuration.restart, configuration.allow), (Some(3), vec!["stop".to_owned()]));
    let safe =
        |line, name: &str, value: &str| SafeEntry { line, name: name.into(), value: value.into() };
    assert_eq!(configuration.safe, [safe(9, "PUMP", "hold"), safe(10, "PORT1.0", "1")]);
    assert_eq!(read("period = \"20ms\"").0.period, Some(Duration::from_millis(20)));
}

#[test]
fn a_key_that_needs_another_one_is_taken_if_that_is_there() {
    for text in ["socket = \"s\"\nallow = [\"stop\"]\n", "allow = [\"stop\"]\nsocket = \"s\"\n"] {
        assert_eq!(mistakes(&format!("artifact = \"a\"\n{text}")), []);
    }
    let alone = mistakes("artifact = \"a\"\nallow = [\"stop\"]\n");
    assert_eq!(alone, [(2, "`allow` needs the key `socket`".to_owned())]);
}

#[test]
fn a_safe_value_that_stands_twice_is_a_mistake() {
    let text = "artifact = \"p.plcx\"\n[safe]\nPUMP = 1\nFAN = 0\nPump = \"off\"\n";
    assert_eq!(mistakes(text), [(5, "`Pump` has a value in line 3 already".into())]);
    assert_eq!(mistakes("artifact = \"p.plcx\"\nsafe = { A = 1, a = 0 }\n").len(), 1);
}

#[test]
fn every_mistake_is_found_with_its_line() {
    let text = "artifact = 5\nretian = \"a\"\n\noverrun = 1\nperiod = \"x\"\n\
                restart = -1\nlog = 1\n[safe]\nPUMP = true\n[other]\nA = 1\n";
    let found = mistakes(text);
    let lines: Vec<usize> = found.iter().map(|&(line, _)| line).collect();
    assert_eq!(lines, [1, 2, 4, 5, 6, 7, 9, 10], "{found:?}");
    for (index, part) in [
        (1, "there is no key `retian`; did you mean `retain`?"),
        (2, "a text in quotes is expected, as in \"skip\""),
        (3, "as in 20 or 20ms"),
        (4, "a number is expected"),
        (6, "\"off\", \"hold\" or a number"),
        (7, "there is no key `other`"),
    ] {
        assert!(found[index].1.contains(part), "{part}: {found:?}");
    }
}

#[test]
fn what_is_no_toml_is_found_with_its_line_beside_the_rest() {
    let found = mistakes("artifact = \"a\"\nretain = \nlgo = 1\n");
    assert_eq!(found[0].0, 2, "{found:?}");
    assert!(found[0].1.starts_with("this is not valid TOML: "), "{found:?}");
    assert!(found.iter().any(|(line, _)| *line == 3), "{found:?}");
    for text in ["", "# the artifact comes later\n", "log = \"artifact.jsonl\"\n"] {
        assert!(mistakes(text)[0].1.contains("`artifact` is missing"), "{text}");
    }
}

#[test]
fn the_table_of_plcio_has_defaults_and_its_mistakes_have_lines() {
    let good = "artifact = \"a\"\nimage = \"i\"\n[plcio]\npoll_ms = 5\nidle = \"2s\"\nlog = \"l\"\n[[io]]\n\
                name = \"A\"\ndriver = \"other\"\n";
    let (configuration, findings) = read(good);
    assert_eq!(findings.all(), []);
    assert_eq!(configuration.image, Some("etc/i".into()));
    let plcio = &configuration.plcio;
    assert_eq!((plcio.poll, plcio.answer), (Duration::from_millis(5), Duration::from_millis(500)));
    assert_eq!(plcio.drivers.modbus.idle, Duration::from_secs(2));
    assert_eq!((configuration.entries.len(), plcio.log.clone()), (1, Some("etc/l".into())));
    let bad = "[plcio]\npol_ms = 5\nanswer_ms = 0\nlog = 1\n[[io]]\nname = \"A\"\n";
    let lines = read(bad).1.for_plcio().iter().map(|mistake| mistake.line).collect::<Vec<_>>();
    assert_eq!(lines, [1, 2, 3, 4, 5]);
    let twice = "image = \"i\"\n[plcio]\npoll = \"2ms\"\npoll_ms = 5\nsilence = 5\n";
    let found = read(twice).1.for_plcio();
    assert_eq!(found.iter().map(|mistake| mistake.line).collect::<Vec<_>>(), [4, 5], "{found:?}");
    assert!(found[0].message.contains("an older name of `poll`"), "{found:?}");
    assert!(found[1].message.contains("a time from 1ms to 1h is expected"), "{found:?}");
}

#[test]
fn a_driver_without_its_setting_is_a_warning() {
    let io = "[[io]]\nname = \"A\"\ndriver = \"modbus-server\"\naddress = \"coil/0\"\n";
    let warnings = |plcio: &str| read(&format!("{plcio}{io}")).0.warnings();
    assert_eq!(warnings("[plcio]\nmodbus-server = \"[::]:502\"\n"), []);
    let alone = warnings("");
    assert_eq!((alone.len(), alone[0].line), (1, Some(1)));
    assert!(alone[0].message.contains("need the key `modbus-server`"), "{alone:?}");
}

#[test]
fn the_log_of_plcio_is_no_other_file() {
    let folder = std::env::temp_dir().join(format!("plcc-configuration-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("c.toml");
    std::fs::write(folder.join("i"), "").unwrap();
    std::fs::hard_link(folder.join("i"), folder.join("j")).unwrap();
    for (log, expected) in [
        ("c.toml", "is the configuration"),
        ("i", "is `image`"),
        ("j", "is `image`"),
        ("p.plcx", "is `artifact`"),
        ("own.jsonl", "is the control's own log"),
        ("l", ""),
    ] {
        let text = "artifact = \"p.plcx\"\nimage = \"i\"\nlog = \"own.jsonl\"\n[plcio]\n";
        std::fs::write(&path, format!("{text}log = \"{log}\"\n")).unwrap();
        let (_, findings) = Configuration::open(&path).unwrap();
        let why = findings.for_plcio().first().map(|mistake| mistake.message.clone());
        let why = why.unwrap_or_default();
        assert!(why.ends_with(expected) && why.is_empty() == expected.is_empty(), "{why}");
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn a_file_that_can_not_be_read_is_said_in_words() {
    let missing = Configuration::open(Path::new("/nowhere/a.toml")).unwrap_err();
    assert_eq!(missing, "/nowhere/a.toml: there is no such file or folder");
    let binary = Configuration::open(Path::new("/bin/true")).unwrap_err();
    assert!(binary.contains("it is not text"), "{binary}");
}
