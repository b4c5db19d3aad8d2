//! The names of a PMAC's variables, as users write them ([`PmacName`]), and the values of a stimulus.

use std::collections::HashSet;

use plcc_abi::DialectVariable;
use plcc_abi::image::read_u64;
use plcc_abi::place::{Direction, Place, Type};
use plcc_abi::pmac::motion::{MotionName, Plant};
use plcc_abi::pmac::name::suggest;
use plcc_abi::pmac::{
    Definition, Field, Kind, Layout, Output, PlcOp, PmacName, PmacNameError, PmacTables, Run,
    Space, Variable, field_place,
};
use plcc_simulator::Equipment;

use super::equipment::equipment;
use super::forces::share_bits;
use crate::names::{Class, Names, Properties};
use crate::safe_outputs::{SafeLines, SafeOutputs};
use crate::{NameError, Purpose, Setting, ValueError, VariableKey};

/// All names of a download.
#[derive(Debug)]
pub(super) struct PmacNames {
    pub(super) layout: Layout,
    /// The definitions of L-variables, by rising number.
    l: Vec<(u32, Definition)>,
    /// Those of M-variables after load, by their numbers.
    m: Vec<Definition>,
    /// The PLCs that have text: whether each is compiled, and its number.
    plcs: Vec<(bool, u32)>,
    named: Vec<Variable>,
    pub(super) outputs: Vec<Output>,
    /// Whether motors and coordinate systems are simulated, so that their names mean something.
    simulated: bool,
    /// The bits that their plant writes.
    plant: Vec<Definition>,
    /// Motors and coordinate systems, where they are simulated.
    equipment: Equipment,
}

/// The key of a variable.
pub(super) fn key(name: PmacName) -> VariableKey {
    VariableKey(DialectVariable::Pmac(name))
}

/// The variable of a key; `None` for the key of another control.
pub(super) fn name(key: VariableKey) -> Option<PmacName> {
    let DialectVariable::Pmac(name) = key.0 else { return None };
    Some(name)
}

impl PmacNames {
    pub(super) fn new(tables: &PmacTables) -> Self {
        let layout = Layout::new(tables.controller);
        let mut image = vec![0; layout.size as usize];
        Run::unpack(&tables.initial, &mut image);
        let code = |number| read_u64(&image, layout.definition_offset(number));
        Self {
            m: (0..layout.count).map(|number| Definition::decode(code(number))).collect(),
            l: tables.l.clone(),
            plcs: tables.programs.iter().map(|plc| (plc.compiled, plc.number)).collect(),
            named: tables.named.clone(),
            outputs: tables.outputs.clone(),
            simulated: false,
            plant: vec![],
            equipment: Equipment::default(),
            layout,
        }
    }

    /// The names of a control whose motors and coordinate systems are simulated. `plants` are what the motors are fastened to.
    pub(super) fn simulated(tables: &PmacTables, plants: &[Plant]) -> Self {
        let names = Self::new(tables);
        let equipment = equipment(tables, &names.layout, plants);
        Self { simulated: true, equipment, plant: super::plant::written(tables), ..names }
    }

    /// Finds what a name means.
    pub(super) fn variable(&self, text: &str) -> Result<PmacName, NameError> {
        let unfit = |reason: String| NameError::Unfit { name: text.into(), reason };
        let name = PmacName::parse(text, &self.layout).map_err(|error| match error {
            PmacNameError::Malformed => {
                NameError::Unknown { name: text.into(), suggestion: suggest(text) }
            }
            PmacNameError::Beyond(reason) => unfit(reason),
        })?;
        if let PmacName::Variable(Variable { kind: Kind::L, number, .. }) = name
            && self.l_definition(number).is_none()
        {
            return Err(unfit("is an L-variable that the program does not define".into()));
        }
        if let PmacName::Plc { compiled, number } = name
            && !self.plcs.contains(&(compiled, number))
        {
            return Err(unfit("is empty: the program has no text for it".into()));
        }
        if let PmacName::Motion(_) = name
            && !self.simulated
        {
            return Err(unfit("is simulated with --simulate only".into()));
        }
        Ok(name)
    }

