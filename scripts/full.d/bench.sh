# All benchmarks one after the other, their tables as text for docs/. Leave the machine alone.
head=$'benchmark\tresult\tseconds'

units() { for file in "$root"/benches/benches/*.rs; do basename "$file" .rs; done; }

unit() {
  local start=$SECONDS result=measured
  cargo bench --locked -p plcc-benches --bench "$1" >"$state/$1.txt" || result="**fails, see logs/$1**"
  printf '%s\t%s\t%s\n' "$1" "$result" $((SECONDS - start))
}

note() {
  sed -n 's/^model name[^:]*: //p' /proc/cpuinfo 2>/dev/null | sort | uniq -c | sed 's/^ *\([0-9]*\) /\1 × /'
  local unit
  for unit in $(units); do
    [ -f "$state/rows/$unit" ] || continue
    # cargo's and libtest's own lines are no results.
    printf '\n### %s\n\n```\n%s\n```\n' "$unit" "$(grep -vE '^(running|test result|$)' "$state/$unit.txt")"
  done
}
