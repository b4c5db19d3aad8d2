//! `plcc key`, `plcc build --sign` and `--key`.

#![allow(clippy::unwrap_used, clippy::indexing_slicing)]

mod support;

use std::fs;

use support::{COUNTER, Folder};

#[test]
fn a_signed_artifact_runs_with_its_key_alone() {
    let folder = Folder::with(&[("a.pmi", COUNTER)]);
    let made = folder.plcc("key new mine").exits(0);
    assert_eq!(made.stdout.trim().len(), 64);
    folder.plcc("key new other").exits(0);
    folder.plcc("build a.pmi -o plain.plcx").exits(0);
    folder.plcc("build a.pmi --sign mine").exits(0);
    let run = "--ticks 5 --watch N --trace -";
    let plain = folder.plcc(&format!("run plain.plcx {run}")).exits(0).stdout;
    assert!(plain.contains("4,N,5"), "{plain}");
    for key in ["", "--key mine.pub"] {
        assert_eq!(folder.plcc(&format!("run a.plcx {run} {key}")).exits(0).stdout, plain);
    }
    folder.plcc("run plain.plcx --ticks 1 --key mine.pub").exits(2).says(&["is not signed"]);
    folder.plcc("run a.plcx --ticks 1 --key other.pub").exits(2).says(&["another key"]);
    let mut changed = fs::read(folder.path().join("a.plcx")).unwrap();
    // After the magic bytes nothing is looked at before the signature.
    changed[8] ^= 0xFF;
    folder.write("a.plcx", &changed);
    folder.plcc("run a.plcx --ticks 1 --key mine.pub").exits(2).says(&["signature is wrong"]);
}

#[test]
fn keys_are_written_once_and_for_their_owner_alone() {
    let folder = Folder::with(&[("a.pmi", COUNTER)]);
    folder.plcc("key new mine").exits(0);
    let private = folder.read("mine");
    assert!(private.starts_with("-----BEGIN PRIVATE KEY-----\n"), "{private}");
    assert!(folder.read("mine.pub").starts_with("-----BEGIN PUBLIC KEY-----\n"));
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        let mode = fs::metadata(folder.path().join("mine")).unwrap().permissions().mode();
        assert_eq!(mode & 0o777, 0o600);
    }
    folder.plcc("key new mine").exits(2).says(&["exists already"]);
    assert_eq!(folder.read("mine"), private);
    folder.write("taken.pub", "");
    folder.plcc("key new taken").exits(2).says(&["taken.pub", "exists already"]);
    assert!(!folder.has("taken"));
}

#[test]
fn what_is_no_key_is_refused() {
    let folder = Folder::with(&[("a.pmi", COUNTER), ("text", "no key")]);
    folder.plcc("key new mine").exits(0);
    folder.plcc("build a.pmi --sign text").exits(2).says(&["text", "not a private key"]);
    folder.plcc("build a.pmi --sign missing").exits(2).says(&["missing", "can't be read"]);
    folder.plcc("build a.pmi --sign mine.pub").exits(2).says(&["not a private key"]);
    folder.plcc("build a.pmi --sign mine --emit obj").exits(2).says(&["for artifacts"]);
    assert!(!folder.has("a.plcx"));
    folder.plcc("build a.pmi --sign mine").exits(0);
    folder.plcc("run a.plcx --ticks 1 --key text").exits(2).says(&["text", "not a public key"]);
    folder.plcc("run a.plcx --ticks 1 --key mine").exits(2).says(&["a private key"]);
    folder.plcc("run a.plcx --ticks 1 --key missing").exits(2).says(&["missing", "can't be read"]);
    folder.plcc("run a.pmi --ticks 1 --key mine.pub").exits(2).says(&["for artifacts"]);
    // A key is never overwritten by the artifact.
    folder.plcc("build a.pmi --sign mine -o mine").exits(2);
    assert!(folder.read("mine").contains("PRIVATE KEY"));
}
