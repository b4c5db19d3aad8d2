# Kills the control or its supervisor 10000 times at random moments, and tells when the outputs are safe
#
# Each unit is 500 kills of one of the two. The times include the start of the program `kill`, about
# a millisecond.

head=$'unit\tkills; safe after'

units() {
  local number
  for number in 1 2 3 4 5 6 7 8 9 10; do
    echo "control-$number"
    echo "supervisor-$number"
  done
}

unit() {
  local which=${1%-*}
  PLCC_KILLS=500 cargo test --quiet -p plcc-tests --test controller -- --nocapture \
    "outputs_are_safe_after_the_${which}_is_killed" >"$state/logs/$1.out"
  printf '%s\t%s\n' "$1" "$(sed -n 's/^.*-killed: //p' "$state/logs/$1.out")"
}
