//! The tables and keys that a machine file can have, with what each is for: what editors propose and explain.

use alloc::{vec, vec::Vec};

use crate::nct::NctControl;

/// What is the value of a key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Value {
    /// The name of a variable of the program, in quotes.
    Variable,
    /// One of these texts.
    OneOf(&'static [&'static str]),
    /// The name of a type of NCT's controls.
    NctControl,
    /// Something else, such as a number.
    Other,
}

/// A key of a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Key {
    /// Its name.
    pub name: &'static str,
    /// What it is for.
    pub meaning: &'static str,
    /// What its value is.
    pub value: Value,
}

/// A table, or the entries of a list of tables.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MachineTable {
    /// Its name as it is between the brackets; empty for the keys before the first table.
    pub name: &'static str,
    /// Whether it is a list, each entry of which begins with `[[NAME]]`.
    pub is_list: bool,
    /// What it is for.
    pub meaning: &'static str,
    /// What its keys are.
    pub keys: Keys,
}

/// What the keys of a table are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Keys {
    /// These.
    These(&'static [Key]),
    /// Names of variables of the program. The value of each is a table in braces with these keys.
    Variables(&'static [Key]),
    /// Names or numbers of something else, with values of this kind.
    Any(Value),
}

impl Keys {
    /// Those that have names in this reference.
    pub fn named(self) -> &'static [Key] {
        match self {
            Self::These(keys) | Self::Variables(keys) => keys,
            Self::Any(_) => &[],
        }
    }

    /// The key with a name.
    pub fn get(self, name: &str) -> Option<&'static Key> {
        self.named().iter().find(|key| key.name == name)
    }
}

const fn key(name: &'static str, meaning: &'static str) -> Key {
    Key { name, meaning, value: Value::Other }
}

const fn variable(name: &'static str, meaning: &'static str) -> Key {
    Key { name, meaning, value: Value::Variable }
}

const fn one_of(name: &'static str, meaning: &'static str, values: &'static [&'static str]) -> Key {
    Key { name, meaning, value: Value::OneOf(values) }
}

const fn table(name: &'static str, meaning: &'static str, keys: &'static [Key]) -> MachineTable {
    MachineTable { name, is_list: false, meaning, keys: Keys::These(keys) }
}

const fn list(name: &'static str, meaning: &'static str, keys: &'static [Key]) -> MachineTable {
    MachineTable { is_list: true, ..table(name, meaning, keys) }
}

const fn by_variable(
    name: &'static str,
    meaning: &'static str,
    keys: &'static [Key],
) -> MachineTable {
    MachineTable { keys: Keys::Variables(keys), ..table(name, meaning, &[]) }
}

const fn of_any(name: &'static str, meaning: &'static str, value: Value) -> MachineTable {
    MachineTable { keys: Keys::Any(value), ..table(name, meaning, &[]) }
}

const SPINDLE: &[Key] = &[
    key("rpm", "the speed at 10 V: 5500 with PMI, 6000 with NCT"),
    key("min", "the lowest speed that is commanded"),
    key("ramp_ms", "from standing to `rpm`"),
    key("lag_ms", "NCT: by which the actual speed follows"),
    key("orient_ms", "NCT: how long the spindle takes to orient"),
    key("encoder", "PMI: whether there is an encoder; true or false"),
];

