//! A node for each variable of the program, and its value.
//!
//! Below `Objects` is a folder with the name of the control, and in it the folders `Inputs`, `Outputs` and
//! `Variables`. The identifier of a variable's node is its name. Beside the folders is the variable `State`.

use opcua::nodes::{AccessLevel, VariableBuilder};
use opcua::server::SubscriptionCache;
use opcua::server::address_space::AddressSpace;
use opcua::server::node_manager::memory::SimpleNodeManager;
use opcua::types::{
    DataTypeId, DataValue, DateTime, EUInformation, ExtensionObject, LocalizedText, NodeId,
    NumericRange, ObjectId, QualifiedName, StatusCode, VariableTypeId, Variant,
};
use plcc_configuration::Point;
use plcc_image::{Direction, Number, Snapshot, Symbol};

use crate::hub::ControlState;
use crate::session::Shared;

/// The identifier of the node that says what the control is doing. No variable has this name, since names in
/// the languages have no colon.
const STATE: &str = "plcio:State";

/// The nodes of one address space.
pub(super) struct Nodes {
    variables: Vec<Node>,
    state: NodeId,
    last_state: Option<&'static str>,
}

/// A variable's node.
struct Node {
    id: NodeId,
    symbol: Symbol,
    /// What the configuration says of it, where it is a point of the driver `opcua`.
    point: Option<Point>,
    kind: Kind,
    /// What clients have.
    last: Option<(Variant, StatusCode)>,
}

/// The type of a node.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Boolean,
    Int16,
    UInt16,
    Int32,
    UInt32,
    Double,
}

impl Kind {
    /// The type that has all values of a variable.
    fn of(symbol: &Symbol, point: Option<&Point>) -> Self {
        let scaled = |point: &Point| point.entry.scale != 1.0 || point.entry.offset != 0.0;
        let Some(range) = symbol.outside().range().filter(|_| !point.is_some_and(scaled)) else {
            return Self::Double;
        };
        let within = |low: i64, high: i64| low <= *range.start() && *range.end() <= high;
        if symbol.outside().is_bit() {
            Self::Boolean
        } else if within(i16::MIN.into(), i16::MAX.into()) {
            Self::Int16
        } else if within(0, u16::MAX.into()) {
            Self::UInt16
        } else if within(i32::MIN.into(), i32::MAX.into()) {
            Self::Int32
        } else {
            Self::UInt32
        }
    }

    fn data_type(self) -> DataTypeId {
        match self {
            Self::Boolean => DataTypeId::Boolean,
            Self::Int16 => DataTypeId::Int16,
            Self::UInt16 => DataTypeId::UInt16,
            Self::Int32 => DataTypeId::Int32,
            Self::UInt32 => DataTypeId::UInt32,
            Self::Double => DataTypeId::Double,
        }
    }

    fn value(self, number: f64) -> Variant {
        match self {
            Self::Boolean => (number != 0.0).into(),
            Self::Int16 => (number as i16).into(),
            Self::UInt16 => (number as u16).into(),
            Self::Int32 => (number as i32).into(),
            Self::UInt32 => (number as u32).into(),
            Self::Double => number.into(),
        }
    }

    /// The number that a value of this type is; `None` for a value of another type.
    fn number(self, value: &Variant) -> Option<f64> {
        Some(match (self, value) {
            (Self::Boolean, Variant::Boolean(bit)) => f64::from(*bit),
            (Self::Int16, Variant::Int16(number)) => f64::from(*number),
            (Self::UInt16, Variant::UInt16(number)) => f64::from(*number),
            (Self::Int32, Variant::Int32(number)) => f64::from(*number),
            (Self::UInt32, Variant::UInt32(number)) => f64::from(*number),
            (Self::Double, Variant::Double(number)) => *number,
            _ => return None,
        })
    }

    fn values(self, numbers: &[f64]) -> Variant {
        let all = numbers.iter();
        match self {
            Self::Boolean => all.map(|&number| number != 0.0).collect::<Vec<_>>().into(),
            Self::Int16 => all.map(|&number| number as i16).collect::<Vec<_>>().into(),
            Self::UInt16 => all.map(|&number| number as u16).collect::<Vec<_>>().into(),
            Self::Int32 => all.map(|&number| number as i32).collect::<Vec<_>>().into(),
            Self::UInt32 => all.map(|&number| number as u32).collect::<Vec<_>>().into(),
            Self::Double => numbers.to_vec().into(),
        }
    }
}

/// What is said of a variable besides its name.
fn description(symbol: &Symbol, point: Option<&Point>) -> String {
    let said = point.map_or("", |point| point.entry.description.as_str());
    let unit = match symbol.unit.as_str() {
        "" => String::new(),
        unit => format!(" in {unit}"),
    };
    let what = format!("{}{unit} ({})", symbol.direction.name(), symbol.value.ty.name());
    if said.is_empty() { what } else { format!("{said}: {what}") }
}

