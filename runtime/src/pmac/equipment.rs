//! What displays show of simulated motors, coordinate systems and motion programs.

use std::collections::BTreeSet;

use plcc_abi::pmac::motion::registers::motors;
use plcc_abi::pmac::motion::{AxisGroup, Plant};
use plcc_abi::pmac::{Layout, PmacTables};
use plcc_simulator::{Equipment, MachineAxis, MachinePath, MachineProgram, Reading};

/// The motors with the ends of their travel, where the machine file says them, and the coordinate systems that have motors.
pub(super) fn equipment(tables: &PmacTables, layout: &Layout, plants: &[Plant]) -> Equipment {
    let motor = |number: u32| {
        let plant = plants.iter().find(|plant| u32::from(plant.number) == number);
        let value = |name: &str| Reading::of(format!("#{number}.{name}"));
        MachineAxis {
            name: format!("#{number}"),
            unit: "counts",
            actual: value("ACT"),
            commanded: Some(value("CMD")),
            error: Some(value("FE")),
            travel: plant.and_then(|plant| plant.limits.or(plant.stroke)),
            active: Some(format!("I{number}00")),
        }
    };
    let definitions = tables.motion.definitions.iter();
    let systems: BTreeSet<u8> = definitions.clone().map(|(_, axes)| axes.system).collect();
    let program = |system: &u8| MachineProgram {
        name: format!("&{system}"),
        line: format!("&{system}.LINE"),
        number: Some(format!("&{system}.PROG")),
        base: Some(format!("&{system}.BASE")),
        text: vec![],
        entries: vec![],
    };
    let in_plane = definitions.filter(|(_, axes)| axes.group == AxisGroup::Xyz);
    let planes: BTreeSet<u8> = in_plane.map(|(_, axes)| axes.system).collect();
    let path = |system: &u8| MachinePath {
        name: format!("&{system} X Y"),
        axes: ["X", "Y"].map(|axis| format!("&{system}.{axis}")),
    };
    Equipment {
        axes: (1..=motors(layout.controller)).map(motor).collect(),
        programs: systems.iter().map(program).collect(),
        paths: planes.iter().map(path).collect(),
        ..Equipment::default()
    }
}
