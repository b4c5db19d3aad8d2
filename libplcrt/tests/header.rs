//! The checked-in header is the one that cbindgen makes. `BLESS=1` writes it.
#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::Path;

#[test]
fn the_header_is_up_to_date() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let config = cbindgen::Config::from_file(folder.join("cbindgen.toml")).unwrap();
    let bindings = cbindgen::Builder::new().with_config(config).with_src(folder.join("src/c.rs"));
    let mut made = vec![];
    bindings.generate().unwrap().write(&mut made);
    let made = String::from_utf8(made).unwrap();
    let path = folder.join("include/plcrt.h");
    if std::env::var_os("BLESS").is_some_and(|value| value == "1") {
        fs::write(&path, &made).unwrap();
    }
    assert_eq!(fs::read_to_string(&path).unwrap(), made, "BLESS=1 cargo test -p libplcrt");
    for name in ["plcrt_open", "plcrt_tick", "plcrt_next_event", "plcrt_restore", "PLCRT_STOPPED"] {
        assert!(made.contains(name), "{name}");
    }
}
