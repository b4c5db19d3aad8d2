//! The example for `halcmd -f`: a thread, the component, its pins, and a sampler for its outputs.

use std::fmt::Write;

use super::pins::{Direction, Pin, Type};

/// How many pins HAL's sampler takes in one channel.
const SAMPLED: usize = 20;

/// The text of the example. `tick_ns` is the length of a tick, and the thread's period.
pub(crate) fn example(name: &str, pins: &[Pin], tick_ns: u64) -> String {
    let sampled: Vec<&Pin> =
        pins.iter().filter(|pin| pin.direction == Direction::Out).take(SAMPLED).collect();
    let letters: String = sampled.iter().map(|pin| pin.ty.letter()).collect();
    let mut text = format!(
        "# Runs {name} in a thread of its own, and samples its first outputs in every tick.\n\
         #\n#     halrun -I -f {name}.hal\n#     halsampler -n 100 -t\n\n\
         loadrt threads name1=plc period1={tick_ns}\n\
         loadrt {name}\n"
    );
    if !sampled.is_empty() {
        let _ = writeln!(text, "loadrt sampler depth=1000 cfg={letters}");
    }
    let _ = writeln!(text, "\naddf {name}.tick plc");
    if !sampled.is_empty() {
        let _ = writeln!(text, "addf sampler.0 plc");
    }
    text.push_str("\n# Outputs.\n");
    for (number, pin) in sampled.iter().enumerate() {
        let pin_name = &pin.name;
        note(&mut text, pin);
        let _ = writeln!(text, "net {name}-{pin_name} {name}.{pin_name} => sampler.0.pin.{number}");
    }
    let unsampled = pins.iter().filter(|pin| pin.direction == Direction::Out).skip(SAMPLED);
    for pin in unsampled {
        note(&mut text, pin);
        let _ = writeln!(text, "net {name}-{0} {name}.{0}", pin.name);
    }
    text.push_str(
        "\n# Inputs: set one by `halcmd setp`, or take the `#` away and name a signal.\n",
    );
    for pin in pins.iter().filter(|pin| pin.direction != Direction::Out) {
        note(&mut text, pin);
        let value = match pin.ty {
            Type::Bit | Type::S32 => "1",
            Type::Float => "0.5",
        };
        let _ = writeln!(text, "# setp {name}.{} {value}", pin.name);
    }
    text.push_str("\nstart\n");
    text
}

/// Says what a pin's variable means.
fn note(text: &mut String, pin: &Pin) {
    let meaning = pin.meaning.as_deref().unwrap_or_default().replace(['\n', '\r'], " ");
    let between = if meaning.is_empty() { "" } else { ": " };
    let _ = writeln!(text, "# {}{between}{meaning}", pin.variable);
}
