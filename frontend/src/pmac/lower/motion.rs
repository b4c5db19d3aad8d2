//! Lowers motion programs. Their statements of motion ask the host whether they can be calculated now, and tell it to
//! carry them out. Either can suspend the program: in front of the statement, or behind it. A WHILE goes back to its
//! condition by a suspension too, so that no code has a loop; the executive goes on at once where the control would.

use plcc_abi::HostFn;
use plcc_abi::pmac::layout::exec;
use plcc_abi::pmac::motion::registers;
use plcc_ir::{Address, InstBuilder, IntCond, Place, Type};

use super::emit::{self, Operand};
use super::{Lowerer, StatementPlaces};
use crate::common::BrokenInvariant;
use crate::pmac::ast::{Stmt, StmtKind};

impl Lowerer<'_> {
    /// Lowers a statement of a motion program.
    pub(super) fn motion(
        &mut self,
        index: usize,
        stmt: &Stmt,
        version: &StatementPlaces,
        resumes: &[Option<Place>],
    ) -> Result<(), BrokenInvariant> {
        let resume = |index: usize| {
            let place = resumes.get(index).copied().flatten();
            place.ok_or_else(|| BrokenInvariant::new(format!("no program goes on at {index}")))
        };
        match stmt.kind {
            StmtKind::Motion(motion, _) => {
                self.call_or_suspend(HostFn::PmacMotionReady, motion, true, resume(index)?)?;
                let download = self.download;
                let statement = download.motion.get(motion as usize);
                let statement = statement
                    .ok_or_else(|| BrokenInvariant::new("there is no such statement of motion"))?;
                for value in &statement.values {
                    let value = self.value(*value)?;
                    let b = self.builder.func();
                    let value = value.stored(b);
                    b.host_call(HostFn::PmacMotionValue, &[value]);
                }
                self.call_or_suspend(HostFn::PmacMotion, motion, false, resume(index + 1)?)
            }
            StmtKind::Loop(head, motion) => {
                let b = self.builder.func();
                let number = b.constant(Type::I32, i64::from(motion));
                emit::host_value(b, HostFn::PmacMotion, &[number])?;
                self.builder.suspend(resume(head as usize)?);
                Ok(())
            }
            _ => self.statement(stmt, version, resumes),
        }
    }

    /// Addresses a motor whose number is in the source, for commands. A number that no motor has changes nothing.
    pub(super) fn address_motor_by_number(&mut self, motor: u32) {
        if (1..=registers::motors(self.layout.controller)).contains(&motor) {
            let at = Address::fixed(self.regions.exec, exec::motor(self.context));
            let b = self.builder.func();
            let motor = b.constant(Type::I32, i64::from(motor));
            b.store(at, motor);
        }
    }

    /// Addresses a motor, for commands.
    pub(super) fn address_motor(&mut self, motor: Operand) {
        let context = i64::from(self.context);
        let b = self.builder.func();
        let motor = motor.stored(b);
        let context = b.constant(Type::I32, context);
        b.host_call(HostFn::PmacAddressMotor, &[context, motor]);
    }

    /// Calls a function of the host with the number of a statement of motion, and goes on if what it gives is not 0,
    /// or is 0, as `goes_on` says; else suspends the program.
    fn call_or_suspend(
        &mut self,
        function: HostFn,
        motion: u32,
        goes_on: bool,
        resume: Place,
    ) -> Result<(), BrokenInvariant> {
        let b = self.builder.func();
        let number = b.constant(Type::I32, i64::from(motion));
        let given = emit::host_value(b, function, &[number])?;
        let cond = if goes_on { IntCond::Ne } else { IntCond::Eq };
        let next_cond = b.icmp_imm(cond, given, 0);
        let (next, wait) = (self.builder.place(), self.builder.place());
        self.builder.brif(next_cond, next, wait);
        self.builder.bind(wait);
        self.builder.suspend(resume);
        self.builder.bind(next);
        Ok(())
    }
}
