//! Builds a whole program from flat code and cuts it into functions (chunks).
//!
//! Code generation takes more than linear time in the length of a function, so a program becomes
//! many functions of limited length, and front ends need not know. A front end asks for
//! [`Place`]s, its branch targets, and binds each of them once to the point where the code then
//! stands. It may branch to a place before and after it is bound, whichever function that turns
//! out to be in. It also says where statements begin. There, and at places, the builder begins a
//! new function if the current one has reached the limit.
//!
//! A branch inside one function becomes a branch between blocks. One to another function becomes
//! a [`Terminator::Goto`] to a label that the builder puts at the place:
//!
//! ```text
//! front end          one function                two functions
//!   brif c, p, q       brif c, block1, block2      fn chunk0                fn chunk1
//!   bind p             block1:                       brif c, block1, block2   block0 (L1):
//!   …                    …                           block1: …                  …
//!   bind q             block2:                       block2: goto L1
//! ```
//!
//! Values do not live across a bound place or the beginning of a statement; what is needed after
//! it is in the process image. Control flow inside one statement that passes values along uses
//! blocks of the [`FuncBuilder`] directly.

use plcc_abi::{Region, Task, TrapCode, TrapSite};

use crate::tables::FastMap;
use crate::{
    Block, BlockCall, FuncBuilder, FuncData, InstBuilder, Label, Module, RegionId, SourceFile,
    Statement, StatementId, Terminator, Value,
};

/// A new function begins at the next statement or place when the current one has this many
/// instructions or blocks.
pub const DEFAULT_LIMIT: usize = 2000;

/// How many instructions a program may have before any pass. Programs of 20 000 lines have some
/// 300 000. More would take the compiler seconds and hundreds of mebibytes.
pub const MAX_INSTRUCTIONS: usize = 1 << 19;

/// How many instructions a single statement may have, host calls counted several times. All of them are
/// in one function, for which code generation takes more memory than for several short ones.
pub const MAX_STATEMENT_INSTRUCTIONS: usize = 1 << 17;

/// The number of instructions that a host call counts as in a statement: values that live across it are
/// spilled, so that code generation takes about as much memory for it as for that many others.
const INSTRUCTIONS_PER_HOST_CALL: usize = 9;

/// The number of instructions that a task counts as, for its entry and its tables.
const INSTRUCTIONS_PER_TASK: usize = 12;

/// A branch target, which may not be bound yet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Place(u32);

#[derive(Clone, Copy, Default)]
struct PlaceData {
    label: Option<Label>,
    /// The number of the function and the block that the place is bound to.
    bound: Option<(usize, Block)>,
}

/// A branch whose place may not be bound yet.
enum Branch {
    Jump(Place),
    Brif(Value, Place, Place),
    Switch(Value, Vec<Place>, Place),
}

/// Builds a module.
pub struct ChunkBuilder {
    module: Module,
    limit: usize,
    /// Whether the next place that is bound begins a new function, however short the current one is.
    begins_function: bool,
    current: FuncBuilder,
    places: Vec<PlaceData>,
    /// The branches so far, each with the number of the function and the block that it ends.
    branches: Vec<(usize, Block, Branch)>,
    /// The functions that are complete but for their branches.
    finished: Vec<FuncBuilder>,
    /// How many instructions the finished functions have.
    finished_instructions: usize,
    /// The last statement of the first finished function that has more than
    /// [`MAX_STATEMENT_INSTRUCTIONS`].
    long_statement: Option<StatementId>,
}

impl ChunkBuilder {
    /// An empty module over a process image of `image_size` bytes, cut at [`DEFAULT_LIMIT`].
    pub fn new(image_size: u32, regions: Vec<Region>) -> Self {
        Self {
            module: Module { image_size, regions, ..Module::default() },
            limit: DEFAULT_LIMIT,
            begins_function: false,
            current: FuncBuilder::new("chunk0"),
            places: vec![],
            branches: vec![],
            finished: vec![],
            finished_instructions: 0,
            long_statement: None,
        }
    }

    /// Sets another number of instructions or blocks at which a new function begins.
    pub fn with_limit(mut self, limit: usize) -> Self {
        self.limit = limit;
        self
    }

