//! `plcc key`: makes keys with which artifacts are signed.

use crate::args::KeyCommand;
use crate::failure::{DONE, Failure};
use crate::output;
use crate::signing;

pub(crate) fn key(command: &KeyCommand) -> Result<u8, Failure> {
    let KeyCommand::New { path } = command;
    let public = signing::new_key(path)?;
    output::print(format!("{public}\n").as_bytes())?;
    Ok(DONE)
}