    fn l_definition(&self, number: u32) -> Option<Definition> {
        let index = self.l.binary_search_by_key(&number, |(number, _)| *number).ok()?;
        self.l.get(index).map(|(_, definition)| *definition)
    }

    /// Where in memory a variable is after load; `None` for one that is a value of its own.
    pub(super) fn definition(&self, name: PmacName) -> Option<Definition> {
        match name {
            PmacName::Memory(definition) => Some(definition),
            PmacName::Variable(Variable { kind: Kind::M, number, .. }) => {
                self.m.get(number as usize).copied()
            }
            PmacName::Variable(Variable { kind: Kind::L, number, .. }) => self.l_definition(number),
            PmacName::Variable(_) | PmacName::Plc { .. } | PmacName::Motion(_) => None,
        }
    }

    /// Where the value of a variable lies in the image.
    fn place(&self, name: PmacName) -> Option<Place> {
        let layout = &self.layout;
        let double = |offset| Some(Place::bytes(offset, Type::Double));
        match name {
            PmacName::Variable(Variable { kind, number, system }) => match kind {
                Kind::P => double(layout.p_offset(number)),
                Kind::I => double(layout.i_offset(number)),
                Kind::Q => double(layout.q_offset(layout.q_base_of(system) + number)),
                Kind::M | Kind::L => field_place(layout, self.definition(name)?),
            },
            PmacName::Memory(definition) => field_place(layout, definition),
            PmacName::Plc { .. } | PmacName::Motion(_) => None,
        }
    }

    /// Whether a variable is an output that the download writes, or another word of I/O.
    fn direction(&self, name: PmacName) -> Direction {
        let Some(definition) = self.definition(name) else { return Direction::Internal };
        let is_output = |output: &Output| match name {
            PmacName::Variable(variable) => output.variable == Some(variable),
            _ if is_whole_word(definition) => output.definition == definition,
            _ => share_bits(output.definition, definition),
        };
        match definition {
            // What assigns one does not make it an output.
            _ if self.layout.is_input(definition) => Direction::Input,
            _ if self.outputs.iter().any(is_output) => Direction::Output,
            Definition::X { address, .. } if self.layout.is_io(Space::X, address) => {
                Direction::Input
            }
            Definition::Y { address, .. } if self.layout.is_io(Space::Y, address) => {
                Direction::Input
            }
            _ => Direction::Internal,
        }
    }

    /// Names in the order of a dump, each once.
    fn ordered(mut names: Vec<PmacName>) -> Vec<(String, VariableKey)> {
        names.sort_by_key(PmacName::dump_order);
        names.dedup();
        names.into_iter().map(|name| (name.to_string(), key(name))).collect()
    }
}

impl Names for PmacNames {
    /// All names can be used for every purpose, but for what motors do, which nobody sets, and for commands, which have no
    /// value.
    fn find(&self, text: &str, purpose: Purpose) -> Result<VariableKey, NameError> {
        let name = self.variable(text)?;
        if let (PmacName::Motion(MotionName::Online(_)), Purpose::Watch) = (name, purpose) {
            let reason =
                "is an on-line command, which has no value: it is given by setting it to 1";
            return Err(NameError::Unfit { name: text.into(), reason: reason.into() });
        }
        let can_be_set = match name {
            PmacName::Motion(MotionName::Motor(_, value)) => value.can_be_set(),
            PmacName::Motion(MotionName::System(..)) => false,
            _ => true,
        };
        if !can_be_set && purpose != Purpose::Watch {
            let reason = "is what the simulated motion does, and can't be set".into();
            return Err(NameError::Unfit { name: text.into(), reason });
        }
        Ok(key(name))
    }