impl Node {
    fn new(namespace: u16, symbol: Symbol, point: Option<Point>) -> Self {
        let kind = Kind::of(&symbol, point.as_ref());
        let id = NodeId::new(namespace, symbol.name.clone());
        Self { id, symbol, point, kind, last: None }
    }

    fn insert(&self, space: &mut AddressSpace, namespace: u16, folder: &NodeId) {
        let is_given = self.point.as_ref().is_some_and(|point| point.is_input);
        let access = match is_given {
            true => AccessLevel::CURRENT_READ | AccessLevel::CURRENT_WRITE,
            false => AccessLevel::CURRENT_READ,
        };
        let name = self.symbol.name.as_str();
        let mut variable =
            VariableBuilder::new(&self.id, QualifiedName::new(namespace, name), name)
                .data_type(self.kind.data_type())
                .description(description(&self.symbol, self.point.as_ref()))
                .access_level(access)
                .user_access_level(access)
                .minimum_sampling_interval(super::PERIOD.as_secs_f64() * 1000.0)
                .organized_by(folder.clone());
        variable = match self.symbol.elements {
            1 => variable.value_rank(-1).value(self.kind.value(0.0)),
            count => variable
                .value_rank(1)
                .array_dimensions(&[count])
                .value(self.kind.values(&vec![0.0; count as usize])),
        };
        let has_unit = !self.symbol.unit.is_empty();
        let definition = match has_unit {
            true => VariableTypeId::AnalogUnitType,
            false => VariableTypeId::BaseDataVariableType,
        };
        variable.has_type_definition(definition).insert(space);
        if has_unit {
            let unit = EUInformation {
                namespace_uri: "urn:plcc:units".into(),
                unit_id: -1,
                display_name: LocalizedText::new("", &self.symbol.unit),
                description: LocalizedText::null(),
            };
            let id = NodeId::new(namespace, format!("{name}:EngineeringUnits"));
            VariableBuilder::new(&id, "EngineeringUnits", "EngineeringUnits")
                .data_type(DataTypeId::EUInformation)
                .value(ExtensionObject::from_message(unit))
                .has_type_definition(VariableTypeId::PropertyType)
                .property_of(self.id.clone())
                .insert(space);
        }
    }

    /// The value in a tick: of an output what is on its lines, of all others what the program sees. `None`
    /// where it lies outside the image.
    fn read(&self, tick: &Snapshot) -> Option<Variant> {
        let place = match self.symbol.direction {
            Direction::Output => self.symbol.outside(),
            _ => self.symbol.value,
        };
        let outside = |number: Number| match &self.point {
            Some(point) => point.outside(number),
            None => number.float(),
        };
        if self.symbol.elements == 1 {
            return place.read(&tick.image).map(|number| self.kind.value(outside(number)));
        }
        let step = u32::from(place.width.div_ceil(8));
        let element = |index: u32| {
            let mut place = place;
            place.offset = place.offset.checked_add(index.checked_mul(step)?)?;
            place.read(&tick.image).map(outside)
        };
        let numbers: Option<Vec<f64>> = (0..self.symbol.elements).map(element).collect();
        numbers.map(|numbers| self.kind.values(&numbers))
    }
}

/// How good values are because of what the control is doing.
fn quality(state: ControlState) -> StatusCode {
    match state {
        ControlState::Waiting => StatusCode::BadWaitingForInitialData,
        ControlState::Running | ControlState::Stopped => StatusCode::Good,
        ControlState::Silent | ControlState::Ended => StatusCode::UncertainLastUsableValue,
    }
}

impl Nodes {
    /// Makes the nodes of all variables, and takes what clients write.
    pub(super) fn create(
        shared: &Shared,
        points: &[usize],
        manager: &SimpleNodeManager,
        namespace: u16,
        name: &str,
    ) -> Self {
        let mut variables = vec![];
        {
            let hub = shared.hub();
            let wired: Vec<(usize, &Point)> =
                points.iter().filter_map(|&index| Some((index, hub.point(index)?))).collect();
            for symbol in hub.symbols() {
                // Where several entries name a variable, the one counts by which it is written.
                let mut own = wired.iter().filter(|(_, point)| point.symbol.name == symbol.name);
                let given = own.clone().find(|(_, point)| point.is_input).or_else(|| own.next());
                let node = Node::new(namespace, symbol.clone(), given.map(|&(_, p)| p.clone()));
                if let Some(&(index, point)) = given
                    && point.is_input
                {
                    let (shared, kind) = (shared.clone(), node.kind);
                    manager.inner().add_write_callback(node.id.clone(), move |value, range| {
                        write(&shared, (index, kind), &value, range)
                    });
                }
                variables.push(node);
            }
        }
        let folder = NodeId::new(namespace, "plcio:Control");
        let state = NodeId::new(namespace, STATE);
        let mut space = manager.address_space().write();
        let own = |text: &str| QualifiedName::new(namespace, text);
        space.add_folder(&folder, own(name), name, &ObjectId::ObjectsFolder.into());
        VariableBuilder::new(&state, own("State"), "State")
            .data_type(DataTypeId::String)
            .value("waiting")
            .description("what the control is doing: running, stopped, silent, ended")
            .has_type_definition(VariableTypeId::BaseDataVariableType)
            .organized_by(folder.clone())
            .insert(&mut *space);
        for (direction, title) in [
            (Direction::Input, "Inputs"),
            (Direction::Output, "Outputs"),
            (Direction::Internal, "Variables"),
        ] {
            let id = NodeId::new(namespace, format!("plcio:{title}"));
            space.add_folder(&id, own(title), title, &folder);
            let members = variables.iter().filter(|node| node.symbol.direction == direction);
            members.for_each(|node| node.insert(&mut space, namespace, &id));
        }
        drop(space);
        Self { variables, state, last_state: None }
    }