    /// The region with a name; `None` if there is none.
    pub fn region(&self, name: &str) -> Option<RegionId> {
        let index = self.module.regions.iter().position(|region| region.name == name)?;
        Some(RegionId(index as u32))
    }

    /// Says that a region holds only doubles that are finite and never -0
    /// ([`Module::finite_regions`]).
    pub fn finite_region(&mut self, region: RegionId) {
        self.module.finite_regions.push(region);
    }

    /// Adds a source file and returns its number, by which statements refer to it.
    pub fn add_file(&mut self, name: impl Into<String>, text: impl Into<String>) -> u32 {
        self.module.files.push(SourceFile { name: name.into(), text: text.into() });
        self.module.files.len() as u32 - 1
    }

    /// A new place, which is not bound yet.
    pub fn place(&mut self) -> Place {
        self.places.push(PlaceData::default());
        Place(self.places.len() as u32 - 1)
    }

    /// The label of a place, whose number [`goto_indirect`](Self::goto_indirect) takes. Labels are
    /// numbered in the order in which they are first asked for.
    pub fn label(&mut self, place: Place) -> Label {
        let data = &mut self.places[place.0 as usize];
        *data.label.get_or_insert_with(|| {
            self.module.label_count += 1;
            Label(self.module.label_count - 1)
        })
    }

    /// The number of the function at this point of the program.
    pub fn function_number(&self) -> usize {
        self.finished.len()
    }

    /// How many instructions the function at this point of the program has so far.
    pub fn function_length(&self) -> usize {
        self.current.length()
    }

    /// Sets after how many instructions a new function begins, from here on.
    pub fn set_limit(&mut self, limit: usize) {
        self.limit = limit;
    }

    /// Says that a region holds only words of four bytes whose highest byte is 0
    /// ([`Module::word_regions`]).
    pub fn word_region(&mut self, region: RegionId) {
        self.module.word_regions.push(region);
    }

    /// Adds a task that starts at a place. Tasks are numbered in the order of these calls.
    pub fn task(&mut self, name: impl Into<String>, place: Place) {
        let entry = self.label(place).0;
        self.module.tasks.push(Task { name: name.into(), entry, resume_points: vec![] });
    }

    /// The places at which a task can be suspended, in the source's order; the task's number is
    /// as [`task`](Self::task) counts. A task that does not exist gets none.
    pub fn resume_points(&mut self, task: usize, places: &[Place]) {
        let labels = places.iter().map(|&place| self.label(place).0).collect();
        if let Some(task) = self.module.tasks.get_mut(task) {
            task.resume_points = labels;
        }
    }

    /// Begins a statement, to which further instructions belong. A new function may begin here.
    pub fn statement(&mut self, statement: Statement) -> StatementId {
        if self.is_full() && !self.current.is_terminated() {
            let next = self.place();
            self.jump(next);
            self.bind(next);
        }
        let loc = StatementId(self.module.statements.len() as u32);
        self.module.statements.push(statement);
        self.current.set_loc(loc);
        loc
    }

    /// The statement with which the program has more than [`MAX_INSTRUCTIONS`], or a function more than
    /// [`MAX_STATEMENT_INSTRUCTIONS`]; `None` as long as neither is so. A front end asks this after
    /// each statement, and gives up when there is one.
    pub fn statement_over_budget(&self) -> Option<Statement> {
        let statement = |loc: StatementId| self.module.statements.get(loc.0 as usize).copied();
        if let Some(long) = self.long_statement {
            return statement(long);
        }
        if self.instruction_count() <= MAX_INSTRUCTIONS && !self.is_long_statement() {
            return None;
        }
        statement(self.current.loc())
    }

    /// How many instructions the program has so far; a task counts as several.
    pub fn instruction_count(&self) -> usize {
        let current = self.current.length();
        self.finished_instructions + current + INSTRUCTIONS_PER_TASK * self.module.tasks.len()
    }

    /// Whether the current function has more instructions than a statement may have.
    fn is_long_statement(&self) -> bool {
        let calls = (INSTRUCTIONS_PER_HOST_CALL - 1) * self.current.host_call_count();
        self.current.length() + calls > MAX_STATEMENT_INSTRUCTIONS
    }

