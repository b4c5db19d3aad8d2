//! The keys of an NCT control's panels: the flag of each, and the flags by which the program selects it (NCT 2.2.1,
//! 2.2.2; cnc-side 3.26).

/// The keys by name, each with the name of its flag or register and those of the selections of which one must be 1; without
/// any it always counts.
pub(crate) fn panel() -> Vec<(String, String, &'static [&'static str])> {
    const MODE: &[&str] = &["Y520", "Y532"];
    const INCREMENT: &[&str] = &["Y522", "Y532"];
    const JOG: &[&str] = &["Y530", "Y531", "Y532"];
    const STATE: &[&str] = &["Y523", "Y532"];
    const BOARD2: &[&str] = &["Y532"];
    const BOARDS: &[&str] = &["Y531", "Y532"];
    let mut keys: Vec<(String, String, &'static [&'static str])> = vec![];
    let mut key = |name: &str, flag: &str, selected: &'static [&'static str]| {
        keys.push((name.into(), flag.into(), selected));
    };
    for (name, flag) in [
        ("REF", "I400"),
        ("HNDL", "I401"),
        ("INCR", "I402"),
        ("JOG", "I403"),
        ("MDI", "I405"),
        ("AUTO", "I406"),
        ("EDIT", "I407"),
    ] {
        key(name, flag, MODE);
    }
    for (name, flag) in [("1", "I420"), ("10", "I421"), ("100", "I422"), ("1000", "I423")] {
        key(name, flag, INCREMENT);
    }
    for number in 0..8 {
        let one = number + 1;
        key(&format!("AXIS {one}"), &format!("I41{number}"), &["Y521"]);
        key(&format!("JOG {one}"), &format!("I43{number}"), JOG);
        key(&format!("B{one}"), &format!("I48{number}"), BOARD2);
        key(&format!("S{one}"), &format!("I50{number}"), &["Y524"]);
        key(&format!("U{one}"), &format!("I45{number}"), &["Y537"]);
        key(&format!("U{}", one + 8), &format!("I46{number}"), &["Y537"]);
    }
    key("RAPID", "I427", JOG);
    for (name, flag) in [
        ("TEST", "I440"),
        ("MACHINE LOCK", "I441"),
        ("DRY RUN", "I442"),
        ("BLOCK RESTART", "I443"),
        ("BLOCK RETURN", "I444"),
        ("COND STOP", "I445"),
        ("COND BLOCK", "I446"),
        ("SINGLE BLOCK", "I447"),
    ] {
        key(name, flag, STATE);
    }
    for (name, flag) in [("START", "I470"), ("STOP", "I471"), ("MST", "I472")] {
        key(name, flag, BOARD2);
    }
    for (name, flag) in [("M3", "I474"), ("M4", "I475"), ("M5", "I476"), ("RESET", "I477")] {
        key(name, flag, BOARDS);
    }
    for (name, register) in [("F%", "RH028"), ("S%", "RH029"), ("R%", "RH039")] {
        key(name, register, &[]);
    }
    keys
}
