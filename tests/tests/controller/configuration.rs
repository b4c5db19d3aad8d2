//! The configuration file of a controller: `plcrt --config` and `plcrt --check-config`.

use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::os::unix::net::UnixStream;
use std::process::{Command, Output};

use plcc_abi::Dialect;

use crate::shop::{Shop, loader, wait};

const PMI: &str = "$OUTPUT\nLAMP = 1/0\n$INTEGER\nN\n$END\nN = N + 1\nLAMP = T\n";

fn plcrt(shop: &Shop, args: &str) -> Output {
    let mut command = Command::new(loader());
    command.args(args.split_whitespace()).current_dir(shop.path("")).output().unwrap()
}

#[test]
fn a_configuration_says_what_runs_and_the_command_line_counts_more() {
    let shop = Shop::new("config", Dialect::Pmi, PMI);
    fs::create_dir(shop.path("etc")).unwrap();
    let text = "artifact = \"../p.plcx\"\nperiod = 1\nlog = \"log.jsonl\"\noverrun = \"catch-up=3\"\n\
         watchdog-device = \"device\"\n";
    fs::write(shop.path("etc/device"), "").unwrap();
    fs::write(shop.path("etc/c.toml"), text).unwrap();
    let run = |args: &str| {
        let mut command = Command::new(loader());
        let args = format!("--config etc/c.toml --ticks 20 --dump d.json {args}");
        command.args(args.split_whitespace()).current_dir(shop.path(""));
        assert_eq!(wait(&mut command.spawn().unwrap()).code(), Some(0), "{args}");
        assert!(shop.read("d.json").contains("\"ticks\":20,"));
    };
    run("");
    assert!(shop.read("etc/log.jsonl").contains("\"kind\":\"timing\""), "it runs in real time");
    assert!(shop.read("etc/device").ends_with('V'), "the hardware watchdog is told the end");
    run("--log other.jsonl --period 2");
    assert!(shop.read("other.jsonl").contains("\"kind\":\"timing\""));
}

/// An option may need another one that is in the file, and a list on the command line replaces that of the file.
#[test]
fn options_of_the_socket_override_the_file() {
    let shop = Shop::new("override", Dialect::Pmi, PMI);
    let configurations = [
        ("plain.toml", "artifact = \"p.plcx\"\n"),
        (
            "served.toml",
            "artifact = \"p.plcx\"\nsocket = \"a.sock\"\nallow = [\"write\", \"swap\"]\n",
        ),
        ("kept.toml", "artifact = \"p.plcx\"\nretain = \"kept\"\n"),
    ];
    for (name, text) in configurations {
        fs::write(shop.path(name), text).unwrap();
    }
    let run = |args: &str| plcrt(&shop, &format!("--no-record --ticks 5 {args}"));
    for args in [
        "--config plain.toml --socket b.sock",
        "--config plain.toml --socket b.sock --allow stop --allow-user root --allow-group root",
        "--config served.toml --allow force",
        "--config served.toml --allow-user root",
        "--config served.toml --socket b.sock",
    ] {
        let output = run(args);
        assert_eq!(output.status.code(), Some(0), "{args}: {output:?}");
    }
    for (args, why) in [
        (
            "--config plain.toml --allow force",
            "--allow needs --socket, or the key `socket` in plain.toml",
        ),
        ("--config plain.toml --allow-group root", "--allow-group needs --socket"),
        ("--config plain.toml --retain-must-exist", "--retain-must-exist needs --retain"),
        ("--config kept.toml --retain-must-exist", "kept"),
        ("p.plcx --realtime --allow force", "--socket <PATH>"),
        ("p.plcx --socket a.sock", "--realtime"),
    ] {
        let output = run(args);
        let text = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{args}: {text}");
        assert!(text.contains(why), "{args}: {text}");
    }
    // The permissions of the command line alone are those of the control.
    let args = "--config served.toml --no-record --allow force";
    let mut control = Command::new(loader());
    control.args(args.split_whitespace()).current_dir(shop.path(""));
    let mut control = control.spawn().unwrap();
    let status = loop {
        assert_eq!(control.try_wait().unwrap(), None);
        if let Ok(mut client) = UnixStream::connect(shop.path("a.sock")) {
            client.write_all(b"{\"version\":1,\"request\":\"status\"}\n").unwrap();
            let mut reply = String::new();
            BufReader::new(client).read_line(&mut reply).unwrap();
            break reply;
        }
        std::thread::sleep(std::time::Duration::from_millis(5));
    };
    control.kill().unwrap();
    wait(&mut control);
    assert!(status.contains("\"allow\":[\"force\"]"), "{status}");
}