    /// Whether the current function has reached the limit.
    fn is_full(&self) -> bool {
        self.current.length() >= self.limit || self.current.func().block_count() >= self.limit
    }

    /// Lets the next place that is bound begin a new function. Code that seldom runs should not be in a
    /// function with code that often does, since the registers that it saves are saved for both.
    pub fn begin_function(&mut self) {
        self.begins_function = true;
    }

    /// Binds a place to this point of the program. If the code before it has no terminator, control
    /// goes on from there to the place.
    pub fn bind(&mut self, place: Place) {
        if !self.current.is_terminated() {
            self.jump(place);
        }
        let begins_function = std::mem::take(&mut self.begins_function);
        if self.is_full() || begins_function && self.current.length() > 0 {
            let loc = self.current.loc();
            let name = format!("chunk{}", self.finished.len() + 1);
            self.finished_instructions += self.current.length();
            if self.is_long_statement() {
                self.long_statement.get_or_insert(loc);
            }
            let for_size = self.current.optimizes_for_size();
            let next = FuncBuilder::with_room(name, self.current.inst_count());
            self.finished.push(std::mem::replace(&mut self.current, next));
            self.current.set_loc(loc);
            self.current.set_optimize_for_size(for_size);
        } else {
            let block = self.current.create_block();
            self.current.switch_to(block);
        }
        self.places[place.0 as usize].bound = Some((self.finished.len(), self.current.current()));
    }

    /// The builder of the current function, to append instructions.
    pub fn func(&mut self) -> &mut FuncBuilder {
        &mut self.current
    }

    fn branch(&mut self, branch: Branch) {
        // The terminator is put in when every place is bound.
        self.current.terminate(Terminator::Return);
        self.branches.push((self.finished.len(), self.current.current(), branch));
    }

    /// Ends the current block with a jump to a place.
    pub fn jump(&mut self, place: Place) {
        self.branch(Branch::Jump(place));
    }

    /// Ends the current block with a branch to one of two places; `cond` is an `i1`.
    pub fn brif(&mut self, cond: Value, then: Place, otherwise: Place) {
        self.branch(Branch::Brif(cond, then, otherwise));
    }

    /// Ends the current block with a branch to the place in `targets` that has the index `arg`, an
    /// `i32`, or to `default` if there is none.
    pub fn switch(&mut self, arg: Value, targets: Vec<Place>, default: Place) {
        self.branch(Branch::Switch(arg, targets, default));
    }

    /// Ends the current block with a jump to the label that has the number `label`, an `i32`.
    pub fn goto_indirect(&mut self, label: Value) {
        self.current.terminate(Terminator::GotoIndirect(label));
    }

    /// Ends the scan, suspended; the task's next scan goes on at the place, which has to be one of
    /// the [resume points](Self::resume_points) of each task that can come here.
    pub fn suspend(&mut self, place: Place) {
        let label = self.label(place);
        self.current.terminate(Terminator::Suspend(label));
    }

    /// Ends the scan; the task's next scan starts at its entry.
    pub fn ret(&mut self) {
        self.current.ret();
    }

    /// Stops the program with a code.
    pub fn trap(&mut self, code: TrapCode) {
        self.current.trap(code);
    }

    /// Adds a place at which the program may be stopped, for [`FuncBuilder::trap_at`], and returns its
    /// number. They are numbered from 0 in the order of these calls.
    pub fn trap_site(&mut self, site: TrapSite) -> u32 {
        self.module.trap_sites.push(site);
        self.module.trap_sites.len() as u32 - 1
    }

