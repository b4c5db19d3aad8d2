//! A folder with an artifact, and the loader that runs it.

use std::fs;
use std::path::PathBuf;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use plcc::compile;
use plcc::disk::Disk;
use plcc_abi::Dialect;
use plcc_codegen::{OptLevel, Target};
use plcc_diag::SourceMap;
use plcc_frontend::common::Options;
use plcc_tests::programs::program;

/// After this time a process that was to end is taken to hang. Where all is well nothing waits for it.
const HANGS: Duration = Duration::from_secs(600);

/// The loader, built once from the sources under test.
pub(crate) fn loader() -> PathBuf {
    program("plcrt")
}

/// A folder of a test, which goes away with it.
pub(crate) struct Shop(PathBuf);

impl Shop {
    /// A folder with the artifact `p.plcx`, compiled from a source.
    pub(crate) fn new(name: &str, dialect: Dialect, source: &str) -> Self {
        let path = std::env::temp_dir().join(format!("plcrt-{name}-{}", std::process::id()));
        fs::create_dir_all(&path).unwrap();
        let shop = Self(path);
        let mut sources = SourceMap::new();
        let file = sources.add("p", source.as_bytes());
        let options = Options::default();
        let (checked, diagnostics) =
            compile::check(&mut sources, &[file], dialect, &Disk, &options);
        let checked = checked.unwrap_or_else(|| panic!("{diagnostics:?}"));
        let lowered = checked.optimized(OptLevel::Speed).unwrap();
        let code = compile::code(&lowered, &Target::host_baseline().unwrap()).unwrap();
        fs::write(shop.path("p.plcx"), compile::artifact(&lowered.program, &code).unwrap())
            .unwrap();
        shop
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    pub(crate) fn read(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).unwrap()
    }

    /// The command `plcrt p.plcx ARGS` in the folder, without standard input and output.
    pub(crate) fn command(&self, args: &str) -> Command {
        let mut command = Command::new(loader());
        command.arg("p.plcx").args(args.split_whitespace()).current_dir(&self.0);
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        command
    }
}

impl Drop for Shop {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// Waits for a process that has to end by itself.
pub(crate) fn wait(child: &mut Child) -> ExitStatus {
    let start = Instant::now();
    loop {
        if let Some(status) = child.try_wait().unwrap() {
            return status;
        }
        if start.elapsed() > HANGS {
            child.kill().unwrap();
            panic!("the process does not end");
        }
        std::thread::sleep(Duration::from_millis(5));
    }
}
