//! `plcio checkout`: goes through the wires with two people, one at the machine and one at the screen. Each input is switched, each
//! output driven after a question, and what was seen goes into a protocol with times.
//!
//! Nothing moves that was not asked for. The outputs are held by forces at what they are before the first question, so that
//! the program can move none of them, whatever the inputs do meanwhile. Only the output that was agreed to is driven, and it
//! goes back to what it was before the next question. At the end the outputs stay held until somebody agrees to give them
//! back to the program.

use std::fs::File;
use std::io::{BufRead, Write};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, SystemTime};

use plcc_abi::printable;
use plcc_configuration::{Configuration, Entry, Mistakes, Point, points};
use plcc_image::{ImageReader, Number, State, Symbol};
use plcc_protocol::{Assignment, Client, ClientError, Done, Request, Status};

/// How often inputs are looked at.
const LOOK: Duration = Duration::from_millis(20);
/// How long the control has for an answer.
const ANSWER: Duration = Duration::from_secs(5);
/// How many outputs can be held.
const MAX_OUTPUTS: usize = 256;

/// Goes through the wires of a configuration.
///
/// # Errors
/// When the configuration has mistakes, the control can't be reached or does not allow forces, or the protocol can't be
/// written.
pub(crate) fn checkout(path: &Path, protocol: Option<PathBuf>) -> Result<(), String> {
    let (configuration, findings) = Configuration::open(path)?;
    let mut mistakes = findings.for_plcio();
    let Configuration { image, socket, entries, .. } = configuration;
    let image =
        image.ok_or("the configuration has no key `image`, by which the inputs are seen")?;
    let socket =
        socket.ok_or("the configuration has no key `socket`, by which outputs are driven")?;
    let reader = ImageReader::open(&image)
        .map_err(|error| format!("{}: {error}; start the control first", image.display()))?;
    let wired = wired(&entries, &reader);
    mistakes.extend(wired.1);
    if !mistakes.is_empty() {
        mistakes.sort();
        return Err(Mistakes(path, &mistakes).to_string());
    }
    let wired = wired.0;
    let client = Client::connect(&socket, ANSWER).map_err(|error| error.to_string())?;
    let to = protocol.unwrap_or_else(|| path.with_extension(format!("checkout-{}.csv", stamp())));
    let is_there = to.exists();
    if is_there {
        return Err(format!(
            "{}: it is there already; --protocol names another file",
            to.display()
        ));
    }
    let file = plcc_files::open_output(&to, false)
        .map_err(|error| format!("{}: {}", to.display(), plcc_files::why_not_written(&error)))?;
    let mut work = Work { reader, client, socket, file, lines: typed(), wired };
    work.note(["time", "side", "name", "point", "result", "remark"])?;
    work.run()?;
    say(&format!("The protocol is {}.\n", to.display()));
    Ok(())
}

/// The points of the entries, and what is wrong with them.
fn wired(
    entries: &[Entry],
    reader: &ImageReader,
) -> (Vec<Point>, Vec<plcc_configuration::Mistake>) {
    let ends_in_bit = plcc_abi::Dialect::ALL
        .get(reader.dialect() as usize)
        .is_some_and(|dialect| dialect.names_end_in_bits());
    let checked = points(entries, &reader.symbols(), ends_in_bit, &[]);
    (checked.points, checked.mistakes)
}

/// A time for the name of a file.
fn stamp() -> String {
    let time = humantime::format_rfc3339_seconds(SystemTime::now()).to_string();
    time.replace([':', '-'], "")
}

/// The lines that are typed, until the end of the input.
fn typed() -> Receiver<String> {
    let (send, receive) = channel();
    // It ends with the process: a read of a terminal can't be interrupted.
    std::thread::spawn(move || {
        for line in std::io::stdin().lock().lines() {
            let Ok(line) = line else { return };
            if send.send(line.trim().to_owned()).is_err() {
                return;
            }
        }
    });
    receive
}

fn say(text: &str) {
    let mut out = std::io::stdout().lock();
    // Where nobody reads, nobody is asked: then no answer comes.
    let _ = out.write_all(printable(text).as_bytes()).and_then(|()| out.flush());
}

/// Why the work ends before its end.
struct Ended;

/// What has become of a wire.
struct Found {
    result: &'static str,
    remark: String,
}

struct Work {
    reader: ImageReader,
    client: Client,
    socket: PathBuf,
    file: File,
    lines: Receiver<String>,
    wired: Vec<Point>,
}

