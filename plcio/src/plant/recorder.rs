//! Answers queries of history: the values of variables at past ticks, which `plcc convert` makes from the record of the control, and
//! the record itself.

use std::ffi::OsString;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use plcc_configuration::drivers::zenoh::Settings;
use tokio::sync::Semaphore;
use zenoh::query::Query;

/// How long `plcc` may take for an answer.
const TIME: Duration = Duration::from_secs(60);
/// The longest answer, in bytes.
const MAX_ANSWER: u64 = 8 << 20;
/// How many bytes of a record are in a message.
const CHUNK: u64 = 256 << 10;
/// How many ticks are given when the query does not say from where.
const DEFAULT_TICKS: u64 = 1000;

/// The recorder. It does one thing at a time: whoever asks meanwhile is told so.
#[derive(Clone)]
pub(super) struct Recorder {
    settings: Arc<Settings>,
    base: Arc<str>,
    free: Arc<Semaphore>,
}

/// A process, which is killed when this is dropped.
struct Process(Arc<Mutex<Child>>);

impl Drop for Process {
    fn drop(&mut self) {
        let mut child = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let _ = child.kill();
        let _ = child.wait();
    }
}

/// What `plcc convert` is to write: its arguments after the name of the record.
///
/// # Errors
/// When a parameter is not a number, or there is none of that name.
fn arguments<'a>(
    parameters: impl Iterator<Item = (&'a str, &'a str)>,
    tick: u64,
) -> Result<Vec<OsString>, String> {
    let (mut from, mut to) = (None, None);
    let mut arguments = vec!["--to=csv".into(), "-o".into(), "-".into()];
    for (key, value) in parameters {
        let number =
            || value.parse::<u64>().map_err(|_| format!("`{value}` is not the number of a tick"));
        match key {
            "from" => from = Some(number()?),
            "to" => to = Some(number()?),
            "variables" => arguments.push(format!("--watch={value}").into()),
            _ => return Err(format!("there is no parameter `{key}`: from, to and variables")),
        }
    }
    let last = to.unwrap_or(tick);
    let first = from.unwrap_or(last.saturating_sub(DEFAULT_TICKS));
    arguments.push(format!("--from={first}").into());
    // The newest ticks are not in the file yet: then all that are there are given.
    if to.is_some() {
        arguments.push(format!("--until={last}").into());
    }
    Ok(arguments)
}

/// Runs `plcc convert` with these arguments, at the lowest priority.
///
/// # Errors
/// When it can't be started, refuses, takes too long or writes too much.
async fn convert(
    program: &Path,
    record: &Path,
    arguments: Vec<OsString>,
) -> Result<Vec<u8>, String> {
    let mut command = Command::new("nice");
    command.args(["-n", "19"]).arg(program).arg("convert").arg(record).args(arguments);
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let named = |error: std::io::Error| format!("{}: {error}", program.display());
    let mut child = command.spawn().map_err(named)?;
    let (output, errors) = (child.stdout.take(), child.stderr.take());
    let process = Process(Arc::new(Mutex::new(child)));
    let read = move || {
        let (mut answer, mut why) = (vec![], vec![]);
        if let Some(output) = output {
            output.take(MAX_ANSWER + 1).read_to_end(&mut answer)?;
        }
        if let Some(errors) = errors {
            errors.take(4096).read_to_end(&mut why)?;
        }
        Ok((answer, why))
    };
    let done = tokio::time::timeout(TIME, tokio::task::spawn_blocking(read)).await;
    let read: std::io::Result<_> = match done {
        Ok(Ok(read)) => read,
        Ok(Err(error)) => return Err(error.to_string()),
        Err(_) => return Err(format!("plcc has not ended after {} s", TIME.as_secs())),
    };
    let (answer, why) = read.map_err(named)?;
    if answer.len() as u64 > MAX_ANSWER {
        return Err(format!("the answer is longer than {MAX_ANSWER} bytes: ask for fewer ticks"));
    }
    let ended = process.0.lock().unwrap_or_else(PoisonError::into_inner).wait();
    if ended.map_err(named)?.success() {
        Ok(answer)
    } else {
        Err(String::from_utf8_lossy(&why).trim().to_owned())
    }
}

