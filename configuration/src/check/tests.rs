//! What is found wrong in wired points, with the lines of the entries.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, clippy::panic)]

use std::path::Path;

use plcc_image::latch::Rule;
use plcc_image::{Number, Type};

use super::*;
use crate::Configuration;
use crate::drivers::modbus::ModbusAddress;
use crate::drivers::zenoh::ZenohVariable;

/// Inputs LS1 to LS4 and COUNT (four lines), outputs PUMP and LAMP, the variable SPEED.
fn symbols() -> Vec<Symbol> {
    let symbol = |(name, offset, width, direction): (&str, u32, u8, Direction)| Symbol {
        name: name.into(),
        aliases: if name == "PUMP" { vec!["Coolant".into()] } else { vec![] },
        value: Place::bytes(offset, Type::Integer),
        line: (direction != Direction::Internal).then(|| Place::bits(offset, Type::Bits, 0, width)),
        elements: 1,
        direction,
        slot: (direction != Direction::Output).then_some(offset),
        unit: String::new(),
    };
    [
        ("LS1", 0, 1, Direction::Input),
        ("LS2", 1, 1, Direction::Input),
        ("LS3", 2, 1, Direction::Input),
        ("LS4", 3, 1, Direction::Input),
        ("COUNT", 4, 4, Direction::Input),
        ("PUMP", 5, 1, Direction::Output),
        ("LAMP", 6, 1, Direction::Output),
        ("SPEED", 7, 0, Direction::Internal),
    ]
    .map(symbol)
    .into()
}

fn check(text: &str) -> Checked {
    let (configuration, findings) = Configuration::read(text, Path::new("c.toml"));
    let outputs = ["PUMP", "LAMP"].map(str::to_owned);
    let mut checked = points(&configuration.entries, &symbols(), false, &outputs);
    checked.mistakes.extend(findings.file);
    checked.mistakes.sort();
    checked
}

#[test]
fn ranges_become_points_that_follow_each_other() {
    let checked = check(
        "[[io]]\nname = \"LS1..LS4\"\ndriver = \"modbus-tcp\"\naddress = \"h/1/discrete/8\"\n\
         invert = true\nsafe = 1\ntimeout_ms = 200\n\
         [[io]]\nname = \"SPEED\"\ndriver = \"modbus-server\"\naddress = \"holding/0:i16\"\n\
         direction = \"in\"\nscale = 0.5\noffset = 10\n\
         [[io]]\nname = \"coolant\"\ndriver = \"modbus-tcp\"\naddress = \"h/1/coil/0\"\n",
    );
    assert_eq!(checked.mistakes, []);
    let message = "output LAMP is not wired: no entry [[io]] names it".into();
    assert_eq!(checked.warnings, [Warning { line: None, message }]);
    let numbers: Vec<_> = checked
        .points
        .iter()
        .map(|point| {
            let address = point.address::<ModbusAddress>().unwrap();
            (point.symbol.name.as_str(), address.number, point.is_input)
        })
        .collect();
    let expected = [
        ("LS1", 8, true),
        ("LS2", 9, true),
        ("LS3", 10, true),
        ("LS4", 11, true),
        ("SPEED", 0, true),
        ("PUMP", 0, false),
    ];
    assert_eq!(numbers, expected);
    let rule = Rule { safe: Safe::Value(Number::Int(1)), timeout_ns: 200_000_000 };
    assert_eq!(checked.points[0].rule(), rule);
    assert_eq!(checked.points[0].inside(0.0), Some(Number::Int(1)), "it is inverted");
    assert_eq!(checked.points[0].outside(Number::Int(1)), 0.0);
    assert_eq!(checked.points[4].inside(21.0), Some(Number::Int(21)), "10.5 + 10, rounded");
    assert_eq!(checked.points[4].outside(Number::Int(20)), 20.0);
    assert_eq!(checked.points[4].inside(1e9), None, "beyond an integer");
    assert_eq!(checked.points[4].inside(f64::NAN), None);
}

/// TPOS, an input of four lines in BCD with the lines L0 to L3, and the output GEAR of three lines.
fn groups() -> Vec<Symbol> {
    let symbol = |name: &str, value: Place, direction| Symbol {
        name: name.into(),
        aliases: vec![],
        value,
        line: Some(value),
        elements: 1,
        direction,
        slot: (direction == Direction::Input).then_some(0),
        unit: String::new(),
    };
    let line = |number: u8| {
        let place = Place::bits(9, Type::Bits, number, 1);
        symbol(&format!("L{number}"), place, Direction::Input)
    };
    let gear = |number: u8| {
        let place = Place::bits(12, Type::Bits, number + 1, 1);
        symbol(&format!("G{number}"), place, Direction::Output)
    };
    let mut all = vec![
        symbol("TPOS", Place::bits(9, Type::Bcd, 0, 4), Direction::Input),
        symbol("GEAR", Place::bits(12, Type::SignedBits, 1, 3), Direction::Output),
    ];
    all.extend((0..4).map(line));
    all.extend((0..3).map(gear));
    all
}

