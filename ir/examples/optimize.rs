//! Runs the passes on modules in text form, in up to three ways: `X.after` is what they make of `X.ir` in their order, `X-long.after` what they
//! make of it as if it were long, if that is something else, and `X-alone.after` what the passes make of it that a line `; passes NAME…` names.
//! Beside each is the module before them, as `.ir`. `scripts/full validate` compares the two.

use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};

use plcc_ir::Module;
use plcc_ir::passes::{OptLevel, Pass, PassOptions, optimize, run};
use plcc_ir::text::{parse, print};

/// Writes a module before and after passes; the name of the files has a word behind that of the module's file.
fn write(file: &Path, word: &str, before: &str, after: &Module) -> Result<(), Box<dyn Error>> {
    let stem = file.file_stem().unwrap_or_default().to_string_lossy();
    let file = file.with_file_name(format!("{stem}{word}.ir"));
    fs::write(&file, before)?;
    Ok(fs::write(file.with_extension("after"), print(after))?)
}

fn main() -> Result<(), Box<dyn Error>> {
    for file in std::env::args_os().skip(1).map(PathBuf::from) {
        let text = fs::read_to_string(&file)?;
        let text = text.split("; becomes").next().unwrap_or_default();
        let Ok(module) = parse(text) else {
            eprintln!("{} is not a module", file.display());
            continue;
        };
        let before = print(&module);
        // The passes that are named come first: another pass may keep what one does wrong from being reached, or may stop.
        let names = text.lines().find_map(|line| line.strip_prefix("; passes "));
        let passes: Option<Vec<Pass>> =
            names.and_then(|names| names.split_whitespace().map(Pass::from_name).collect());
        if let Some(passes) = passes {
            let mut after = module.clone();
            run(&mut after, &passes);
            write(&file, "-alone", &before, &after)?;
        }
        let options = PassOptions::from(OptLevel::Speed);
        let (mut usual, mut long) = (module.clone(), module);
        optimize(&mut usual, options);
        write(&file, "", &before, &usual)?;
        optimize(&mut long, PassOptions { by_length: false, ..options });
        if print(&long) != print(&usual) {
            write(&file, "-long", &before, &long)?;
        }
    }
    Ok(())
}
