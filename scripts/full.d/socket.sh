# Clients of the socket that flood, stall and leave: how late ticks end with and without them.
#
# A unit is a measurement of FULL_SOCKET_SECONDS (60 unless it is set) for each kind of client. Use the
# machine for nothing else, and permit a real-time priority (ulimit -r 50), else the figures say little.
head=$'unit\tresult\tseconds'

units() { seq 1 5; }

unit() {
  local start=$SECONDS result=measured
  PLCC_SECONDS=${FULL_SOCKET_SECONDS:-60} \
    cargo test --release --locked -p plcc-tests --test socket ticks_go_on_whatever_clients_do -- --nocapture \
    2>&1 | tee "$state/$1.txt" >&2 || result="**fails, see logs/$1**"
  tests_ran "$1" || return 1
  printf '%s\t%s\t%s\n' "$1" "$result" $((SECONDS - start))
}

# What each unit printed.
note() {
  local unit
  for unit in $(units); do
    [ -f "$state/rows/$unit" ] || continue
    printf '\n### %s\n\n```\n%s\n```\n' "$unit" "$(grep -P '\t' "$state/$unit.txt")"
  done
}
