//! Downloads whose motors and motion programs are simulated, and their executives.

use plcc_abi::Program;
use plcc_runtime::pmac::{PmacExecutive, PmacOptions};

/// What a download does, and the download. All have eight motors; the first tick makes everything ready.
pub fn downloads() -> [(&'static str, String); 3] {
    [
        ("8 motors, idle", download("CLOSE")),
        // A move of two hours.
        ("8 motors, moving", download(&format!("LINEAR INC TM8000000\n{MOVE}\nCLOSE\n&1B1R"))),
        // The servo cycle is half a millisecond, and so is a move, of which one is calculated in each cycle.
        (
            "8 motors, a LINEAR move",
            download(&format!(
                "LINEAR INC TA0 TS0 TM0.5\nWHILE (1=1)\n{MOVE}\nENDWHILE\nCLOSE\n&1B1R"
            )),
        ),
    ]
}

/// A move of all axes.
const MOVE: &str = "X0.5 Y0.25 Z-0.5 A0.125 B0.5 C-0.25 U0.5 V-0.125";

/// A download with eight motors, and a motion program with these lines and what is behind it.
fn download(program: &str) -> String {
    let mut text = String::from("I5=3 I8=0 I10=4194304 I13=0\n&1\n");
    for (motor, axis) in (1..=8).zip("XYZABCUV".chars()) {
        text += &format!(
            "I{motor}00=1 I{motor}11=0 I{motor}13=0 I{motor}14=0 I{motor}16=1000 I{motor}17=10000\n"
        );
        text += &format!("#{motor}->100{axis}\n");
    }
    text + "OPEN PROG 1 CLEAR\n" + program + "\n"
}

/// An executive that simulates the motors of a download.
///
/// # Errors
/// When the program is not one of a PMAC.
pub fn executive(program: &Program) -> Result<PmacExecutive, String> {
    let made = PmacExecutive::new(program, PmacOptions::default());
    let mut executive = made.ok_or("the program is not a PMAC's")?;
    executive.simulate(&[])?;
    Ok(executive)
}

#[cfg(test)]
mod tests {
    use plcc_codegen::Optimization;
    use plcc_runtime::{Executive, Purpose, Value};

    use super::*;
    use crate::compiled;

    /// What is measured is what the names say.
    #[test]
    fn the_motors_do_what_is_measured() {
        for (name, source) in downloads() {
            let mut made = compiled::pmac(&source, Optimization::ALL).unwrap();
            let mut executive = executive(&made.program).unwrap();
            let names = executive.names();
            let mut events = vec![];
            for _ in 0..2000 {
                executive.tick(&mut made.native, &mut events).unwrap();
            }
            let value = |name: &str| executive.read(names.find(name, Purpose::Watch).unwrap());
            for motor in 1..=8 {
                let moved = value(&format!("#{motor}.CMD")) != Value::Float(0.0);
                assert_eq!(moved, !name.ends_with("idle"), "{name}: motor {motor}");
            }
            let runs = value("&1.PROG") == Value::Float(1.0);
            assert_eq!(runs, !name.ends_with("idle"), "{name}: {events:?}");
        }
    }
}
