//! Exports the two symbols by which gdb learns of code that is made or loaded while the program runs
//! (`runtime/src/gdb/interface.rs`), so that gdb finds them when the program is stripped, too.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    // Linkers of other systems have no such option, and gdb's interface is for ELF files.
    if std::env::var("CARGO_CFG_TARGET_OS").is_ok_and(|system| system == "linux") {
        for symbol in ["__jit_debug_register_code", "__jit_debug_descriptor"] {
            println!("cargo:rustc-link-arg-bins=-Wl,--export-dynamic-symbol={symbol}");
        }
    }
}
