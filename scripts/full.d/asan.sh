# Runs the tests of native code, the image file and all languages with AddressSanitizer.
#
# The sanitizer sees what Rust code does, also around machine code that we compiled: it notices when that
# code, through the host, has memory accessed that nobody owns, and memory that is used after it was given
# back. A unit is a crate's tests. It needs rustup's nightly.
head=$'tests\tresult\tseconds'

units() { printf '%s\n' codegen runtime image languages; }

unit() {
  local start=$SECONDS result=passes words
  case $1 in
    # Examples in documentation are left out: rustdoc does not link them with the sanitizer.
    codegen) words="-p plcc-codegen --lib --tests" ;;
    runtime) words="-p plcc-runtime -p plcc-load -p plcc-record -p plcc-host --lib" ;;
    image) words="-p plcc-image --lib" ;;
    # The tests that build the loader would build its procedural macros with the flags.
    languages) words="-p plcc-tests --test all_languages -- --skip loader::" ;;
  esac
  # With a target of its own the flags do not reach build scripts and procedural macros. Memory that is
  # kept until the process ends is not a mistake: gdb reads it.
  # shellcheck disable=SC2086
  RUSTFLAGS=-Zsanitizer=address ASAN_OPTIONS=detect_leaks=0 \
    cargo +nightly test --locked --release --target "$(rustc -vV | sed -n 's/^host: //p')" $words >&2 \
    || result="**fails, see logs/$1**"
  tests_ran "$1" || return 1
  printf '%s\t%s\t%s\n' "$1" "$result" $((SECONDS - start))
}
