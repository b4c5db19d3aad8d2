//! The template of the entries `[[io]]`.

use std::fmt::Write as _;

use plcc_abi::printable;
use plcc_frontend::presentation::Exchange;

use super::gather::{Exchanged, Gathered, Wire};

/// A text in quotes for TOML.
fn quoted(text: &str) -> String {
    format!("\"{}\"", printable(text).replace('\\', "\\\\").replace('"', "\\\""))
}

/// The entries of all wires, and behind them, as comments, what the control gives and takes.
pub(super) fn template(gathered: &Gathered) -> String {
    let mut text = String::from(
        "# The inputs and outputs of the program, for the configuration of its control (controller.toml).\n\
         # Set driver and address of each (see docs/wiring.md), and safe and timeout of inputs; remove\n\
         # what is not wired. Neighbours may become ranges, as in name = \"LS1..LS16\".\n",
    );
    gathered.wires.iter().for_each(|wire| entry(wire, &mut text));
    let sides = [
        (Exchange::Machine, "What the control gives the program; it is not wired:"),
        (Exchange::Program, "What the program gives the control; it is not wired:"),
        (Exchange::Both, "What both of them set; it is not wired:"),
    ];
    for (side, title) in sides {
        let of_side: Vec<&Exchanged> =
            gathered.exchanged.iter().filter(|one| one.exchange == side).collect();
        if of_side.is_empty() {
            continue;
        }
        let _ = write!(text, "\n# {title}\n");
        let width = of_side.iter().map(|one| one.name.len()).max().unwrap_or(0);
        for one in of_side {
            let line = format!("# {:width$}  {}", one.name, printable(&one.description()));
            let _ = writeln!(text, "{}", line.trim_end());
        }
    }
    text
}

/// Writing to memory does not fail.
fn entry(wire: &Wire, text: &mut String) {
    let Wire { name, is_input, lines, place, said, .. } = wire;
    let what = if *is_input { "an input" } else { "an output" };
    let alias = if said.alias.is_empty() { String::new() } else { format!(", {}", said.alias) };
    let _ = write!(text, "\n[[io]]\nname = {}  # {what}, {place}{alias}\n", quoted(name));
    let description = wire.description();
    if !description.is_empty() {
        let _ = writeln!(text, "description = {}", quoted(&description));
    }
    let several = match lines.len() {
        0 | 1 => String::new(),
        count => format!("  # {count} lines: a number in a register, or a list or range of bits"),
    };
    let _ = write!(text, "driver = \"other\"\naddress = \"\"{several}\n");
    if *is_input {
        text.push_str("safe = \"off\"\ntimeout = \"500ms\"\n");
    }
}
