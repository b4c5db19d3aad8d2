//! Names of compiled functions for the profiler `perf`.
//!
//! With `PLCC_PERF=1` in the environment every [`NativeEngine`](crate::NativeEngine) appends its
//! functions to `/tmp/perf-PID.map`. `perf report` and `perf annotate` read the names of code that
//! belongs to no file there. A function has the name that it has in the IR, followed by the source
//! lines that it was made from.

use std::fmt::Write as _;
use std::fs::OpenOptions;
use std::io::Write as _;

use plcc_abi::{CodeLine, CodeParts};

/// The environment variable that asks for a map.
pub const VARIABLE: &str = "PLCC_PERF";

/// Whether the environment asks for a map.
pub(crate) fn is_wanted() -> bool {
    std::env::var_os(VARIABLE).is_some_and(|value| value == "1")
}

/// Appends code that lies at the address `base` to this process's map. When the file can't be
/// written, nothing is lost but the names in a profile.
pub(crate) fn write_map(code: &CodeParts, files: &[String], base: usize) {
    // The path is fixed in perf.
    let path = format!("/tmp/perf-{}.map", std::process::id());
    let file = OpenOptions::new().create(true).append(true).open(path);
    let _ = file.and_then(|mut file| file.write_all(map(code, files, base).as_bytes()));
}

/// The map's text: for each function a line with its address, length (both hexadecimal) and name.
fn map(code: &CodeParts, files: &[String], base: usize) -> String {
    let mut text = String::new();
    for function in &code.functions {
        let start = base + function.offset as usize;
        let _ = write!(text, "{start:x} {:x} plcc:{}", function.len, function.name);
        let end = function.offset + function.len;
        let from = code.lines.partition_point(|line| line.offset < function.offset);
        let to = code.lines.partition_point(|line| line.offset < end);
        let lines = code.lines.get(from..to).unwrap_or_default();
        if let Some(&CodeLine { offset: _, file, line }) = lines.first() {
            let last = lines.iter().map(|line| line.line).max().unwrap_or(line);
            let name = files.get(file as usize).map_or("", String::as_str);
            let _ = write!(text, " {name}:{line}-{last}");
        }
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use plcc_abi::{CodeLine, CodeParts, FunctionRange};

    #[test]
    fn functions_are_named_with_their_lines() {
        let function = |name: &str, offset| FunctionRange { name: name.into(), offset, len: 16 };
        let line = |offset, line| CodeLine { offset, file: 0, line };
        let code = CodeParts {
            functions: vec![function("chunk0", 0), function("chunk1", 16)],
            lines: Arc::new(vec![line(0, 3), line(8, 7)]),
            ..CodeParts::default()
        };
        let map = super::map(&code, &["a.pmi".into()], 0x1000);
        assert_eq!(map, "1000 10 plcc:chunk0 a.pmi:3-7\n1010 10 plcc:chunk1\n");
    }
}