    /// Those of the simulated motors and coordinate systems, which no dump has.
    fn patterns(&self) -> Vec<(String, VariableKey)> {
        let mut names = self.declared();
        if self.simulated {
            let motion = MotionName::all(&self.layout).map(PmacName::Motion);
            names.extend(motion.map(|name| (name.to_string(), key(name))));
        }
        names
    }

    fn equipment(&self) -> Equipment {
        self.equipment.clone()
    }

    fn canonical(&self, key: VariableKey) -> String {
        name(key).map_or_else(String::new, |name| name.to_string())
    }

    fn properties(&self, key: VariableKey) -> Properties {
        let Some(name) = name(key) else { return Properties::internal(Class::Fraction, None) };
        let definition = self.definition(name);
        Properties {
            direction: self.direction(name),
            can_be_forced: matches!(definition, Some(Definition::X { .. } | Definition::Y { .. })),
            ..Properties::internal(Class::Fraction, self.place(name))
        }
    }

    fn is_simulated(&self, key: VariableKey) -> bool {
        let definition = name(key).and_then(|name| self.definition(name));
        definition.is_some_and(|own| self.plant.iter().any(|bits| share_bits(*bits, own)))
    }

    /// A PMAC has no arrays.
    fn element(&self, _: VariableKey, _: u32) -> Option<VariableKey> {
        None
    }

    fn parse(&self, key: VariableKey, text: &str) -> Result<Setting, ValueError> {
        let value = number(text)?;
        if let Some(PmacName::Plc { .. }) = name(key)
            && plc_op(value).is_none()
        {
            let reason = "is not 0 (DISABLE), 1 (ENABLE), 2 (PAUSE) or 3 (RESUME)".into();
            return Err(ValueError { value: text.into(), reason });
        }
        Ok(Setting::Float(value))
    }

    fn declared(&self) -> Vec<(String, VariableKey)> {
        Self::ordered(self.named.iter().map(|variable| PmacName::Variable(*variable)).collect())
    }

    /// The M- and L-variables of outputs; words without a variable by their addresses.
    fn outputs(&self) -> Vec<(String, VariableKey)> {
        let name = |output: &Output| match output.variable {
            Some(variable) => PmacName::Variable(variable),
            None => PmacName::Memory(match output.definition {
                Definition::X { address, .. } => Definition::word(Space::X, address, Field::WORD),
                definition => Definition::word(Space::Y, definition.address(), Field::WORD),
            }),
        };
        Self::ordered(self.outputs.iter().map(name).collect())
    }

    /// P, Q and I that the download names, M and L that are bits of words, and the lines of those that are several lines.
    fn shown_in_image(&self) -> Vec<VariableKey> {
        let is_pointer = |variable: &&Variable| matches!(variable.kind, Kind::M | Kind::L);
        let values = self.named.iter().filter(|variable| !is_pointer(variable));
        let names = values.chain(self.named.iter().filter(is_pointer));
        let names = names.map(|variable| PmacName::Variable(*variable));
        let mut shown: Vec<VariableKey> =
            names.filter(|name| self.place(*name).is_some()).map(key).collect();
        let lines = shown.iter().map(|key| self.lines(*key));
        let (single, several): (Vec<_>, Vec<_>) = lines.partition(|lines| lines.len() == 1);
        let mut lines: Vec<VariableKey> = several.into_iter().flatten().collect();
        lines.sort_by_key(|line| name(*line).map(|name| name.line_order()));
        lines.dedup();
        let single: HashSet<VariableKey> = single.into_iter().flatten().collect();
        shown.extend(lines.into_iter().filter(|line| !single.contains(line)));
        shown
    }

