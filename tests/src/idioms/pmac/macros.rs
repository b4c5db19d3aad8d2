//! Names that are defined by `#define`, definitions in definitions, and parts that `#ifdef` leaves out.

use std::fmt::Write as _;

use super::Writer;

const NAMES: [&str; 12] = [
    "Pump",
    "DOOR_SHUT",
    "5_SEC",
    "Clamp",
    "LUBE",
    "kPart",
    "READY",
    "tool",
    "AXIS_X",
    "Lamp",
    "MODE",
    "Held",
];

impl Writer {
    /// The text itself, or a name for it that is defined at the beginning of the download.
    pub(super) fn named(&mut self, text: String) -> String {
        if !self.rng.chance(self.macro_percent) || text.contains('\n') {
            return text;
        }
        let name = format!("{}{}", self.rng.pick(&NAMES), self.macros.len());
        self.macros.push((name.clone(), text));
        name
    }

    /// Writes all definitions, in an order that does not matter.
    pub(super) fn write_macros(&mut self, source: &mut String) {
        let mut all = std::mem::take(&mut self.macros);
        while !all.is_empty() {
            let at = self.rng.below(all.len());
            let (name, text) = all.swap_remove(at);
            let comment = *self.rng.pick(&["", "", " ; a name", " // another"]);
            let define = *self.rng.pick(&["#define", "#define", "#DEFINE", "#Define"]);
            match self.rng.below(6) {
                // Defined twice: the first one is undone.
                0 => {
                    let _ = writeln!(source, "{define} {name} P1023{comment}\n#undef {name}");
                    let _ = writeln!(source, "{define} {name} {text}");
                }
                1 => {
                    let _ =
                        writeln!(source, "#ifndef {name}\n{define} {name} {text}{comment}\n#endif");
                }
                2 => {
                    let _ = writeln!(source, "#ifdef {name}_OFF\n{define} {name} ((\n#else");
                    let _ = writeln!(source, "{define} {name} {text}{comment}\n#endif");
                }
                _ => {
                    let _ = writeln!(source, "{define} {name} {text}{comment}");
                }
            }
        }
    }
}
