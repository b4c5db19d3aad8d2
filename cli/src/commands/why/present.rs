//! The answer for a control that runs and has no record: of what it tells itself, its values now.
//!
//! With the program's source, an executive of the program is given all of the control's values and runs on for a scan, so that
//! what holds a value now is found as in any other run. Since when it has the value is not known.

use std::collections::BTreeSet;

use plcc_frontend::CheckedProgram;
use plcc_host::args::RunArgs;
use plcc_host::run::{Player, Stimulus};
use plcc_host::session;
use plcc_replay::{ControlSocket, DebuggedProgram, Debugger, Launched, Session};
use plcc_runtime::{Executive, Purpose, Setting};
use plcc_why::{ChangedBy, Explanation, ForPeople, Number, Said};

use super::{answer, refused, run_command};
use crate::args::WhyArgs;
use crate::failure::Failure;
use crate::input::{Input, SourceSettings};
use crate::report::{Destination, Report};

/// The shortest tick in which all of a program is executed, in nanoseconds. In shorter ones a PMAC runs its up to 31 background
/// PLCs in turn, one a tick.
const WHOLE_SCAN_NS: u64 = 1_000_000;

/// How many of the shorter ticks are run.
const SHORT_TICKS: u64 = 40;

/// The answer; `None` if the source has errors, which are shown.
pub(super) fn explanation(
    args: &WhyArgs,
    control: &ControlSocket,
    report: &Report,
) -> Result<Option<Explanation>, Failure> {
    if args.tick.is_some() {
        return Err(Failure::usage(
            "the past of a control that runs is in its record: name that with --record",
        ));
    }
    let files = args.target.get(1..).unwrap_or_default();
    if files.is_empty() {
        report.note(
            "the control says what the value is; what holds it is in the program: name its source after the socket, or its \
             record with --record",
        );
        return value_alone(control, &args.name).map(Some);
    }
    let settings = SourceSettings::for_files(&args.source, files, report)?;
    let program = Input::read(files, &args.source)?.check(&settings)?;
    let to = Destination::from(args.source.message_format);
    let Some((checked, sources)) = program.without_errors(to, report)? else { return Ok(None) };
    let tables = checked.lower().map_err(Failure::from)?.program;
    let command = run_command(args)?;
    let run = RunArgs { machine_path: settings.machine.clone(), ..command.run.clone() };
    let make = || {
        session::simulated_executive(&tables, &run, settings.machine_file())
            .map_err(|error| Failure::usage(error.to_string()))
    };
    let (mut executive, view) = (make()?, make()?);
    let mut engine = checked.interpreter();
    // The first scan after power-up is another one.
    let _ = executive.tick(engine.as_mut(), &mut vec![]);
    let file = files.first().map(|file| file.display().to_string()).unwrap_or_default();
    let program = DebuggedProgram::new(checked.into_program(), sources, tables);
    let ticks = take_over(executive.as_mut(), program.checked(), control, &file)?;
    let last = if executive.tick_ns() < WHOLE_SCAN_NS { SHORT_TICKS - 1 } else { 0 };
    let player = Player::new(Stimulus::default(), false);
    let history = Launched::new(executive, engine, player, Some(last + 1));
    let mut debugger = Debugger::new(Session::offline(program, Box::new(history), view, true));
    debugger.history_mut().run_unobserved(last).map_err(refused)?;
    let explanation = answer(&mut debugger, args, last)?.of_present(ticks);
    if explanation.for_people.is_of_text {
        return Ok(Some(explanation));
    }
    let value = control.values(std::slice::from_ref(&explanation.name)).map_err(refused)?.1;
    let value = value.get(&explanation.name).and_then(|values| values.first().copied());
    if let Some(value) = value.filter(|value| *value != explanation.value.0) {
        report.note(&format!(
            "the control has {} = {} by now; the answer is for a scan with its values of tick {ticks}",
            explanation.name,
            Number(value)
        ));
    }
    Ok(Some(explanation))
}

/// The answer for a control of whose program nothing is known.
fn value_alone(control: &ControlSocket, name: &str) -> Result<Explanation, Failure> {
    if name.contains('"') {
        return Err(Failure::usage(
            "the texts of a program are in its source: name that after the socket, or the record with --record",
        ));
    }
    let (ticks, values) = control.values(&[name.to_owned()]).map_err(refused)?;
    let value = match values.get(name).map(Vec::as_slice) {
        Some([value]) => *value,
        _ => {
            return Err(Failure::usage(format!(
                "`{name}` is not one variable; name a single one, or an element of an array"
            )));
        }
    };
    let known = control.variables(name).map_err(refused)?.variables;
    let known = known.into_iter().next().unwrap_or_default();
    let canonical = if known.name.is_empty() { name.to_owned() } else { known.name };
    let line = match (known.alias.as_str(), known.text.as_str()) {
        ("", text) => text.to_owned(),
        (alias, "") => alias.to_owned(),
        (alias, text) => format!("{alias}: {text}"),
    };
    let status = control.status().map_err(refused)?;
    let is_forced = status.forces.iter().any(|force| force.name == canonical);
    Ok(Explanation {
        name: canonical,
        said: Said { alias: known.alias, text: known.text, line, ..Said::default() },
        value: Number(value),
        tick: ticks,
        since: ticks,
        file: None,
        line: None,
        because: vec![],
        changed_by: if is_forced { ChangedBy::Force { by: None } } else { ChangedBy::Unknown },
        would: vec![],
        for_people: ForPeople {
            is_logical: known.logical,
            is_of_present: true,
            ..ForPeople::default()
        },
    })
}

/// Gives an executive the values and the forces that a control has. Gives the number of ticks that the control has done.
fn take_over(
    executive: &mut dyn Executive,
    program: &dyn CheckedProgram,
    control: &ControlSocket,
    file: &str,
) -> Result<u64, Failure> {
    let status = control.status().map_err(refused)?;
    let own = format!("{:016x}", executive.fingerprint());
    if status.fingerprint != own {
        return Err(Failure::usage(format!(
            "{file} is another program than the one that the control runs ({})",
            status.program
        )));
    }
    let names = executive.names();
    let mut wanted: Vec<String> = names.declared().into_iter().map(|(name, _)| name).collect();
    // Parts that a dump does not show as variables, such as the counters of timers.
    let parts = wanted.iter().flat_map(|name| program.parts(name, executive.image()));
    let known: BTreeSet<&String> = wanted.iter().collect();
    let further: BTreeSet<String> =
        parts.map(|part| part.name).filter(|name| !known.contains(name)).collect();
    wanted.extend(further);
    let (ticks, values) = control.values(&wanted).map_err(refused)?;
    // The second time, since to set one can act on others: a clock on its flip-flop.
    for name in wanted.iter().chain(&wanted) {
        let (Some(values), Ok(key)) = (values.get(name), names.find(name, Purpose::Watch)) else {
            continue;
        };
        if names.find(name, Purpose::Stimulus).is_err() {
            continue;
        }
        for (key, &value) in names.elements(key).into_iter().zip(values) {
            let is_whole = value.fract() == 0.0 && value.abs() < 9e15;
            let setting = if is_whole { Setting::Int(value as i64) } else { Setting::Float(value) };
            executive.write(key, setting);
        }
    }
    for force in &status.forces {
        if let Ok(key) = names.find(&force.name, Purpose::Watch)
            && let Ok(setting) = names.parse(key, &force.value)
        {
            // A program with the same fingerprint can hold the same.
            let _ = executive.force(key, Some(setting));
        }
    }
    Ok(ticks)
}
