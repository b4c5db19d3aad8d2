# Programs that `plcc export` writes, compiled by compilers of other makes, beside the control: 300 of each language, 2000 scans each.
#
# Builds matiec first, of the sources that FULL_MATIEC_SOURCE names (a folder or an address for git). It needs git, autoconf,
# automake, flex, bison, make, a C++ and a C compiler. PLCC_MATIEC names a matiec that is built already. A unit is a language.
# PLCC_STRUCPP and PLCC_IRONPLC name folders with STruC++ and IronPLC, which are then used too; docs/dev/export.md says what is in them.
head=$'language\tresult\tseconds'

units() { printf '%s\n' pmi nct pmac; }

# matiec, built in the state's folder.
matiec() {
  [ -n "${PLCC_MATIEC:-}" ] && return
  export PLCC_MATIEC=$state/matiec
  [ -x "$PLCC_MATIEC/iec2c" ] && return
  rm -rf "$PLCC_MATIEC"
  git clone --quiet --depth 1 "${FULL_MATIEC_SOURCE:-https://github.com/beremiz/matiec}" "$PLCC_MATIEC"
  (cd "$PLCC_MATIEC" && autoreconf -i && ./configure && make) >&2
}

unit() {
  local start=$SECONDS result=agree
  matiec
  PLCC_SEEDS=${FULL_SEEDS:-300} cargo test --release --locked -p plcc-tests --test iec "$1::" >&2 \
    || result="**differ, see logs/$1**"
  tests_ran "$1" || return 1
  printf '%s\t%s\t%s\n' "$1" "$result" $((SECONDS - start))
}
