# Programs that `plcc export` writes, compiled by compilers of other makes, beside the control: 300 of each language, 2000 scans each.
#
# PLCC_MATIEC names the folder of a matiec that is built; without it the check does not begin. PLCC_STRUCPP and PLCC_IRONPLC name folders
# with STruC++ and IronPLC, which are then used too; docs/dev/export.md says what is in them. It needs a C and a C++ compiler. A unit is
# a language.
head=$'language\tresult\tseconds'

units() { printf '%s\n' pmi nct pmac; }

unit() {
  local start=$SECONDS result=agree
  [ -x "${PLCC_MATIEC:-}/iec2c" ] || { echo "PLCC_MATIEC names no folder with iec2c" >&2; return 1; }
  PLCC_SEEDS=${FULL_SEEDS:-300} cargo test --release --locked -p plcc-tests --test iec "$1::" >&2 \
    || result="**differ, see logs/$1**"
  tests_ran "$1" || return 1
  printf '%s\t%s\t%s\n' "$1" "$result" $((SECONDS - start))
}