impl Work {
    fn run(&mut self) -> Result<(), String> {
        let status: Status = self.ask(&Request::Status {})?;
        if !status.allow.iter().any(|word| word == "force") {
            return Err(
                "the control was started without --allow force, so no output can be driven".into(),
            );
        }
        if !status.forces.is_empty() {
            return Err(
                "the control has forces in effect; end them first: plcctl SOCKET unforce --all"
                    .into(),
            );
        }
        let outputs = self.wired.iter().filter(|point| !point.is_input);
        let outputs: Vec<Symbol> = outputs.map(|point| point.symbol.clone()).collect();
        if outputs.len() > MAX_OUTPUTS {
            return Err(format!(
                "there are more than {MAX_OUTPUTS} outputs, which can't be held at once"
            ));
        }
        let inputs = self.wired.len() - outputs.len();
        say(&format!(
            "{inputs} inputs and {} outputs. The outputs will be held at what they are now, whatever the program says. Begin? (yes) ",
            outputs.len()
        ));
        if !self.is_agreed() {
            say("Nothing was done.\n");
            return self.row(["begin", "", "", "not begun", ""]);
        }
        let held = outputs.iter().map(|symbol| Ok((symbol.name.clone(), self.value(symbol)?)));
        let held: Vec<(String, Number)> = held.collect::<Result<_, String>>()?;
        self.force(&held).map_err(|why| format!("the outputs can't be held: {why}"))?;
        self.row(["begin", "", "", "outputs held", &format!("{} outputs", held.len())])?;
        let ended = self.each()?.is_err();
        if !ended {
            for person in ["first", "second"] {
                say(&format!("Name of the {person} person: "));
                let name = self.line().unwrap_or_default();
                self.row([
                    "signed",
                    &name,
                    "",
                    if name.is_empty() { "no name" } else { "yes" },
                    "",
                ])?;
            }
        }
        say("Give the outputs back to the program? They become what it assigns at once. (yes) ");
        if self.is_agreed() {
            let _: Done = self.ask(&Request::Unforce { names: vec![], all: true })?;
            self.row(["end", "", "", "outputs given back", ""])
        } else {
            say("\nThe outputs stay held; `plcctl SOCKET unforce --all` gives them back.\n");
            let how = if ended { "ended early, outputs stay held" } else { "outputs stay held" };
            self.row(["end", "", "", how, ""])
        }
    }

    /// Goes through all wires in their order.
    fn each(&mut self) -> Result<Result<(), Ended>, String> {
        for point in self.wired.clone() {
            let found = match point.is_input {
                true => self.input(&point)?,
                false => self.output(&point)?,
            };
            let Ok(Found { result, remark }) = found else { return Ok(Err(Ended)) };
            let side = if point.is_input { "input" } else { "output" };
            let at = format!("{} {}", point.entry.driver.name(), point.entry.address);
            self.row([side, &point.symbol.name, &at, result, &remark])?;
        }
        Ok(Ok(()))
    }

    /// What a wire is called, and what is said of it.
    fn title(point: &Point) -> String {
        let Point { symbol, entry, .. } = point;
        let alias = symbol.aliases.first().map(|alias| format!(" {alias}")).unwrap_or_default();
        let said = match entry.description.as_str() {
            "" => String::new(),
            text => format!(" ({text})"),
        };
        format!("{}{alias}{said} at {} {}", symbol.name, entry.driver.name(), entry.address)
    }

    /// Waits until an input has another value.
    fn input(&mut self, point: &Point) -> Result<Result<Found, Ended>, String> {
        let before = self.value(&point.symbol)?;
        say(&format!(
            "\nInput {}: it is {before}. Switch it. (s skips it, f notes a fault) ",
            Self::title(point)
        ));
        let others: Vec<Symbol> =
            self.wired.iter().filter(|other| other.is_input).map(|p| p.symbol.clone()).collect();
        let mut seen: Vec<Number> =
            others.iter().map(|symbol| self.value(symbol)).collect::<Result<_, _>>()?;
        let mut strangers: Vec<String> = vec![];
        loop {
            for (symbol, last) in others.iter().zip(&mut seen) {
                let now = self.value(symbol)?;
                if now == *last {
                    continue;
                }
                *last = now;
                if symbol.name == point.symbol.name {
                    say(&format!("\n{} is {now}.\n", symbol.name));
                    return Ok(Ok(Found {
                        result: "switched",
                        remark: [format!("{before} to {now}")]
                            .into_iter()
                            .chain(strangers)
                            .collect::<Vec<_>>()
                            .join("; "),
                    }));
                }
                say(&format!("\n{} is {now}, not {}. ", symbol.name, point.symbol.name));
                strangers.push(format!("{} became {now}", symbol.name));
            }
            match self.lines.recv_timeout(LOOK) {
                Ok(line) if line == "s" => {
                    return Ok(Ok(Found { result: "passed over", remark: strangers.join("; ") }));
                }
                Ok(line) if line == "f" => {
                    return Ok(Ok(Found { result: "fault", remark: strangers.join("; ") }));
                }
                Ok(_) => say("\nSwitch the input, or type s or f. "),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return Ok(Err(Ended)),
            }
        }
    }