fn check_groups(text: &str) -> Checked {
    let (configuration, findings) = Configuration::read(text, Path::new("c.toml"));
    assert_eq!(findings.file, []);
    points(&configuration.entries, &groups(), false, &["GEAR".to_owned()])
}

#[test]
fn each_line_of_a_group_gets_a_point() {
    let checked = check_groups(
        "[[io]]\nname = \"TPOS\"\ndriver = \"gpio\"\naddress = \"gpiochip0/4,5..6,9\"\nsafe = 6\ninvert = true\n\
         [[io]]\nname = \"GEAR\"\ndriver = \"modbus-tcp\"\naddress = [\"h/1/coil/8..9\", \"h/1/holding/7.3\"]\n",
    );
    assert_eq!((checked.mistakes.as_slice(), checked.warnings.as_slice()), (&[][..], &[][..]));
    let shown: Vec<_> = checked
        .points
        .iter()
        .map(|point| {
            let place = point.address.as_ref().unwrap().place();
            let place = place.rsplit("number: ").next().unwrap().to_owned();
            (point.symbol.name.as_str(), place, point.entry.safe)
        })
        .collect();
    let safe = |bit| Safe::Value(Number::Int(bit));
    let expected = [
        ("L0", "gpio gpiochip0/4", safe(0)),
        ("L1", "gpio gpiochip0/5", safe(1)),
        ("L2", "gpio gpiochip0/6", safe(1)),
        ("L3", "gpio gpiochip0/9", safe(0)),
        ("G0", "8, format: Bit }", Safe::Off),
        ("G1", "9, format: Bit }", Safe::Off),
        ("G2", "7, format: BitOf(3) }", Safe::Off),
    ];
    assert_eq!(shown, expected.map(|(name, place, safe)| (name, place.to_owned(), safe)));
    assert_eq!(checked.points[0].inside(1.0), Some(Number::Int(0)), "each line is inverted");
}

#[test]
fn what_is_wrong_with_a_group_is_told() {
    let io = |rest: &str| format!("[[io]]\n{rest}\n");
    for (text, parts) in [
        (
            io("name = \"TPOS\"\ndriver = \"gpio\"\naddress = \"gpiochip0/4\""),
            &["it has 4 lines: a range or a list of as many addresses"][..],
        ),
        (
            io("name = \"TPOS\"\ndriver = \"gpio\"\naddress = \"gpiochip0/4..6\""),
            &["`address` has no point for `L3`"],
        ),
        (
            io("name = \"TPOS\"\ndriver = \"gpio\"\naddress = \"gpiochip0/4..8\""),
            &["`address` has 5 points, but `TPOS` has 4 lines"],
        ),
        (
            io("name = \"TPOS\"\ndriver = \"gpio\"\naddress = \"gpiochip0/4..7\"\nsafe = 10"),
            &["`TPOS` can't be 10, its `safe`"],
        ),
        (
            io("name = \"TPOS\"\ndriver = \"gpio\"\naddress = \"gpiochip0/4..7\"\nscale = 2"),
            &["`L0` is a bit", "`L1` is a bit", "`L2` is a bit", "`L3` is a bit"],
        ),
        (
            io("name = \"TPOS\"\ndriver = \"gpio\"\naddress = \"gpiochip0/4..7\"")
                + &io("name = \"L2\"\ndriver = \"gpio\"\naddress = \"gpiochip0/9\""),
            &["`L2` is given by the entry of line 1 already"],
        ),
        (
            io("name = \"L2\"\ndriver = \"gpio\"\naddress = \"gpiochip0/9\"")
                + &io("name = \"TPOS\"\ndriver = \"modbus-tcp\"\naddress = \"h/1/holding/9\""),
            &["`TPOS` is given by the entry of line 1 already"],
        ),
        (
            io("name = \"GEAR\"\ndriver = \"modbus-tcp\"\naddress = \"h/1/discrete/0..2\""),
            &["`G0` goes outside", "`G1` goes outside", "`G2` goes outside"],
        ),
    ] {
        let found = check_groups(&text).mistakes;
        assert_eq!(found.len(), parts.len(), "{text}{found:#?}");
        for (mistake, part) in found.iter().zip(parts) {
            assert!(mistake.message.contains(part), "{mistake:?} {part}");
        }
    }
    let partly = io("name = \"G0\"\ndriver = \"gpio\"\naddress = \"gpiochip0/1\"");
    let message = check_groups(&partly).warnings.into_iter().map(|warning| warning.message).next();
    assert!(message.is_some_and(|message| message.contains("output GEAR is not wired")));
}

