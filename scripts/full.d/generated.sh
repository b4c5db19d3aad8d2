# Thousands of random programs of each language, run in every engine: all engines must agree.
#
# FULL_SEEDS is the number of programs of each language and of IR (5000 unless it is set). A unit is
# FULL_UNIT of them (250); its name is the language and the seed of the first, such as pmi-250.
head=$'programs\tfirst seed\tresult\tseconds'

unit_size=${FULL_UNIT:-250}

units() {
  local at
  for ((at = 0; at < ${FULL_SEEDS:-5000}; at += unit_size)); do
    printf '%s-%s\n' pmi "$at" nct "$at" pmac "$at" ir "$at"
  done
}

unit() {
  local start=$SECONDS result=agree test=${1%-*}
  local -A tests=([pmi]=engines::generated [nct]=generated:: [pmac]=engines::generated [ir]=passes::)
  PLCC_SEEDS=$unit_size PLCC_FIRST=${1#*-} \
    cargo test --release --locked -p plcc-tests --test "$test" "${tests[$test]}" >&2 \
    || result="**differ, see logs/$1**"
  tests_ran "$1" || return 1
  printf '%s\t%s\t%s\t%s\n' "$test" "${1#*-}" "$result" $((SECONDS - start))
}
