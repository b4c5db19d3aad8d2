# Programs of the second generator, 100 000 of each language, run in every engine: all engines must agree.
#
# FULL_SEEDS is the number of programs of each language (100000 unless it is set). A unit is FULL_UNIT
# of them (2500); its name is the language and the seed of the first, such as pmac-2500. Continuous integration runs
# seeds from 100000 on (tests/random/first_seed).
head=$'programs\tfirst seed\tresult\tseconds'

unit_size=${FULL_UNIT:-2500}

units() {
  local at
  for ((at = 0; at < ${FULL_SEEDS:-100000}; at += unit_size)); do
    printf '%s-%s\n' pmac "$at" nct "$at" pmi "$at"
  done
}

unit() {
  local start=$SECONDS result=agree
  PLCC_SEEDS=$unit_size PLCC_FIRST=${1#*-} \
    cargo test --release --locked -p plcc-tests --test "${1%-*}" -- --nocapture idioms:: >&2 \
    || result="**differ, see logs/$1**"
  tests_ran "$1" || return 1
  printf '%s\t%s\t%s\t%s\n' "${1%-*}" "${1#*-}" "$result" $((SECONDS - start))
}
