# Feeds damaged sources and artifacts to compiler and loader: they must report errors, never panic.
#
# With cargo-fuzz, where it is installed, a unit lasts FULL_FUZZ_SECONDS (900 unless it is set).
# Without it the unit is a test that makes FULL_MUTATIONS (50000) changes to the inputs in
# fuzz/corpus and to the tests' own programs. A unit is a quarter of a target in fuzz/fuzz_targets:
# the same work from other random numbers.
head=$'target\tpart\thow\tresult\tseconds'

units() {
  local target part
  for target in parse_pmi parse_nct parse_pmac artifact ir_text retained key configuration socket; do
    for part in 1 2 3 4; do echo "$target-$part"; done
  done
}

unit() {
  local start=$SECONDS result=passes target=${1%-*} part=${1#*-} how
  if cargo +nightly fuzz --version >/dev/null 2>&1; then
    how="libFuzzer, ${FULL_FUZZ_SECONDS:-900} s"
    # What it finds stays in the state's folder; the committed corpus is only read.
    mkdir -p "$state/corpus/$target"
    cargo +nightly fuzz run "$target" "$state/corpus/$target" "fuzz/corpus/$target" -- \
      -seed="$part" -max_total_time="${FULL_FUZZ_SECONDS:-900}" >&2 || result="**fails, see logs/$1**"
  else
    how="${FULL_MUTATIONS:-50000} mutations"
    PLCC_MUTATIONS=${FULL_MUTATIONS:-50000} PLCC_MUTATION_SEED=$((part * 1000000)) \
      cargo test --release --locked -p plcc-tests --test all_languages "fuzz_replay::$target" >&2 \
      || result="**fails, see logs/$1**"
    tests_ran "$1" || return 1
  fi
  printf '%s\t%s\t%s\t%s\t%s\n' "$target" "$part" "$how" "$result" $((SECONDS - start))
}
