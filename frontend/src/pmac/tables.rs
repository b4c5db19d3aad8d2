//! Fills the tables that the executive needs of a download.

use plcc_abi::pmac::{Kind, PmacTables, Program as PlcProgram, Run, Text, Variable};
use plcc_abi::{Program, Tables, Task};

use super::analyse::load::Loaded;
use super::ast::{Download, Op, Stmt, StmtKind, Target};
use super::fingerprint::fingerprint;
use super::host_statements;
use super::outputs;
use super::tasks::{TaskKind, tasks};

/// The program for the executive. `files` are the paths of its sources, `module_tasks` the tasks of
/// its code.
pub(crate) fn program(
    download: &Download,
    loaded: &Loaded,
    files: Vec<String>,
    module_tasks: Vec<Task>,
) -> Program {
    let tasks = tasks(download, loaded);
    let mut programs = Vec::new();
    let mut named = loaded.named.clone();
    let mut first_command = 0;
    for (task, (kind, code)) in (0u32..).zip(&tasks) {
        if let TaskKind::Plc { compiled, number } = *kind {
            let states = if compiled { loaded.plccs } else { loaded.plcs };
            let enabled = states.enabled & (1 << number) != 0;
            let paused = states.paused & (1 << number) != 0;
            let fingerprint = fingerprint(download, code);
            programs.push(PlcProgram { number, compiled, task, enabled, paused, fingerprint });
            add_named(download, code, &mut named);
            first_command = task + 1;
        }
    }
    named.sort_unstable();
    named.dedup();
    let mut texts = download.texts.clone();
    for text in &mut texts {
        if let Text::Command { task: Some(task), .. } = text {
            *task += first_command;
        }
    }
    let tables = PmacTables {
        controller: loaded.layout.controller,
        programs,
        texts,
        defines: download.defines.clone(),
        statements: host_statements::table(download, &tasks),
        ranges: loaded.ranges.clone(),
        l: download.l_defs.iter().map(|(&number, &def)| (u32::from(number), def)).collect(),
        named,
        initial: Run::pack(&loaded.image),
        sparse: loaded.sparse.clone(),
        save: loaded.save,
        outputs: outputs::outputs(download, loaded, tasks.iter().map(|(_, code)| *code)),
    };
    Program {
        files,
        image_size: loaded.layout.size,
        regions: loaded.layout.regions(),
        tasks: module_tasks,
        tables: Tables::Pmac(tables),
        names: vec![],
    }
}

/// Appends the variables that statements name to `named`, for dumps. A Q-variable is taken to
/// belong to the coordinate system of the last ADDRESS above it.
fn add_named(download: &Download, code: &[Stmt], named: &mut Vec<Variable>) {
    let mut system = 1;
    for stmt in code {
        let mut name = |kind: Kind, number: u16| {
            let system = if kind == Kind::Q { system } else { 1 };
            named.push(Variable { kind, number: u32::from(number), system });
        };
        if let StmtKind::Assign(Target::Var(kind, number), _) = stmt.kind {
            name(kind, number);
        }
        // ATAN2 reads Q0, which the text does not name.
        for op in stmt.kind.expressions().flat_map(|expr| download.ops(expr)) {
            if let Op::Var(kind, number) = *op {
                name(kind, number);
            }
        }
        if let StmtKind::Address(_, Some(number)) = stmt.kind {
            system = u32::from(number);
        }
    }
}
