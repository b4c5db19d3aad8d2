# Runs tests in Miri, an interpreter of Rust that notices undefined behaviour, for files with `unsafe`.
#
# A unit is named for what it looks at. Miri runs no machine code and maps no files, so code that is compiled
# by us, and the image file, are left to scripts/full asan. It needs rustup's nightly with the component miri.
head=$'tests\tresult\tseconds'

units() { printf '%s\n' code artifact gdb retained state; }

unit() {
  local start=$SECONDS result=passes
  export MIRIFLAGS="${MIRIFLAGS:--Zmiri-disable-isolation}"
  case $1 in
    code) in_miri -p plcc-abi --lib -- code:: unwind:: deadline:: image:: ;;
    # Other tests of artifacts read one thousands of times, which takes Miri hours, or open files as it can't.
    artifact) in_miri -p plcc-load --lib -- tests::an_artifact ;;
    gdb) in_miri -p plcc-runtime --lib -- gdb:: ;;
    retained) in_miri -p plcc-host --lib -- retain::format && in_miri -p plcc-runtime --lib -- retained:: ;;
    state) in_miri -p plcc-runtime --lib -- checkpoint:: safe_outputs:: ;;
  esac || result="**fails, see logs/$1**"
  tests_ran "$1" || return 1
  printf '%s\t%s\t%s\n' "$1" "$result" $((SECONDS - start))
}

# Runs tests in Miri; what they print goes to the log of the unit.
in_miri() {
  cargo +nightly miri test --locked "$@" >&2
}