    /// The bits of words of I/O memory, `Y:$FFC2,8` and on.
    fn lines(&self, key: VariableKey) -> Vec<VariableKey> {
        let definition = name(key).and_then(|name| self.definition(name));
        let (space, address, field) = match definition {
            Some(Definition::X { address, field }) => (Space::X, address, field),
            Some(Definition::Y { address, field }) => (Space::Y, address, field),
            _ => return vec![],
        };
        if !self.layout.is_io(space, address) {
            return vec![];
        }
        let bits = field.offset..field.offset.saturating_add(field.width).min(24);
        let line =
            |offset| Definition::word(space, address, Field { offset, width: 1, ..Field::WORD });
        bits.map(|bit| self::key(PmacName::Memory(line(bit)))).collect()
    }

    fn safe_lines(&self, outputs: &SafeOutputs) -> Result<SafeLines, Vec<NameError>> {
        self.lines_at_stop(outputs)
    }

    /// Where variables lie can change, so that the executive compares their bits.
    fn share_forced_bits(&self, _: VariableKey, _: VariableKey) -> bool {
        false
    }
}

/// Whether a definition is a word of memory, rather than bits of one.
fn is_whole_word(definition: Definition) -> bool {
    match definition {
        Definition::X { field, .. } | Definition::Y { field, .. } => field == Field::WORD,
        _ => true,
    }
}

/// What setting a PLC to a value does, as the on-line commands of these names do: 0 DISABLE, 1 ENABLE, 2
/// PAUSE, 3 RESUME. `None` for other values.
pub(super) fn plc_op(value: f64) -> Option<PlcOp> {
    [(0.0, PlcOp::Disable), (1.0, PlcOp::Enable), (2.0, PlcOp::Pause), (3.0, PlcOp::Resume)]
        .into_iter()
        .find_map(|(number, op)| (number == value).then_some(op))
}

/// A value of a stimulus: an optional sign, then digits with or without a fraction, or `$hex`.
pub(super) fn number(text: &str) -> Result<f64, ValueError> {
    let error = || ValueError {
        value: text.into(),
        reason: "is not a number: digits with or without a fraction, or $ and hexadecimal".into(),
    };
    let trimmed = text.trim();
    let (negative, digits) = match trimmed.strip_prefix('-') {
        Some(rest) => (true, rest),
        None => (false, trimmed.strip_prefix('+').unwrap_or(trimmed)),
    };
    let value = match digits.strip_prefix('$') {
        Some(hex) => {
            if hex.is_empty() || !hex.bytes().all(|byte| byte.is_ascii_hexdigit()) {
                return Err(error());
            }
            hex.bytes().fold(0.0, |sum, byte| {
                sum * 16.0 + f64::from(char::from(byte).to_digit(16).unwrap_or(0))
            })
        }
        None => {
            let plain = digits.bytes().all(|byte| byte.is_ascii_digit() || byte == b'.');
            if !plain || !digits.bytes().any(|byte| byte.is_ascii_digit()) {
                return Err(error());
            }
            digits.parse::<f64>().map_err(|_| error())?
        }
    };
    Ok(if negative { -value } else { value })
}

#[cfg(test)]
mod tests {
    use plcc_abi::pmac::Definition;

    use super::*;

    fn found(name: &str) -> Result<String, String> {
        let tables = PmacTables { l: vec![(3, Definition::Star)], ..PmacTables::default() };
        PmacNames::new(&tables)
            .variable(name)
            .map(|name| name.to_string())
            .map_err(|error| error.to_string())
    }

    #[test]
    fn a_wrong_name_is_refused_with_the_reason() {
        for name in
            ["", "P", "P-1", "P1.5", "PUMP", "&2P5", "&Q5", "X:", "X:$G", "Z:0", "P4294967296"]
        {
            assert!(found(name).is_err(), "{name}");
        }
        assert!(found("P1024").is_err_and(|error| error.contains("--controller turbo")));
        assert!(found("&9Q1").is_err());
        assert!(found("X:$10000").is_err());
        assert!(found("L4").is_err_and(|error| error.contains("does not define")));
        assert!(found("P[3]").is_err_and(|error| error.contains("did you mean `P3`?")));
    }

