# Generated programs of each language in every engine, thousands of seeds.
#
# FULL_SEEDS says how many of each language (5000); a unit is 250 of them.
head=$'programs\tfirst seed\tresult\tseconds'

unit_size=250

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
  printf '%s\t%s\t%s\t%s\n' "$test" "${1#*-}" "$result" $((SECONDS - start))
}