#[test]
fn every_mistake_of_a_configuration_is_told_with_its_line() {
    let shop = Shop::new("check", Dialect::Pmi, PMI);
    fs::write(shop.path("good.toml"), "artifact = \"p.plcx\"\n[safe]\nLAMP = 1\n").unwrap();
    let good = plcrt(&shop, "--check-config good.toml");
    assert_eq!(good.status.code(), Some(0), "{good:?}");
    // On the control's own computer the folder may be there.
    let elsewhere = "artifact = \"p.plcx\"\nlog = \"none/log.jsonl\"\nretain = \"none/r\"\n";
    fs::write(shop.path("elsewhere.toml"), elsewhere).unwrap();
    let output = plcrt(&shop, "--check-config elsewhere.toml");
    let text = String::from_utf8(output.stderr).unwrap();
    assert_eq!((output.status.code(), text.lines().count()), (Some(0), 1), "{text}");
    assert!(
        text.contains("elsewhere.toml:2: `log`: the folder ") && text.contains("none"),
        "{text}"
    );
    let bad = "artifact = \"p.plcx\"\noverun = \"skip\"\nrecord = 5\noverrun = \"sometimes\"\n\
               [safe]\nLMAP = \"off\"\nLAMP = 1\n";
    fs::write(shop.path("bad.toml"), bad).unwrap();
    let output = plcrt(&shop, "--check-config bad.toml");
    let text = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{text}");
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines.len(), 4, "{text}");
    for (line, parts) in lines.iter().zip([
        ["bad.toml:2: ", "did you mean `overrun`?"],
        ["bad.toml:3: ", "`record`: a path in quotes"],
        ["bad.toml:4: ", "sometimes"],
        ["bad.toml:6: ", "LMAP"],
    ]) {
        assert!(parts.iter().all(|part| line.contains(part)), "{line}: {parts:?}");
    }
    let run = plcrt(&shop, "--config bad.toml --ticks 1");
    assert_eq!(run.status.code(), Some(2));
    let wiring = "artifact = \"p.plcx\"\nwatchdog = 5\n[[io]]\nname = \"LMP\"\n\
                 driver = \"other\"\ntimout = 5\n";
    fs::write(shop.path("wiring.toml"), wiring).unwrap();
    let output = plcrt(&shop, "--check-config wiring.toml");
    let text = String::from_utf8(output.stderr).unwrap();
    for part in [
        "wiring.toml:2: `watchdog`: a text in quotes is expected, as in \"60ms\"",
        "wiring.toml:3: the program has no variable named `LMP`; did you mean `LAMP`?",
        "wiring.toml:6: there is no key `timout` in [[io]]; did you mean `timeout`?",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
    assert!(!text.contains("warning"), "the entry for LAMP is the one with the mistakes: {text}");
    fs::write(shop.path("other.toml"), "artifact = \"missing.plcx\"\n").unwrap();
    let output = plcrt(&shop, "--check-config other.toml");
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8(output.stderr).unwrap().contains("other.toml:1: "));
    assert_eq!(plcrt(&shop, "--check-config none.toml").status.code(), Some(2));
}

#[test]
fn outputs_that_would_overwrite_what_is_read_or_each_other_are_mistakes() {
    let shop = Shop::new("overwrite", Dialect::Pmi, PMI);
    let text = "artifact = \"p.plcx\"\nlog = \"c.toml\"\nimage = \"p.plcx\"\nretain = \"kept\"\n\
                record = \"kept.bak\"\n";
    fs::write(shop.path("c.toml"), text).unwrap();
    for option in ["--check-config", "--config"] {
        let output = plcrt(&shop, &format!("{option} c.toml"));
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{option}: {message}");
        assert!(message.contains("--log would overwrite"), "{option}: {message}");
        if option == "--check-config" {
            for (line, name) in [(2, "--log"), (3, "--image"), (4, "--retain's copy")] {
                let mistake = format!("c.toml:{line}: {name} would overwrite");
                assert!(message.contains(&mistake), "{mistake}: {message}");
            }
        }
    }
    assert_eq!(shop.read("c.toml"), text, "the configuration is as it was");
}
