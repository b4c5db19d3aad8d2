//! What must hold for any part program, any program and any operator.

use plcc_abi::Dialect;
use plcc_abi::pmi::DeclaredCode;
use plcc_random::Rng;

use super::Desk;
use crate::event::Told;

/// A part program of blocks that are valid on both controls.
fn part(rng: &mut Rng) -> String {
    let mut text = String::new();
    for _ in 0..rng.below(12) {
        let line = match rng.below(6) {
            0 => "M3 S700".to_owned(),
            1 => format!("G0 X{} Y-{}.5", rng.below(9), rng.below(9)),
            2 => format!("G1 X{} Z0.{} F{}", rng.below(9), rng.below(9), 100 + rng.below(9000)),
            3 => "G91".into(),
            4 => "G4 P0.1".into(),
            _ => "/M5 T3".into(),
        };
        text.push_str(&line);
        text.push('\n');
    }
    if rng.below(4) > 0 {
        text.push_str("M30\n");
    }
    text
}

fn codes() -> [DeclaredCode; 3] {
    let code = |number, delayed| DeclaredCode { letter: 'M', number, delayed };
    [code(3, false), code(5, true), code(30, true)]
}

#[test]
fn a_program_whose_plc_answers_after_any_time_always_ends() {
    for seed in 0..300 {
        let mut rng = Rng::new(seed);
        let text = part(&mut rng);
        let mut desk =
            Desk::new(Dialect::Pmi, "[simulator]\nunits = \"mm\"\n", &codes(), Some(&text));
        desk.set("@MONRQ", 1);
        desk.step();
        desk.set("@MCRDY", 1);
        desk.set("@MODRQ", 2);
        desk.step();
        desk.set("@CYCRQ", 1);
        for _ in 0..20_000 {
            desk.step();
            for name in ["@M03", "@M05", "@M30", "@NEWSC"] {
                if rng.below(5) == 0 {
                    desk.set(name, 0);
                }
            }
            if desk.get("@PGMSE") == 2 {
                break;
            }
        }
        assert_eq!(desk.get("@PGMSE"), 2, "{seed}: {text}");
        assert!(desk.told.iter().any(|(_, told)| *told == Told::End));

        let mut desk = Desk::new(Dialect::Nct, "", &[], Some(&text));
        for (name, value) in
            [("Y540", 1), ("Y406", 1), ("Y650", 1), ("RH078", 13), ("RH089", 13), ("Y470", 1)]
        {
            desk.set(name, value);
        }
        for _ in 0..20_000 {
            desk.step();
            desk.set("Y547", i64::from(rng.below(4) == 0));
            if desk.told.iter().any(|(_, told)| *told == Told::End) {
                break;
            }
        }
        assert!(desk.told.iter().any(|(_, told)| *told == Told::End), "{seed}: {text}");
    }
}

#[test]
fn any_keys_and_flags_neither_panic_nor_change_what_a_state_holds() {
    for seed in 0..60 {
        let mut rng = Rng::new(seed);
        let dialect = if rng.below(2) == 0 { Dialect::Pmi } else { Dialect::Nct };
        let text = part(&mut rng);
        let machine = "[simulator]\nblocks = [\"G1 X5 F100\", \"M3 M4\"]\n";
        let mut desk = Desk::new(dialect, machine, &codes(), Some(&text));
        let names: Vec<String> = desk.table.numbers.keys().cloned().collect();
        for _ in 0..2000 {
            for _ in 0..rng.below(4) {
                let name = &names[rng.below(names.len())];
                let value = match rng.below(3) {
                    0 => 0,
                    1 => 1,
                    _ => rng.below(1 << 16) as i64 - (1 << 15),
                };
                desk.set(name, value);
            }
            let keys = desk.simulator.keys().len();
            let key = rng.below(keys);
            desk.simulator.key(key, rng.below(2) as i64, &mut desk.table);
            // A simulator that goes on from a state goes on as the one that had it.
            let mut other = desk.simulator.clone();
            assert!(other.set_state(desk.simulator.state().clone()));
            desk.step();
            assert!(desk.simulator.set_state(desk.simulator.state().clone()));
        }
    }
}

#[test]
fn garbage_is_refused_line_by_line_without_a_hang() {
    let mut rng = Rng::new(7);
    let letters = b"GMXYZFSTN/().%;0123456789 -+\n\n\xE9";
    let mut text = vec![];
    while text.len() < 200_000 {
        text.push(letters[rng.below(letters.len())]);
    }
    let text = String::from_utf8_lossy(&text).into_owned();
    for dialect in [Dialect::Pmi, Dialect::Nct] {
        let found = super::mistakes(dialect, "", &text);
        assert!(found.len() > 1000);
        // One mistake a line, in the order of the lines.
        let errors = found.iter().filter(|(code, ..)| !matches!(*code, "SIM-10" | "SIM-11"));
        let lines: Vec<u32> = errors.map(|(_, line, _)| *line).collect();
        assert!(lines.windows(2).all(|pair| pair[0] < pair[1]));
    }
    let long = format!("G0 {}", "X1 ".repeat(700_000));
    assert_eq!(super::mistakes(Dialect::Nct, "", &long).first().unwrap().0, "SIM-3");
    let open = "(".repeat(2_000_000);
    assert_eq!(super::mistakes(Dialect::Nct, "", &open).first().unwrap().0, "SIM-1");
}