impl Recorder {
    pub(super) fn new(settings: Settings, base: &str) -> Self {
        Self { settings: Arc::new(settings), base: base.into(), free: Arc::new(Semaphore::new(1)) }
    }

    /// Answers a query of `history` with the values up to about this tick. Others are left to who answers them.
    pub(super) async fn history(self, query: Query, tick: u64) {
        let answer = match (&self.settings.history, self.free.try_acquire()) {
            (None, _) => Err("[plcio] has no key `zenoh-history`, which names plcc".into()),
            (_, Err(_)) => Err("another query is answered at the moment: ask again".into()),
            (Some(program), Ok(_permit)) => match arguments(query.parameters().iter(), tick) {
                Ok(arguments) => convert(program, &self.settings.record, arguments).await,
                Err(why) => Err(why),
            },
        };
        // Who has asked may have left.
        let _ = match answer {
            Ok(table) => query.reply(format!("{}/history", self.base), table).await,
            Err(why) => query.reply_err(why).await,
        };
    }

    /// Answers a query of `record/**` with both parts of the record, in pieces with numbers.
    pub(super) async fn record(self, query: Query) {
        let Ok(_permit) = self.free.try_acquire() else {
            let _ = query.reply_err("another query is answered at the moment: ask again").await;
            return;
        };
        let mut older = self.settings.record.clone().into_os_string();
        older.push(".1");
        // Both are opened first, so that no part is missing when the newer one takes the place of the older one.
        let parts = [("older", PathBuf::from(older)), ("newer", self.settings.record.clone())];
        let parts = parts.map(|(part, path)| (part, plcc_files::open_regular(&path)));
        for (part, file) in parts {
            let Ok(mut file) = file else { continue };
            for number in 0.. {
                let mut chunk = vec![];
                let read = Read::by_ref(&mut file).take(CHUNK).read_to_end(&mut chunk);
                if read.is_err() || chunk.is_empty() {
                    break;
                }
                let key = format!("{}/record/{part}/{number:06}", self.base);
                let Ok(key) = zenoh::key_expr::KeyExpr::try_from(key) else { break };
                if query.key_expr().intersects(&key) && query.reply(key, chunk).await.is_err() {
                    return;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn parameters_become_arguments() {
        let shown = |parameters: &[(&'static str, &'static str)]| {
            arguments(parameters.iter().copied(), 5000).map(|arguments| {
                let texts = arguments.iter().skip(3).map(|word| word.to_string_lossy());
                texts.collect::<Vec<_>>().join(" ")
            })
        };
        assert_eq!(shown(&[]).unwrap(), "--from=4000");
        assert_eq!(shown(&[("to", "70")]).unwrap(), "--from=0 --until=70");
        let all = [("variables", "A,@B"), ("from", "3"), ("to", "9")];
        assert_eq!(shown(&all).unwrap(), "--watch=A,@B --from=3 --until=9");
        assert!(shown(&[("from", "-1")]).is_err() && shown(&[("watch", "A")]).is_err());
    }

    #[tokio::test(flavor = "current_thread")]
    async fn what_plcc_says_is_the_answer_and_its_failure_the_reason() {
        let folder = std::env::temp_dir().join(format!("plcio-recorder-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let program = |name: &str, text: &str| {
            use std::os::unix::fs::PermissionsExt;
            let path = folder.join(name);
            std::fs::write(&path, format!("#!/bin/sh\n{text}\n")).unwrap();
            std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).unwrap();
            path
        };
        let record = Path::new("r.plcrec");
        let run = |program: PathBuf| async move {
            convert(&program, record, vec!["--from=1".into()]).await
        };
        let said = run(program("says", "echo \"$@\"")).await.unwrap();
        assert_eq!(said, b"convert r.plcrec --from=1\n");
        let why = run(program("refuses", "echo 'error: no' >&2; exit 2")).await;
        assert_eq!(why.unwrap_err(), "error: no");
        let much = run(program("much", "yes")).await;
        assert!(much.unwrap_err().contains("longer than"));
        assert!(!run(folder.join("none")).await.unwrap_err().is_empty());
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
