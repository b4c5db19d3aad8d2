# Kills a control or its supervisor 10 000 times at random moments, and tells when the outputs are safe.
#
# FULL_KILLS is the number of kills in a unit (500). A unit is named for the process that is killed. The
# thread that kills and measures has a real-time priority where that is permitted.
head=$'killed\tunit\tresult'

units() {
  local number
  for number in 1 2 3 4 5 6 7 8 9 10; do
    printf '%s-%s\n' control "$number" supervisor "$number"
  done
}

unit() {
  local which=${1%-*}
  PLCC_KILLS=${FULL_KILLS:-500} cargo test --release --locked -p plcc-tests --test controller -- \
    --nocapture "outputs_are_safe_after_the_${which}_is_killed" >&2 || return 1
  tests_ran "$1" || return 1
  printf '%s\t%s\t%s\n' "$which" "${1#*-}" "$(sed -n 's/^.*-killed: //p' "$state/logs/$1")"
}
