//! A C program that runs as a process of its own beside the benchmark, and measures itself when the
//! benchmark sends it a command. The benchmark waits meanwhile, so that programs are measured in turns.

use std::error::Error;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use super::{Inputs, Kernel, c, patterns};

/// A compiler and its level of optimisation.
#[derive(Clone, Debug)]
pub struct Compiler {
    /// The command.
    pub command: String,
    /// `-O2` or `-O3`.
    pub level: &'static str,
}

impl Compiler {
    /// The compilers among these commands that are installed, each with `-O2` and `-O3`.
    pub fn installed(commands: &[&str]) -> Vec<Self> {
        let works = |command: &&&str| {
            let mut probe = Command::new(command);
            let probe = probe.arg("--version").stdout(Stdio::null()).stderr(Stdio::null());
            probe.status().is_ok_and(|status| status.success())
        };
        let levels = ["-O2", "-O3"];
        let both = |command: &&str| levels.map(|level| Self { command: (*command).into(), level });
        commands.iter().filter(works).flat_map(both).collect()
    }

    /// A short name for tables.
    pub fn name(&self) -> String {
        format!("{} {}", self.command, self.level)
    }
}

/// A running C program.
pub struct CProcess {
    child: Child,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
}

impl CProcess {
    /// Compiles the C of a kernel in a folder and starts it. The patterns of the inputs are made
    /// from the seed.
    ///
    /// # Errors
    /// When the compiler fails or the program cannot be started.
    pub fn start(
        kernel: &Kernel,
        compiler: &Compiler,
        folder: &Path,
        seed: u64,
    ) -> Result<Self, Box<dyn Error>> {
        let name = compiler.name().replace(' ', "");
        // Each program has its own files, since an earlier one may still be reading its own.
        let (source, data) = (folder.join("kernel.c"), folder.join(format!("{name}.patterns")));
        let program = folder.join(name);
        std::fs::write(&source, c::program(kernel))?;
        std::fs::write(&data, pattern_bytes(kernel, seed))?;
        let mut command = Command::new(&compiler.command);
        command.args([compiler.level, "-w", "-fno-strict-aliasing", "-o"]);
        let status = command.arg(&program).arg(&source).status()?;
        if !status.success() {
            return Err(format!("{} failed", compiler.name()).into());
        }
        let mut child = Command::new(&program)
            .arg(&data)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()?;
        let input = child.stdin.take().ok_or("no input")?;
        let output = BufReader::new(child.stdout.take().ok_or("no output")?);
        Ok(Self { child, input, output })
    }

    /// Sends a command and gives the line that the program answers.
    fn ask(&mut self, command: &str) -> Result<String, Box<dyn Error>> {
        writeln!(self.input, "{command}")?;
        self.input.flush()?;
        let mut line = String::new();
        self.output.read_line(&mut line)?;
        Ok(line.trim().to_owned())
    }

    /// Runs scans of a variant; gives nanoseconds a scan.
    ///
    /// # Errors
    /// When the program has ended.
    pub fn run(
        &mut self,
        variant: usize,
        inputs: Inputs,
        scans: usize,
        cold: bool,
    ) -> Result<f64, Box<dyn Error>> {
        let word = if cold { "cold" } else { "run" };
        let answer = self.ask(&format!("{word} {variant} {} {scans}", inputs as usize))?;
        let ns = answer.parse::<f64>()?;
        Ok(if cold { ns } else { ns / scans as f64 })
    }

    /// Makes all variables of a variant 0, runs scans, and gives bits, words and elements.
    ///
    /// # Errors
    /// When the program has ended.
    pub fn state_after(
        &mut self,
        variant: usize,
        inputs: Inputs,
        scans: usize,
    ) -> Result<Vec<f64>, Box<dyn Error>> {
        writeln!(self.input, "reset {variant}")?;
        self.run(variant, inputs, scans, false)?;
        let answer = self.ask(&format!("state {variant}"))?;
        Ok(answer.split_whitespace().map(str::parse).collect::<Result<_, _>>()?)
    }
}

impl Drop for CProcess {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The patterns as the C program reads them: for each kind of inputs and each scan the bits, a byte
/// each, and the words.
fn pattern_bytes(kernel: &Kernel, seed: u64) -> Vec<u8> {
    let mut out = vec![];
    for inputs in Inputs::ALL {
        for pattern in patterns(kernel, inputs, seed) {
            let room = kernel.inputs.next_multiple_of(2).max(2);
            out.extend(&pattern.bits);
            out.resize(out.len() + room - pattern.bits.len(), 0);
            out.extend(pattern.words.iter().flat_map(|word| word.to_le_bytes()));
            if pattern.words.is_empty() {
                out.extend([0, 0]);
            }
        }
    }
    out
}
