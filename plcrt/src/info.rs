//! `plcrt info`: what an artifact holds.

use plcc_abi::{ABI_VERSION, printable};
use plcc_load::Inspection;

/// A line `key: value` for each thing that is known of an artifact. `verified` says that its signature
/// was checked.
pub(crate) fn info(artifact: &Inspection, verified: bool) -> String {
    let Inspection { program, code, debug, sources, operator, machine, digest, signed_by } =
        artifact;
    let operator = if operator.is_some() { "yes" } else { "no" };
    let digest: String = digest.iter().map(|byte| format!("{byte:02x}")).collect();
    let signature = match signed_by {
        None => "none".to_owned(),
        Some(key) if verified => format!("right, with the key {key}"),
        Some(key) => format!("says it is by the key {key}; --key PUBKEY checks it"),
    };
    let tasks: Vec<&str> = program.tasks.iter().map(|task| task.name.as_str()).collect();
    let features = match code.features.as_slice() {
        [] => "none beyond the architecture's".to_owned(),
        features => features.join(", "),
    };
    let runs = match machine {
        Ok(()) => "yes".to_owned(),
        Err(error) => format!("no: {error}"),
    };
    let lines = [
        ("language", program.dialect().name().to_owned()),
        ("sources", program.files.join(", ")),
        ("format version", ABI_VERSION.to_string()),
        ("architecture", code.architecture.clone()),
        ("processor features", features),
        ("runs on this machine", runs),
        ("digest", digest),
        ("signature", signature),
        ("entry points", tasks.join(", ")),
        ("process image", format!("{} bytes", program.image_size)),
        ("machine code", format!("{} bytes", code.bytes.len())),
        ("debug part", format!("{} bytes", debug.len())),
        ("text of the sources", format!("{} bytes", sources.len())),
        ("operator's screen", operator.to_owned()),
    ];
    // A line of its own for each, whatever the artifact's texts hold.
    let shown = |value: &str| printable(value).replace(['\n', '\t'], " ");
    lines.iter().map(|(key, value)| format!("{key}: {}\n", shown(value))).collect()
}
