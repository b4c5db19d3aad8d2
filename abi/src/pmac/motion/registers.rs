//! Where the registers of motors and coordinate systems are (guide, appendix E; for Turbo PMAC its software
//! reference). Motors and coordinate systems count from 1.

use crate::pmac::{Controller, Definition, Layout, Memory, Space, View, fixed};

/// The addresses of a motor's registers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MotorRegisters {
    /// D: the commanded position.
    pub commanded: u32,
    /// D: the actual position.
    pub actual: u32,
    /// D: the target.
    pub target: u32,
    /// D: the position bias.
    pub bias: u32,
    /// D: the following error, where there is one.
    pub following_error: Option<u32>,
    /// X: the actual velocity.
    pub velocity: u32,
    /// Y: the filtered velocity.
    pub filtered: u32,
    /// L: the variable jog.
    pub variable_jog: u32,
    /// Y: the home capture offset.
    pub home_offset: u32,
    /// L: the first of the three scale factors, behind which the axis offset is.
    pub scales: u32,
    /// X: the filter's output.
    pub output: u32,
    /// X: the first status word.
    pub status_x: u32,
    /// Y: the second status word.
    pub status_y: u32,
}

impl MotorRegisters {
    /// Those of a motor.
    pub const fn of(controller: Controller, motor: u32) -> Self {
        let index = motor.wrapping_sub(1);
        match controller {
            Controller::Pmac => {
                let (low, high) = (0x3C * index, 0xC0 * index);
                Self {
                    commanded: 0x28 + low,
                    actual: 0x2B + low,
                    target: 0x80B + high,
                    bias: 0x813 + high,
                    following_error: Some(0x840 + high),
                    velocity: 0x33 + low,
                    filtered: 0x82A + high,
                    variable_jog: 0x82B + high,
                    home_offset: 0x815 + high,
                    scales: 0x822 + high,
                    output: 0x45 + low,
                    status_x: 0x3D + low,
                    status_y: 0x814 + high,
                }
            }
            Controller::Turbo => {
                let base = 0x80 * index;
                Self {
                    commanded: 0x88 + base,
                    actual: 0x8B + base,
                    target: 0xC7 + base,
                    bias: 0xCC + base,
                    following_error: None,
                    velocity: 0x9D + base,
                    filtered: 0xEF + base,
                    variable_jog: 0xD7 + base,
                    home_offset: 0xCE + base,
                    scales: 0xCF + base,
                    output: 0xBF + base,
                    status_x: 0xB0 + base,
                    status_y: 0xC0 + base,
                }
            }
        }
    }
}

/// The addresses of a coordinate system's registers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SystemRegisters {
    /// L: the target of A; those of B C U V W X Y Z are behind it.
    pub targets: u32,
    /// X: the commanded time base.
    pub commanded_base: u32,
    /// X: the present time base.
    pub present_base: u32,
    /// X: the first status word.
    pub status_x: u32,
    /// Y: the second status word.
    pub status_y: u32,
}

impl SystemRegisters {
    /// Those of a coordinate system.
    pub const fn of(controller: Controller, system: u32) -> Self {
        let index = system.wrapping_sub(1);
        match controller {
            Controller::Pmac => {
                let base = 0xC0 * index;
                Self {
                    targets: 0x819 + base,
                    commanded_base: 0x806 + base,
                    present_base: 0x808 + base,
                    status_x: 0x818 + base,
                    status_y: 0x817 + base,
                }
            }
            Controller::Turbo => {
                let base = 0x2000 + 0x100 * index;
                Self {
                    targets: 0x41 + base,
                    commanded_base: base,
                    present_base: base + 2,
                    status_x: 0x40 + base,
                    status_y: 0x3F + base,
                }
            }
        }
    }
}

/// How many motors a controller has.
pub const fn motors(controller: Controller) -> u32 {
    match controller {
        Controller::Pmac => 8,
        Controller::Turbo => 32,
    }
}

/// The 48-bit floating-point number at an address.
pub fn read_float(view: &View<'_>, address: u32) -> f64 {
    let x = view.read_word(Space::X, address);
    let y = view.read_word(Space::Y, address);
    fixed::from_float48(x, y)
}

/// Writes a 48-bit floating-point number.
pub fn write_float(memory: &mut Memory<'_>, address: u32, value: f64) {
    let (x, y) = fixed::to_float48(value);
    memory.write_word(Space::X, address, x);
    memory.write_word(Space::Y, address, y);
}

/// The 48-bit integer at an address.
pub fn read_integer(view: &View<'_>, address: u32) -> f64 {
    view.read(Definition::D { address })
}

/// Writes a value rounded to a 48-bit integer.
pub fn write_integer(memory: &mut Memory<'_>, address: u32, value: f64) {
    memory.write(Definition::D { address }, value);
}

/// Ix08·32 of a motor, by which positions are multiplied in its registers.
pub fn position_scale(layout: &Layout, image: &[u8], motor: u32) -> f64 {
    crate::image::read_f64(image, layout.i_offset(100 * motor + 8)) * 32.0
}

/// The position bias of a motor in counts; 0 where Ix08 is 0.
pub fn bias(view: &View<'_>, motor: u32) -> f64 {
    let scale = position_scale(view.layout, view.image, motor);
    if scale == 0.0 {
        return 0.0;
    }
    read_integer(view, MotorRegisters::of(view.layout.controller, motor).bias) / scale
}

/// Sets the position bias of a motor, which is rounded to the register's unit.
pub fn set_bias(memory: &mut Memory<'_>, motor: u32, counts: f64) {
    let scale = position_scale(memory.layout, memory.image, motor);
    let address = MotorRegisters::of(memory.layout.controller, motor).bias;
    write_integer(memory, address, counts * scale);
}

/// The three scale factors of a motor.
pub fn scales(view: &View<'_>, motor: u32) -> [f64; 3] {
    let first = MotorRegisters::of(view.layout.controller, motor).scales;
    [0, 1, 2].map(|slot| read_float(view, first + slot))
}

/// Writes the registers of an axis definition; without an offset the bias becomes 0 (decided).
pub fn define(memory: &mut Memory<'_>, motor: u32, scales: [f64; 3], offset: f64) {
    let first = MotorRegisters::of(memory.layout.controller, motor).scales;
    for (slot, scale) in (0..).zip(scales) {
        write_float(memory, first + slot, scale);
    }
    write_float(memory, first + 3, offset);
    set_bias(memory, motor, offset);
}

/// The commanded time base for a percentage: `%n` (guide, appendix C).
pub fn time_base(layout: &Layout, image: &[u8], percent: f64) -> u32 {
    let units = crate::pmac::arithmetic::round(servo_units(layout, image) as f64 * percent / 100.0);
    units.clamp(0.0, 8_388_607.0) as u32
}

/// The time of a servo cycle as I10 says, in 2^-23 ms; the default where that is 0.
pub fn servo_units(layout: &Layout, image: &[u8]) -> i64 {
    let units = crate::image::read_f64(image, layout.i_offset(10));
    if units > 0.0 { units as i64 } else { 3_713_707 }
}
