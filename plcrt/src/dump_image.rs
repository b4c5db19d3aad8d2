//! `plcrt dump-image`: the dump of a control that was killed, from its image file.

use std::path::Path;

use plcc_control::Watch;
use plcc_host::args::RunArgs;
use plcc_host::image_file::ImageReader;
use plcc_host::run::{dump_image, dump_image_alone};
use plcc_load::Inspection;
use plcc_runtime::Executive;

/// The dump of the image file `path`. With the artifact of its program the dump has what a dump of a run
/// has; without it, what the image file's own table names.
///
/// # Errors
/// Why there is none, for people.
pub(crate) fn dump(
    path: &Path,
    artifact: Option<&Inspection>,
    args: &RunArgs,
) -> Result<Vec<u8>, String> {
    let failed = |error: std::io::Error| format!("{}: {error}", path.display());
    let reader = ImageReader::open(path).map_err(failed)?;
    let mut text = vec![];
    match artifact {
        None => dump_image_alone(&mut text, &reader).map_err(failed)?,
        Some(artifact) => {
            let made = plcc_control::executive(&artifact.program, &args.control, false, None);
            let mut executive = made.map_err(|error| error.to_string())?;
            let executive: &mut dyn Executive = executive.as_mut();
            let watch = Watch::parse(&args.watch, &*executive.names())
                .map_err(|errors| errors.first().map_or_else(String::new, ToString::to_string))?;
            dump_image(&mut text, &reader, executive, &watch).map_err(failed)?;
        }
    }
    Ok(text)
}