#[test]
fn values_that_a_point_can_not_hold_are_a_warning() {
    let io = |name: &str, rest: &str| {
        format!(
            "[[io]]\nname = \"{name}\"\ndriver = \"modbus-tcp\"\naddress = \"h/1/holding/{rest}\n"
        )
    };
    let text = [
        io("SPEED", "0\""),
        io("SPEED", "1:i16\""),
        io("SPEED", "2:bcd16\"\nscale = 0.5"),
        io("SPEED", "3:f32\"\nscale = 0.001"),
        io("COUNT", "6\"\ndirection = \"out\""),
        io("COUNT", "7\"\noffset = 1\ndirection = \"out\""),
        io("SPEED", "8\"\ndirection = \"in\""),
        io("PUMP", "9:bit1\""),
        io("LAMP", "9:bit2\""),
        "[[io]]\nname = \"COUNT\"\ndriver = \"ethercat\"\naddress = \"e/1/out/0:u8\"\nscale = 0.01\ndirection = \"out\"\n"
            .into(),
    ];
    let checked = check(&text.concat());
    assert_eq!(checked.mistakes, []);
    let shown: Vec<_> =
        checked.warnings.iter().map(|w| (w.line.unwrap_or(0), w.message.as_str())).collect();
    let expected = [
        (
            1,
            "`SPEED` can be -32768 to 32767, but u16 is 0 to 65535: what does not fit is not written; i16 holds all",
        ),
        (
            9,
            "`SPEED` can be -65536 to 65534, but bcd16 is 0 to 9999: what does not fit is not written; i32 holds all",
        ),
        (
            24,
            "`COUNT` can be -1 to 14, but u16 is 0 to 65535: what does not fit is not written; i16 holds all",
        ),
        (
            43,
            "`COUNT` can be 0 to 1500, but u8 is 0 to 255: what does not fit is not written; u16 holds all",
        ),
    ];
    assert_eq!(shown, expected);
}

#[test]
fn large_configurations_have_an_end() {
    let many = |name: &str, count| {
        format!("[[io]]\nname = \"{name}\"\ndriver = \"other\"\n").repeat(count)
    };
    let checked = check(&many("LAMP1..LAMP4096", 10_000));
    assert_eq!(checked.mistakes.len(), 4096 + 1, "an entry is read to its end");
    let last = |checked: &Checked| checked.mistakes.last().map(|m| m.message.clone());
    assert_eq!(last(&checked).as_deref(), Some("further mistakes are not shown"));
    let checked = check(&many("PUMP", MAX_POINTS + 2));
    assert_eq!(last(&checked).as_deref(), Some("there are more than 65536 points"));
    assert_eq!(check(&many("PUMP", MAX_POINTS)).mistakes, []);
}

#[test]
fn inputs_follow_variables_of_other_controls() {
    let io = |name: &str, address: &str| {
        format!("[[io]]\nname = \"{name}\"\ndriver = \"zenoh\"\naddress = \"{address}\"\n")
    };
    let text = [
        io("LS1..LS2", "mill"),
        io("LS3..LS4", "mill/READY"),
        io("COUNT", "m*"),
        io("PUMP", "mill"),
        io("LAMP", ""),
    ];
    let checked = check(&text.concat());
    let shown: Vec<_> = checked
        .points
        .iter()
        .map(|point| match point.address::<ZenohVariable>() {
            Some(ZenohVariable { control, variable }) => {
                (point.symbol.name.as_str(), control.as_str(), variable.as_deref())
            }
            None => (point.symbol.name.as_str(), "", None),
        })
        .collect();
    let expected = [
        ("LS1", "mill", None),
        ("LS2", "mill", None),
        ("LS3", "mill", Some("READY")),
        ("LAMP", "", None),
    ];
    assert_eq!(shown, expected);
    let expected = [
        (5, "`LS3..LS4` is a range, but its address names a single variable"),
        (9, "`m*` is not an address"),
        (13, "`PUMP` goes outside by its own name"),
    ];
    assert_eq!(checked.mistakes.len(), expected.len(), "{:#?}", checked.mistakes);
    for (mistake, (line, part)) in checked.mistakes.iter().zip(expected) {
        assert!(mistake.line == line && mistake.message.contains(part), "{mistake:?} {part}");
    }
}