    /// The finished module. Places that were never bound lead to the end of the scan.
    pub fn finish(mut self) -> Module {
        self.finished.push(std::mem::replace(&mut self.current, FuncBuilder::new("")));
        self.bind_remaining_places();
        let mut stubs = FastMap::default();
        for (func, block, branch) in std::mem::take(&mut self.branches) {
            let mut resolve = |place: Place| self.resolve(func, place, &mut stubs);
            let terminator = match branch {
                Branch::Jump(place) => Terminator::Jump(BlockCall::plain(resolve(place))),
                Branch::Brif(cond, then, otherwise) => Terminator::Brif {
                    cond,
                    then: BlockCall::plain(resolve(then)),
                    otherwise: BlockCall::plain(resolve(otherwise)),
                },
                Branch::Switch(arg, targets, default) => Terminator::Switch {
                    arg,
                    targets: targets.into_iter().map(&mut resolve).collect(),
                    default: resolve(default),
                },
            };
            self.finished[func].set_terminator(block, terminator);
        }
        for data in &self.places {
            if let (Some(label), Some((func, block))) = (data.label, data.bound) {
                self.finished[func].add_entry(label, block);
            }
        }
        self.module.funcs = self.finished.into_iter().map(FuncBuilder::finish).collect();
        for func in &mut self.module.funcs {
            func.entries.sort_unstable();
        }
        drop_without_entry(&mut self.module.funcs);
        self.module
    }

    /// Binds the places that are not bound yet to the end of the scan.
    fn bind_remaining_places(&mut self) {
        let last = self.finished.len() - 1;
        for data in self.places.iter_mut().filter(|data| data.bound.is_none()) {
            let block = self.finished[last].create_block();
            data.bound = Some((last, block));
        }
    }

    /// The block of a function through which it branches to a place: the place's own block if that
    /// is in the function, else a stub, which is a block that only goes to the place's label.
    /// `stubs` holds the stubs that were made so far.
    fn resolve(
        &mut self,
        func: usize,
        place: Place,
        stubs: &mut FastMap<(usize, Place), Block>,
    ) -> Block {
        match self.places[place.0 as usize].bound {
            Some((owner, block)) if owner == func => block,
            _ => *stubs.entry((func, place)).or_insert_with(|| {
                let label = self.label(place);
                let block = self.finished[func].create_block();
                self.finished[func].set_terminator(block, Terminator::Goto(label));
                block
            }),
        }
    }
}

/// Drops the functions without entry: nothing can call them.
fn drop_without_entry(funcs: &mut Vec<FuncData>) {
    funcs.retain(|func| !func.entries.is_empty());
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Address, BinaryOp, IntCond, Type};

    fn regions() -> Vec<Region> {
        vec![Region { name: "vars".into(), offset: 0, size: 8, bits: false }]
    }

    #[test]
    fn a_function_begins_where_one_is_asked_for() {
        let mut b = ChunkBuilder::new(8, regions());
        let region = b.region("vars").unwrap();
        let (start, rare) = (b.place(), b.place());
        b.begin_function();
        b.bind(start);
        b.task("scan", start);
        let v = b.func().load(Type::I16, Address::fixed(region, 0));
        let cond = b.func().icmp_imm(IntCond::Eq, v, 0);
        let next = b.place();
        b.brif(cond, rare, next);
        b.bind(next);
        b.ret();
        b.begin_function();
        b.bind(rare);
        let v = b.func().load(Type::I16, Address::fixed(region, 2));
        b.func().store(Address::fixed(region, 0), v);
        b.ret();
        let module = b.finish();
        assert_eq!(module.funcs.len(), 2, "nothing is before the first place");
        assert!(module.label_targets().values().all(Option::is_some));
        assert_eq!(crate::verify::module(&module).first(), None);
    }

    #[test]
    fn a_long_program_is_cut_into_chunks_that_continue_each_other() {
        let mut b = ChunkBuilder::new(8, regions()).with_limit(4);
        let region = b.region("vars").unwrap();
        let (start, end) = (b.place(), b.place());
        b.bind(start);
        b.task("scan", start);
        for line in 1..=20 {
            b.statement(Statement { file: 0, line, start: 0, end: 0 });
            let v = b.func().load(Type::I16, Address::fixed(region, 0));
            let v = b.func().binary_imm(BinaryOp::Add, v, 1);
            b.func().store(Address::fixed(region, 0), v);
            if line == 10 {
                let cond = b.func().icmp_imm(IntCond::Eq, v, 0);
                let next = b.place();
                b.brif(cond, end, next);
                b.bind(next);
            }
        }
        b.bind(end);
        b.ret();
        let module = b.finish();
        assert!(module.funcs.len() > 5);
        assert!(module.label_targets().values().all(Option::is_some));
        assert_eq!(module.tasks[0].entry, 0);
    }
}
