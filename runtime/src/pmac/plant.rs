//! What the simulation of a PMAC's motors says of a download: the words that its plant writes, and what it leaves out.

use plcc_abi::image::read_f64;
use plcc_abi::pmac::motion::registers::motors;
use plcc_abi::pmac::{Controller, Definition, Field, Layout, PmacTables, Run, Space};
use plcc_abi::{Program, Tables};

/// I-variables as they are after load, where motion is simulated.
struct Loaded {
    layout: Layout,
    image: Vec<u8>,
}

impl Loaded {
    fn new(tables: &PmacTables) -> Self {
        let layout = Layout::new(tables.controller);
        let mut image = vec![0; layout.size as usize];
        Run::unpack(&tables.initial, &mut image);
        Run::unpack(&tables.motion.image, &mut image);
        Self { layout, image }
    }

    fn i(&self, number: u32) -> u32 {
        read_f64(&self.image, self.layout.i_offset(number)) as u32
    }

    fn turbo(&self) -> bool {
        self.layout.controller == Controller::Turbo
    }

    fn motors(&self) -> impl Iterator<Item = u32> {
        1..=motors(self.layout.controller)
    }

    /// The address of a motor's flag word; `None` where it has no channel.
    fn channel(&self, motor: u32) -> Option<u32> {
        let address = self.i(100 * motor + 25) & self.layout.address_mask();
        self.layout.is_io(Space::X, address).then_some(address)
    }
}

/// The bits of a gate array's words that the plant writes: switches, index, captured, counters and the outputs of filters.
pub(super) fn written(tables: &PmacTables) -> Vec<Definition> {
    let loaded = Loaded::new(tables);
    let mut all = vec![];
    let bits = |offset, width| Field { offset, width, ..Field::WORD };
    for motor in loaded.motors() {
        let Some(address) = loaded.channel(motor) else { continue };
        let pmac2 = loaded.turbo() && loaded.i(100 * motor + 24) & 1 != 0;
        let flags: &[Field] = match pmac2 {
            true => &[bits(11, 1), bits(14, 5)],
            false => &[bits(16, 2), bits(19, 5)],
        };
        all.extend(flags.iter().map(|field| Definition::word(Space::X, address, *field)));
        for word in [1, 3] {
            all.push(Definition::word(Space::X, address + word, Field::WORD));
        }
    }
    all
}

/// What a download sets up that the simulation of its motors leaves out, a sentence each; nothing for other controls.
pub fn not_simulated(program: &Program) -> Vec<String> {
    let Tables::Pmac(tables) = &program.tables else { return vec![] };
    let loaded = Loaded::new(tables);
    let mut all = vec![];
    for motor in loaded.motors().filter(|motor| loaded.i(100 * motor) != 0) {
        let number = |variable: u32| 100 * motor + variable;
        let set = |variable: u32| loaded.i(number(variable));
        let mut say = |variable: u32, what: &str| {
            all.push(format!(
                "motor {motor}: {what} is not simulated (I{}={})",
                number(variable),
                set(variable)
            ));
        };
        if set(1) != 0 {
            say(1, "commutation");
        }
        if set(3) >> 16 & 3 != 0 {
            say(3, "what bits 16 and 17 of Ix03 choose");
        }
        if loaded.channel(motor).is_none() {
            say(25, "the channel of its flags, so that it has no switches,");
        }
        if set(60) != 0 {
            say(60, "a longer servo cycle of one motor");
        }
        if set(86) != 0 {
            say(86, "backlash");
        }
        if loaded.turbo() && set(97) != 0 {
            say(97, "what Ixx97 chooses");
        }
    }
    if loaded.i(51) != 0 {
        all.push("compensation tables are not simulated (I51=1)".to_owned());
    }
    all
}
