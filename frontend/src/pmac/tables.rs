//! Fills the tables that the executive needs of a download.

use plcc_abi::pmac::motion::{
    KinematicStep, Kinematics, MotionProgram, MotionStatement, MotionTables,
};
use plcc_abi::pmac::{CommandStep, Kind, PmacTables, Program as PlcProgram, Run, Text, Variable};
use plcc_abi::{Program, Tables, Task};
use plcc_diag::SourceMap;

use super::analyse::load::Loaded;
use super::ast::{Buffer, Download, Op, Stmt, StmtKind, Target};
use super::fingerprint::fingerprint;
use super::host_statements;
use super::outputs;
use super::tasks::{TaskKind, tasks};

/// The program for the executive. `files` are the paths of its sources, which `sources` has, `module_tasks`
/// the tasks of its code.
pub(crate) fn program(
    download: &Download,
    loaded: &Loaded,
    files: Vec<String>,
    module_tasks: Vec<Task>,
    sources: &SourceMap,
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
        } else if let TaskKind::Motion(_) = kind {
            add_named(download, code, &mut named);
        }
    }
    let kinematics = || download.kinematics.values().map(|buffer| buffer.code.as_slice());
    kinematics().for_each(|code| add_named(download, code, &mut named));
    named.sort_unstable();
    named.dedup();
    let mut texts = download.texts.clone();
    for text in &mut texts {
        let Text::Command { steps, .. } = text else { continue };
        for step in steps {
            if let CommandStep::Task(task) = step {
                *task += first_command;
            }
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
        motion: motion_tables(download, loaded, &tasks, sources),
        outputs: {
            let tasks = tasks.iter().map(|(_, code)| *code);
            outputs::outputs(download, loaded, tasks.chain(kinematics()))
        },
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

/// What concerns motors, coordinate systems and motion programs.
fn motion_tables(
    download: &Download,
    loaded: &Loaded,
    tasks: &[(TaskKind, &[Stmt])],
    sources: &SourceMap,
) -> MotionTables {
    let motion = &loaded.motion;
    // Where each statement of motion stands.
    let mut statements: Vec<MotionStatement> = download
        .motion
        .iter()
        .map(|stmt| MotionStatement {
            kind: stmt.kind.clone(),
            words: stmt.words.clone(),
            file: 0,
            line: 0,
        })
        .collect();
    let mut programs = Vec::new();
    for (&number, buffer) in &download.progs {
        for stmt in &buffer.code {
            let (StmtKind::Motion(index, _) | StmtKind::Loop(_, index)) = stmt.kind else {
                continue;
            };
            if let Some(statement) = statements.get_mut(index as usize) {
                let (span, _) = download.origins.place(stmt.at);
                statement.file = span.file.0;
                statement.line = sources.line(span.file, span.start);
            }
        }
        let is_it = |(kind, _): &(TaskKind, &[Stmt])| *kind == TaskKind::Motion(number);
        let task = tasks.iter().position(is_it).map(|task| task as u32);
        programs.push(MotionProgram {
            number,
            task,
            labels: labels(buffer),
            fingerprint: fingerprint(download, &buffer.code),
        });
    }
    MotionTables {
        kinematics: kinematics(download),
        programs,
        statements,
        commands: download.motion_commands.clone(),
        start: motion.start.clone(),
        definitions: motion.definitions.iter().map(|(&motor, &own)| (motor, own)).collect(),
        transformations: motion.transformations,
        modes: motion.modes.iter().map(|(&system, &modes)| (system, modes)).collect(),
        image: motion.image.clone(),
        sparse: motion.sparse.clone(),
    }
}

/// The kinematic programs that have statements.
fn kinematics(download: &Download) -> Vec<Kinematics> {
    let ops = |expr| download.ops(expr).to_vec();
    let step = |stmt: &Stmt| {
        Some(match stmt.kind {
            StmtKind::Assign(Target::Indirect(kind, number), value) => {
                KinematicStep::AssignIndirect { kind, number: ops(number), value: ops(value) }
            }
            StmtKind::Assign(Target::Var(kind, first), value) => {
                KinematicStep::Assign { kind, first, count: 1, step: 1, value: ops(value) }
            }
            StmtKind::Assign(Target::Range { kind, first, count, step }, value) => {
                KinematicStep::Assign { kind, first, count, step, value: ops(value) }
            }
            StmtKind::If(condition, to) | StmtKind::While(condition, to) => {
                KinematicStep::Unless(ops(condition), to)
            }
            StmtKind::Jump(to) | StmtKind::EndWhile(to) => KinematicStep::Jump(to),
            // The reader has refused all others.
            _ => return None,
        })
    };
    let programs = download.kinematics.iter().filter(|(_, buffer)| !buffer.code.is_empty());
    let program = |(&(system, inverse), buffer): (&(u8, bool), &Buffer)| Kinematics {
        system,
        inverse,
        steps: buffer.code.iter().filter_map(step).collect(),
    };
    programs.map(program).collect()
}

/// The labels of a motion program by rising number, each with its resume point. The first of a number counts.
fn labels(buffer: &Buffer) -> Vec<(u32, u32)> {
    let points = buffer.resume_points();
    let mut labels: Vec<(u32, u32)> = Vec::new();
    for &(number, index, _) in &buffer.labels {
        let Ok(point) = points.binary_search(&index) else { continue };
        if let Err(at) = labels.binary_search_by_key(&number, |(label, _)| *label) {
            labels.insert(at, (number, point as u32));
        }
    }
    labels
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