#[test]
fn every_mistake_is_found_with_its_line() {
    let io = |rest: &str| format!("[[io]]\n{rest}\n");
    let text = [
        io("name = \"LS9\"\ndriver = \"other\""),
        io("name = \"PUMP\"\ndriver = \"other\"\ndirection = \"in\""),
        io("name = \"LS1\"\ndriver = \"modbus-tcp\"\naddress = \"h/1/holding/0\""),
        io("name = \"COUNT\"\ndriver = \"modbus-tcp\"\naddress = \"h/1/input/0\"\nsafe = 16"),
        io("name = \"LS2\"\ndriver = \"modbus-tcp\"\naddress = \"h/1/coil/0\"\nscale = 2"),
        io("name = \"COUNT\"\ndriver = \"other\"\ninvert = true"),
        io("name = \"PUMP\"\ndriver = \"modbus-tcp\"\naddress = \"h/1/discrete/0\""),
        io("name = \"PUMP\"\ndriver = \"modbus-tcp\"\naddress = \"h/1/coil/0\""),
        io("name = \"LAMP\"\ndriver = \"modbus-tcp\"\naddress = \"h/1/coil/0\""),
        io("name = \"LS3\"\ndriver = \"other\""),
        io("name = \"LS3..LS4\"\ndriver = \"other\""),
        io("name = \"LS4\"\ndriver = \"opcua\"\naddress = \"x\""),
        io("name = \"LS1\"\ndriver = \"gpio\"\naddress = \"gpiochip0/1:pull-up\""),
        io("name = \"PUMP\"\ndriver = \"gpio\"\naddress = \"gpiochip0/1:open-drain\""),
        io("name = \"LAMP\"\ndriver = \"gpio\"\naddress = \"gpiochip0/1\""),
        io("name = \"LAMP\"\ndriver = \"gpio\"\naddress = \"gpiochip0/2:pull-up\""),
        io("name = \"COUNT\"\ndriver = \"gpio\"\naddress = \"gpiochip0/3\"\nsafe = 16"),
        io("name = \"LS1\"\ndriver = \"ethercat\"\naddress = \"eth1/1/out/0.0\""),
        io("name = \"PUMP\"\ndriver = \"ethercat\"\naddress = \"eth1/1/in/0.0\""),
        io("name = \"LAMP\"\ndriver = \"ethercat\"\naddress = \"eth1/2/out/0:u8\""),
        io("name = \"SPEED\"\ndriver = \"ethercat\"\naddress = \"eth1/2/out/0.7\""),
        io("name = \"SPEED\"\ndriver = \"ethercat\"\naddress = \"eth1/2/out/0:i16\""),
        io("name = \"PUMP\"\ndriver = \"ethercat\"\naddress = \"eth2/2/out/1.7\""),
        io("name = \"LAMP\"\ndriver = \"ethercat\"\naddress = \"eth1/2/out/0.2\""),
        io("name = \"LS4\"\ndirver = \"other\"\ndriver = \"modbustcp\"\nsafe = true"),
    ]
    .concat();
    let checked = check(&text);
    let expected = [
        (1, "no variable named `LS9`; did you mean `LS1`?"),
        (4, "can't be given from outside"),
        (8, "is a bit, which needs a coil"),
        (12, "can't be 16, its `safe`"),
        (17, "neither `scale` nor `offset`"),
        (22, "can't be inverted"),
        (26, "can only be read"),
        (34, "is driven by the entry of line 30 already"),
        (41, "`LS3` is given by the entry of line 38 already"),
        (44, "have the names of their variables, and no address"),
        (48, "the line of `LS1` is driven by the entry of line 52"),
        (56, "the point of `LAMP` is driven by the entry of line 52 already"),
        (60, "pull-up and pull-down are for inputs"),
        (64, "is a number, which a line of a GPIO chip can't be"),
        (69, "`LS1` is given from outside, but its address is an output of a terminal"),
        (73, "`PUMP` goes outside, but its address is an input of a terminal"),
        (77, "`LAMP` is a bit, which needs a bit of a byte, as in 0.3"),
        (81, "`SPEED` is a number, which needs a format, as in 0:i16"),
        (89, "`PUMP` is at eth2, but the entry of line 85 at eth1: all terminals are at one"),
        (89, "the point of `PUMP` shares bits with that of `SPEED`, of the entry of line 85"),
        (93, "the point of `LAMP` shares bits with that of `SPEED`, of the entry of line 85"),
        (99, "there is no key `dirver` in [[io]]; did you mean `driver`?"),
        (100, "there is no driver `modbustcp`; did you mean `modbus-tcp`?"),
        (101, "`safe`: \"off\", \"hold\" or a number is expected"),
    ];
    assert_eq!(checked.mistakes.len(), expected.len(), "{:#?}", checked.mistakes);
    for (mistake, (line, part)) in checked.mistakes.iter().zip(expected) {
        assert_eq!(mistake.line, line, "{mistake:?}");
        assert!(mistake.message.contains(part), "{mistake:?} {part}");
    }
}