    /// Gives clients all values that have changed.
    pub(super) fn update(
        &mut self,
        shared: &Shared,
        manager: &SimpleNodeManager,
        subscriptions: &SubscriptionCache,
    ) {
        let (state, status, tick) = {
            let hub = shared.hub();
            let state = hub.control_state();
            (state.name(), quality(state), hub.tick().cloned())
        };
        let now = DateTime::now();
        let data = |value: Option<Variant>, status: StatusCode| DataValue {
            value,
            status: Some(status),
            source_timestamp: Some(now),
            server_timestamp: Some(now),
            ..Default::default()
        };
        let mut changed: Vec<(&NodeId, Option<&NumericRange>, DataValue)> = vec![];
        if self.last_state != Some(state) {
            self.last_state = Some(state);
            changed.push((&self.state, None, data(Some(state.into()), StatusCode::Good)));
        }
        for node in &mut self.variables {
            let Some(value) = tick.as_ref().and_then(|tick| node.read(tick)) else { continue };
            let is_new = !node
                .last
                .as_ref()
                .is_some_and(|(last, quality)| *last == value && *quality == status);
            if is_new {
                changed.push((&node.id, None, data(Some(value.clone()), status)));
                node.last = Some((value, status));
            }
        }
        // All of these nodes exist.
        let _ = manager.set_values(subscriptions, changed.into_iter());
    }
}

/// Takes a value that a client has written.
fn write(
    shared: &Shared,
    (index, kind): (usize, Kind),
    value: &DataValue,
    range: &NumericRange,
) -> StatusCode {
    if *range != NumericRange::None {
        return StatusCode::BadWriteNotSupported;
    }
    let Some(number) = value.value.as_ref().and_then(|value| kind.number(value)) else {
        return StatusCode::BadTypeMismatch;
    };
    let mut hub = shared.hub();
    if hub.control_state() == ControlState::Ended {
        return StatusCode::BadOutOfService;
    }
    if !hub.set_input_if_it_fits(index, number) {
        return StatusCode::BadOutOfRange;
    }
    hub.publish();
    StatusCode::Good
}

#[cfg(test)]
mod tests {
    use plcc_image::{Place, Type};

    use super::*;

    fn symbol(place: Place, elements: u32) -> Symbol {
        Symbol {
            name: "X".into(),
            aliases: vec![],
            value: place,
            line: None,
            elements,
            direction: Direction::Internal,
            slot: None,
            unit: "mm".into(),
        }
    }

    #[test]
    fn a_node_has_the_type_and_the_value_of_its_variable() {
        let image = vec![0xFF, 0xFF, 0x02, 0x00, 0xA5, 0, 0, 0];
        let tick = Snapshot { ticks: 1, time: 1, state: None, forces: 0, image };
        for (place, elements, value) in [
            (Place::bytes(0, Type::Integer), 1, Variant::from(-1_i16)),
            (Place::bytes(0, Type::Word), 1, Variant::from(65535_u16)),
            (Place::bytes(0, Type::Long), 1, Variant::from(0x2_FFFF_i32)),
            (Place::bytes(0, Type::Logical), 1, Variant::from(true)),
            (Place::bits(4, Type::Bits, 5, 1), 1, Variant::from(true)),
            (Place::bits(4, Type::Bits, 4, 4), 1, Variant::from(10_i16)),
            (Place::bits(0, Type::Bits, 0, 32), 1, Variant::from(0x2_FFFF_u32)),
            (Place::bytes(0, Type::Integer), 2, Variant::from(vec![-1_i16, 2])),
        ] {
            let node = Node::new(2, symbol(place, elements), None);
            assert_eq!(node.read(&tick), Some(value.clone()), "{place:?}");
            if elements == 1 {
                let back = node.kind.number(&value).map(|number| node.kind.value(number));
                assert_eq!(back, Some(value), "{place:?}");
            }
        }
        let beyond = Node::new(2, symbol(Place::bytes(4, Type::Long), 2), None);
        assert_eq!(beyond.read(&tick), None);
        assert_eq!(description(&beyond.symbol, None), "a variable in mm (long)");
    }
}
