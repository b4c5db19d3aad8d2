# Millions of random PMAC statements: code that computes in integers gives what doubles give.
#
# FULL_MILLIONS is the number of statements in millions (5 unless it is set). A unit is a hundred
# thousand statements; its name is the number of its first one in thousands, such as 100k.
head=$'statements from\tresult\tseconds'

unit_size=100000
# A program of tests/tests/pmac/arithmetic.rs has so many statements. PLCC_FIRST counts programs.
statements=250

units() { seq 0 $((${FULL_MILLIONS:-5} * 10 - 1)) | sed "s/\$/00k/"; }

unit() {
  local start=$SECONDS result=agree
  PLCC_CASES=$unit_size PLCC_FIRST=$((10#${1%00k} * unit_size / statements)) \
    cargo test --release --locked -p plcc-tests --test pmac -- --nocapture integers_compute_what_floating_point_does >&2 \
    || result="**differ, see logs/$1**"
  tests_ran "$1" || return 1
  printf '%s\t%s\t%s\n' "$1" "$result" $((SECONDS - start))
}
