//! What an NCT program may call.

use plcc_abi::nct::{FlagLocation, arithmetic::Operation};
use plcc_abi::{Host, HostFn};

use super::arithmetic_area;
use super::memory::NcMemory;
use super::operand::Locals;
use super::search;
use super::time::ModuleTime;

/// The host of an NCT program, for one call of a module.
#[derive(Debug)]
pub(super) struct NctHost<'a> {
    pub(super) flags: &'a [FlagLocation],
    pub(super) memory: &'a mut NcMemory,
    /// Until when the module may run, if there is a limit.
    pub(super) time: Option<ModuleTime<'a>>,
}

impl Host for NctHost<'_> {
    fn call(&mut self, image: &mut [u8], function: HostFn, args: [u64; 4]) -> u64 {
        let [area, op, ..] = args.map(|arg| arg as u16);
        let locals = &mut Locals::new(image, self.flags);
        match function {
            HostFn::NctHf => search::find_item(locals, area, op),
            HostFn::NctPf => search::find_pot(locals, area, op, self.memory.magazine()),
            HostFn::NctMr => self.memory.read(locals, area),
            HostFn::NctMw => self.memory.write(locals, area),
            HostFn::NctAdd => arithmetic_area::execute(locals, Operation::Add, area),
            HostFn::NctSub => arithmetic_area::execute(locals, Operation::Sub, area),
            HostFn::NctMul => arithmetic_area::execute(locals, Operation::Mul, area),
            HostFn::NctDiv => arithmetic_area::execute(locals, Operation::Div, area),
            HostFn::NctCmp => arithmetic_area::execute(locals, Operation::Cmp, area),
            // The functions of other dialects, which no NCT program calls.
            _ => {}
        }
        0
    }

    fn extend_time(&mut self) -> Option<u64> {
        self.time.as_ref()?.extend()
    }
}
