# PMAC's statements one by one: integers compute what floating point does, millions of cases.
#
# FULL_MILLIONS says how many (5); a unit is a hundred thousand statements.
head=$'statements from\tresult\tseconds'

unit_size=100000
# Statements to a program in tests/tests/pmac/arithmetic.rs: seeds count programs.
statements=250

units() { seq 0 $((${FULL_MILLIONS:-5} * 10 - 1)) | sed "s/\$/00k/"; }

unit() {
  local start=$SECONDS result=agree
  PLCC_CASES=$unit_size PLCC_FIRST=$((10#${1%00k} * unit_size / statements)) \
    cargo test --release --locked -p plcc-tests --test pmac -- --nocapture integers_compute_what_floating_point_does >&2 \
    || result="**differ, see logs/$1**"
  printf '%s\t%s\t%s\n' "$1" "$result" $((SECONDS - start))
}
