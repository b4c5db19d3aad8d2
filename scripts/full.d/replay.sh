# Random programs of each language recorded in one engine and replayed in others, from records cut and damaged too, and recorded by processes that are killed.
#
# FULL_SEEDS is the number of programs of each language (300 unless it is set). A unit is FULL_UNIT of
# them (50); its name is the language and the seed of the first, such as pmi-50. In a unit such as killed-pmi-50
# plcrt records each program and is killed by SIGKILL at a random moment.
head=$'programs\tfirst seed\tresult\tseconds'

unit_size=${FULL_UNIT:-50}

units() {
  local at
  for ((at = 0; at < ${FULL_SEEDS:-300}; at += unit_size)); do
    printf '%s-%s\n' pmi "$at" nct "$at" pmac "$at" killed-pmi "$at" killed-nct "$at" killed-pmac "$at"
  done
}

unit() {
  local start=$SECONDS result="as recorded" programs=${1%-*} test
  case $programs in
    killed-*) test="--test controller killed_records::killed_${programs#killed-}_programs_are_replayed" ;;
    *) test="--test all_languages replay::generated_${programs}_programs_are_replayed" ;;
  esac
  # shellcheck disable=SC2086
  PLCC_SEEDS=$unit_size PLCC_FIRST=${1##*-} \
    cargo test --release --locked -p plcc-tests $test >&2 || result="**differ, see logs/$1**"
  tests_ran "$1" || return 1
  printf '%s\t%s\t%s\t%s\n' "$programs" "${1##*-}" "$result" $((SECONDS - start))
}