/// All tables. The first one has the keys before the first table.
pub const TABLES: &[MachineTable] = &[
    table(
        "",
        "",
        &[
            Key {
                name: "control",
                meaning: "NCT: the type, which says how often :002 runs",
                value: Value::NctControl,
            },
            key("boards", "NCT: how many interface boards there are"),
        ],
    ),
    by_variable(
        "names",
        "what people call the variables and say of them",
        &[
            key("alias", "another name for the variable"),
            key("text", "what it is, in a few words"),
            key("device", "the device"),
            key("at", "the terminal"),
            key("drawing", "the place in the drawings"),
        ],
    ),
    by_variable(
        "variables",
        "PMI: executive variables of this machine, added or changed",
        &[
            one_of("type", "LOGICAL, 16 or 32 bits", &["logical", "integer", "long"]),
            one_of("class", "what a program may do with it", &["ro", "rw", "reset"]),
            key("size", "how many elements it has as an array, 0 for none"),
            key("meaning", "a line for `plcc explain`"),
        ],
    ),
    of_any("lints", "which lints are shown, and how", Value::OneOf(&["allow", "warn", "deny"])),
    of_any(
        "parameters",
        "NCT: parameters of the NC by number, MAGAZINE and PLC_TAB by name",
        Value::Other,
    ),
    of_any("constants", "NCT: constants of the PLC, RP001 to RP040, by number", Value::Other),
    of_any("macros", "NCT: macro variables by number", Value::Other),
    of_any(
        "tool_pots",
        "NCT: the first content of the pot table; pot 0 is the spindle",
        Value::Other,
    ),
    table(
        "simulator",
        "the other side of the control: CNC, axes, small machines",
        &[
            key("part_program", "the part program, a file beside the machine file"),
            one_of("units", "of the table and of the part program", &["inch", "mm"]),
            key("lag_ms", "by which actual positions follow the commands"),
            key("home_ms", "how long the search for a reference point takes"),
            key("machine_on_ms", "PMI: how long @MONRQ waits for @MCRDY"),
            one_of(
                "option_keys",
                "PMI: @BKDLT and @OPSTP are states, or each falling edge changes one",
                &["level", "toggle"],
            ),
            key("stop_ms", "NCT: from a stop to I550"),
            key("blocks", "NCT: the blocks that KEY.BLOCK enters, a list of texts"),
            key("in_position", "NCT: within how many increments an axis is in position"),
            key("feed_max", "NCT: the highest feed"),
            key("chop_ms", "NCT: from Y675 to I676, and back to I677"),
            key("serial", "NCT: what the serial line receives"),
            key("misc", "NCT: letters of A, B, C that are functions"),
            key("program_number", "NCT: RH030 and RH031"),
            key("homed", "whether all axes have their reference points at power-up"),
        ],
    ),
    of_any(
        "simulator.keys",
        "names of keys, each for a variable: `\"DOOR\" = \"LS12\"` makes KEY.DOOR a row on LS12",
        Value::Variable,
    ),
    list(
        "simulator.axis",
        "an axis, in the order of the control's numbers; none at all are X, Y, Z",
        &[
            one_of("name", "its letter", &["X", "Y", "Z", "U", "V", "W", "A", "B", "C"]),
            key("counts", "counts a unit: 10000 with PMI, 1000 with NCT"),
            key("start", "where it is at power-up"),
            key("home", "its reference point"),
            key("min", "PMI: the lower limit"),
            key("max", "PMI: the upper limit"),
            key("rapid", "the speed of rapid traverse, a minute"),
            key("jog", "PMI: three speeds, high, medium, low; NCT: one"),
            one_of("reference", "NCT: how the reference point is found", &["time", "switch"]),
            key("ref", "NCT: the speed of the search by a switch"),
            key("ref_direction", "NCT: in which direction an axis of the PLC searches, 1 or -1"),
        ],
    ),
    list(
        "simulator.aux",
        "PMI: an auxiliary axis, at most 6",
        &[key("counts", "counts a unit"), key("max", "the largest @AUVEL")],
    ),
    table("simulator.spindle", "the spindle", SPINDLE),
    table("simulator.spindle2", "the second spindle", SPINDLE),
    list(
        "simulator.device",
        "a small machine. A `!` before a name inverts it",
        &[
            key("name", "its name: SIM.NAME shows where it is, JAM NAME holds it there"),
            one_of("kind", "what it is", &["relay", "cylinder", "turret", "pump", "switch"]),
            variable("output", "relay, turret, pump: the output that drives it"),
            variable("input", "relay, pump, switch: the input that it gives"),
            key("on_ms", "relay: from the output to the input"),
            key("off_ms", "relay: from the output to the input"),
            variable("extend", "cylinder: the coil that extends it"),
            variable("retract", "cylinder: the coil that retracts it; without it a spring does"),
            variable("extended", "cylinder: the switch at the one end"),
            variable("retracted", "cylinder: the switch at the other end"),
            key("extend_ms", "cylinder: how long it takes"),
            key("retract_ms", "cylinder: how long it takes"),
            variable("reverse", "turret: the output that turns it the other way"),
            key("stations", "turret: how many stations it has"),
            key("station_ms", "turret: from one station to the next"),
            key("station", "turret: where it is at power-up"),
            variable(
                "code",
                "turret: what takes the number of the station, or a list of bits, the lowest first",
            ),
            variable("strobe", "turret: is 1 at the beginning of each station"),
            key("rise_ms", "pump: from no pressure to 100 per cent"),
            key("fall_ms", "pump: from 100 per cent to no pressure"),
            key("on", "pump: at how many per cent the switch closes"),
            key("off", "pump: at how many per cent the switch opens"),
            key("axis", "switch: the letter of the axis"),
            key("from", "switch: where it begins"),
            key("to", "switch: where it ends"),
        ],
    ),
    list(
        "simulator.motor",
        "PMAC: what a motor drives; lengths are counts from the position at power-up",
        &[
            key("number", "the number of the motor"),
            key("stroke", "the hard stops: `[-50000, 250000]`"),
            key("limits", "the limit inputs are closed between these"),
            key("home", "where the home input is 1: `[[10000, 12000]]`"),
            key("index", "counts between index pulses, 0 for none"),
            key("index_at", "where one of them is"),
            key("lag", "servo cycles from the command to the actual position"),
            key("open_loop", "counts a millisecond at O100"),
        ],
    ),
];

