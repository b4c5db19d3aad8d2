//! Online change of an NCT program. The state of every NCT program has the same parts, which only lie
//! elsewhere in the image, so all of it is taken over.
//!
//! A suspended module, such as `:000`, goes on where it was only if the code that it can reach is the same
//! in both programs: its own and that of the subroutines that it calls. Else it begins at its label, with no
//! open calls; `:000` does so in the next slice.

use plcc_abi::image::{read_u8, read_u16, read_u32, write_u8, write_u16, write_u32};
use plcc_abi::nct::{
    FlagLocation, LINE_BYTES, MODULES, NctName, NctTables, ReachableCode, context,
};
use plcc_abi::nct::{H_COUNT, M_COUNT, Q_COUNT, RH_COUNT, T_COUNT};
use plcc_abi::{Program, ResumePoint, natural_cmp};

use super::NctExecutive;
use super::state::State;
use crate::online_change::{Comparison, Plan, Row};

/// How the state of one program becomes that of another one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct NctTransfer {
    /// For each module how its places are found in the new program; `None` where its code is not the same.
    modules: [Option<SameCode>; MODULES],
}

/// A module whose code is the same in two programs.
#[derive(Clone, Debug, PartialEq, Eq)]
struct SameCode {
    /// The new program's resume point for each of the old one's that the module can reach.
    resume_points: Vec<Option<u32>>,
    /// The numbers of its calls, old and new, by rising old ones.
    calls: Vec<(u32, u32)>,
}

impl SameCode {
    /// Compares the code that a module can reach in two programs.
    fn of(was: &ReachableCode, is: &ReachableCode) -> Option<Self> {
        if was.fingerprint != is.fingerprint || was.calls.len() != is.calls.len() {
            return None;
        }
        let found = |statement: u32| {
            let mut points = (0..).zip(&is.resume_points);
            points.find(|(_, other)| **other == Some(statement)).map(|(point, _)| point)
        };
        let resume_points = was.resume_points.iter().map(|point| point.and_then(found)).collect();
        let calls = was.calls.iter().copied().zip(is.calls.iter().copied()).collect();
        Some(Self { resume_points, calls })
    }

    /// Replaces the return addresses in the registers of a suspended module, and gives where it goes on;
    /// `None` when one of these places is unknown.
    fn translate(&self, resume: ResumePoint, registers: &mut [u8]) -> Option<ResumePoint> {
        let point = self.resume_points.get(resume.0 as usize).copied().flatten()?;
        for depth in 0..u32::from(read_u16(registers, context::DEPTH)) {
            let place = context::SITES + 4 * depth;
            let number = read_u32(registers, place);
            let at = self.calls.binary_search_by_key(&number, |(old, _)| *old).ok()?;
            write_u32(registers, place, self.calls.get(at)?.1);
        }
        Some(ResumePoint(point))
    }
}

/// Compares two NCT programs.
pub(super) fn compare(old: &Program, was: &NctTables, new: &Program, is: &NctTables) -> Comparison {
    let mut rows = vec![];
    let mut row = |name: &str, old: Option<String>, new: Option<String>, needs_accept: bool| {
        rows.extend(
            Row::of(name, old, new)
                .map(|row| Row { needs_accept: row.needs_accept || needs_accept, ..row }),
        );
    };
    let tasks = |program: &Program| {
        let names: Vec<&str> = program.tasks.iter().map(|task| task.name.as_str()).collect();
        Some(names.join(", "))
    };
    row("tasks", tasks(old), tasks(new), true);
    let control = |tables: &NctTables| Some(tables.settings.control.name().to_owned());
    row("control", control(was), control(is), true);
    let boards = |tables: &NctTables| Some(tables.settings.boards.unwrap_or(4).to_string());
    row("boards", boards(was), boards(is), true);
    let shown = |tables: &NctTables, name: NctName| {
        tables.named.contains(&name).then(|| "variable".to_owned())
    };
    let mut names: Vec<NctName> = was.named.iter().chain(&is.named).copied().collect();
    names.sort_by_cached_key(ToString::to_string);
    names.dedup();
    let old_names: std::collections::HashSet<NctName> = was.named.iter().copied().collect();
    let kept = is.named.iter().filter(|name| old_names.contains(name)).count();
    for name in names {
        row(&name.to_string(), shown(was, name), shown(is, name), false);
    }
    rows.sort_by(|a, b| natural_cmp(&a.name, &b.name));
    let same = |module: usize| SameCode::of(was.reachable.get(module)?, is.reachable.get(module)?);
    let modules = std::array::from_fn(same);
    Comparison { kept, rows, plan: Plan::new(NctTransfer { modules }) }
}

