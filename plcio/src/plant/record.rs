//! Answers queries of the record of the control, with the file itself in pieces.

use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use tokio::sync::Semaphore;
use zenoh::query::Query;

/// How many bytes of a record are in a message.
const CHUNK: u64 = 256 << 10;

/// The record of the control. One query is answered at a time: whoever asks meanwhile is told so.
#[derive(Clone)]
pub(super) struct Record {
    path: Arc<Path>,
    base: Arc<str>,
    free: Arc<Semaphore>,
}

impl Record {
    pub(super) fn new(path: &Path, base: &str) -> Self {
        Self { path: path.into(), base: base.into(), free: Arc::new(Semaphore::new(1)) }
    }

    /// Answers a query of `record/**` with both parts of the record, in pieces with numbers.
    pub(super) async fn answer(self, query: Query) {
        let Ok(_permit) = self.free.try_acquire() else {
            let _ = query.reply_err("another query is answered at the moment: ask again").await;
            return;
        };
        let mut older = self.path.as_os_str().to_owned();
        older.push(".1");
        // Both are opened first, so that no part is missing when the newer one takes the place of the older one.
        let parts = [("older", PathBuf::from(older)), ("newer", self.path.to_path_buf())];
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
                // Who has asked may have left.
                if query.key_expr().intersects(&key) && query.reply(key, chunk).await.is_err() {
                    return;
                }
            }
        }
    }
}