impl Value {
    /// The texts that it can be, where these are known.
    pub fn texts(self) -> Vec<&'static str> {
        match self {
            Self::OneOf(texts) => texts.to_vec(),
            Self::NctControl => NctControl::ALL.iter().map(|control| control.name()).collect(),
            Self::Variable | Self::Other => vec![],
        }
    }
}

/// The table with a name, as it is between the brackets.
pub fn machine_table(name: &str) -> Option<&'static MachineTable> {
    TABLES.iter().find(|table| table.name == name)
}

#[cfg(test)]
mod tests {
    use alloc::format;
    use alloc::string::{String, ToString};

    use super::*;
    use crate::machine::Machine;

    /// What is wrong with a file that has a key with a value that no key has.
    fn refusal(table: &MachineTable, key: &str) -> Option<String> {
        let odd = "1979-05-27";
        let text = match (table.name, table.keys, table.is_list) {
            ("", ..) => format!("{key} = {odd}\n"),
            (name, Keys::Variables(_), _) => format!("[{name}]\n\"@ABC\" = {{ {key} = {odd} }}\n"),
            (name, _, true) => format!("[[{name}]]\n{key} = {odd}\n"),
            (name, ..) => format!("[{name}]\n{key} = {odd}\n"),
        };
        Machine::parse(&text).err().map(|error| error.to_string())
    }

    #[test]
    fn each_key_is_known_to_what_reads_it() {
        // Which keys a small machine has depends on its kind.
        let tables = TABLES.iter().filter(|table| table.name != "simulator.device");
        let is_refused =
            |text: &str| text.contains("is not a key") || text.contains("unknown field");
        for table in tables {
            let unknown = refusal(table, "nonsense").unwrap_or_default();
            let takes_any = table.name.is_empty() || table.keys.named().is_empty();
            assert!(takes_any || is_refused(&unknown), "[{}]: {unknown}", table.name);
            for key in table.keys.named() {
                let known = refusal(table, key.name).unwrap_or_default();
                assert!(!is_refused(&known), "[{}] {}: {known}", table.name, key.name);
            }
        }
    }

    #[test]
    fn each_key_of_a_small_machine_is_known_for_some_kind() {
        let device = machine_table("simulator.device").unwrap();
        let kinds = device.keys.get("kind").unwrap().value.texts();
        // What an entry of a kind needs.
        let needed = |kind: &str| match kind {
            "relay" | "pump" => "output = \"Y1\"\ninput = \"I1\"\n",
            "turret" => "output = \"Y1\"\n",
            "cylinder" => "extend = \"Y1\"\n",
            _ => "axis = \"X\"\nfrom = 1\nto = 2\ninput = \"I1\"\n",
        };
        for key in device.keys.named().iter().filter(|key| !["name", "kind"].contains(&key.name)) {
            let is_known = |kind: &&str| {
                let needed = needed(kind);
                let has_key =
                    needed.lines().any(|line| line.starts_with(&format!("{} ", key.name)));
                let odd =
                    if has_key { String::new() } else { format!("{} = 1979-05-27\n", key.name) };
                let text =
                    format!("[[simulator.device]]\nname = \"A\"\nkind = \"{kind}\"\n{needed}{odd}");
                let error = Machine::parse(&text).err().map(|error| error.to_string());
                error.is_none_or(|error| !error.contains("is not a key"))
            };
            assert!(kinds.iter().any(is_known), "{}", key.name);
        }
    }
}
