//! Runs all passes on modules in text form. What comes of `X.ir` is `X.after`; `scripts/full validate` compares the two.

use std::error::Error;
use std::fs;
use std::path::PathBuf;

use plcc_ir::passes::{OptLevel, optimize};
use plcc_ir::text::{parse, print};

fn main() -> Result<(), Box<dyn Error>> {
    for file in std::env::args_os().skip(1).map(PathBuf::from) {
        let text = fs::read_to_string(&file)?;
        let text = text.split("; becomes").next().unwrap_or_default();
        let Ok(mut module) = parse(text) else {
            eprintln!("{} is not a module", file.display());
            continue;
        };
        fs::write(&file, print(&module))?;
        optimize(&mut module, OptLevel::Speed);
        fs::write(file.with_extension("after"), print(&module))?;
    }
    Ok(())
}