    /// Drives an output after a question, asks what was seen, and gives it its value from before.
    fn output(&mut self, point: &Point) -> Result<Result<Found, Ended>, String> {
        let Point { symbol, .. } = point;
        let before = self.value(symbol)?;
        let is_bit = symbol.outside().is_bit();
        let wanted = match (is_bit, before) {
            (true, Number::Int(value)) => Number::Int(1 - value),
            _ => {
                say(&format!(
                    "\nOutput {}: it is {before}. Drive it to which number? (s skips it) ",
                    Self::title(point)
                ));
                let Some(line) = self.line() else { return Ok(Err(Ended)) };
                match line
                    .parse::<i64>()
                    .map(Number::Int)
                    .or_else(|_| line.parse().map(Number::Float))
                {
                    Ok(number) if symbol.takes(number) => number,
                    _ => return Ok(Ok(Found { result: "passed over", remark: String::new() })),
                }
            }
        };
        say(&format!(
            "\nOutput {}: it is {before}. DRIVE IT TO {wanted}? (yes drives it, anything else skips it) ",
            Self::title(point)
        ));
        let Some(line) = self.line() else { return Ok(Err(Ended)) };
        if !is_yes(&line) {
            return Ok(Ok(Found { result: "passed over", remark: String::new() }));
        }
        self.force(&[(symbol.name.clone(), wanted)])?;
        say(&format!("{} is {wanted}. Has it acted? (yes, or what was seen) ", symbol.name));
        let seen = self.line();
        // It goes back whatever was answered.
        self.force(&[(symbol.name.clone(), before)])?;
        let driven = format!("driven to {wanted} and back to {before}");
        Ok(match seen {
            None => {
                self.row(["output", &symbol.name, "", "no answer", &driven])?;
                Err(Ended)
            }
            Some(line) if is_yes(&line) => Ok(Found { result: "acted", remark: driven }),
            Some(line) => Ok(Found { result: "fault", remark: format!("{driven}; {line}") }),
        })
    }

    /// The present value of a variable's lines.
    fn value(&self, symbol: &Symbol) -> Result<Number, String> {
        let runs = matches!(self.reader.state(), Some(State::Running | State::Prepared));
        let tick =
            self.reader.read().filter(|_| runs).ok_or("the control does not run any more")?;
        tick.output(symbol).ok_or_else(|| format!("{} can't be read", symbol.name))
    }

    fn ask<T: serde::de::DeserializeOwned>(&mut self, request: &Request) -> Result<T, String> {
        let first = match self.client.ask(request) {
            Ok(answer) => return Ok(answer),
            Err(error @ ClientError::Refused(_)) => return Err(error.to_string()),
            Err(ClientError::Unreachable(_)) => Client::connect(&self.socket, ANSWER),
        };
        // People take their time, and a connection on which nothing is said for long may be closed.
        self.client = first.map_err(|error| error.to_string())?;
        self.client.ask(request).map_err(|error| error.to_string())
    }

    fn force(&mut self, values: &[(String, Number)]) -> Result<(), String> {
        if values.is_empty() {
            return Ok(());
        }
        let assignment = |(name, value): &(String, Number)| Assignment {
            name: name.clone(),
            value: match value {
                Number::Int(number) => (*number).into(),
                Number::Float(number) => (*number).into(),
            },
        };
        let values = values.iter().map(assignment).collect();
        let _: Done = self.ask(&Request::Force { values })?;
        Ok(())
    }

    /// The next line that is typed; `None` at the end of the input.
    fn line(&mut self) -> Option<String> {
        self.lines.recv().ok()
    }

    fn is_agreed(&mut self) -> bool {
        self.line().is_some_and(|line| is_yes(&line))
    }

    /// Writes a row of the protocol with the time.
    fn row(&mut self, cells: [&str; 5]) -> Result<(), String> {
        let time = humantime::format_rfc3339_seconds(SystemTime::now()).to_string();
        let [side, name, point, result, remark] = cells;
        self.note([&time, side, name, point, result, remark])
    }

    fn note(&mut self, cells: [&str; 6]) -> Result<(), String> {
        let cell = |text: &str| match text.contains([',', '"']) {
            true => format!("\"{}\"", printable(text).replace('"', "\"\"")),
            false => printable(text).into_owned(),
        };
        let line = format!("{}\n", cells.map(cell).join(","));
        let written = self.file.write_all(line.as_bytes());
        written.map_err(|error| format!("the protocol can't be written: {error}"))
    }
}

fn is_yes(line: &str) -> bool {
    ["y", "yes"].iter().any(|yes| line.eq_ignore_ascii_case(yes))
}
