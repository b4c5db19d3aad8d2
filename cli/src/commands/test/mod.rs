//! `plcc test`: runs test scripts.

mod broken;
mod coverage;
mod from_record;
mod parallel;
mod program;
mod records;
pub(crate) mod scripts;
mod search;

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::time::Instant;

use plcc_abi::Engine;
use plcc_diag::SourceMap;
use plcc_plctest::coverage::{Counts as CoverageCounts, Map, ObservedEngine};
use plcc_plctest::report::{self, Counts, Ran};
use plcc_plctest::{PlannedTest, run_test};

use crate::args::{FormatArg, TestArgs};
use crate::failure::{DONE, ERRORS, Failure, USAGE};
use crate::output;
use crate::report::{Destination, Report};
use coverage::CoverageFile;
use parallel::parallel;
use program::TestProgram;
use scripts::{Scripts, TestScript};

pub(crate) fn test(args: &TestArgs, report: &Report) -> Result<u8, Failure> {
    if let Some(record) = &args.from {
        return from_record::from_record(record, args, report);
    }
    if args.output.is_some() && args.search.is_none() {
        return Err(Failure::usage("-o names the script that --from or --search writes"));
    }
    let mut paths = args.paths.clone();
    let coverage_file = CoverageFile::of(args, &mut paths)?;
    if paths.is_empty() {
        return Err(Failure::usage("no script is named: plcc test SCRIPT…"));
    }
    let paths = scripts::find(&paths)?;
    let mut scripts = Scripts::default();
    for path in &paths {
        scripts.read(path, args, report)?;
    }
    let to = Destination::from(args.source.message_format);
    if !scripts.found.is_empty() {
        let findings: Vec<_> =
            scripts.found.iter().map(|(sources, found)| (sources, found.as_slice())).collect();
        let count = report.show_all(&findings, to)?;
        report.message(&format!("{count}: no test is run"));
        return Ok(USAGE);
    }
    let jobs = jobs(&scripts.scripts, args.filter.as_deref());
    if jobs.is_empty() {
        return Err(Failure::usage(match &args.filter {
            Some(filter) => format!("no test has a name that contains `{filter}`"),
            None => "the scripts have no tests".into(),
        }));
    }
    if let Some(seconds) = args.search {
        return search::search(seconds, &jobs, &scripts.programs, args, report);
    }
    let maps: Vec<Map> = match args.coverage {
        None => vec![],
        Some(_) => {
            scripts.programs.iter().map(|p| Map::new(p.checked.as_ref(), &p.sources)).collect()
        }
    };
    let (mut all, counts): (Vec<Ran>, Vec<_>) =
        run_all(&jobs, &scripts.programs, &maps)?.into_iter().unzip();
    if args.broken && Counts::of(&all).failed == 0 {
        return broken::broken(&jobs, &scripts.programs, args, report);
    }
    records::record_failures(&mut all, &jobs, &scripts.programs, args, report)?;
    let mut shown = !args.junit.as_deref().is_some_and(output::is_stdout);
    if let Some(path) = &args.junit {
        let text = report::junit(&all).map_err(Failure::internal)?;
        output::write(path, text.as_bytes(), &SourceMap::new(), &paths)?;
    }
    let covered = coverage::coverage(&jobs, &counts, &scripts.programs, &maps);
    if let Some(file) = &coverage_file {
        file.write(&covered, &paths)?;
        shown &= !file.is_stdout();
    }
    if shown {
        let mut text = match args.source.message_format {
            FormatArg::Json => report::json(&all),
            FormatArg::Human => report::human(&all, &|word, good| {
                report.paint_result(word, if good { "32" } else { "31;1" })
            }),
        };
        if !maps.is_empty() && args.source.message_format == FormatArg::Human {
            text.push_str(&format!("{}\n", coverage::summary(&covered).line()));
        }
        output::print(text.as_bytes())?;
    }
    Ok(if Counts::of(&all).failed == 0 { DONE } else { ERRORS })
}

/// A test that is to be run.
struct Job<'s> {
    script: &'s TestScript,
    test: &'s PlannedTest,
}

/// The tests whose names contain a text.
fn jobs<'s>(scripts: &'s [TestScript], filter: Option<&str>) -> Vec<Job<'s>> {
    let all = scripts
        .iter()
        .flat_map(|script| script.plan.tests.iter().map(move |test| Job { script, test }));
    all.filter(|job| filter.is_none_or(|filter| job.test.name.contains(filter))).collect()
}

/// Runs tests, as many at a time as there are processors.
/// With `maps` of the programs, counts coverage.
fn run_all<'m>(
    jobs: &[Job<'_>],
    programs: &[TestProgram],
    maps: &'m [Map],
) -> Result<Vec<(Ran, Option<CoverageCounts>)>, Failure> {
    let missing = || Failure::internal("a test is not there");
    parallel(jobs.len(), |number, engines: &mut HashMap<usize, TestEngine<'m>>| {
        run(jobs.get(number).ok_or_else(missing)?, programs, maps, engines)
    })
}

/// The engine of a program, in one thread.
enum TestEngine<'m> {
    /// The one that the options name.
    Plain(Box<dyn Engine>),
    /// One that counts coverage.
    Counting(Box<ObservedEngine<'m>>),
}

/// Runs one test.
fn run<'m>(
    job: &Job<'_>,
    programs: &[TestProgram],
    maps: &'m [Map],
    engines: &mut HashMap<usize, TestEngine<'m>>,
) -> Result<(Ran, Option<CoverageCounts>), Failure> {
    let number = job.script.program;
    let program = programs.get(number).ok_or_else(|| Failure::internal("a test has no program"))?;
    let engine = match engines.entry(number) {
        Entry::Occupied(entry) => entry.into_mut(),
        Entry::Vacant(entry) => entry.insert(match maps.get(number) {
            Some(map) => {
                TestEngine::Counting(Box::new(ObservedEngine::new(program.checked.as_ref(), map)))
            }
            None => TestEngine::Plain(program.engine().map_err(Failure::usage)?),
        }),
    };
    let begun = Instant::now();
    let plan = &job.script.plan;
    let (outcome, counts) = match engine {
        TestEngine::Plain(engine) => (run_test(plan, job.test, program, engine.as_mut()), None),
        TestEngine::Counting(engine) => {
            let outcome = run_test(plan, job.test, program, engine.as_mut());
            (outcome, Some(engine.take()))
        }
    };
    let ran = Ran {
        script: job.script.path.clone(),
        name: job.test.name.clone(),
        line: job.test.line,
        outcome,
        why: None,
        record: None,
        took: begun.elapsed(),
    };
    Ok((ran, counts))
}