    #[test]
    fn variables_lie_where_the_definitions_put_them() {
        let variable = |kind, number, system| Variable { kind, number, system };
        let (q, m, l) = (variable(Kind::Q, 5, 1), variable(Kind::M, 7, 1), variable(Kind::L, 3, 1));
        let field = |offset, width| Field { offset, width, ..Field::WORD };
        let line = |address, bit| Definition::word(Space::Y, address, field(bit, 1));
        let tables = PmacTables {
            named: vec![m, l, q, variable(Kind::Q, 5, 2)],
            l: vec![(3, line(0xC000, 4))],
            outputs: vec![Output { variable: Some(l), definition: line(0xC000, 4) }],
            ..PmacTables::default()
        };
        let names = PmacNames::new(&tables);
        let shown = names.shown_in_image().into_iter().map(|key| names.canonical(key));
        // M7 has no definition.
        assert_eq!(shown.collect::<Vec<_>>(), ["Q5", "&2Q5", "L3"]);
        let of = |name: &str| names.properties(names.find(name, Purpose::Watch).unwrap());
        assert_eq!((of("L3").direction, of("L3").can_be_forced), (Direction::Output, true));
        assert_eq!(of("Q5").value.map(|place| place.ty), Some(Type::Double));
        assert_eq!(
            (of("Y:$C000").direction, of("Y:$700").direction),
            (Direction::Input, Direction::Internal)
        );
        assert!(!of("M7").can_be_forced && of("M7").value.is_none());
        let line =
            |name: &str| (of(name).direction, of(name).value.map(|place| (place.bit, place.width)));
        assert_eq!(line("Y:$C000,4"), (Direction::Output, Some((4, 1))));
        assert_eq!(line("Y:$C000,5"), (Direction::Input, Some((5, 1))));
        let lines = |name: &str| {
            let lines = names.lines(names.find(name, Purpose::Watch).unwrap()).into_iter();
            lines.map(|line| names.canonical(line)).collect::<Vec<_>>()
        };
        assert_eq!(lines("L3"), ["Y:$C000,4"]);
        assert_eq!(lines("Y:$C000,20,2"), ["Y:$C000,20", "Y:$C000,21"]);
        assert_eq!(lines("Y:$C000").len(), 24);
        assert_eq!(lines("Q5"), [""; 0]);
    }

    #[test]
    fn what_the_plant_writes_is_simulated() {
        let layout = Layout::new(plcc_abi::pmac::Controller::Pmac);
        let channel = |motor: u32, address: f64| Run {
            offset: layout.i_offset(100 * motor + 25),
            bytes: address.to_le_bytes().to_vec(),
        };
        // Motor 1 has the first channel, the others none.
        let tables = PmacTables { initial: vec![channel(1, 49152.0)], ..PmacTables::default() };
        let names = PmacNames::simulated(&tables, &[]);
        let is = |name: &str| names.is_simulated(names.find(name, Purpose::Watch).unwrap());
        for name in ["X:$C000,20", "X:$C000", "X:$C000,17", "X:$C001", "X:$C003"] {
            assert!(is(name), "{name}");
        }
        for name in ["X:$C000,18", "X:$C000,12", "Y:$C000", "X:$C004", "Y:$FFC2,0", "#1.CMD", "P1"]
        {
            assert!(!is(name), "{name}");
        }
        let names = PmacNames::new(&tables);
        assert!(!names.is_simulated(names.find("X:$C000,20", Purpose::Watch).unwrap()));
    }

    #[test]
    fn values_of_a_stimulus_are_numbers_of_pmac() {
        for (text, value) in
            [("1", 1.0), ("-2.5", -2.5), ("$FF", 255.0), ("-$a", -10.0), (" .5 ", 0.5), ("+3", 3.0)]
        {
            assert_eq!(number(text), Ok(value));
        }
        for text in ["", "-", "1e5", "0x1", "$", "$G", "1.2.3", "nan", "inf", ".", "1 2", "--1"] {
            assert!(number(text).is_err(), "{text}");
        }
    }
}