/// Copies bytes of flags, each from its place in one image to its place in the other.
fn copy_flags(from: &[u8], old: &[FlagLocation], to: &mut [u8], new: &[FlagLocation]) {
    for (old, new) in old.iter().zip(new) {
        new.write(to, old.read(from));
    }
}

impl NctExecutive {
    /// Takes the state of another program's executive over.
    pub(super) fn take_over_from(&mut self, old: &mut Self, plan: &NctTransfer) {
        // Both modules' input images, which take turns in the process image.
        self.image.input_images_replaced();
        old.image.input_images_replaced();
        for level0 in [true, false] {
            old.image.show(&mut old.state.modules, level0);
            self.image.show(&mut self.state.modules, level0);
            let (was, is) = (&old.tables, &self.tables);
            let (from, to) = (&old.image.bytes, &mut self.image.bytes);
            copy_flags(from, &was.inputs, to, &is.inputs);
            copy_flags(from, &was.previous, to, &is.previous);
        }
        let (was, is) = (&old.tables, &self.tables);
        let (from, to) = (&old.image.bytes, &mut self.image.bytes);
        copy_flags(from, &was.outputs, to, &is.outputs);
        copy_flags(from, &was.flags, to, &is.flags);
        let (places, into) = (&old.image.places, &self.image.places);
        let words = |count: u16| u32::from(count) * 2;
        for (was, is, length) in [
            (places.lines_in, into.lines_in, LINE_BYTES as u32),
            (places.lines_out, into.lines_out, LINE_BYTES as u32),
            (places.rh, into.rh, words(RH_COUNT)),
            (places.q, into.q, words(Q_COUNT)),
            (places.t, into.t, words(T_COUNT)),
            (places.h, into.h, words(H_COUNT)),
            (places.m, into.m, words(M_COUNT)),
        ] {
            for byte in 0..length {
                write_u8(to, is + byte, read_u8(from, was + byte));
            }
        }
        let State { tick, resume, level0_starts, synchronised, nc_flags, latched, .. } = &old.state;
        self.state.tick = *tick;
        self.state.synchronised = *synchronised;
        self.state.nc_flags.copy_from_slice(nc_flags);
        self.state.latched.copy_from_slice(latched);
        let (resume, level0_starts) = (*resume, *level0_starts);
        for (to, from) in self.state.messages.iter_mut().zip(&old.state.messages) {
            *to = *from;
        }
        self.state.level0_starts = level0_starts;
        let registers = self.state.modules.registers.iter_mut();
        let modules = registers.zip(&old.state.modules.registers).zip(&mut self.state.resume);
        for (module, (((to, from), goes_on), (was, same))) in
            modules.zip(resume.iter().zip(&plan.modules)).enumerate()
        {
            to.copy_from_slice(from);
            *goes_on = None;
            let Some(was) = *was else { continue };
            *goes_on = same.as_ref().and_then(|same| same.translate(was, to));
            if goes_on.is_none() {
                write_u16(to, context::DEPTH, 0);
                self.state.level0_starts |= module == 0;
            }
        }
        std::mem::swap(&mut self.state.memory, &mut old.state.memory);
    }
}
