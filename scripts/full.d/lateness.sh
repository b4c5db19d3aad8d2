# Measures how late the ticks of a program begin, idle and loaded, beside cyclictest in the same minutes.
#
# A unit lasts FULL_LATENESS_SECONDS (300 unless it is set). cyclictest is in Debian's package rt-tests;
# without it the column is empty. Both need permission for real-time priorities (as root, or `ulimit -r`).
# `loaded` has two processes a processor that compute and one that writes files. Use the machine for
# nothing else.
head=$'load\tticks of 1 ms\tlatest tick, µs\t99.9 % by, µs\tmedian, µs\tcyclictest maximum, µs\tcyclictest average, µs'

units() { printf 'idle\nloaded\n'; }

unit() {
  local seconds=${FULL_LATENESS_SECONDS:-300} load=() pid ours theirs cyclic
  # Built before anything is measured.
  cargo bench --locked -p plcc-benches --bench lateness --no-run >&2 || return 1
  if [ "$1" = loaded ]; then
    for _ in $(seq $((2 * $(nproc)))); do (while :; do :; done) & load+=($!); done
    (while :; do dd if=/dev/zero of="$state/load" bs=1M count=256 conv=fsync status=none; done) & load+=($!)
  fi
  if command -v cyclictest >/dev/null; then
    cyclictest --mlockall --priority=50 --interval=1000 --duration="$seconds" --quiet >"$state/$1.cyclic" 2>&1 &
    cyclic=$!
  fi
  cargo bench --locked -p plcc-benches --bench lateness -- "$seconds" >"$state/$1.txt" || ours=fails
  [ -z "${cyclic:-}" ] || wait "$cyclic" || true
  for pid in "${load[@]}"; do kill "$pid" 2>/dev/null || true; done
  rm -f "$state/load"
  ours=${ours:-$(sed -n 's/^ticks \([0-9]*\), latest \([0-9.]*\), 99.9 % \([0-9.]*\), median \([0-9.]*\) .*/\1\t\2\t\3\t\4/p' "$state/$1.txt")}
  [ -n "$ours" ] && [ "$ours" != fails ] || return 1
  theirs=$(sed -n 's/.*Avg: *\([0-9]*\) Max: *\([0-9]*\).*/\2\t\1/p' "$state/$1.cyclic" 2>/dev/null | tail -1)
  printf '%s\t%s\t%s\n' "$1" "$ours" "${theirs:-$'\t'}"
}

# The computer and its kernel, on which all figures depend.
note() {
  uname -srm
  sed -n 's/^model name[^:]*: //p' /proc/cpuinfo 2>/dev/null | sort | uniq -c | sed 's/^ *\([0-9]*\) /\1 × /'
}
